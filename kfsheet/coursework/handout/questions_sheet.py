"""The sheet "Questions" of a student's workbook: what to do, and whether it looks right yet.

Beside each answer stands a checksum of three figures, computed live, and the stored one of the
right answer. It is the remainder of a salted, weighted sum to three figures: enough to notice a
mistake, too little to work back to a column of numbers. Weights and salts stand on a hidden sheet.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import floor, isnan, log10
from typing import NamedTuple

from openpyxl.utils import get_column_letter
from openpyxl.workbook import Workbook

from kfsheet.coursework.handout import course_secret
from kfsheet.errors import ModelError
from kfsheet.model.exercise import Exercise, Question
from kfsheet.workbook.write.layout import FIRST_ROW, TOKEN_NAME, Layout, quote
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Sheet, Words

SHEET, HIDDEN = "Questions", "kfsheet"
FIRST, MODULUS = 7, 997
LOOKS_RIGHT, NOT_YET = "looks right", "not yet"
YOURS, WANTED = "check number: yours", "check number: wanted"
HEADS = ("answer", "points", "where", "what to do", "filled in", YOURS, WANTED, "feedback")
WIDTHS = {1: 14, 2: 8, 3: 22, 4: 64, 5: 10, 6: 22, 7: 22, 8: 14, 10: 12, 11: 12}
CHARACTERS_A_LINE = 185  # of the columns A to H together, in a wide font
HOW = (
    "Fill in the orange cells on the sheets named below: a formula in each, from top to bottom. "
    "Everything that follows from them is live, charts too. Helper cells may stand anywhere beside "
    "the tables. A formula must follow when a parameter or a measurement changes: type no number "
    'that stands in a cell. Where there is no value, a formula gives the empty text "", as the '
    "others do; ISNUMBER tells whether there is one."
)
FEEDBACK = (
    "A check number is made of all values of an answer; it sees values, not formulas, and is none "
    "of them. A typed number may look right here and earns nothing. A right answer still shows "
    f"'{NOT_YET}' while an answer it depends on is wrong; each formula is graded on its own. In "
    "LibreOffice, press Ctrl+Shift+F9 once."
)


class Salt(NamedTuple):
    """What makes the checksum of one answer this student's own."""

    weights: list[int]
    factor: int
    shift: int


def place_of(layout: Layout, question: Question) -> str:
    """Where an answer belongs, as a range."""
    name = question.name
    if name in layout.scalars:
        sheet, row, column = layout.scalars[name]
        return f"{quote(sheet)}!${get_column_letter(column)}${row}"
    return layout.range(name)


def _values(now: Run, name: str) -> list[float]:
    return now.columns[name] if name in now.columns else [now.scalars[name]]


def salts(secret: bytes, exercise: str, student: str, name: str, rows: int) -> Iterator[Salt]:
    """Candidates, in an order that only the secret knows."""
    for attempt in range(100):
        parts = (exercise, student, name, str(attempt))
        stream = b"".join(
            course_secret.digest(secret, "salt", *parts, str(n)) for n in range(rows // 32 + 2)
        )
        factor = 2 + int.from_bytes(stream[:4], "big") % (MODULUS - 2)
        shift = int.from_bytes(stream[4:8], "big") % MODULUS
        yield Salt([1 + byte % 97 for byte in stream[8 : 8 + rows]], factor, shift)


def fitting_salt(
    secret: bytes, exercise: str, student: str, name: str, values: list[float]
) -> tuple[Salt, int]:
    """The first salt for which rounding in the last digits cannot change the checksum."""
    for salt in salts(secret, exercise, student, name, len(values)):
        terms = [w * v for w, v in zip(salt.weights, values, strict=True) if not isnan(v)]
        total = sum(terms)
        # Where terms cancel, programs that add in another order differ in the figures that count;
        # and a figure that ends near 5 may round either way.
        if abs(total) <= 0.02 * sum(map(abs, terms)):
            continue
        mantissa = abs(total) / 10 ** (floor(log10(abs(total))) - 2)
        if abs(mantissa % 1 - 0.5) > 0.1 and 100.5 < mantissa < 999.4:
            return salt, checksum(salt, total)
    raise ModelError(f"question {name}: its values are zero, so that no checksum can be made")


def checksum(salt: Salt, total: float) -> int:
    """Three figures of a weighted sum, with its sign and size, scrambled."""
    size = floor(log10(abs(total)))
    figures = floor(abs(total) / 10 ** (size - 2) + 0.5)
    whole = figures + 1_000 * (2 if total > 0 else 0) + 7_000 * (size + 30)
    return (whole * salt.factor + salt.shift) % MODULUS


def question_pages(
    exercise: Exercise, layout: Layout, now: Run, secret: bytes, student: tuple[str, str]
) -> list[Sheet]:
    """The visible sheet of questions, and the hidden one with salts and token."""
    page, hidden = Sheet(SHEET, widths=dict(WIDTHS)), Sheet(HIDDEN)
    page.put(1, 1, f"{exercise.title}: questions for {student[1]}", "title")
    for row, words in ((3, HOW), (4, FEEDBACK)):
        _put_paragraph(page, row, words)
    for column, word in enumerate(HEADS, 1):
        page.put(FIRST - 1, column, word, "header", align="center")
    hidden.put(1, 1, course_secret.token(secret, exercise.name, student[0]), "index")
    hidden.names[TOKEN_NAME] = (1, 1)
    for n, question in enumerate(exercise.questions):
        values = _values(now, question.name)
        salt, right = fitting_salt(secret, exercise.name, student[0], question.name, values)
        _put_question(page, FIRST + n, layout, question, values, right)
        _put_formulas(page, FIRST + n, n + 1, layout, question)
        _put_salt(hidden, n + 1, question, salt)
    _put_task(page, FIRST + len(exercise.questions) + 1, exercise.task)
    return [page, hidden]


def _put_task(page: Sheet, row: int, task: tuple[str, ...]) -> None:
    if task:
        page.put(row, 1, "What you need to know", "heading")
    for line, words in enumerate(task, row + 1):
        _put_paragraph(page, line, words)


def _put_paragraph(page: Sheet, row: int, words: str) -> None:
    page.put(row, 1, Words(words), "text", align="wrap")
    page.merges.append(f"A{row}:H{row}")
    page.heights[row] = 15 * (1 + len(words) // CHARACTERS_A_LINE) + 5


def _put_question(
    page: Sheet, row: int, layout: Layout, question: Question, values: list[float], right: int
) -> None:
    page.put(row, 1, question.name, "index")
    page.put(row, 2, question.points, "index", align="center")
    page.put(row, 3, place_of(layout, question).replace("$", ""), "index")
    page.put(row, 4, Words(question.hint), "meaning", align="wrap")
    page.put(row, 7, right, "index", align="center")
    page.put(row, 10, sum(not isnan(v) for v in values), "index")


def _put_formulas(page: Sheet, row: int, column: int, layout: Layout, question: Question) -> None:
    cells, letter = place_of(layout, question), get_column_letter(column)
    weights = f"{HIDDEN}!{letter}{FIRST_ROW + 1}:{letter}{FIRST_ROW + layout.model.rows}"
    if question.name in layout.scalars:
        weights = f"{HIDDEN}!{letter}{FIRST_ROW + 1}"
    factor, shift = f"{HIDDEN}!{letter}3", f"{HIDDEN}!{letter}4"
    # The exponent comes from the same cell twice; a total of 0 or an error leaves no checksum.
    whole = (
        f"ROUND(ABS(K{row})/10^(INT(LOG10(ABS(K{row})))-2),0)"
        f"+1000*(SIGN(K{row})+1)+7000*(INT(LOG10(ABS(K{row})))+30)"
    )
    page.put(row, 5, f"=COUNT({cells})", "formula", format="0", align="center")
    page.put(row, 11, f"=SUMPRODUCT({weights},{cells})", "formula")
    ready = f"AND(E{row}=J{row},ISNUMBER(K{row}))"
    page.put(row, 12, f"=IF({ready},IF(K{row}=0,1,{whole}),0)", "formula")
    page.put(row, 6, f"=MOD(L{row}*{factor}+{shift},{MODULUS})", "formula", align="center")
    words = f'=IF(AND(L{row}>0,F{row}=G{row}),"{LOOKS_RIGHT}","{NOT_YET}")'
    page.put(row, 8, words, "formula", align="center")


def _put_salt(hidden: Sheet, column: int, question: Question, salt: Salt) -> None:
    hidden.put(2, column, question.name, "index")
    for row, number in enumerate((salt.factor, salt.shift, *salt.weights), 3):
        hidden.put(row, column, number, "index")


def hide(book: Workbook) -> None:
    """Hide the sheet of salts and the columns of sums."""
    book[HIDDEN].sheet_state = "veryHidden"
    for letter in "JKL":
        book[SHEET].column_dimensions[letter].hidden = True
