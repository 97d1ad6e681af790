"""Whose numbers a file holds: a token can be put into another student's file, numbers tell.

Some changes are allowed, and some are made by programs: one parameter, a few data, figures that
were rounded. A file is a student's own unless most of the numbers that were drawn for the student
are others.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isclose, isnan

from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.judging.model_runs import OwnNumbers
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.roster import Student
from kfsheet.coursework.reading.submission import Book
from kfsheet.model.exercise import Exercise

ROUNDED = 1e-7  # relative; programs keep 15 figures
FEW = 3  # other numbers that no file is blamed for
MOST = 0.9  # of the numbers of whom they are taken from
Numbers = dict[str, list[float | None]]
"""By parameter and data column; None is no number."""


def drawn(exercise: Exercise, own: OwnNumbers) -> Numbers:
    """What is not the same for all students."""
    parameters, data = dict(own.parameters), dict(own.data)
    found: Numbers = {name: [parameters[name]] for name in exercise.vary}
    for name, values in data.items():
        given = exercise.model.table[name].values
        if any(a != b for a, b in zip(values, given, strict=True) if a == a and b == b):
            found[name] = [None if isnan(v) else v for v in values]
    return found


def strange_numbers(
    exercise: Exercise, book: Book, addresses: CellAddresses, own: OwnNumbers
) -> Numbers:
    """The numbers of a file, if they are not the student's; nothing if they are."""
    wanted = drawn(exercise, own)
    found = {
        name: [_number(book, addresses, name, step) for step in range(len(values))]
        for name, values in wanted.items()
    }
    # Who plays with a parameter keeps the data, and the other way round.
    kinds = {True: [0, 0], False: [0, 0]}
    for name in wanted:
        other, known = _others(found[name], wanted[name])
        kinds[name in exercise.vary][0] += other
        kinds[name in exercise.vary][1] += known
    strange = all(2 * other > known for other, known in kinds.values() if known)
    return found if strange and sum(other for other, _ in kinds.values()) >= FEW else {}


def holder(numbers: Numbers, exercise: Exercise, secret: bytes, students: Sequence[Student]) -> str:
    """The id of the student for whom most of the numbers were drawn, or nothing."""
    for student in students:
        wanted = drawn(exercise, own_numbers(exercise, secret, student.id))
        pairs = [_others(numbers[n], wanted[n]) for n in numbers if n in wanted]
        other, known = map(sum, zip((0, 0), *pairs, strict=True))
        if known - other > MOST * known:
            return student.id
    return ""


def _others(found: list[float | None], wanted: list[float | None]) -> tuple[int, int]:
    """How many numbers are not those wanted, and how many can be compared."""
    pairs = [(a, b) for a, b in zip(found, wanted, strict=True) if None not in (a, b)]
    return sum(not isclose(a, b, rel_tol=ROUNDED) for a, b in pairs), len(pairs)


def _number(book: Book, addresses: CellAddresses, name: str, step: int) -> float | None:
    address = addresses.of(name, step)
    content = book.sheets[address[0]].get(address[1:]) if address else None
    return content if type(content) is float else None
