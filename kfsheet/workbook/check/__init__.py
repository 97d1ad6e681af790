"""Does a workbook compute what NumPy computes?

Here belongs what a workbook is asked, what is expected of every cell, and how the cell that is
wrong is told from those that follow from it. Nothing here may change the workbook. Begin with
:func:`kfsheet.workbook.check.check_workbook.check_workbook`.
"""
