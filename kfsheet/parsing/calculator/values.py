"""What a formula can be worth: numbers, texts, truth values, errors, arrays and references.

A number is whatever the arithmetic calculates with, a float for one; None is an empty cell. An
error is a value like others, which propagates; what is raised here as a Python exception is only
that a formula cannot be calculated at all (:class:`UnsupportedError`, :class:`TooMuchWorkError`).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

from kfsheet.errors import FormulaError, TooMuchWorkError
from kfsheet.parsing.calculator.arithmetic import DOUBLES, Arithmetic

EMPTY = None
"""An empty cell: 0 among numbers, "" among texts, FALSE among truth values."""
LARGEST = 1.7976931348623157e308


class Error(Enum):
    """An error as a cell shows it; compare with ``is``."""

    NULL = "#NULL!"
    DIV0 = "#DIV/0!"
    VALUE = "#VALUE!"
    REF = "#REF!"
    NAME = "#NAME?"
    NUM = "#NUM!"
    NA = "#N/A"
    SPILL = "#SPILL!"
    CALC = "#CALC!"
    CIRC = "#CIRC!"


class Area(NamedTuple):
    """A reference to a rectangle of cells; its ends are counted from 1 and belong to it."""

    sheet: str
    top: int
    left: int
    bottom: int
    right: int

    @property
    def height(self) -> int:
        """Number of rows."""
        return self.bottom - self.top + 1

    @property
    def width(self) -> int:
        """Number of columns."""
        return self.right - self.left + 1


class Areas(NamedTuple):
    """A reference to several rectangles: a union, or one area on several sheets."""

    areas: tuple[Area, ...]


class Lambda(NamedTuple):
    """A function made by LAMBDA, with what the names in it stood for where it was made."""

    parameters: tuple[str, ...]
    body: Program
    variables: Mapping[str, Any]


Scalar = Any
"""A number of the arithmetic, str, bool, EMPTY or an :class:`Error`."""
Array = tuple
"""Rows of scalars, all of one length: a plain tuple of tuples."""
Value = Any
"""A scalar, an array, an :class:`Area`, :class:`Areas` or a :class:`Lambda`."""


class UnsupportedError(FormulaError):
    """Our calculator cannot tell what a formula is worth; another reader may."""


class FailedError(Exception):
    """Inside a function: its result is an error."""

    def __init__(self, error: Error) -> None:
        self.error = error


def _no_name(sheet: str | None, text: str) -> Value:
    return Error.NAME


class CellsNeededError(Exception):
    """Cells must be calculated before the one that asks for them can be."""

    def __init__(self, addresses: list[tuple[str, int, int]]) -> None:
        self.addresses = addresses


@dataclass(slots=True)
class Context:
    """Where a formula is evaluated: its cell, and what it can see.

    Attributes
    ----------
    cell : callable
        ``cell(sheet, row, column)``, the scalar in a cell; #REF! for a sheet that is not there.
    host : (sheet, row, column)
        The cell that holds the formula. References in a tree are distances from it, as
        ``relative_tree`` writes them; with row 0 and column 0 they are taken as they stand.
    name : callable
        ``name(sheet or None, text)``, what a defined name stands for: a value or a reference.
    extent : (rows, columns)
        What the sheets use; whole columns and rows are cut to it.
    work : int
        How many operations the formula may still take, reading a cell being one.
    """

    cell: Callable[[str, int, int], Scalar]
    host: tuple[str, int, int] = ("", 0, 0)
    name: Callable[[str | None, str], Value] = _no_name
    arithmetic: Arithmetic = DOUBLES
    extent: tuple[int, int] = (1000, 100)
    work: int = 1_000_000
    sheets: tuple[str, ...] = ()
    formula_at: Callable[[str, int, int], bool] = lambda sheet, row, column: False
    spilled: Callable[[str, int, int], Value] = lambda sheet, row, column: Error.REF
    variables: Mapping[str, Value] = field(default_factory=dict)

    def spend(self, operations: int) -> None:
        """Take so many operations from what is left."""
        self.work -= operations
        if self.work < 0:
            raise TooMuchWorkError("the formula takes more work than a formula may")


Program = Callable[[Context], Value]


# -- scalars as numbers, texts and truth values ----------------------------------------------------

NUMERAL = re.compile(r"\s*([+-]?(?:\d{1,3}(?:,\d{3})+|\d+)?(?:\.\d*)?(?:[Ee][+-]?\d+)?)\s*(%?)\s*")
# Which of these are numbers depends on the country and the program.
DEPENDS = re.compile(r"\s*[-+(]*\s*[$€£]?\s*\d[\d\s.,:/'-]*(?:[ap]m|[%$€£)])*\s*", re.IGNORECASE)


def number(c: Context, value: Scalar) -> Any:
    """A scalar in arithmetic, or the error that it is or gives."""
    kind = type(value)
    if kind is c.arithmetic.kind or kind is Error:
        return value
    if kind is str:
        return numeral(c, value)
    return c.arithmetic.from_float(float(value or 0)) if kind in (bool, type(None)) else Error.VALUE


def numeral(c: Context, text: str) -> Any:
    """The number that a text holds; #VALUE! if none does."""
    match = NUMERAL.fullmatch(text)
    if match and any(map(str.isdigit, match[1])):
        try:
            worth = float(match[1].replace(",", ""))
        except ValueError:
            return Error.VALUE
        return c.arithmetic.from_float(worth / 100 if match[2] else worth)
    if DEPENDS.fullmatch(text):
        raise UnsupportedError(f"whether {text[:30]!r} is a number depends on the program")
    return Error.VALUE


def truth(c: Context, value: Scalar) -> bool | Error:
    """A scalar as a condition."""
    if type(value) is bool or type(value) is Error:
        return value
    if type(value) is str:
        word = value.upper()
        return word == "TRUE" if word in ("TRUE", "FALSE") else Error.VALUE
    return bool(number(c, value) != 0) if value is not EMPTY else False


def text(c: Context, value: Scalar) -> str | Error:
    """A scalar as ``&`` joins it."""
    if type(value) is str or type(value) is Error:
        return value
    if type(value) is bool:
        return "TRUE" if value else "FALSE"
    return "" if value is EMPTY else shown(c.arithmetic.to_float(value))


def shown(x: float) -> str:
    """A number in the format General of texts: 15 digits, an E only where it is far from 1."""
    digits, _, exponent = f"{x:.14e}".partition("e")
    digits, power = digits.rstrip("0").rstrip("."), int(exponent)
    if x == 0:
        return "0"
    if -5 <= power <= 20 or (power < 0 and len(digits.lstrip("-")) - 2 - power <= 9):
        places = max(len(digits.lstrip("-")) - 2, 0) - power
        return f"{float(f'{x:.14e}'):.{max(places, 0)}f}"
    return f"{digits}E{power:+03d}"


def compare(c: Context, left: Scalar, right: Scalar) -> int:
    """-1, 0 or 1 as ``left`` sorts before ``right``: numbers, then texts, then truth values."""
    if left is EMPTY or right is EMPTY:
        left, right = (_like(c, *pair) for pair in ((left, right), (right, left)))
    ranks = _rank(left), _rank(right)
    if ranks[0] != ranks[1]:
        return -1 if ranks[0] < ranks[1] else 1
    if ranks[0] == 0:
        return c.arithmetic.compare(left, right)
    if ranks[0] == 1:
        left, right = left.lower(), right.lower()
    return (left > right) - (left < right)


def _like(c: Context, value: Scalar, other: Scalar) -> Scalar:
    """An empty cell as what it is compared with."""
    if value is not EMPTY:
        return value
    return "" if type(other) is str else False if type(other) is bool else number(c, EMPTY)


def _rank(value: Scalar) -> int:
    return 1 if type(value) is str else 2 if type(value) is bool else 0


# -- areas and arrays ------------------------------------------------------------------------------


def is_number(c: Context, value: Scalar) -> bool:
    """Whether a scalar is a number, not only something that arithmetic takes for one."""
    return type(value) is c.arithmetic.kind


def read(c: Context, area: Area) -> Array:
    """The scalars in an area; of whole columns and rows, those down to the last one in use."""
    bottom, right = area.bottom, area.right
    if area.top == 1 and bottom > 1_000_000:
        bottom = max(c.extent[0], 1)
    if area.left == 1 and right > 16_000:
        right = max(c.extent[1], 1)
    c.spend((bottom - area.top + 1) * (right - area.left + 1))
    rows, columns = range(area.top, bottom + 1), range(area.left, right + 1)
    cell, sheet = c.cell, area.sheet
    try:
        return tuple([tuple([cell(sheet, row, column) for column in columns]) for row in rows])
    except CellsNeededError:
        raise CellsNeededError(_missing(c, sheet, rows, columns)) from None


def _missing(c: Context, sheet: str, rows: range, columns: range) -> list[tuple[str, int, int]]:
    """All cells of an area that must be calculated first, so that it is read twice at most."""
    missing = []
    for row in rows:
        for column in columns:
            try:
                c.cell(sheet, row, column)
            except CellsNeededError as needed:
                missing += needed.addresses
    return missing


def used(c: Context, area: Area) -> Area:
    """The part of an area that can hold anything; one row and column at least."""
    bottom = max(min(area.bottom, c.extent[0]), area.top)
    return area._replace(bottom=bottom, right=max(min(area.right, c.extent[1]), area.left))


def areas_of(value: Area | Areas) -> tuple[Area, ...]:
    """The rectangles of a reference."""
    return (value,) if type(value) is Area else value.areas


def rows_of(c: Context, value: Value) -> Array:
    """A value as an array; a scalar is one of one cell."""
    if type(value) is tuple:
        c.spend(len(value) * len(value[0]))  # whoever asks will go through it
        return value
    if type(value) is Area:
        return read(c, value)
    if type(value) is Areas:
        raise FailedError(Error.VALUE)
    return ((value,),)


def cells_of(c: Context, value: Value) -> Iterator[Scalar]:
    """The scalars in a value, row by row; cells beyond those in use are left out."""
    if type(value) is Area or type(value) is Areas:
        for area in areas_of(value):
            for row in read(c, used(c, area)):
                yield from row
    elif type(value) is tuple:
        for row in rows_of(c, value):
            yield from row
    else:
        yield value


def is_reference(value: Value) -> bool:
    """Whether a value is a reference to cells."""
    return type(value) is Area or type(value) is Areas


def size_of(c: Context, value: Value) -> tuple[int, int]:
    """Rows and columns of a value; a reference need not be read for it."""
    if type(value) is Area:
        return value.height, value.width
    rows = value if type(value) is tuple else rows_of(c, value)
    return len(rows), len(rows[0])
