"""Workbooks for the calculator's tests: read by openpyxl, with the stored values beside."""

from openpyxl import load_workbook
from openpyxl.worksheet.formula import ArrayFormula

from kfsheet.parsing.calculator import Formula


def contents(path):
    """Contents of the sheets and the names of a workbook, for SheetCalculator."""
    book = load_workbook(path)
    sheets = {
        sheet.title: {
            (cell.row, cell.column): _content(cell)
            for row in sheet.iter_rows()
            for cell in row
            if cell.value is not None
        }
        for sheet in book.worksheets
    }
    names = {name: defined.attr_text for name, defined in book.defined_names.items()}
    for sheet in book.worksheets:
        for name, defined in sheet.defined_names.items():
            names[sheet.title, name] = defined.attr_text
    return sheets, names


def _content(cell):
    if isinstance(cell.value, ArrayFormula):
        return Formula(cell.value.text, (cell.row, cell.column), _corners(cell.value.ref))
    if cell.data_type == "f":
        return Formula(cell.value, (cell.row, cell.column))
    return cell.value


def _corners(ref):
    from openpyxl.utils import range_boundaries

    left, top, right, bottom = range_boundaries(ref)
    return top, left, bottom, right


def stored(path):
    """Stored values of the cells, by sheet, row and column."""
    book = load_workbook(path, data_only=True)
    return {
        (sheet.title, cell.row, cell.column): cell.value
        for sheet in book.worksheets
        for row in sheet.iter_rows()
        for cell in row
        if cell.value is not None
    }
