"""A recurrence as an .xlsx file: written, read, calculated by engines, checked.

``write`` makes the file, ``reading`` takes one apart, ``engines`` are programs that calculate it,
``check`` compares what they find with NumPy. Nothing here may know of students and marks.
Begin with :func:`kfsheet.workbook.write.write_workbook.write_workbook`.
"""
