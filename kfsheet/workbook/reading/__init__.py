"""The parts of an .xlsx file, as they are.

Here belongs what opens a zip with suspicion and finds worksheets, names and formula cells in it.
Nothing here may know which exercise a workbook was built from.
Begin with :class:`kfsheet.workbook.reading.package.Package`.
"""
