"""What the formulas of an answer give in the worlds of its exercise, by the spreadsheet's rules.

Each row's own formula is calculated in its own row. Cells that belong to the model hold the world's
values, the answer's other rows among them; helper cells and names are calculated from those; all
other cells hold what they hold.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from kfsheet.coursework.judging.model_runs import World
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import KfsheetError
from kfsheet.parsing.calculator import Error, Formula, SheetCalculator, TooMuchWorkError
from kfsheet.parsing.references import Address, Cell

TOLERANCE = 1e-9  # an answer that adds in another order rounds in another way
SMALL = 1e-4  # of a column's root mean square: differences of large numbers are small and rough
WORK = 200_000  # operations of one formula
SECONDS = 2.0  # of one answer, all rows and worlds together
MOMENT = 0.05  # a limit of no time at all would be none
LOOK_UP = re.compile(r"LOOKUP\(|MATCH\(|FILTER\(")
KEPT = 4  # workbooks whose cells a world keeps: those of moved rows are few
Value = float | str | bool | Error | None
Cells = dict[str, dict[Cell, Value]]
Chosen = Callable[[str, int], bool]


class Outcome(NamedTuple):
    """What a formula gives in one world, what the key gives, and whether that is the same."""

    found: Value
    wanted: Value
    right: bool
    world: World


class CalculatedAnswers:
    """The answers of one workbook; the first of the worlds is that of the student's own numbers."""

    def __init__(self, book: Book, addresses: CellAddresses, worlds: Sequence[World]) -> None:
        self.worlds = worlds
        self._addresses, self._own, self._contents = addresses, worlds[0], book.sheets
        self._base = SheetCalculator(book.sheets, {**book.names, **book.sheet_names}, work=WORK)
        self._sheets: dict[World, SheetCalculator] = {}
        self._places = _places(addresses)
        self.deadline = float("inf")

    def is_formula(self, address: Address) -> bool:
        """Whether a formula fills a cell, be it one of an array."""
        return self._base.is_formula(address)

    def kind(self, name: str, step: int) -> type:
        """What the key gives in a row with the student's own numbers: a number, or a text."""
        return type(self._own.cell(name, step))

    def begin(self) -> None:
        """A new answer, with time of its own."""
        self.deadline = time.process_time() + SECONDS

    def time_left(self) -> float:
        """Seconds of computing for this answer."""
        return max(MOMENT, min(SECONDS, self.deadline - time.process_time()))

    def outcomes(
        self, name: str, step: int, address: Address, worlds: Sequence[World] | None = None
    ) -> list[Outcome]:
        """What the formula of one row gives in every world, or in some.

        Raises
        ------
        FormulaError, ForbiddenError
            If it cannot be calculated, not in time, or must not be.
        """
        if time.process_time() > self.deadline:
            raise TooMuchWorkError("calculating it takes too long")
        return [self.outcome(world, name, step, address) for world in worlds or self.worlds]

    def outcome(
        self, world: World, name: str, step: int, address: Address, formula: Formula | None = None
    ) -> Outcome:
        """What the formula of one row, or another one in its place, gives in one world."""
        wanted = world.cell(name, step)
        found = self._sheet(world).formula_value(address, formula)
        return Outcome(found, wanted, same(found, wanted, world.sizes.get(name, 0.0)), world)

    def needs(self, chosen: Chosen, address: Address) -> bool:
        """Whether a formula gives something else if the cells that are chosen are errors."""
        return self._spoilt(chosen, address)[0]

    def reads(self, chosen: Chosen, address: Address) -> bool:
        """The same, or it looks at one of them: COUNT and IFERROR swallow an error, and no circle.

        An array or a look-up reads many cells of which only some count.
        """
        differs, looked_at = self._spoilt(chosen, address)
        return differs or (looked_at and not self._picks(address))

    def _spoilt(self, chosen: Chosen, address: Address) -> tuple[bool, bool]:
        cells = self._cells(self._own)
        spoilt = {name: _Spoilt(self._addresses, name, chosen, cells[name]) for name in cells}
        try:
            found = self._base.with_values(spoilt).formula_value(address)
        except KfsheetError:  # it goes another way, to what we cannot calculate
            return True, True
        differs = not same(found, self._sheet(self._own).formula_value(address))
        return differs, any(sheet.were_read for sheet in spoilt.values())

    def _picks(self, address: Address) -> bool:
        """Whether only some of the cells that a formula reads count: a look-up, or an array."""
        content = self._contents.get(address[0], {}).get(address[1:])
        if not isinstance(content, Formula) or content.area or content.dynamic:
            return True
        return bool(LOOK_UP.search(content.text.upper()))

    def works(self, name: str, step: int, address: Address) -> bool:
        """Whether a cell, calculated in the student's own file, has the key's value."""
        wanted, size = self._own.cell(name, step), self._own.sizes.get(name, 0.0)
        try:
            return same(self._base.value(address), wanted, size)
        except KfsheetError:  # another answer, that it reads, cannot be calculated
            return False

    def _sheet(self, world: World) -> SheetCalculator:
        if world not in self._sheets:
            self._sheets[world] = self._base.with_values(self._cells(world))
        return self._sheets[world]

    def _cells(self, world: World) -> Mapping[str, Mapping[Cell, Value]]:
        if self._places not in world.known:
            while len(world.known) >= KEPT:
                del world.known[next(iter(world.known))]
            sheets = {address[0] for address in self._addresses.scalars} | {*self._addresses.tables}
            world.known[self._places] = {
                sheet: _WorldCells(self._addresses, sheet, world) for sheet in sheets
            }
        return world.known[self._places]


class _WorldCells(dict[Cell, Value]):
    """The cells of the model on one worksheet, as a world has them, made when asked for."""

    def __init__(self, addresses: CellAddresses, sheet: str, world: World) -> None:
        super().__init__()
        self._addresses, self._sheet, self._world = addresses, sheet, world

    def __missing__(self, cell: Cell) -> Value:
        role = self._addresses.role((self._sheet, *cell))
        if role is None:
            raise KeyError(cell)
        self[cell] = self._world.cell(role) if isinstance(role, str) else self._world.cell(*role)
        return self[cell]


class _Spoilt(dict[Cell, Value]):
    """The same with errors in the cells that are chosen, to see who needs them."""

    def __init__(
        self, addresses: CellAddresses, sheet: str, chosen: Chosen, cells: Mapping[Cell, Value]
    ) -> None:
        super().__init__()
        self._addresses, self._sheet = addresses, sheet
        self._chosen, self._others = chosen, cells
        self.were_read = False

    def __missing__(self, cell: Cell) -> Value:
        role = self._addresses.role((self._sheet, *cell))
        if role is None:
            raise KeyError(cell)
        name, step = (role, 0) if isinstance(role, str) else role
        if not self._chosen(name, step):
            return self._others[cell]
        self.were_read = True
        return Error.CIRC


def _places(addresses: CellAddresses) -> tuple:
    """Where everything stands, as a key."""
    tables = [
        (sheet, tuple(table.columns.items()), tuple(table.steps.items()))
        for sheet, found in addresses.tables.items()
        for table in found
    ]
    return tuple(tables), tuple(addresses.scalars.items())


def filled(world: World, addresses: CellAddresses) -> Cells:
    """What every cell of the model holds in a world."""
    cells: Cells = {}
    for sheet, tables in addresses.tables.items():
        filled = cells.setdefault(sheet, {})
        for table in reversed(tables):
            for column, name in table.columns.items():
                filled.update({(r, column): world.cell(name, k) for r, k in table.steps.items()})
    for (sheet, *place), name in addresses.scalars.items():
        cells.setdefault(sheet, {})[tuple(place)] = world.cell(name)
    return cells


def same(found: Value, wanted: Value, size: float = 0.0, tolerance: float = TOLERANCE) -> bool:
    """Whether a value is the key's, but for rounding; ``size`` is that of the column."""
    if type(found) is float and type(wanted) is float:
        return abs(found - wanted) <= tolerance * max(abs(wanted), SMALL * size)
    return type(found) is type(wanted) and found == wanted
