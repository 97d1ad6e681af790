"""An exercise -> an .xlsx file of live formulas, with stored values, charts and a Check sheet."""

from __future__ import annotations

from io import BytesIO
from math import ceil
from pathlib import Path

from openpyxl import Workbook
from openpyxl.formatting.rule import CellIsRule, FormulaRule
from openpyxl.packaging.custom import StringProperty
from openpyxl.styles import Font, PatternFill
from openpyxl.utils import column_index_from_string, get_column_letter, quote_sheetname
from openpyxl.utils.cell import coordinate_from_string
from openpyxl.workbook.defined_name import DefinedName
from openpyxl.worksheet.datavalidation import DataValidation
from openpyxl.worksheet.worksheet import Worksheet

from kfsheet.errors import WorkbookError
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise
from kfsheet.workbook.write.cell_xml import sheet_data
from kfsheet.workbook.write.check_sheet import FAIL, PASS, TABLE_ROW, check_page
from kfsheet.workbook.write.contents import (
    Run,
    charts_page,
    parameters_page,
    readme_page,
    section_page,
)
from kfsheet.workbook.write.finish import finish, untouched
from kfsheet.workbook.write.layout import EXERCISE_PROPERTY, FIRST_ROW, Layout
from kfsheet.workbook.write.native_charts import draw
from kfsheet.workbook.write.page import Page
from kfsheet.workbook.write.styles import Styles

TABS = {"Read me": "1F3864", "Parameters": "FFC000", "Charts": "0072B2", "Check": "70AD47"}
COLUMNS_AT_MOST, COLUMNS_ON_PAPER = 14, 10  # a wider table is unreadable on one page


def compose(exercise: Exercise, layout: Layout, now: Run, built: Run) -> list[Page]:
    """Every worksheet, in order, for the run ``now`` of a workbook built from the run ``built``."""
    sections = [section_page(layout, section, now) for section in exercise.model.sections]
    return [
        readme_page(exercise, layout),
        parameters_page(layout, now),
        *sections,
        charts_page(exercise, layout, now),
        check_page(layout, now, built),
    ]


def workbook_bytes(exercise: Exercise) -> bytes:
    """The workbook of an exercise; the same bytes for the same exercise."""
    layout = Layout.standard(exercise.model)
    now = Run.of(exercise.model)
    return built_bytes(exercise, layout, now)


def built_bytes(exercise: Exercise, layout: Layout, now: Run) -> bytes:
    """The workbook of an exercise for a run with other parameters and data."""
    pages = compose(exercise, layout, now, now)
    return Shell(assemble(exercise, layout, pages, now), pages).filled(pages)


class Shell:
    """A saved workbook without cells, which can be filled with them more than once."""

    def __init__(self, book: Workbook, pages: list[Page]) -> None:
        self._styles = Styles(book)
        for page in pages:
            for piece in page.pieces.values():
                self._styles.number(piece.kind, piece.format, piece.align)
            for filled in page.columns.values():
                self._styles.number(filled.kind, filled.format, "")
        self._styles.close()
        saved = BytesIO()
        book.save(saved)
        self._saved = saved.getvalue()

    def filled(self, pages: list[Page]) -> bytes:
        """The file with the cells of ``pages``, of the styles that it was saved with."""
        sheets = {part(n): sheet_data(page, self._styles.number) for n, page in enumerate(pages, 1)}
        return finish(self._saved, sheets)


def part(number: int) -> str:
    """Name inside the zip of a worksheet; openpyxl numbers them in order."""
    return f"xl/worksheets/sheet{number}.xml"


def assemble(exercise: Exercise, layout: Layout, pages: list[Page], now: Run) -> Workbook:
    """Pages as a workbook of openpyxl, with names, validations and charts, but without cells."""
    book = Workbook()
    book.remove(book.active)
    for page in pages:
        _dress(book.create_sheet(page.title), page)
    _define_names(book, layout, pages)
    _add_validations(book["Parameters"], layout, now)
    if "Check" in book.sheetnames:
        _colour_verdict(book["Check"])
    if exercise.greyed:
        _grey_rows(book, layout, exercise.greyed)
    for name in exercise.alarm:
        _redden(book["Parameters"], layout, name)
    draw(book, exercise, layout)
    _describe(book, exercise)
    return book


def write_workbook(exercise: Exercise, path: str | Path, *, force: bool = False) -> Path:
    """Write the workbook of an exercise.

    Parameters
    ----------
    exercise : Exercise
        What to write.
    path : path
        File to write, ending in ``.xlsx``, or a folder, which gets ``NAME.xlsx``.

    force : bool
        Whether to replace a workbook that another program has saved: somebody's changes.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    WorkbookError
        If the file cannot be written, or holds somebody's changes; nothing half-written stays.
    PrintError
        If a formula has no equivalent in Excel 2010.
    """
    path = Path(path)
    target = path if path.suffix == ".xlsx" else path / f"{exercise.name}.xlsx"
    if target.is_file() and not force and not untouched(target):
        raise WorkbookError(
            f"{target} was changed since it was built; move it away to keep it, "
            "or replace it with: kfsheet build --force"
        )
    return write_file(target, workbook_bytes(exercise))


def _dress(sheet: Worksheet, page: Page) -> None:
    """Widths, heights, what is frozen, and how it prints."""
    for column, size in page.widths.items():
        sheet.column_dimensions[get_column_letter(column)].width = size
    for row, size in page.heights.items():
        sheet.row_dimensions[row].height = size
    for cells in page.merges:
        sheet.merge_cells(cells)
    sheet.freeze_panes = page.freeze or None
    sheet.sheet_properties.tabColor = TABS.get(page.title, "A6A6A6")
    sheet.sheet_view.showGridLines = bool(page.freeze)
    sheet.page_setup.orientation = "landscape"
    sheet.page_setup.fitToHeight = 1 if page.title == "Read me" else 0  # 0: as many as it takes
    sheet.sheet_properties.pageSetUpPr.fitToPage = True
    sheet.page_setup.paperSize = sheet.PAPERSIZE_A4
    sheet.oddFooter.left.text, sheet.oddFooter.right.text = "&A", "&P / &N"
    if page.freeze:
        first = TABLE_ROW if page.title == "Check" else 1
        sheet.print_title_rows = f"{first}:{coordinate_from_string(page.freeze)[1] - 1}"
        _spread(sheet, page)


def _spread(sheet: Worksheet, page: Page) -> None:
    """A wide table on several pages side by side, each with the columns that stay in view."""
    if page.width <= COLUMNS_AT_MOST:
        return
    sheet.page_setup.fitToWidth = ceil(page.width / COLUMNS_ON_PAPER)
    last = coordinate_from_string(page.freeze)[0]
    if last != "A":
        sheet.print_title_cols = f"A:{get_column_letter(column_index_from_string(last) - 1)}"


def _define_names(book: Workbook, layout: Layout, pages: list[Page]) -> None:
    own = {name: (p.title, *cell) for p in pages for name, cell in p.names.items()}
    for name, (sheet, row, column) in {**layout.scalars, **own}.items():
        cell = f"{quote_sheetname(sheet)}!${get_column_letter(column)}${row}"
        book.defined_names[name] = DefinedName(name, attr_text=cell)


def _add_validations(sheet: Worksheet, layout: Layout, now: Run) -> None:
    """Input messages, and refusal of values that a parameter cannot have."""
    limits = {"positive": "greaterThan", "nonnegative": "greaterThanOrEqual"}
    for name, parameter in layout.model.parameters.items():
        bound = limits.get(parameter.sign)
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
        rule = FormulaRule(formula=[f"{cell}=0"], font=Font(color="FFBFBFBF"))
        area = f"A{FIRST_ROW}:{last}{layout.last_row}"
        book[section].conditional_formatting.add(area, rule)


def _describe(book: Workbook, exercise: Exercise) -> None:
    book.properties.creator, book.properties.title = "kfsheet", exercise.title
    book.custom_doc_props.append(StringProperty(name=EXERCISE_PROPERTY, value=exercise.name))
    book.active = 0
