"""A workbook as openpyxl writes it: names, validations, colours, charts, paper; but no cells.

The cells are most of a file and of the time that openpyxl takes; they are written by
:mod:`kfsheet.workbook.write.cell_xml` and filled into what is made here.
"""

from __future__ import annotations

from io import BytesIO
from math import ceil

from openpyxl import Workbook
from openpyxl.formatting.rule import CellIsRule, FormulaRule
from openpyxl.packaging.custom import StringProperty
from openpyxl.styles import Font, PatternFill
from openpyxl.utils import column_index_from_string, get_column_letter, quote_sheetname
from openpyxl.utils.cell import coordinate_from_string
from openpyxl.workbook.defined_name import DefinedName
from openpyxl.worksheet.datavalidation import DataValidation
from openpyxl.worksheet.worksheet import Worksheet

from kfsheet.model.exercise import Exercise
from kfsheet.workbook.write.cell_xml import sheet_data
from kfsheet.workbook.write.check_sheet import FAIL, PASS, TABLE_ROW
from kfsheet.workbook.write.layout import EXERCISE_PROPERTY, FIRST_ROW, Layout
from kfsheet.workbook.write.native_charts import draw
from kfsheet.workbook.write.reproducible_zip import reproducible_zip
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Sheet
from kfsheet.workbook.write.styles import Styles

TABS = {"Read me": "1F3864", "Parameters": "FFC000", "Charts": "0072B2", "Check": "70AD47"}
COLUMNS_AT_MOST, COLUMNS_ON_PAPER = 14, 10  # a wider table is unreadable on one page


def assemble(exercise: Exercise, layout: Layout, sheets: list[Sheet], now: Run) -> Workbook:
    """Pages as a workbook of openpyxl, with names, validations and charts, but without cells."""
    book = Workbook()
    book.remove(book.active)
    for sheet in sheets:
        _set_up(book.create_sheet(sheet.title), sheet)
    _define_names(book, layout, sheets)
    _add_validations(book["Parameters"], layout, now)
    if "Check" in book.sheetnames:  # a student's handout has none: it would tell the answers
        _colour_verdict(book["Check"])
    if exercise.greyed:
        _grey_rows(book, layout, exercise.greyed)
    for name in exercise.alarm:
        _redden(book["Parameters"], layout, name)
    draw(book, exercise, layout)
    _describe(book, exercise)
    return book


class WorkbookTemplate:
    """A saved workbook without cells, which can be filled with them more than once."""

    def __init__(self, book: Workbook, sheets: list[Sheet]) -> None:
        # A style gets its number here, before openpyxl saves the table of styles: a cell that is
        # filled in later can only point to one of those.
        self._styles = Styles(book)
        for sheet in sheets:
            for cell in sheet.cells.values():
                self._styles.number(cell.kind, cell.format, cell.align)
            for filled in sheet.columns.values():
                self._styles.number(filled.kind, filled.format, "")
        self._styles.close()
        saved = BytesIO()
        book.save(saved)
        self._saved = saved.getvalue()

    def filled(self, sheets: list[Sheet]) -> bytes:
        """The file with the cells of ``sheets``, of the styles that it was saved with."""
        cells = {
            worksheet_part(n): sheet_data(sheet, self._styles.number)
            for n, sheet in enumerate(sheets, 1)
        }
        return reproducible_zip(self._saved, cells)


def worksheet_part(number: int) -> str:
    """Name inside the zip of a worksheet; openpyxl numbers them in order."""
    return f"xl/worksheets/sheet{number}.xml"


def _set_up(worksheet: Worksheet, sheet: Sheet) -> None:
    """Widths, heights, what is frozen, and how it prints."""
    for column, size in sheet.widths.items():
        worksheet.column_dimensions[get_column_letter(column)].width = size
    for row, size in sheet.heights.items():
        worksheet.row_dimensions[row].height = size
    for cells in sheet.merges:
        worksheet.merge_cells(cells)
    worksheet.freeze_panes = sheet.freeze or None
    worksheet.sheet_properties.tabColor = TABS.get(sheet.title, "A6A6A6")
    worksheet.sheet_view.showGridLines = bool(sheet.freeze)
    worksheet.page_setup.orientation = "landscape"
    worksheet.page_setup.fitToHeight = (
        1 if sheet.title == "Read me" else 0
    )  # 0: as many as it takes
    worksheet.sheet_properties.pageSetUpPr.fitToPage = True
    worksheet.page_setup.paperSize = worksheet.PAPERSIZE_A4
    worksheet.oddFooter.left.text, worksheet.oddFooter.right.text = "&A", "&P / &N"
    if sheet.freeze:
        first = TABLE_ROW if sheet.title == "Check" else 1
        worksheet.print_title_rows = f"{first}:{coordinate_from_string(sheet.freeze)[1] - 1}"
        _print_side_by_side(worksheet, sheet)


def _print_side_by_side(worksheet: Worksheet, sheet: Sheet) -> None:
    """A wide table on several pages side by side, each with the columns that stay in view."""
    if sheet.width <= COLUMNS_AT_MOST:
        return
    worksheet.page_setup.fitToWidth = ceil(sheet.width / COLUMNS_ON_PAPER)
    last = coordinate_from_string(sheet.freeze)[0]
    if last != "A":
        worksheet.print_title_cols = f"A:{get_column_letter(column_index_from_string(last) - 1)}"


def _define_names(book: Workbook, layout: Layout, sheets: list[Sheet]) -> None:
    own = {name: (p.title, *cell) for p in sheets for name, cell in p.names.items()}
    for name, (sheet, row, column) in {**layout.scalars, **own}.items():
        # Absolute, or a name would mean another cell wherever it is used.
        cell = f"{quote_sheetname(sheet)}!${get_column_letter(column)}${row}"
        book.defined_names[name] = DefinedName(name, attr_text=cell)


def _add_validations(sheet: Worksheet, layout: Layout, now: Run) -> None:
    """Input messages, and refusal of values that a parameter cannot have."""
    limits = {"positive": "greaterThan", "nonnegative": "greaterThanOrEqual"}
    for name, parameter in layout.model.parameters.items():
        bound = limits.get(parameter.sign)
        # Excel has no rule "any number": a decimal between limits that no model comes near.
        rule = DataValidation(
            type="decimal",
            operator=bound or "between",
            formula1="0" if bound else "-1E+300",
            formula2=None if bound else "1E+300",
            showErrorMessage=True,
            showInputMessage=True,
            errorTitle=name,
            error=f"{name} must be a number" + (f", {parameter.bound}" if bound else ""),
            promptTitle=name,
            prompt=f"{parameter.description}. At build: {now.scalars[name]:g} {parameter.unit}",
        )
        rule.add(f"{get_column_letter(layout.scalars[name][2])}{layout.scalars[name][1]}")
        sheet.add_data_validation(rule)


def _colour_verdict(sheet: Worksheet) -> None:
    for word, colour in ((PASS, "C6EFCE"), (FAIL, "FFC7CE")):
        fill = PatternFill("solid", start_color="FF" + colour, end_color="FF" + colour)
        rule = CellIsRule(operator="equal", formula=[f'"{word}"'], fill=fill, font=Font(bold=True))
        sheet.conditional_formatting.add("B4", rule)


def _redden(sheet: Worksheet, layout: Layout, name: str) -> None:
    """Red for a result, from its symbol to its meaning, where it is 0."""
    _, row, column = layout.scalars[name]
    first, value, last = (get_column_letter(column + n) for n in (-1, 0, 2))
    fill = PatternFill("solid", start_color="FFFFC7CE", end_color="FFFFC7CE")
    rule = FormulaRule(formula=[f"${value}${row}=0"], fill=fill)
    sheet.conditional_formatting.add(f"{first}{row}:{last}{row}", rule)


def _grey_rows(book: Workbook, layout: Layout, name: str) -> None:
    """Grey text in rows in which a column is 0, on every sheet of the recurrence."""
    home, column = layout.home(name)
    cell = f"{quote_sheetname(home)}!${get_column_letter(column)}{FIRST_ROW}"
    for section, columns in layout.columns.items():
        last = get_column_letter(max(columns.values()))
        # Relative to the area's first row, as Excel reads rules: each row asks for its own cell.
        rule = FormulaRule(formula=[f"{cell}=0"], font=Font(color="FFBFBFBF"))
        area = f"A{FIRST_ROW}:{last}{layout.last_row}"
        book[section].conditional_formatting.add(area, rule)


def _describe(book: Workbook, exercise: Exercise) -> None:
    book.properties.creator, book.properties.title = "kfsheet", exercise.title
    book.custom_doc_props.append(StringProperty(name=EXERCISE_PROPERTY, value=exercise.name))
    book.active = 0
