"""What makes a workbook one student's handout: the signed token, and cells that are locked."""

from __future__ import annotations

from openpyxl.formatting.rule import CellIsRule
from openpyxl.packaging.custom import StringProperty
from openpyxl.styles import PatternFill, Protection
from openpyxl.utils import get_column_letter
from openpyxl.workbook import Workbook
from openpyxl.worksheet.dimensions import ColumnDimension
from openpyxl.worksheet.worksheet import Worksheet

from kfsheet.coursework.handout import course_secret
from kfsheet.coursework.handout.questions_sheet import FIRST, HIDDEN, LOOKS_RIGHT, SHEET, hide
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
    fill = PatternFill("solid", start_color="FFC6EFCE", end_color="FFC6EFCE")
    rule = CellIsRule(operator="equal", formula=[f'"{LOOKS_RIGHT}"'], fill=fill)
    area = f"H{FIRST}:H{FIRST + len(exercise.questions) - 1}"
    book[SHEET].conditional_formatting.add(area, rule)
    hide(book)
    for page in pages:
        _protect(book[page.title], page.width)
    book.active = book.sheetnames.index(SHEET)


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
