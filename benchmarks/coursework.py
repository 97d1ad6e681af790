"""A class hands in: what making and grading its workbooks takes."""

import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from itertools import cycle
from pathlib import Path
from shutil import copyfile

from measuring import Line, seconds

from kfsheet import load_exercise
from kfsheet.coursework.handout.handout_workbook import handout_bytes, solution_bytes
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.reading.roster import Student
from kfsheet.coursework.reports.assessment import assess
from kfsheet.coursework.reports.grading import grade

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import students as do

CLASS, SMALL_CLASS, HANDOUTS = 300, 30, 20


def sign_error(paper: do.Paper, name: str) -> None:
    """Minus the answer."""
    paper.answer(name, do.negated)


MISTAKES = (
    do.helper_columns, do.values_pasted, do.absolute_slip, do.broken_fill_down, sign_error,
)  # fmt: skip
HOSTILE = {
    "sums of sums": "=" + "SUM(" * 60 + "A4:L19" + ",1)" * 60,
    "arrays of arrays": "=SUMPRODUCT((A1:A9999=TRANSPOSE(A1:A9999))*1)",
    "a sheet's worth": "=SUMPRODUCT(A1:XFD1048576*1)",
    "powers of powers": "=" + "^".join("9" * 60),
    "8,192 characters": "=" + "+".join(f"C{4 + n % 16}*K{4 + n % 16}" for n in range(1_000)),
    "deep parentheses": "=" + "(" * 2_000 + "1" + ")" * 2_000,
}  # fmt: skip


def lines() -> Iterator[Line]:
    """Two processes grade a class; one makes and judges the cannon-ball's long table."""
    with tempfile.TemporaryDirectory() as folder:
        yield graded(Path(folder))
        yield hostile(Path(folder))
        yield handouts()
        yield from long_table(Path(folder))


def processor() -> float:
    """Seconds of the processors so far, of this process and those that it has waited for."""
    return sum(os.times()[:4])


def spent(work: Callable[[], object]) -> tuple[float, str]:
    """Time of one call, and the processors' time in words: other people's work costs none."""
    began = processor()
    time = seconds(work, repeats=1)
    return time, f"{processor() - began:.1f} s of processors"


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
    time, words = spent(lambda: football_marks(people, folder / "in", folder / "out"))
    words = f"{CLASS / time:.0f} a second; 20 wanted; {words}"
    return Line(f"grade {CLASS} footballs with two processes", time, 0, words)


def football_marks(people: list[Student], folder: Path, out: Path) -> None:
    """Two processes grade footballs."""
    grade(load_exercise("football"), "football", folder, people, do.SECRET, out, jobs=2)


def hostile(folder: Path) -> Line:
    """What a class takes longer if one formula was written to be slow: the worst of some."""
    people = [Student(f"s{n:03d}", f"Student {n}") for n in range(SMALL_CLASS)]
    home = folder / "small"
    home.mkdir()
    for student in people:
        copyfile(folder / "in" / f"{student.id}.xlsx", home / f"{student.id}.xlsx")
    plain, _ = spent(lambda: football_marks(people, home, folder / "plain"))
    times = {}
    for name, text in HOSTILE.items():
        paper = do.Paper(load_exercise("football"), people[0]).open(home / "s000.xlsx").answer_all()
        paper.answer("x_f", lambda _, __, text=text: text)
        paper.save()
        times[name], _ = spent(lambda: football_marks(people, home, folder / f"out {name}"))  # noqa: B023
    worst = max(times, key=times.get)
    words = f"{times[worst] - plain:.1f} s more than without ({worst}); at most 2 wanted"
    return Line(f"grade {SMALL_CLASS} footballs, one formula hostile", times[worst], 0, words)


def handouts() -> Line:
    """Footballs for a class, in one process."""
    exercise = load_exercise("football")

    def make() -> None:
        for n in range(HANDOUTS):
            handout_bytes(exercise, Student(f"h{n}", f"Student {n}"), do.SECRET)

    time, words = spent(make)
    return Line(
        f"make {HANDOUTS} football handouts", time, 0, f"{HANDOUTS / time:.1f} a second; {words}"
    )


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
    time, words = spent(judge)
    yield Line("judge a cannon-ball of 1,320 rows", time, 0, f"under 3 s; {words}")


if __name__ == "__main__":
    for line in lines():
        print(f"{line.what}: {line.ours:.2f} s; {line.note}", flush=True)
