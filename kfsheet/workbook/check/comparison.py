"""Expected cells beside an engine's values: which differ, and which of those are to blame.

The rule: a cell agrees if

    |sheet - NumPy| <= tolerance * max(|NumPy|, root mean square of its column)

so that a value that is small because two numbers cancelled is not asked for more figures than
those numbers have. The tolerance is 1e-12 for IronCalc and 1e-11 for LibreOffice, which stores 15
digits.

A wrong cell makes those that follow wrong too. Each cell that disagrees is therefore computed once
more from the *engine's own* values of its inputs: where that agrees, the cell only follows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import Any

from sympy import Expr, Indexed, IndexedBase

from kfsheet.evaluation import numerics
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import lag, t
from kfsheet.model.validation import walk
from kfsheet.parsing.references import Address
from kfsheet.printing.python import python_code
from kfsheet.workbook.check.column_comparison import ColumnComparison
from kfsheet.workbook.check.opened_workbook import OpenedWorkbook
from kfsheet.workbook.engines.spreadsheet_engine import Values
from kfsheet.workbook.write.check_sheet import check_sheet
from kfsheet.workbook.write.exercise_sheets import (
    Run,
    charts_sheet,
    parameters_sheet,
    section_sheet,
)
from kfsheet.workbook.write.layout import FIRST_ROW, Layout
from kfsheet.workbook.write.sheet import Cell, Sheet, is_formula

TOLERANCES = {"ironcalc": 1e-12, "libreoffice": 1e-11}


class Comparison:
    """Expected pieces beside an engine's values, and who is to blame for a difference.

    ``now`` is the run that is expected, ``built`` the one that the workbook was built from.
    """

    def __init__(
        self, book: OpenedWorkbook, layout: Layout, exercise: Exercise, now: Run, built: Run
    ) -> None:
        self.book, self.layout = book, layout
        self.tolerance = TOLERANCES[book.engine_name]
        self.pages = [*self._pages(exercise, now, built)]
        self.values: Values = {}
        self.cells, self.largest = 0, 0.0
        self._wholes: dict[tuple[str, int], ColumnComparison | None] = {}
        self.differing: dict[Address, Cell] = {}
        self.problems: dict[Address, str] = {}

    def run(self, values: Values) -> None:
        """Compare every formula cell, then look for the culprits among those that differ."""
        self.values = values
        for page in self.pages:
            for (row, column), piece in page.cells.items():
                self._compare((page.title, row, column), piece)
            for column, filled in page.columns.items():
                if not self._whole(page, column):
                    for row in filled.rows:
                        self._compare((page.title, row, column), filled.cell(row))
        homes = self._homes() if self.differing else {}
        blind = []
        for address, piece in self.differing.items():
            if address in self.problems:
                continue
            if address in homes:
                self._judge(address, piece, *homes[address])
            else:
                blind.append((address, piece))
        for address, piece in blind:
            if self._text(address) != _plain(piece.content) or not self.problems:
                self.problems[address] = self._words(piece.stored, address)

    def _pages(self, exercise: Exercise, now: Run, built: Run) -> Iterator[Sheet]:
        """The worksheets that hold formulas."""
        yield parameters_sheet(self.layout, now)
        for section in self.layout.model.sections:
            yield section_sheet(self.layout, section, now)
        yield charts_sheet(exercise, self.layout, now)
        yield check_sheet(self.layout, now, built)

    def prepare(self) -> None:
        """Find what is needed to compare whole columns, before the engine has answered."""
        for page in self.pages:
            for column in page.columns:
                self._wanted(page, column)

    def _wanted(self, page: Sheet, at: int) -> ColumnComparison | None:
        """What is expected of a column; None if its formulas are not where they belong."""
        key = page.title, at
        if key not in self._wholes:
            filled = page.columns[at]
            hollow = {filled.first + n for n, rule in enumerate(filled.rules) if rule is None}
            formulas = self.book.formulas_among(filled.rows, page.title, at)
            there = not filled.rules or formulas == set(filled.rows) - hollow
            self._wholes[key] = ColumnComparison(filled, at, self.tolerance) if there else None
        return self._wholes[key]

    def _whole(self, page: Sheet, at: int) -> bool:
        """Whether a column agrees as a whole, so that none of its cells needs words."""
        wanted = self._wanted(page, at)
        far = wanted.distance(self.values.get(page.title, {})) if wanted else None
        if far is None:
            return False
        self.cells += wanted.count
        self.largest = max(self.largest, far)
        return True

    def _compare(self, address: Address, piece: Cell) -> None:
        formula, value = self.book.is_formula(address), self.book.value(address)
        if is_formula(piece.content):
            self.cells += 1
            if not formula:
                found = "is empty" if value is None else f"holds {value!r}"
                self.problems[address] = f"{found} where a formula belongs"
            if not self._agree(address, piece.stored, piece.scale):
                self.differing[address] = piece
        elif piece.kind in ("formula", "index") and piece.content is None:
            if formula or value is not None:
                found = self.book.text(address) if formula else value
                self.problems[address] = f"holds {found!r}; there is no value in this row"
        elif isinstance(piece.content, int) and piece.kind == "index" and value != piece.content:
            self.problems[address] = f"holds {value!r}, not the step index {piece.content}"

    def value(self, address: Address) -> Any:
        """What the engine found in a cell."""
        sheet, row, column = address
        return self.values.get(sheet, {}).get((row, column))

    def _agree(self, address: Address, expected: Any, scale: float, keep: bool = True) -> bool:
        found = self.value(address)
        if isinstance(expected, str) or expected is None:
            # A column without a value is an empty text; a mean of nothing is an error.
            broken = _error(found) and not expected and address[0] in self.layout.columns
            return (not broken and _no_number(expected) and _no_number(found)) or expected == found
        if not isinstance(found, int | float) or isinstance(found, bool):
            return False
        size = max(abs(expected), 0 if math.isnan(scale) else scale) or 1.0
        difference = abs(found - expected) / size
        if keep:
            self.largest = max(self.largest, difference)
        return difference <= self.tolerance

    # -- culprits --------------------------------------------------------------------------

    def _homes(self) -> dict[Address, tuple[Expr, int]]:
        """The definition and row behind each formula cell of the model."""
        layout, model = self.layout, self.layout.model
        homes: dict[Address, tuple[Expr, int]] = {}
        for column in model.all_columns():
            for sheet, those in layout.columns.items():
                if column.name in those and not column.is_data:
                    for row in range(model.rows):
                        cell = (sheet, FIRST_ROW + row, those[column.name])
                        homes[cell] = (column.definition(row), row)
        for name, scalar in {**model.derived_scalars, **model.summaries}.items():
            homes[layout.scalars[name]] = (scalar.expression, 0)
        return homes

    def _judge(self, address: Address, piece: Cell, rule: Expr, row: int) -> None:
        """Compute one cell from the engine's values of its inputs; if it differs, it is wrong."""
        inputs = list(self._inputs(address, rule, row))
        if any(cell in self.problems and cell[2] == self._step(cell[0]) for cell in inputs):
            return  # the step index beside it is wrong
        if _error(self.value(address)) and any(_error(self.value(cell)) for cell in inputs):
            return
        try:
            local = eval(python_code(rule), {**self._namespace, "t": row})  # our own source
        except (ArithmeticError, ValueError):
            local = math.inf
        if isinstance(local, complex) or math.isinf(local):
            if _error(self.value(address)):
                return  # beyond what either can compute
            local = math.nan
        expected = "" if isinstance(local, float) and math.isnan(local) else local
        scale = max([piece.scale, *(abs(_number(self.value(cell))) for cell in inputs)], key=_size)
        if self._agree(address, expected, scale, keep=False):
            return
        if any(cell in self.problems and _no_number(self.value(cell)) for cell in inputs):
            return  # an answer is still to be filled in; a sheet reads 0 where NumPy has no value
        self.problems[address] = self._words(expected, address)

    def _step(self, sheet: str) -> int | None:
        return self.layout.columns.get(sheet, {}).get("t")

    def _inputs(self, address: Address, rule: Expr, row: int) -> Iterator[Address]:
        """Cells that a formula reads."""
        whole = set()
        for node in walk(rule):
            if isinstance(node, Indexed):
                sheet, column = self._column(str(node.base.label), address[0])
                yield sheet, FIRST_ROW + row - int(lag(node)), column
            elif isinstance(node, IndexedBase):
                whole.add(str(node.label))
            elif node == t:
                yield address[0], address[1], self._step(address[0])
            elif node.is_Symbol:
                yield self.layout.scalars[node.name]
        for name in whole:
            sheet, column = self.layout.home(name)
            rows = range(FIRST_ROW, FIRST_ROW + self.layout.model.rows)
            yield from ((sheet, row, column) for row in rows)

    def _column(self, name: str, sheet: str) -> tuple[str, int]:
        own = self.layout.columns.get(sheet, {})
        return (sheet, own[name]) if name in own else self.layout.home(name)

    @cached_property
    def _namespace(self) -> dict[str, Any]:
        """The engine's values by the names that generated source uses."""
        names: dict[str, Any] = {**vars(math), **vars(numerics)}
        for name, address in self.layout.scalars.items():
            names[name] = _number(self.value(address))
        rows = range(FIRST_ROW, FIRST_ROW + self.layout.model.rows)
        for sheet, those in self.layout.columns.items():
            for name, column in those.items():
                if name != "t":
                    names[name] = [_number(self.value((sheet, row, column))) for row in rows]
        return names

    def _text(self, address: Address) -> str:
        return _plain(self.book.text(address))

    def _words(self, expected: Any, address: Address) -> str:
        found = self.value(address)
        return f"{self.layout_name(address)}the sheet has {_show(found)}, NumPy {_show(expected)}"

    def layout_name(self, address: Address) -> str:
        """Name and step of a cell, for a message: 'x_f, photo 5: '."""
        sheet, row, column = address
        model = self.layout.model
        for name, number in self.layout.columns.get(sheet, {}).items():
            if number == column:
                return f"{name}, {model.step_of(sheet)} {row - FIRST_ROW}: "
        names = (name for name, cell in self.layout.scalars.items() if cell == address)
        return next((f"{name}: " for name in names), "")


def _plain(content: Any) -> str:
    return str(content).upper().replace(" ", "").replace("$", "")


def _number(value: Any) -> float:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return value if number else math.nan


def _size(value: float) -> float:
    return -1.0 if math.isnan(value) else value


def _error(value: Any) -> bool:
    return isinstance(value, str) and value.startswith("#")


def _no_number(value: Any) -> bool:
    """Empty, an empty text or an error: all are 'no value' to a formula that asks."""
    return value is None or value == "" or _error(value)


def _show(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.15g}"
    return "no value" if value in (None, "") else str(value)
