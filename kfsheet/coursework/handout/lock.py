"""What makes a workbook one student's handout: the signed token, and cells that are locked."""

from __future__ import annotations

from openpyxl.formatting.rule import FormulaRule
from openpyxl.packaging.custom import StringProperty
from openpyxl.styles import Font, PatternFill, Protection
from openpyxl.utils import get_column_letter
from openpyxl.workbook import Workbook
from openpyxl.worksheet.dimensions import ColumnDimension
from openpyxl.worksheet.worksheet import Worksheet

from kfsheet.coursework.handout import course_secret
from kfsheet.coursework.handout.live_checks import HIDDEN
from kfsheet.coursework.handout.questions_sheet import (
    DIFFERS,
    FEEDBACK_COLUMN,
    FIRST,
    LOOKS_RIGHT,
    SHEET,
    WAITS,
    hide,
)
from kfsheet.model.exercise import Exercise
from kfsheet.printing.excel_names import LAST_COLUMN
from kfsheet.workbook.write.sheet import Sheet

TOKEN_PROPERTY = "kfsheet token"


def lock(
    book: Workbook, pages: list[Sheet], exercise: Exercise, secret: bytes, student: str
) -> None:
    """Sign a workbook, lock what is not an answer, and open it at the questions."""
    # A second copy beside that on the hidden sheet: programs may lose the one or the other.
    token = course_secret.token(secret, exercise.name, student)
    book.custom_doc_props.append(StringProperty(name=TOKEN_PROPERTY, value=token))
    _colour_feedback(book[SHEET], len(exercise.questions))
    _hide_what_is_not_plotted(book["Charts"], pages)
    hide(book)
    for page in pages:
        _protect(book[page.title], page.width)
    book.active = book.sheetnames.index(SHEET)


def _colour_feedback(sheet: Worksheet, questions: int) -> None:
    """Green where all is right, paler where all is that can be, yellow where something is not."""
    first = f"{FEEDBACK_COLUMN}{FIRST}"
    colours = {
        f'{first}="{LOOKS_RIGHT}"': "FFC6EFCE",
        f'AND(LEFT({first},5)="right",ISNUMBER(SEARCH("{WAITS}",{first})))': "FFE2F5E4",
        f'ISNUMBER(SEARCH("{DIFFERS}",{first}))': "FFFFEB9C",
    }
    area = f"{first}:{FEEDBACK_COLUMN}{FIRST + questions - 1}"
    for test, colour in colours.items():
        fill = PatternFill("solid", start_color=colour, end_color=colour)
        sheet.conditional_formatting.add(area, FormulaRule(formula=[test], fill=fill))


def _hide_what_is_not_plotted(sheet: Worksheet, pages: list[Sheet]) -> None:
    """White text for #N/A in helper columns of the charts: a chart leaves nothing else out."""
    page = next(page for page in pages if page.title == sheet.title)
    for column, filled in page.columns.items():
        first, letter = filled.rows[0], get_column_letter(column)
        rule = FormulaRule(formula=[f"ISNA({letter}{first})"], font=Font(color="FFFFFFFF"))
        sheet.conditional_formatting.add(f"{letter}{first}:{letter}{filled.rows[-1]}", rule)


def _protect(sheet: Worksheet, width: int) -> None:
    """Lock what is there; free cells beside it, and rows and columns to insert, stay open.

    There is no password: the lock prevents accidents. No mark depends on a locked cell.
    """
    protection = sheet.protection
    protection.sheet = True
    protection.formatCells = protection.formatColumns = protection.formatRows = False
    protection.insertColumns = protection.insertRows = False
    if sheet.title == HIDDEN:
        return
    for column in range(1, width + 1):
        letter = get_column_letter(column)
        sheet.column_dimensions[letter].protection = Protection(locked=False)
    rest = ColumnDimension(
        sheet, index=get_column_letter(width + 1), min=width + 1, max=LAST_COLUMN, width=13
    )
    rest.protection = Protection(locked=False)
    sheet.column_dimensions[rest.index] = rest
