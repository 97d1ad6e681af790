"""An exercise as a workbook of live formulas.

Here belongs what stands in which cell and how it looks: layout, worksheets, styles, charts,
the sheet Check. Nothing here may read a workbook. Begin with
:mod:`kfsheet.workbook.write.write_workbook`.
"""
