"""The sheet "Questions" of a student's workbook: what to do, and what looks right so far.

Beside each answer stands, live, up to which row it looks right and what it waits for. How that is
found without the right values stands in :mod:`kfsheet.coursework.handout.live_checks`.
"""

from __future__ import annotations

from openpyxl.workbook import Workbook

from kfsheet.coursework.handout.live_checks import HIDDEN, Answer, LiveChecks, answers, feedback
from kfsheet.model.exercise import Exercise
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Sheet, Words

SHEET = "Questions"
FIRST, FEEDBACK_COLUMN = 7, "F"
LOOKS_RIGHT, NOT_YET, EMPTY = "looks right", "not yet", "empty"
WAITS, DIFFERS = "waits for", "differs in"
FILLED_IN = "filled in"  # the head to the left of the feedback
HEADS = ("answer", "points", "where", "what to do", FILLED_IN)
WIDTHS = {1: 14, 2: 8, 3: 26, 4: 62, 5: 14, 6: 46}
CHARACTERS_A_LINE = 180  # of the columns together, in a wide font
HOW = (
    "Fill in the orange cells on the sheets named below: a formula in each, from top to bottom. "
    "What follows from them is live, charts too, and empty until what it needs is there; so long "
    "a formula of yours that reads it may show an error. Helper cells may stand anywhere beside "
    "the tables. A formula must follow when a parameter or a measurement changes: type no number "
    'that stands in a cell. Where there is no value, a formula gives the empty text "", as the '
    "others do; ISNUMBER tells whether there is one."
)
FEEDBACK = (
    "Values are looked at from the first row on, with your own numbers. 'Right up to ... 3; waits "
    "for x' means: nothing is wrong so far, and the rest needs x, which is not right yet. 'Differs "
    "in ... 4' names the first row to look at. The feedback sees values, not formulas: a typed "
    "number may look right here and earns nothing, and of five hundred wrong numbers one passes. "
    "Each formula is graded on its own. In LibreOffice, press Ctrl+Shift+F9 once."
)


def question_pages(
    exercise: Exercise, layout: Layout, now: Run, secret: bytes, student: tuple[str, str]
) -> list[Sheet]:
    """The visible sheet of questions, and the hidden one with checks and token."""
    page = Sheet(SHEET, widths=dict(WIDTHS))
    page.put(1, 1, f"{exercise.title}: questions for {student[1]}", "title")
    for row, words in ((3, HOW), (4, FEEDBACK)):
        _put_paragraph(page, row, words)
    asked = answers(exercise, layout, now)
    checks = LiveChecks(exercise, asked, secret, student[0])
    last = FIRST + len(asked) - 1
    looks = f'COUNTIF({FEEDBACK_COLUMN}{FIRST}:{FEEDBACK_COLUMN}{last},"{LOOKS_RIGHT}")'
    heads = (*HEADS, f'={looks}&" of {len(asked)} look right"')
    for column, word in enumerate(heads, 1):
        page.put(FIRST - 1, column, word, "header", align="center")
    for number, answer in enumerate(asked):
        _put_question(page, FIRST + number, answer)
        _put_formulas(page, FIRST + number, number, answer, checks)
    _put_task(page, last + 2, exercise.task)
    return [page, checks.sheet]


def _put_task(page: Sheet, row: int, task: tuple[str, ...]) -> None:
    if task:
        page.put(row, 1, "What you need to know", "heading")
    for line, words in enumerate(task, row + 1):
        _put_paragraph(page, line, words)


def _put_paragraph(page: Sheet, row: int, words: str) -> None:
    page.put(row, 1, Words(words), "text", align="wrap")
    page.merges.append(f"A{row}:{FEEDBACK_COLUMN}{row}")
    page.heights[row] = 15 * (1 + len(words) // CHARACTERS_A_LINE) + 5


def _put_question(page: Sheet, row: int, answer: Answer) -> None:
    page.put(row, 1, answer.name, "index")
    page.put(row, 2, answer.question.points, "index", align="center")
    page.put(row, 3, Words(answer.place), "index", align="wrap")
    page.put(row, 4, Words(answer.question.hint), "meaning", align="wrap")


def _put_formulas(page: Sheet, row: int, number: int, answer: Answer, checks: LiveChecks) -> None:
    filled = f'={checks.of(number, "filled")}&" of {len(answer.asked)}"'
    page.put(row, 5, filled, "formula", align="center")
    page.put(row, 6, feedback(checks, number, LOOKS_RIGHT, EMPTY), "formula", align="center")


def hide(book: Workbook) -> None:
    """Hide the sheet of checks."""
    book[HIDDEN].sheet_state = "veryHidden"
