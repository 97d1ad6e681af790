"""A workbook for every student: own numbers, empty answers, live feedback, a signed token."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from openpyxl.formatting.rule import CellIsRule
from openpyxl.packaging.custom import StringProperty
from openpyxl.styles import PatternFill, Protection
from openpyxl.utils import get_column_letter
from openpyxl.workbook import Workbook
from openpyxl.worksheet.dimensions import ColumnDimension
from openpyxl.worksheet.worksheet import Worksheet

from kfsheet.coursework.handout import course_secret
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.handout.questions_sheet import (
    FIRST,
    HIDDEN,
    LOOKS_RIGHT,
    SHEET,
    hide,
    question_pages,
)
from kfsheet.coursework.judging.judge import asked_steps
from kfsheet.coursework.judging.random_samples import OwnNumbers
from kfsheet.coursework.judging.worker_pool import Failed, Pool
from kfsheet.coursework.reading.results_folder import belongs_to, claim
from kfsheet.coursework.reading.roster import Student
from kfsheet.errors import DataError, ModelError, WorkbookError
from kfsheet.exercises import load_exercise
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise
from kfsheet.printing.excel_names import LAST_COLUMN
from kfsheet.workbook.engines.recalculate import recalculate
from kfsheet.workbook.engines.spreadsheet_engine import Values
from kfsheet.workbook.write.layout import FIRST_ROW, Layout
from kfsheet.workbook.write.openpyxl_workbook import WorkbookTemplate, assemble
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Cell, Sheet, is_formula
from kfsheet.workbook.write.styles import LEGEND
from kfsheet.workbook.write.write_workbook import compose, workbook_bytes

TOKEN_PROPERTY = "kfsheet token"
YOURS = (
    "This is your own workbook: its parameters and data are drawn for you alone, so they differ "
    "from the numbers in the words below. What to do stands on the sheet Questions."
)
LOCKED = {
    LEGEND["parameter"]: "a parameter: your own number, locked; the feedback holds for it only",
    LEGEND["data"]: "a measurement or another given number, locked; an empty one was not made",
    LEGEND["formula"]: "a given formula, locked; some are hidden, since they look like an answer",
}


def write_handouts(
    exercise: Exercise,
    spec: str,
    students: list[Student],
    secret: bytes,
    out: str | Path,
    *,
    jobs: int = 1,
    force: bool = False,
) -> Iterator[Path]:
    """Write every student's workbook and its solution.

    Parameters
    ----------
    exercise, spec : Exercise, str
        It must list questions; and the name or file by which a worker process finds it.
    students : list of Student
        Who gets one.
    secret : bytes
        See :mod:`kfsheet.coursework.handout.course_secret`.
    out : path
        Folder; ``students/ID/EXERCISE.xlsx`` and ``solutions/ID/EXERCISE.xlsx`` are written there.
    jobs : int
        Processes.
    force : bool
        Also replace a handout that is there and would become another one.

    Yields
    ------
    Path
        Each student's workbook, once both files are written.

    Raises
    ------
    ModelError
        If the exercise asks nothing.
    DataError
        If the handouts in the folder were made with another secret.
    WorkbookError
        If a file cannot be written, or would replace another handout without ``force``.
    """
    if not exercise.questions:
        raise ModelError(f"{exercise.name} asks no questions; list them in Exercise(questions=...)")
    if not claim(out, "secret", course_secret.fingerprint(secret)):
        raise DataError(
            f"{out} holds handouts made with another secret; give that --secret, or another --out"
        )
    if jobs == 1:
        for student in students:
            yield _write_both(exercise, student, secret, Path(out), force)
        return
    tasks = [(spec, student, secret, Path(out), force) for student in students]
    for (_, student, *_), written in Pool(_write_in_process, jobs).run(tasks):
        if isinstance(written, Failed):
            raise WorkbookError(f"the workbook of {student.id} was not written: {written.reason}")
        yield written


def holds_handouts(out: str | Path) -> bool:
    """Whether a folder holds handouts, or says of what secret they were made."""
    return bool(belongs_to(out, "secret")) or any(Path(out).glob("students/*/*.xlsx"))


def _write_in_process(spec: str, *task: Any) -> Path:
    return _write_both(load_exercise(spec), *task)


def _write_both(
    exercise: Exercise, student: Student, secret: bytes, out: Path, force: bool
) -> Path:
    path = out / "students" / student.id / f"{exercise.name}.xlsx"
    content = handout_bytes(exercise, student, secret)
    if path.exists() and not force and path.read_bytes() != content:
        raise WorkbookError(
            f"{path} is there and would become another workbook; if it was not handed out yet, "
            "replace it with: kfsheet handout --force"
        )
    solution = out / "solutions" / student.id / f"{exercise.name}.xlsx"
    write_file(solution, solution_bytes(exercise, own_numbers(exercise, secret, student.id)))
    return write_file(path, content)


def own_run(exercise: Exercise, own: OwnNumbers) -> Run:
    """The model with a student's numbers."""
    return Run.of(exercise.model, dict(own.data), dict(own.parameters))


def solution_bytes(exercise: Exercise, own: OwnNumbers) -> bytes:
    """The complete workbook with a student's numbers."""
    return workbook_bytes(exercise, own_run(exercise, own))


def handout_bytes(exercise: Exercise, student: Student, secret: bytes) -> bytes:
    """A student's workbook; the same bytes for the same secret, exercise and student."""
    layout = Layout.standard(exercise.model)
    now = own_run(exercise, own_numbers(exercise, secret, student.id))
    pages = handout_pages(exercise, layout, now)
    pages[1:1] = question_pages(exercise, layout, now, secret, (student.id, student.name))
    pages.append(pages.pop(2))  # the hidden sheet last
    book = assemble(exercise, layout, pages, now)
    _finish_book(book, pages, exercise, course_secret.token(secret, exercise.name, student.id))
    shell = WorkbookTemplate(book, pages)
    _store(pages, _calculated(shell.filled(pages)))
    return shell.filled(pages)


def handout_pages(exercise: Exercise, layout: Layout, now: Run) -> list[Sheet]:
    """The exercise's worksheets with empty answers, without "Check", which knows the answers."""
    words = replace(exercise, about=(YOURS, exercise.about[0]), notebook="")
    pages = [p for p in compose(words, layout, now, now) if p.title != "Check"]
    by_title = {page.title: page for page in pages}
    for question in exercise.questions:
        if question.name in layout.scalars:
            sheet, row, column = layout.scalars[question.name]
            _empty(by_title[sheet], (row, column))
            continue
        sheet, column = layout.home(question.name)
        by_title[sheet].heights[3] = 80  # there is the mark's place, later
        for step in asked_steps(exercise.model, question.name):
            _empty(by_title[sheet], (FIRST_ROW + step, column))
    for section in exercise.frozen:
        _freeze(by_title[section])
    for section in exercise.sealed:
        _seal(by_title[section])
    for name in exercise.veiled:
        if name in layout.scalars:
            sheet, *place = layout.scalars[name]
            piece = by_title[sheet].cell_at(*place)
            by_title[sheet].cells[tuple(place)] = piece._replace(kind="veiled")
            continue
        sheet, column = layout.home(name)
        _veil(by_title[sheet], column)
    _mend_read_me(by_title["Read me"])
    _mend_parameters(by_title["Parameters"])
    return pages


def _empty(page: Sheet, place: tuple[int, int]) -> None:
    page.cells[place] = Cell(None, "answer", format=page.cell_at(*place).format)


def _freeze(page: Sheet) -> None:
    """Numbers in the place of formulas that are those of an answer."""
    for at, filled in page.columns.items():
        if filled.rules:
            page.columns[at] = replace(filled, kind="data", rules=())


def _seal(page: Sheet) -> None:
    for at, filled in page.columns.items():
        if filled.rules and filled.kind == "formula":
            _veil(page, at)


def _veil(page: Sheet, at: int) -> None:
    """Formulas stay, and are not shown while the sheet is locked."""
    page.columns[at] = replace(page.columns[at], kind="veiled")


def _mend_parameters(page: Sheet) -> None:
    page.put(2, 1, "These are your own numbers; everything follows from them.")


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


def _finish_book(book: Workbook, pages: list[Sheet], exercise: Exercise, token: str) -> None:
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
    """Lock what is there; free cells beside it, and rows and columns to insert, stay open."""
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


def _calculated(content: bytes) -> Values:
    """What an engine finds in a workbook whose answers are still empty."""
    with tempfile.TemporaryDirectory(prefix="kfsheet-") as folder:
        path = Path(folder) / "handout.xlsx"
        path.write_bytes(content)
        return recalculate(path)


def _store(pages: list[Sheet], values: Values) -> None:
    """Put an engine's values in the place of the key's, which would give the answers away."""
    for page in pages:
        found = values[page.title]
        for place, piece in page.cells.items():
            if is_formula(piece.content):
                page.cells[place] = piece._replace(stored=found.get(place, ""))
        for at, filled in page.columns.items():
            if filled.rules:
                kept = [found.get((row, at), "") for row in filled.rows]
                page.columns[at] = replace(filled, values=kept)
