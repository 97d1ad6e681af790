"""Programs that calculate a workbook from nothing: IronCalc, LibreOffice.

Here belongs how each is started, asked and stopped, and the copies of files that each can take.
Nothing here may judge what an engine answers. Begin with
:func:`kfsheet.workbook.engines.recalculate.recalculate`.
"""
