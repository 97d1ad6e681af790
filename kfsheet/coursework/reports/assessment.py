"""One submission, from top to bottom: file, cells, answers, meaning, marks, a marked copy.

=========  =====================================================================================
file       :mod:`kfsheet.coursework.reading.submission` reads it within limits
cells      :mod:`kfsheet.workbook.reading.sheet_cells` keeps formulas, numbers and texts
answers    :mod:`kfsheet.coursework.reading.cell_addresses` finds where they stand
values     :mod:`kfsheet.coursework.judging.calculated_answers` calculates each in several worlds
mark       :mod:`kfsheet.coursework.judging.judge` compares them with the key's
mistake    :mod:`kfsheet.coursework.judging.mistakes.diagnosis` names it
report     :mod:`kfsheet.coursework.reports.marked_workbook` writes the marks beside the answers
=========  =====================================================================================

It runs in a process that may be stopped at any moment.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from kfsheet.coursework.handout import course_secret
from kfsheet.coursework.handout.lock import TOKEN_PROPERTY
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.judging.changed_cells import changed_cells
from kfsheet.coursework.judging.judge import Judge, Mark
from kfsheet.coursework.judging.mistakes.diagnosis import EMPTY
from kfsheet.coursework.judging.mistakes.known_mistakes import KnownMistakes
from kfsheet.coursework.judging.model_runs import ModelRuns, OwnNumbers
from kfsheet.coursework.judging.recalculated_answers import Recalculation
from kfsheet.coursework.reading.cell_addresses import named_cell
from kfsheet.coursework.reading.submission import Book, read_submission
from kfsheet.coursework.reports.marked_workbook import mark_workbook
from kfsheet.coursework.reports.origin import Numbers, strange_numbers
from kfsheet.errors import KfsheetError, SubmissionError, UnwrittenError
from kfsheet.exercises import load_exercise
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise
from kfsheet.workbook.write.layout import TOKEN_NAME

GRADED, UNTOUCHED, NO_TOKEN, OTHER = "graded", "untouched", "no token", "other exercise"
NOT_OWN = "not own data"


@dataclass
class Assessment:
    """What one file is worth, whoever handed it in; ``student`` comes from its token."""

    status: str
    remark: str = ""
    student: str = ""
    marks: list[Mark] = field(default_factory=list)
    feedback: bool = False
    """Whether a marked copy of the workbook could be made."""

    final: bool = True
    """Whether it would be the same on a machine that has more time and room."""

    numbers: Numbers = field(default_factory=dict)
    """Those of the file, if they are not the student's own."""

    unwritten: str = ""
    """What could not be written for lack of room, if anything."""

    @property
    def score(self) -> float:
        """Points of all answers."""
        return sum(mark.score for mark in self.marks)

    def as_dict(self) -> dict[str, Any]:
        """For a file of results."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Assessment:
        """The way back."""
        return cls(**{**values, "marks": [Mark(**mark) for mark in values["marks"]]})


@lru_cache(maxsize=4)
def prepared(spec: str) -> tuple[ModelRuns, KnownMistakes]:
    """An exercise with its worlds and its mistakes, made once in a process."""
    runs = ModelRuns(load_exercise(spec))
    return runs, KnownMistakes(runs)


def assess(spec: str, secret: bytes, path: Path, copy: Path | None = None) -> Assessment:
    """Read and judge one file; what is wrong with the file becomes a status, never an error.

    Parameters
    ----------
    spec : str
        Name or file of the exercise.
    secret : bytes
        That of the handout.
    path : Path
        The file.
    copy : Path, optional
        Where the marked copy of the workbook goes.
    """
    runs, mistakes = prepared(spec)
    exercise = runs.exercise
    try:
        book = read_submission(path)
        student = _student(book, exercise, secret)
        own = own_numbers(exercise, secret, student)
        recalculation = Recalculation(path, book, runs)
        judge = Judge(runs, mistakes, book, own, recalculation)
        if numbers := strange_numbers(exercise, book, judge.addresses, own):
            words = "parameters and data are not those that this student was given"
            return Assessment(NOT_OWN, words, student, numbers=numbers)
        marks = judge.marks()
        if all(mark.status == EMPTY for mark in marks):
            return Assessment(UNTOUCHED, "no answer was filled in", student, marks)
        remarks = "; ".join(_remarks(exercise, judge, own, recalculation.late))
        found = Assessment(GRADED, remarks, student, marks, final=not recalculation.late)
        if copy:
            _write_copy(found, path, copy, judge)
        return found
    except SubmissionError as error:
        return Assessment(error.status, error.remark)
    except MemoryError:  # the limit of the process, see worker_pool
        return Assessment("too large", "reading the file took more memory than a submission may")


def _student(book: Book, exercise: Exercise, secret: bytes) -> str:
    # Two places hold it: what loses one, a program or a copied sheet, mostly keeps the other.
    address = named_cell(book, TOKEN_NAME)
    cell = book.sheets[address[0]].get(address[1:]) if address else None
    texts = [cell, book.properties.get(TOKEN_PROPERTY)]
    if not any(isinstance(text, str) for text in texts):  # a program that drops names keeps cells
        texts = [text for cells in book.sheets.values() for text in cells.values()]
    found = [
        token
        for text in texts
        if isinstance(text, str) and (token := course_secret.read_token(secret, text))
    ]
    if not found:
        raise SubmissionError(NO_TOKEN, "the file was not handed out, or lost its token")
    if len(set(found)) > 1:
        raise SubmissionError(NO_TOKEN, "the file carries the tokens of two students")
    name, student = found[0]
    if name != exercise.name:
        raise SubmissionError(OTHER, f"the file belongs to the exercise {name}")
    return student


def _remarks(exercise: Exercise, judge: Judge, own: OwnNumbers, late: bool) -> Iterator[str]:
    """What a lecturer should know of the file; no mark depends on it."""
    yield from judge.book.remarks
    if changed := changed_cells(exercise, judge.book, judge.addresses, own, judge.calculated):
        yield f"locked cells were changed ({', '.join(changed[:6])}); marks ignore that"
    if late:
        yield "there was no time to calculate all answers; grade again to try once more"


def _write_copy(found: Assessment, path: Path, copy: Path, judge: Judge) -> None:
    """The student's own workbook with marks; a file too odd for that goes without."""
    try:
        write_file(copy, mark_workbook(path, judge.book, judge.addresses, found.marks))
    except UnwrittenError as error:  # the next run tries again
        found.unwritten, found.final = str(error), False
    except (KfsheetError, ValueError, KeyError):
        return
    else:
        found.feedback = True
