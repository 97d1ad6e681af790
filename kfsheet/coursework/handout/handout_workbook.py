"""One handout, from top to bottom: a student's own numbers, one run, worksheets, a locked file.

What a student gets is the exercise's own workbook with three changes: the answers are empty, what
would give them away is sealed, and the sheet Questions says what to do.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from kfsheet.coursework.handout.empty_answers import with_empty_answers
from kfsheet.coursework.handout.lock import lock
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.handout.questions_sheet import question_pages
from kfsheet.coursework.judging.model_runs import OwnNumbers
from kfsheet.coursework.reading.roster import Student
from kfsheet.model.exercise import Exercise
from kfsheet.workbook.engines.recalculate import recalculate
from kfsheet.workbook.engines.spreadsheet_engine import CellValue, Values
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.openpyxl_workbook import WorkbookTemplate, assemble
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Place, Sheet, is_formula
from kfsheet.workbook.write.write_workbook import workbook_bytes


def own_run(exercise: Exercise, own: OwnNumbers) -> Run:
    """The model with a student's numbers."""
    return Run.of(exercise.model, dict(own.data), dict(own.parameters))


def handout_bytes(exercise: Exercise, student: Student, secret: bytes) -> bytes:
    """A student's workbook; the same bytes for the same secret, exercise and student."""
    now = own_run(exercise, own_numbers(exercise, secret, student.id))
    return handout_of_run(exercise, now, student, secret)


def solution_bytes(exercise: Exercise, own: OwnNumbers) -> bytes:
    """The complete workbook with a student's numbers."""
    return solution_of_run(exercise, own_run(exercise, own))


def solution_of_run(exercise: Exercise, now: Run) -> bytes:
    """The complete workbook of one run."""
    return workbook_bytes(exercise, now)


def handout_of_run(exercise: Exercise, now: Run, student: Student, secret: bytes) -> bytes:
    """The workbook of one run, to be handed out to a student."""
    layout = Layout.standard(exercise.model, exercise.waiting)
    read_me, *pages = with_empty_answers(exercise, layout, now)
    questions, salts = question_pages(exercise, layout, now, secret, (student.id, student.name))
    pages = [read_me, questions, *pages, salts]
    book = assemble(exercise, layout, pages, now)
    lock(book, pages, exercise, secret, student.id)
    shell = WorkbookTemplate(book, pages)
    # The stored values of ``now`` are the key's; those of a workbook without answers are not.
    values = _calculated(shell.filled(pages))
    for page in pages:
        _store(page, values[page.title])
    return shell.filled(pages)


def _calculated(content: bytes) -> Values:
    """What an engine finds in a workbook whose answers are still empty."""
    with tempfile.TemporaryDirectory(prefix="kfsheet-") as folder:
        path = Path(folder) / "handout.xlsx"
        path.write_bytes(content)
        return recalculate(path)


def _store(page: Sheet, found: dict[Place, CellValue]) -> None:
    """Put an engine's values in the place of the stored ones."""
    for place, piece in page.cells.items():
        if is_formula(piece.content):
            page.cells[place] = piece._replace(stored=found.get(place, ""))
    for at, filled in page.columns.items():
        if filled.rules:
            kept = [found.get((row, at), "") for row in filled.rows]
            page.columns[at] = replace(filled, values=kept)
