"""Expected cells beside an engine's values: which differ, and which of those are to blame.

The rule: a cell agrees if

    |sheet - NumPy| <= tolerance * max(|NumPy|, root mean square of its column)

so that a value that is small because two numbers cancelled is not asked for more figures than
those numbers have. The tolerance is 1e-12, and 1e-11 for LibreOffice, which stores 15 digits.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from functools import cached_property
from typing import Any

from kfsheet.model.exercise import Exercise
from kfsheet.parsing.references import Address
from kfsheet.workbook.check.column_comparison import ColumnComparison
from kfsheet.workbook.check.culprits import CellByCell, number
from kfsheet.workbook.check.opened_workbook import OpenedWorkbook
from kfsheet.workbook.engines.spreadsheet_engine import CellValue, Values
from kfsheet.workbook.write.layout import FIRST_ROW, Layout
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Cell, Sheet, is_formula
from kfsheet.workbook.write.write_workbook import compose

TOLERANCES = {"ironcalc": 1e-12, "own": 1e-12, "libreoffice": 1e-11}


NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")


def same_words(expected: Any, found: Any) -> bool:
    """Whether two texts are one sentence: programs may round a number in it the other way."""
    if not (isinstance(expected, str) and isinstance(found, str)) or expected == found:
        return expected == found
    if NUMBER.sub("#", expected) != NUMBER.sub("#", found):
        return False
    pairs = zip(NUMBER.findall(expected), NUMBER.findall(found), strict=True)
    return all(abs(float(a) - float(b)) <= 1.01 * _last_place(a) for a, b in pairs)


def _last_place(figures: str) -> float:
    """What one more in the last figure is worth."""
    exponent = Decimal(figures).as_tuple().exponent
    return 10.0**exponent if exponent < 0 else 0.0


class Comparison:
    """Expected cells beside an engine's values, and who is to blame for a difference.

    ``now`` is the run that is expected, ``built`` the one that the workbook was built from.
    """

    def __init__(
        self, book: OpenedWorkbook, layout: Layout, exercise: Exercise, now: Run, built: Run
    ) -> None:
        self._book, self._layout = book, layout
        self._exercise, self._now, self._built = exercise, now, built
        self._tolerance = TOLERANCES[book.engine_name]
        self._values: Values = {}
        self._columns: dict[tuple[str, int], ColumnComparison | None] = {}
        self._rounded = False  # whether a cell differs by rounding alone
        self.cells, self.largest = 0, 0.0
        self.differing: dict[Address, Cell] = {}
        self.problems: dict[Address, str] = {}

    @cached_property
    def _sheets(self) -> list[Sheet]:
        """What is expected is what would be written."""
        return compose(self._exercise, self._layout, self._now, self._built)

    def prepare(self) -> None:
        """Find what is expected, of whole columns too, before the engine has answered."""
        for sheet in self._sheets:
            for at in sheet.columns:
                self._expected_column(sheet, at)

    def compare(self, values: Values) -> None:
        """Compare every formula cell, then look for the culprits among those that differ."""
        self._values = values
        for sheet in self._sheets:
            for (row, column), cell in sheet.cells.items():
                self._compare_cell((sheet.title, row, column), cell)
            for column, filled in sheet.columns.items():
                if not self._agrees_as_a_whole(sheet, column):
                    for row in filled.rows:
                        self._compare_cell((sheet.title, row, column), filled.cell(row))
        if self.differing:  # costly in a large workbook, and seldom needed
            self._find_culprits()

    def _expected_column(self, sheet: Sheet, at: int) -> ColumnComparison | None:
        """What is expected of a column; None if its formulas are not where they belong."""
        key = sheet.title, at
        if key not in self._columns:
            filled = sheet.columns[at]
            # A start without a value is an empty cell among formulas.
            hollow = {filled.first + n for n, rule in enumerate(filled.rules) if rule is None}
            formulas = self._book.formulas_among(filled.rows, sheet.title, at)
            there = not filled.rules or formulas == set(filled.rows) - hollow
            self._columns[key] = ColumnComparison(filled, at, self._tolerance) if there else None
        return self._columns[key]

    def _agrees_as_a_whole(self, sheet: Sheet, at: int) -> bool:
        """Whether none of a column's cells needs words."""
        expected = self._expected_column(sheet, at)
        far = expected.largest(self._values.get(sheet.title, {})) if expected else None
        if far is None:
            return False
        self.cells += expected.formulas
        self.largest = max(self.largest, far)
        return True

    def _compare_cell(self, address: Address, cell: Cell) -> None:
        formula, value = self._book.is_formula(address), self._book.value(address)
        if is_formula(cell.content):
            self.cells += 1
            if not formula:
                found = "is empty" if value is None else f"holds {value!r}"
                self.problems[address] = f"{found} where a formula belongs"
            if not self._agree(address, cell.stored, cell.scale):
                self.differing[address] = cell
        elif cell.kind in ("formula", "index") and cell.content is None:
            if formula or value is not None:
                found = self._book.text(address) if formula else value
                self.problems[address] = f"holds {found!r}; there is no value in this row"
        elif isinstance(cell.content, int) and cell.kind == "index" and value != cell.content:
            self.problems[address] = f"holds {value!r}, not the step index {cell.content}"

    def _value(self, address: Address) -> CellValue:
        """What the engine found in a cell."""
        sheet, row, column = address
        return self._values.get(sheet, {}).get((row, column))

    def _agree(self, address: Address, expected: Any, scale: float, keep: bool = True) -> bool:
        found = self._value(address)
        if isinstance(expected, str) or expected is None:
            # A column without a value is an empty text; a mean of nothing is an error.
            broken = _is_error(found) and not expected and address[0] in self._layout.columns
            if not broken and _no_number(expected) and _no_number(found):
                return True
            return same_words(expected, found)
        if math.isnan(number(found)):
            return False
        size = max(abs(expected), 0 if math.isnan(scale) else scale) or 1.0
        difference = abs(found - expected) / size
        if keep:
            self.largest = max(self.largest, difference)
        return difference <= self._tolerance

    # -- culprits --------------------------------------------------------------------------

    def _find_culprits(self) -> None:
        cell_by_cell = CellByCell(self._layout, self._values)
        elsewhere = []
        for address, cell in self.differing.items():
            if address in self.problems:
                continue
            if address in cell_by_cell.definitions:
                self._judge(address, cell, cell_by_cell)
            else:
                elsewhere.append((address, cell))
        # Cells of no definition: the sheet Check, helper columns of charts. They follow from the
        # model's, unless somebody has written another formula into them.
        for address, cell in elsewhere:
            followed = self.problems or self._rounded
            if _plain(self._book.text(address)) != _plain(cell.content) or not followed:
                self.problems[address] = self._words(cell.stored, address)

    def _judge(self, address: Address, cell: Cell, cell_by_cell: CellByCell) -> None:
        """Compute one cell from the engine's values of its inputs; if it differs, it is wrong."""
        reads = list(cell_by_cell.reads(address))
        wrong = [other for other in reads if other in self.problems]
        if any(column == cell_by_cell.step_column(sheet) for sheet, _, column in wrong):
            return  # the step index beside it is wrong
        error = _is_error(self._value(address))
        if error and any(_is_error(self._value(other)) for other in reads):
            return
        computed = cell_by_cell.computed(address)
        if computed is None and error:
            return  # beyond what either can compute
        expected = "" if computed is None or math.isnan(computed) else computed
        # Terms may cancel here that do not cancel in the rest of the column.
        sizes = [cell.scale, *(abs(number(self._value(other))) for other in reads)]
        scale = max((size for size in sizes if not math.isnan(size)), default=math.nan)
        if self._agree(address, expected, scale, keep=False):
            return
        far = abs(number(self._value(address)) - (math.nan if computed is None else computed))
        if far <= cell_by_cell.rounding(address):
            self._rounded = True
            return  # its terms cancel, and no two programs need agree in what is left
        if any(_no_number(self._value(other)) for other in wrong):
            return  # an answer is still to be filled in; a sheet reads 0 where NumPy has no value
        self.problems[address] = self._words(expected, address)

    def _words(self, expected: Any, address: Address) -> str:
        found = self._value(address)
        return f"{self._name_of(address)}the sheet has {_show(found)}, NumPy {_show(expected)}"

    def _name_of(self, address: Address) -> str:
        """Name and step of a cell, for a message: 'x_f, photo 5: '."""
        sheet, row, column = address
        model = self._layout.model
        for name, at in self._layout.columns.get(sheet, {}).items():
            if at == column:
                return f"{name}, {model.step_of(sheet)} {row - FIRST_ROW}: "
        names = (name for name, cell in self._layout.scalars.items() if cell == address)
        return next((f"{name}: " for name in names), "")


def _plain(formula: Any) -> str:
    """A formula without what a spreadsheet program may write in another way."""
    return str(formula).upper().replace(" ", "").replace("$", "")


def _is_error(value: Any) -> bool:
    return isinstance(value, str) and value.startswith("#")


def _no_number(value: Any) -> bool:
    """Empty, an empty text or an error: all are 'no value' to a formula that asks."""
    return value is None or value == "" or _is_error(value)


def _show(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.15g}"
    return "no value" if value in (None, "") else str(value)
