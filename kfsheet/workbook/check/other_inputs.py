"""Other numbers to calculate a workbook with.

Every parameter and datum moved by about one percent finds a number typed over a formula, or a
parameter's value typed into one, even while it is still right. Half of the observations taken out,
then the other half, finds a formula that no longer asks whether there is one.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

from kfsheet.parsing.references import Address
from kfsheet.workbook.check.opened_workbook import Inputs
from kfsheet.workbook.engines.spreadsheet_engine import Changes

NUDGE = 0.01
GOLDEN = (math.sqrt(5) - 1) / 2

Data = dict[str, list[float | None]]


def other_inputs(inputs: Inputs) -> Iterator[tuple[str, Changes, Data, dict[str, float]]]:
    """What was done to the inputs, in words; the cells to change; the data and parameters then."""
    changes, data, parameters = _nudged(inputs)
    yield "inputs moved by 1 %", changes, data, parameters
    optional = [n for n in data if inputs.layout.model.table[n].may_be_missing]
    for half in (0, 1) if optional else ():
        emptied = {sheet: dict(cells) for sheet, cells in changes.items()}
        fewer = {name: list(series) for name, series in data.items()}
        for number, name in enumerate(optional):
            for row, (sheet, *cell) in enumerate(inputs.cells(name)):
                # With two observations in a row, one is there while the other is not.
                if (row + number) % 2 == half:
                    fewer[name][row] = emptied.setdefault(sheet, {})[tuple(cell)] = None
        yield "half of the observations taken out", emptied, fewer, parameters


def _nudged(inputs: Inputs) -> tuple[Changes, Data, dict[str, float]]:
    """Every input a little larger, each by another factor, so that no change hides another."""
    changes: Changes = {}
    # Multiples of the golden ratio, modulo 1, never come back to where they were.
    factors = (1 + NUDGE * (0.5 + (n * GOLDEN) % 1) for n in itertools.count(1))

    def move(value: float, address: Address) -> float:
        moved = value * next(factors) if value else NUDGE
        changes.setdefault(address[0], {})[address[1:]] = moved
        return moved

    parameters = {n: move(v, inputs.layout.scalars[n]) for n, v in inputs.parameters.items()}
    data = {
        name: [
            None if value is None else move(value, cell)
            for value, cell in zip(series, inputs.cells(name), strict=True)
        ]
        for name, series in inputs.data.items()
    }
    return changes, data, parameters
