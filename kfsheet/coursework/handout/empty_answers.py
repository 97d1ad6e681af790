"""The exercise's worksheets as a student gets them: empty answers, sealed sheets, other words."""

from __future__ import annotations

from dataclasses import replace

from kfsheet.coursework.handout.questions_sheet import SHEET
from kfsheet.model.exercise import Exercise, asked_steps
from kfsheet.workbook.write.layout import FIRST_ROW, WORDS_ROW, Layout
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Cell, Sheet
from kfsheet.workbook.write.styles import LEGEND
from kfsheet.workbook.write.write_workbook import compose

YOURS = (
    "This is your own workbook: its parameters and data are drawn for you alone, so they differ "
    "from the numbers in the words below. What to do stands on the sheet Questions."
)
LOCKED = {
    LEGEND["parameter"]: "a parameter: your own number, locked; the feedback holds for it only",
    LEGEND["data"]: "a measurement or another given number, locked; an empty one was not made",
    LEGEND["formula"]: "a given formula, locked; some are hidden, since they look like an answer",
}


def with_empty_answers(exercise: Exercise, layout: Layout, now: Run) -> list[Sheet]:
    """The exercise's worksheets with empty answers, without "Check", which knows the answers."""
    words = replace(exercise, about=(YOURS, exercise.about[0]), notebook="")
    pages = {p.title: p for p in compose(words, layout, now, now) if p.title != "Check"}
    for question in exercise.questions:
        _empty(pages, layout, question.name)
    for section in exercise.frozen:
        _freeze(pages[section])
    for section in exercise.sealed:
        _seal(pages[section])
    for name in exercise.veiled:
        _veil(pages, layout, name)
    _mend_read_me(pages["Read me"])
    pages["Parameters"].put(2, 1, "These are your own numbers; everything follows from them.")
    return list(pages.values())


def _empty(pages: dict[str, Sheet], layout: Layout, name: str) -> None:
    """Take a key's formulas away; the cells keep the format of its numbers."""
    if name in layout.scalars:
        sheet, *place = layout.scalars[name]
        places = [tuple(place)]
    else:
        sheet, column = layout.home(name)
        places = [(FIRST_ROW + step, column) for step in asked_steps(layout.model, name)]
        pages[sheet].heights[WORDS_ROW] = 80  # the mark and its words will stand there
    for place in places:
        pages[sheet].cells[place] = Cell(None, "answer", format=pages[sheet].cell_at(*place).format)


def _freeze(page: Sheet) -> None:
    """Numbers in the place of formulas that are those of an answer."""
    for at, filled in page.columns.items():
        if filled.rules:
            page.columns[at] = replace(filled, kind="data", rules=())


def _seal(page: Sheet) -> None:
    """Formulas stay, and are not shown while the sheet is locked."""
    for at, filled in page.columns.items():
        if filled.rules and filled.kind == "formula":
            page.columns[at] = replace(filled, kind="veiled")


def _veil(pages: dict[str, Sheet], layout: Layout, name: str) -> None:
    """The same for one column or scalar."""
    if name in layout.scalars:
        sheet, row, column = layout.scalars[name]
        pages[sheet].cells[row, column] = pages[sheet].cell_at(row, column)._replace(kind="veiled")
    else:
        sheet, at = layout.home(name)
        pages[sheet].columns[at] = replace(pages[sheet].columns[at], kind="veiled")


def _mend_read_me(page: Sheet) -> None:
    """The words about the sheet "Check", which handouts lack, become words about the questions."""
    for (row, column), piece in list(page.cells.items()):
        if piece.content in LOCKED:
            page.put(row, column, LOCKED[piece.content], align="wrap")
        if piece.content == "Check" and piece.kind == "index":
            page.put(row, column, SHEET, "index")
            page.put(row, column + 1, "what to fill in, and whether it looks right", align="wrap")
        if piece.kind == "formula" and column == 1:
            page.put(row + 1, 1, "answer", "sample")
            page.put(row + 1, 2, "an answer: fill in a formula", align="wrap")
