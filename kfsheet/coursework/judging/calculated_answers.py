"""What the formulas of an answer give in the worlds of its exercise, by the spreadsheet's rules.

Each row's own formula is calculated in its own row. Cells that belong to the model hold the world's
values, the answer's other rows among them; helper cells and names are calculated from those; all
other cells hold what they hold.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import NamedTuple

from kfsheet.coursework.judging.model_runs import ModelRuns, World
from kfsheet.coursework.judging.random_samples import OwnNumbers
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.parsing.calculator import Error, SheetCalculator, TooMuchWorkError
from kfsheet.parsing.references import Address, Cell

TOLERANCE = 1e-9  # an answer that adds in another order rounds in another way
SMALL = 1e-4  # of a column's root mean square: differences of large numbers are small and rough
MOVED = 1.37  # of its value, and a little more
WORK = 200_000  # operations of one formula
SECONDS = 2.0  # of one answer, all rows and worlds together
Value = float | str | bool | Error | None
Cells = dict[str, dict[Cell, Value]]


class Outcome(NamedTuple):
    """What a formula gives in one world, what the key gives, and whether that is the same."""

    found: Value
    wanted: Value
    right: bool
    world: World


class CalculatedAnswers:
    """The answers of one workbook."""

    def __init__(
        self, book: Book, addresses: CellAddresses, runs: ModelRuns, own: OwnNumbers
    ) -> None:
        self._addresses, self._model = addresses, runs.model
        self._base = SheetCalculator(book.sheets, {**book.names, **book.sheet_names}, work=WORK)
        self._own = runs.own_worlds(own)
        self.worlds = (*self._own, *runs.worlds)
        self._sheets: dict[World, SheetCalculator] = {}
        self._places = _places(addresses)
        self.deadline = float("inf")

    def is_formula(self, address: Address) -> bool:
        """Whether a formula fills a cell, be it one of an array."""
        return self._base.is_formula(address)

    def kind(self, address: Address) -> type:
        """What the key gives in a cell with the student's own numbers: a number, or a text."""
        return type(self._sheet(self._own[0]).value(address))

    def begin(self) -> None:
        """A new answer, with time of its own."""
        self.deadline = time.process_time() + SECONDS

    def outcomes(self, name: str, step: int, address: Address) -> list[Outcome]:
        """What the formula of one row gives in every world.

        Raises
        ------
        FormulaError, ForbiddenError
            If it cannot be calculated, not in time, or must not be.
        """
        if time.process_time() > self.deadline:
            raise TooMuchWorkError("calculating it takes too long")
        return [self._outcome(world, name, step, address) for world in self.worlds]

    def _outcome(self, world: World, name: str, step: int, address: Address) -> Outcome:
        wanted = self._sheet(world).value(address)
        found = self._sheet(world).formula_value(address)
        size = world.sizes.get(name, 0.0)
        return Outcome(found, wanted, same(found, wanted, size), world)

    def reads(self, cells: Iterable[tuple[str, int]], address: Address) -> bool:
        """Whether the formula in a cell needs one of the cells of the model."""
        world = self._own[0]
        spoilt: Cells = {sheet: dict(found) for sheet, found in self._cells(world).items()}
        for name, step in cells:
            if place := self._addresses.of(name, step):
                spoilt[place[0]][place[1:]] = Error.CIRC
        return self._base.with_values(spoilt).formula_value(address) is Error.CIRC

    def follows(self, cells: Iterable[tuple[str, int]], address: Address) -> bool:
        """Whether the value of the formula in a cell moves with cells of the model."""
        world = self._own[0]
        moved: Cells = {sheet: dict(found) for sheet, found in self._cells(world).items()}
        for name, step in cells:
            if (place := self._addresses.of(name, step)) and place[0] in moved:
                value = moved[place[0]].get(place[1:])
                if type(value) is float:
                    moved[place[0]][place[1:]] = MOVED * value + world.sizes.get(name, 1.0)
        found = self._base.with_values(moved).formula_value(address)
        return not same(found, self._sheet(world).formula_value(address))

    def works(self, name: str, address: Address) -> bool:
        """Whether a cell, calculated in the student's own file, has the key's value."""
        wanted = self._sheet(self._own[0]).value(address)
        return same(self._base.value(address), wanted, self._own[0].sizes.get(name, 0.0))

    def _sheet(self, world: World) -> SheetCalculator:
        if world not in self._sheets:
            self._sheets[world] = self._base.with_values(self._cells(world))
        return self._sheets[world]

    def _cells(self, world: World) -> Cells:
        if self._places not in world.known:
            if len(world.known) > 3:  # files whose rows were moved are few
                world.known.clear()
            world.known[self._places] = filled(world, self._addresses)
        return world.known[self._places]


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
                values = world.cells(name)
                filled.update({(r, column): values[step] for r, step in table.steps.items()})
    for (sheet, *place), name in addresses.scalars.items():
        value = float(world.scalars[name])
        cells.setdefault(sheet, {})[tuple(place)] = value if value == value else ""
    return cells


def same(found: Value, wanted: Value, size: float = 0.0, tolerance: float = TOLERANCE) -> bool:
    """Whether a value is the key's, but for rounding; ``size`` is that of the column."""
    if type(found) is float and type(wanted) is float:
        return abs(found - wanted) <= tolerance * max(abs(wanted), SMALL * size)
    return type(found) is type(wanted) and found == wanted
