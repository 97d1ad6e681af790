"""Cells of a model computed one at a time from an engine's own values of what they read.

A wrong cell makes those that follow wrong too. Where a cell that is computed so agrees with the
engine, it only follows; where it does not, its own formula is to blame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property
from typing import Any

from sympy import Expr, Indexed, IndexedBase

from kfsheet.evaluation import numerics
from kfsheet.model.expressions import lag, t, walk
from kfsheet.parsing.references import Address
from kfsheet.printing.python import python_code
from kfsheet.workbook.check.rounding_error import followed_names, rounding_bound
from kfsheet.workbook.engines.spreadsheet_engine import CellValue, Values
from kfsheet.workbook.write.layout import FIRST_ROW, Layout


class CellByCell:
    """Definitions of formula cells, what they read, and what follows from the engine's values."""

    def __init__(self, layout: Layout, values: Values) -> None:
        self._layout, self._values = layout, values

    @cached_property
    def definitions(self) -> dict[Address, tuple[Expr, int]]:
        """The definition and row behind each formula cell of the model."""
        layout, model = self._layout, self._layout.model
        found: dict[Address, tuple[Expr, int]] = {}
        for column in model.all_columns():
            for sheet, those in layout.columns.items():
                if column.name in those and not column.is_data:
                    for row in range(model.rows):
                        cell = (sheet, FIRST_ROW + row, those[column.name])
                        found[cell] = (column.definition(row), row)
        for name, scalar in {**model.derived_scalars, **model.summaries}.items():
            found[layout.scalars[name]] = (scalar.expression, 0)
        return found

    def reads(self, address: Address) -> Iterator[Address]:
        """Cells that a formula reads."""
        definition, row = self.definitions[address]
        sheet, columns = address[0], set()
        for node in walk(definition):
            if isinstance(node, Indexed):
                home, column = self._home(str(node.base.label), sheet)
                yield home, FIRST_ROW + row - int(lag(node)), column
            elif isinstance(node, IndexedBase):
                columns.add(str(node.label))
            elif node == t:
                yield sheet, address[1], self.step_column(sheet)
            elif node.is_Symbol:
                yield self._layout.scalars[node.name]
        for name in columns:
            home, column = self._layout.home(name)
            yield from ((home, r, column) for r in range(FIRST_ROW, self._layout.last_row + 1))

    def step_column(self, sheet: str) -> int | None:
        """Where the step index stands."""
        return self._layout.columns.get(sheet, {}).get("t")

    def computed(self, address: Address) -> float | None:
        """What a cell should hold, given the others; NaN for no value, None for beyond computing.

        A spreadsheet gives an error where Python raises one or leaves the real numbers.
        """
        definition, row = self.definitions[address]
        try:
            value = eval(python_code(definition), {**self._namespace, "t": row})  # our own source
        except (ArithmeticError, ValueError):
            return None
        return None if isinstance(value, complex) or math.isinf(value) else value

    def rounding(self, address: Address) -> float:
        """How far a right program may be off, given the others, where terms cancel."""
        definition, row = self.definitions[address]
        return rounding_bound(python_code(definition), {**self._followed, "t": row})

    @cached_property
    def _followed(self) -> dict[str, Any]:
        return followed_names(self._namespace)

    def _home(self, name: str, sheet: str) -> tuple[str, int]:
        """Sheet and number of a column; the own sheet comes first, as in formulas."""
        own = self._layout.columns.get(sheet, {})
        return (sheet, own[name]) if name in own else self._layout.home(name)

    @cached_property
    def _namespace(self) -> dict[str, Any]:
        """The engine's values by the names that generated source uses."""
        names: dict[str, Any] = {**vars(math), **vars(numerics)}
        for name, (sheet, *cell) in self._layout.scalars.items():
            names[name] = number(self._values.get(sheet, {}).get(tuple(cell)))
        rows = range(FIRST_ROW, self._layout.last_row + 1)
        for sheet, those in self._layout.columns.items():
            cells = self._values.get(sheet, {})
            for name, column in those.items():
                if name != "t":
                    names[name] = [number(cells.get((row, column))) for row in rows]
        return names


def number(value: CellValue) -> float:
    """The number in a cell, NaN if it holds none; Excel's TRUE is no number, Python's is."""
    return value if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
