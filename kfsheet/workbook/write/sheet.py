"""A worksheet before any file exists: single cells, and columns that are filled down."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from math import isnan
from typing import Any, NamedTuple

TITLE_HEIGHT = 26

Place = tuple[int, int]
"""Row and column; both count from 1."""
Formula = Callable[[int], str]
"""Text of a formula, ``=`` included, by the row that it stands in."""


class Words(str):
    """What a person wrote: no formula, whatever it begins with."""

    __slots__ = ()


class Cell(NamedTuple):
    """One cell: its content (``=`` begins a formula), kind of style, value of the formula."""

    content: Any
    kind: str = "text"
    stored: Any = None
    format: str = ""
    align: str = ""
    scale: float = 0.0
    """What a difference is measured against where the value itself is smaller."""


@dataclass(frozen=True)
class FilledColumn:
    """A column of a table: cells of one look, made only when somebody asks for them.

    ``values`` are the contents of plain cells, or the values of formulas. ``rules`` are the
    formulas of the first rows, one each, and the last of them that of all other rows; a rule that
    is None leaves its cell empty. A formula without a value has ``missing`` as its value.
    """

    first: int
    values: Sequence[Any]
    kind: str
    format: str = ""
    scale: float = 0.0
    rules: tuple[Formula | None, ...] = ()
    missing: str = ""

    @property
    def rows(self) -> range:
        """Rows of the sheet."""
        return range(self.first, self.first + len(self.values))

    def rule_number(self, row: int) -> int:
        """Which of the rules holds in a row."""
        return min(row - self.first, len(self.rules) - 1)

    def stored(self, row: int) -> Any:
        """Value of the formula in a row."""
        return stored_value(self.values[row - self.first], self.missing)

    def cell(self, row: int) -> Cell:
        """The cell in a row."""
        if not self.rules:
            value = self.values[row - self.first]
            empty = isinstance(value, float) and isnan(value)
            return Cell(None if empty else value, self.kind, format=self.format)
        rule = self.rules[self.rule_number(row)]
        return Cell(rule and rule(row), self.kind, self.stored(row), self.format, scale=self.scale)


@dataclass
class Sheet:
    """One worksheet: cells, columns that are filled down, widths, and where it is frozen.

    One of ``cells`` takes the place of one that a column has there.
    """

    title: str
    cells: dict[Place, Cell] = field(default_factory=dict)
    columns: dict[int, FilledColumn] = field(default_factory=dict)
    widths: dict[int, float] = field(default_factory=dict)
    heights: dict[int, float] = field(default_factory=dict)
    merges: list[str] = field(default_factory=list)
    names: dict[str, Place] = field(default_factory=dict)
    freeze: str = ""

    def put(self, row: int, column: int, content: Any, kind: str = "text", **more: Any) -> None:
        """Place one cell."""
        if kind == "title":
            self.heights[row] = TITLE_HEIGHT
        self.cells[row, column] = Cell(content, kind, **more)

    def cell_at(self, row: int, column: int) -> Cell:
        """The cell in a place; there must be one."""
        return self.cells.get((row, column)) or self.columns[column].cell(row)

    def all_cells(self) -> Iterator[tuple[Place, Cell]]:
        """Every cell with its place."""
        yield from self.cells.items()
        for column, filled in self.columns.items():
            for row in filled.rows:
                if (row, column) not in self.cells:
                    yield (row, column), filled.cell(row)

    @property
    def width(self) -> int:
        """Number of the last column."""
        return max([*self.columns, *(column for _, column in self.cells)])


def stored_value(value: Any, missing: str = "") -> Any:
    """What a spreadsheet holds for a number that may be missing."""
    return (missing if isnan(value) else value) if isinstance(value, float) else value


def is_formula(content: object) -> bool:
    """Whether the content of a cell is a formula."""
    text = isinstance(content, str) and not isinstance(content, Words)
    return text and content.startswith("=")
