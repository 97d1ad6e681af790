"""A column of a worksheet compared as a whole, which is quicker than a thousand cells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kfsheet.workbook.engines.spreadsheet_engine import SheetValues
from kfsheet.workbook.write.sheet import FilledColumn

NUMBERS = {float, int}  # a text such as "1.0" is none, though NumPy would read it


class ColumnComparison:
    """What is expected of a column whose formulas are where they belong."""

    def __init__(self, filled: FilledColumn, at: int, tolerance: float) -> None:
        self._filled, self._tolerance = filled, tolerance
        self._places = [(row, at) for row in filled.rows]
        self.formulas = 0
        """How many there are."""
        if filled.rules:
            self.formulas = len(self._places) - filled.rules.count(None)
            self._numbers = np.array(filled.values, dtype=float)
            self._none = np.isnan(self._numbers)
            size = np.fmax(np.abs(self._numbers), filled.scale)  # fmax: NaN gives way
            self._size = np.where(size > 0, size, 1.0)

    def largest(self, cells: SheetValues) -> float | None:
        """Largest relative difference from the values of a sheet; None if a cell disagrees."""
        found = list(map(cells.get, self._places))
        if not self._filled.rules:
            wrong = self._filled.kind == "index" and found != list(self._filled.values)
            return None if wrong else 0.0
        numbers = _numbers(found, self._filled.missing)
        if numbers is None or (np.isnan(numbers) != self._none).any():
            return None
        far = (np.abs(numbers - self._numbers) / self._size)[~self._none].max(initial=0.0)
        return float(far) if far <= self._tolerance else None


def _numbers(found: list[Any], missing: str) -> np.ndarray | None:
    """Values of a column, NaN where there is none; None if something else stands in it."""
    kinds = set(map(type, found))
    if not kinds <= NUMBERS:
        found = [math.nan if v in (None, "", missing) else v for v in found]
        kinds = set(map(type, found))
    return np.array(found, dtype=float) if kinds <= NUMBERS else None
