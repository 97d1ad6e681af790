"""An .xlsx file, whatever program packed it and whoever sent it.

Here belongs what opens a zip with suspicion, brings its parts into one form, and finds worksheets,
names and cells in it; all of kfsheet reads workbooks by it. Nothing here may know which exercise a
workbook was built from. Begin with :class:`kfsheet.workbook.reading.archive.Container` and
:func:`kfsheet.workbook.reading.book.read_book`.
"""
