"""The exercise's worksheets as a student gets them: empty answers, sealed sheets, other words."""

from __future__ import annotations

import re
from dataclasses import replace

from kfsheet.coursework.handout.questions_sheet import SHEET
from kfsheet.coursework.handout.shown_answers import shown_answers
from kfsheet.model.exercise import Exercise, asked_steps
from kfsheet.printing.sentence import Verdict
from kfsheet.workbook.write.layout import FIRST_ROW, WORDS_ROW, Layout
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Cell, Sheet
from kfsheet.workbook.write.styles import LEGEND
from kfsheet.workbook.write.write_workbook import compose

YOURS = (
    "This is your own workbook: its parameters and data are drawn for you alone. What to do stands "
    "on the sheet Questions. What is not orange is locked; what follows from your answers is empty "
    "until they are there."
)
OWN_PARAMETERS = "your own numbers, and what follows from them"
NUMBERS_ONLY = "This sheet holds numbers: its formulas would give answers away."
LOCKED = {
    LEGEND["parameter"]: "a parameter: your own number, locked; the feedback holds for it only",
    LEGEND["data"]: "a measurement or another given number, locked; an empty one was not made",
    LEGEND["formula"]: "a given formula, locked; some are hidden, since they look like an answer",
}


def with_empty_answers(exercise: Exercise, layout: Layout, now: Run) -> list[Sheet]:
    """The exercise's worksheets with empty answers, without "Check", which knows the answers."""
    pages = {p.title: p for p in compose(_in_own_words(exercise, now), layout, now, now)}
    del pages["Check"]
    for question in exercise.questions:
        _empty(pages, layout, question.name)
    for section in exercise.frozen:
        _freeze(pages[section])
    for section in exercise.sealed:
        _seal(pages[section])
    for name in sorted(shown_answers(exercise)):
        _veil(pages, layout, name)
    _mend_read_me(pages["Read me"], exercise)
    pages["Parameters"].put(2, 1, "These are your own numbers; everything follows from them.")
    return list(pages.values())


def _in_own_words(exercise: Exercise, now: Run) -> Exercise:
    """The exercise's words without what was said of other numbers, or asks to change some."""
    about = (YOURS, *_still_true(exercise, now))
    # What stands below a chart with a number in it was seen in the exercise's own run.
    charts = tuple(
        replace(chart, note="")
        if not isinstance(chart.note, Verdict) and re.search(r"\d", chart.note)
        else chart
        for chart in exercise.charts
    )
    return replace(exercise, about=about, charts=charts, notebook="")


def _still_true(exercise: Exercise, now: Run) -> list[str | Verdict]:
    """The story, without sentences that tell the exercise's value of a parameter that differs."""
    others = {
        f"{parameter.value:.10g}"
        for name, parameter in exercise.model.parameters.items()
        if parameter.value != now.scalars[name]
    }
    first = exercise.about[0] if exercise.about else ""
    if isinstance(first, Verdict):  # its numbers are the student's own
        return [first]
    sentences = re.split(r"(?<=[.!?])\s+", first) if first else []
    numbers = r"(?<![\w.{])\d+(?:\.\d+)?(?![\w}])"
    kept = [s for s in sentences if not others & set(re.findall(numbers, s))]
    return [" ".join(kept)] if kept else []


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
    head = page.cell_at(WORDS_ROW, 1)
    page.cells[WORDS_ROW, 1] = head._replace(content=f"{head.content}. {NUMBERS_ONLY}")
    page.widths[1], page.heights[WORDS_ROW] = 26, 60


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


def _mend_read_me(page: Sheet, exercise: Exercise) -> None:
    """Words that ask to change what is locked, or tell of the sheet "Check", give way to others."""
    for (row, column), piece in list(page.cells.items()):
        if piece.content in LOCKED:
            page.put(row, column, LOCKED[piece.content], align="wrap")
        elif piece.kind == "formula" and column == 1:
            page.put(row + 1, 1, "answer", "sample")
            page.put(row + 1, 2, "an answer: fill in a formula", align="wrap")
        elif piece.kind != "index":
            continue
        elif piece.content == "Parameters":
            page.put(row, column + 1, OWN_PARAMETERS, align="wrap")
        elif piece.content == "Check":
            page.put(row, column, SHEET, "index")
            page.put(row, column + 1, "what to fill in, and what looks right so far", align="wrap")
        elif piece.content in exercise.frozen:
            words = f"{page.cell_at(row, column + 1).content} (numbers only)".strip()
            page.put(row, column + 1, words, align="wrap")
