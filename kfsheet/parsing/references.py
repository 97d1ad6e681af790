"""References in formulas: cells, ranges and names, absolute or relative to the cell they stand in.

A formula that was filled down is the same formula in every row: its references are the same
*distances*. :func:`relative_key` finds that out from the text, so that each such formula is parsed
once, however many rows it fills.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import lru_cache

from openpyxl.utils import column_index_from_string

from kfsheet.errors import FormulaError
from kfsheet.printing.excel_names import LAST_COLUMN, LAST_ROW

Cell = tuple[int, int]
"""Row and column, counted from 1."""
Address = tuple[str, int, int]
"""Sheet, row and column."""

CORNER = r"(\$?)([A-Za-z]{1,3})(\$?)([1-9]\d{0,6})"
SHEET = r"(?:'((?:[^'\[\]:*?/\\]|'')+)'|([^'!\[\]:*?/\\ ]+))!"
REFERENCE = re.compile(rf"(?:{SHEET})?{CORNER}(?::{CORNER})?")
NAME = re.compile(rf"(?:{SHEET})?([A-Za-z_][A-Za-z0-9_.]*)")
# Quoted text and sheet names are left alone; LOG10( is a function, x_A1 and A1.b are names.
PIECES = re.compile(rf"\"(?:[^\"]|\"\")*\"|'(?:[^']|'')*'|(?<![\w.$]){CORNER}(?![\w.(!])")


@dataclass(frozen=True)
class Corner:
    """One end of a range; a coordinate that is not fixed may be held as a distance."""

    row: int
    column: int
    row_fixed: bool = False
    column_fixed: bool = False

    def seen_from(self, host: Cell) -> Corner:
        """The same corner with distances from ``host`` where it is not fixed."""
        row = self.row if self.row_fixed else self.row - host[0]
        column = self.column if self.column_fixed else self.column - host[1]
        return replace(self, row=row, column=column)

    def at(self, host: Cell) -> Cell:
        """The cell that a corner held as distances stands for in a formula in ``host``."""
        row = self.row if self.row_fixed else self.row + host[0]
        column = self.column if self.column_fixed else self.column + host[1]
        return row, column


@dataclass(frozen=True)
class Reference:
    """A cell (``last`` is None), a range or a defined name (``name`` is not empty)."""

    sheet: str | None
    first: Corner | None = None
    last: Corner | None = None
    name: str = ""

    def seen_from(self, host: Cell) -> Reference:
        """The same reference with distances in place of relative coordinates."""
        if self.first is None:
            return self
        last = self.last and self.last.seen_from(host)
        return replace(self, first=self.first.seen_from(host), last=last)

    def cells(self, host: Cell, limit: int) -> list[list[Cell]]:
        """The rows of cells that a reference held as distances covers, seen from ``host``.

        Raises
        ------
        FormulaError
            If it lies outside a worksheet or covers more than ``limit`` cells.
        """
        (top, left), (bottom, right) = self.first.at(host), (self.last or self.first).at(host)
        top, bottom, left, right = (
            min(top, bottom),
            max(top, bottom),
            min(left, right),
            max(left, right),
        )
        if top < 1 or left < 1 or bottom > LAST_ROW or right > LAST_COLUMN:
            raise FormulaError("a reference leads outside the worksheet")
        if (bottom - top + 1) * (right - left + 1) > limit:
            raise FormulaError(f"a range covers more than {limit} cells")
        return [[(row, c) for c in range(left, right + 1)] for row in range(top, bottom + 1)]


def read_reference(text: str) -> Reference:
    """A reference as it stands in a formula.

    >>> read_reference("'Free run'!$A4").sheet
    'Free run'

    Raises
    ------
    FormulaError
        For whole rows or columns, other workbooks, tables, and what is no reference at all.
    """
    if match := REFERENCE.fullmatch(text):
        quoted, bare, *corners = match.groups()
        ends = [_corner(*corners[:4]), _corner(*corners[4:])]
        return Reference(_sheet(quoted, bare), *ends)
    if match := NAME.fullmatch(text):
        quoted, bare, name = match.groups()
        return Reference(_sheet(quoted, bare), name=name)
    raise FormulaError(f"{text} is no cell, range or name of this workbook")


def _sheet(quoted: str | None, bare: str | None) -> str | None:
    return quoted.replace("''", "'") if quoted else bare


def _corner(*parts: str | None) -> Corner | None:
    if parts[1] is None:
        return None
    column_fixed, letters, row_fixed, row = parts
    column = column_index_from_string(letters.upper())
    return Corner(int(row), column, bool(row_fixed), bool(column_fixed))


@lru_cache(maxsize=50_000)
def relative_key(text: str, host: Cell) -> str:
    """A text that two formulas share if one is the other, filled into another cell.

    >>> relative_key("=K8+dt", (9, 7)) == relative_key("=K9+dt", (10, 7))
    True
    """

    def shift(match: re.Match) -> str:
        if match[2] is None:
            return match[0]
        column_fixed, letters, row_fixed, row = match.groups()
        down = int(row) - (0 if row_fixed else host[0])
        right = column_index_from_string(letters.upper()) - (0 if column_fixed else host[1])
        return f"{{{down}{row_fixed},{right}{column_fixed}}}"

    return PIECES.sub(shift, text)
