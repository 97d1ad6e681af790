"""One submission, from file to marks, in a process that may be stopped at any moment."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from kfsheet.coursework.handout import course_secret
from kfsheet.coursework.handout.lock import TOKEN_PROPERTY
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.judging.changed_cells import changed_cells
from kfsheet.coursework.judging.diagnosis import EMPTY
from kfsheet.coursework.judging.judge import Judge, Mark
from kfsheet.coursework.judging.random_samples import Sampler
from kfsheet.coursework.judging.recalculated_answers import Recalculation
from kfsheet.coursework.reading.cell_addresses import named_cell
from kfsheet.coursework.reading.submission import Book, read_submission
from kfsheet.coursework.reports.marked_workbook import mark_workbook
from kfsheet.errors import KfsheetError, SubmissionError
from kfsheet.exercises import load_exercise
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise
from kfsheet.workbook.write.layout import TOKEN_NAME

GRADED, UNTOUCHED, NO_TOKEN, OTHER = "graded", "untouched", "no token", "other exercise"


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
    """Whether it would be the same on a machine that has more time."""

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
def prepared(spec: str) -> tuple[Exercise, Sampler]:
    """An exercise and its random points, made once in a process."""
    exercise = load_exercise(spec)
    return exercise, Sampler(exercise.model)


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
    exercise, sampler = prepared(spec)
    try:
        book = read_submission(path)
        student = _student(book, exercise, secret)
        return _assessed(exercise, sampler, secret, path, book, student, copy)
    except SubmissionError as error:
        return Assessment(error.status, error.remark)
    except MemoryError:
        return Assessment("too large", "reading the file took more memory than a submission may")


def _student(book: Book, exercise: Exercise, secret: bytes) -> str:
    address = named_cell(book, TOKEN_NAME)
    cell = book.sheets[address[0]].get(address[1:]) if address else None
    found = [
        token
        for text in (cell, book.properties.get(TOKEN_PROPERTY))
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


def _assessed(
    exercise: Exercise,
    sampler: Sampler,
    secret: bytes,
    path: Path,
    book: Book,
    student: str,
    copy: Path | None,
) -> Assessment:
    own = own_numbers(exercise, secret, student)
    recalculation = Recalculation(path, sampler)

    def asked(name: str) -> dict[int, bool]:
        return recalculation(judge.addresses, name)

    judge = Judge(exercise, sampler, book, own, asked)
    marks = judge.marks()
    if all(mark.status == EMPTY for mark in marks):
        return Assessment(UNTOUCHED, "no answer was filled in", student, marks)
    remarks = list(book.remarks)
    if changed := changed_cells(exercise, book, judge.addresses, own):
        remarks.append(f"locked cells were changed ({', '.join(changed[:6])}); marks ignore that")
    if recalculation.late:
        remarks.append("there was no time to calculate all answers; grade again to try once more")
    final = not recalculation.late
    result = Assessment(GRADED, "; ".join(remarks), student, marks, final=final)
    if copy:
        result.feedback = _write_copy(path, copy, judge, result)
    return result


def _write_copy(path: Path, copy: Path, judge: Judge, result: Assessment) -> bool:
    """The student's own workbook with marks; a file too odd for that goes without."""
    try:
        write_file(copy, mark_workbook(path, judge.book, judge.addresses, result.marks))
    except (KfsheetError, ValueError, KeyError):
        return False
    return True
