"""A recurrence as an .xlsx file: written, read, calculated by engines, checked.

Here belongs what makes the file (``write``), takes one apart (``reading``), calculates it
(``engines``) and compares what they find with NumPy (``check``). Nothing here may know of students
and marks. Begin with :func:`kfsheet.workbook.write.write_workbook.write_workbook`.
"""
