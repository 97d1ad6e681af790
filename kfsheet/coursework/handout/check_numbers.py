"""Does a number look like the right one? Asked without holding the right one.

Of a right value only its remainder after division by a period is kept, to a thousandth of the
period, and the period is a millionth of the value: ``value/period + salt`` has a fractional part
near 1/2. So a hundred thousand numbers of a value's size pass, one wrong number of five hundred,
and every right one whatever program has rounded it.

All periods of a student are one number times powers of 2, or what is kept of equal values under
different periods would, taken together, tell them (as the Chinese remainder theorem has it).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, floor, isnan, log2, sqrt
from typing import NamedTuple

from kfsheet.coursework.handout import course_secret

PERIOD = 1e-6
"""Of the power of 2 above a value; a student's own factor from 2 to 4 comes to it."""
WINDOW = 0.001
"""How far from 1/2 a fractional part may be; salts are as coarse as this."""
LARGEST = 1e9
"""Periods in a value; one that holds more of them has not the right size."""
SMALL = 1e-3
"""Of its neighbours' size: a value below may be little more than what rounding has left."""
NEIGHBOURS = 2
SINGLE_ROWS, ROWS_A_BLOCK = 30, 10  # of a long table
LONG = 150


class Steps(NamedTuple):
    """Steps that are checked together, both ends included."""

    first: int
    last: int


def checked_steps(rows: int) -> list[Steps]:
    """Row by row; in a long table the first rows, and then blocks of rows."""
    single = rows if rows <= LONG else SINGLE_ROWS
    edges = [*range(single), *range(single, rows, ROWS_A_BLOCK), rows]
    return [Steps(a, b - 1) for a, b in pairwise(edges)]


def factor(secret: bytes, exercise: str, student: str) -> float:
    """By what a value is multiplied, beside a power of 2: 1/period."""
    dice = int.from_bytes(course_secret.digest(secret, "salt", exercise, student)[:6], "big")
    return round(1 / (PERIOD * 2 ** (1 + dice / 2**48)), 3)


def weights(secret: bytes, exercise: str, rows: int) -> list[int]:
    """One for each row: in a block two rows must not be interchangeable."""
    stream = b"".join(
        course_secret.digest(secret, "weights", exercise, str(n)) for n in range(rows // 32 + 1)
    )
    return [1 + byte % 97 for byte in stream[:rows]]


def sizes(values: Sequence[float]) -> list[float]:
    """What a difference of each value is measured against: itself, or a part of its neighbours."""
    known = [v for v in values if not isnan(v)]
    whole = sqrt(sum(v * v for v in known) / len(known)) if known else 0.0
    found = []
    for n, value in enumerate(values):
        beside = [v for v in values[max(0, n - NEIGHBOURS) : n + NEIGHBOURS + 1] if not isnan(v)]
        near = max(map(abs, beside), default=0.0) or whole or 1.0
        found.append(max(SMALL * near, 0.0 if isnan(value) else abs(value)))
    return found


def salt(value: float, size: float, own: float) -> float:
    """A power of 2 and a fraction, as one number; see :func:`looks_right`."""
    power = ceil(log2(size))
    return power + round((0.5 - value / 2.0**power * own) % 1, 3) % 1


def looks_right(value: float, kept: float, own: float) -> bool:
    """Whether a value passes the check of a salt, as the cells of a handout compute it."""
    power = floor(kept)
    if not abs(value) < LARGEST / own * 2.0**power:
        return False
    return abs((value * own / 2.0**power + kept) % 1 - 0.5) < WINDOW
