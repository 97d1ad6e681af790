"""A class hands in: what making and grading its workbooks takes."""

import sys
import tempfile
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path

from measuring import Line, seconds

from kfsheet import load_exercise
from kfsheet.coursework.handout.handout_workbook import handout_bytes, solution_bytes
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.reading.roster import Student
from kfsheet.coursework.reports.assessment import assess
from kfsheet.coursework.reports.grading import grade

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import students as do

CLASS = 300


def sign_error(paper: do.Paper, name: str) -> None:
    """Minus the answer."""
    paper.answer(name, do.negated)


MISTAKES = (
    do.helper_columns, do.values_pasted, do.absolute_slip, do.broken_fill_down, sign_error,
)  # fmt: skip


def lines() -> Iterator[Line]:
    """Two processes grade a class; one makes and judges the cannon-ball's long table."""
    with tempfile.TemporaryDirectory() as folder:
        yield graded(Path(folder))
        yield from long_table(Path(folder))


def graded(folder: Path) -> Line:
    """Football, a mistake of some kind in every third answer, start of the processes included."""
    exercise = load_exercise("football")
    people = [Student(f"s{n:03d}", f"Student {n}") for n in range(CLASS)]
    kinds = cycle(MISTAKES)
    (folder / "in").mkdir()
    for n, student in enumerate(people):
        paper = do.Paper(exercise, student).open(folder / "in" / f"{student.id}.xlsx").answer_all()
        for question in exercise.questions[n % 3 :: 3]:
            if question.name in exercise.model.table:
                next(kinds)(paper, question.name)
        if n % 7 == 0:
            do.hard_coded(paper, "x_f")
        paper.save()
    out = iter(range(CLASS))

    def work() -> object:
        return grade(
            exercise, "football", folder / "in", people, do.SECRET, folder / f"out{next(out)}",
            jobs=2,
        )  # fmt: skip

    time = seconds(work, repeats=1)
    words = f"{CLASS / time:.0f} a second; 20 wanted"
    return Line(f"grade {CLASS} footballs with two processes", time, 0, words)


def long_table(folder: Path) -> Iterator[Line]:
    """The cannon-ball's 1,320 rows."""
    exercise = load_exercise("cannonball")
    own = own_numbers(exercise, do.SECRET, do.ADA.id)

    def make() -> None:
        solution_bytes(exercise, own)
        handout_bytes(exercise, do.ADA, do.SECRET)

    yield Line("make a cannon-ball handout and its solution", seconds(make, repeats=3))
    path = do.Paper(exercise).open(folder / "a.xlsx").answer_all().save()

    def judge() -> None:
        assert assess("cannonball", do.SECRET, path, folder / "copy.xlsx").status == "graded"

    judge()
    yield Line("judge a cannon-ball of 1,320 rows", seconds(judge, repeats=3), 0, "under 3 s")
