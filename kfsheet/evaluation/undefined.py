"""What a run computed that is no value: infinite, complex, or NaN though nothing was missing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite

import numpy as np


def _suspicious(columns: Mapping[str, list]) -> Iterator[tuple[str, list]]:
    """Columns that may hold something else than finite numbers: then their sum is none either."""
    for name, column in columns.items():
        try:
            fine = isfinite(sum(column, 0.0))
        except (OverflowError, TypeError):  # of endless integers, of complex numbers
            fine = False
        if not fine:
            yield name, column


def without_value(
    columns: Mapping[str, list], scalars: Mapping[str, float], gaps: Mapping[str, np.ndarray]
) -> str:
    """What is infinite, complex, or NaN though nothing was missing; '' if nothing is."""
    for name, column in _suspicious(columns):
        if _gaps_alone(column, gaps.get(name)):
            continue
        for row, value in enumerate(column):
            missing = value != value and name in gaps and gaps[name][row]
            if not missing and (reason := _no_number(value)):
                return f"{name} in row {row} {reason}"
    for name, value in scalars.items():
        if value == value and (reason := _no_number(value)):
            return f"{name} {reason}"
    return ""


def _gaps_alone(column: list, gaps: np.ndarray | None) -> bool:
    """Whether a column holds finite numbers, and NaN only where a value may be missing."""
    try:
        numbers = np.array(column, dtype=float)
    except (TypeError, OverflowError):  # complex numbers, endless integers
        return False
    return gaps is not None and bool((np.isfinite(numbers) | (np.isnan(numbers) & gaps)).all())


def _no_number(value: complex) -> str:
    """Why a value is no finite number; '' if it is."""
    try:
        return "" if isfinite(value) else f"is {value}, no finite number"
    except TypeError:
        return f"is {value}, no finite number: it holds a root or power of a negative number"
    except OverflowError:  # of an endless integer
        return "grows beyond 1e308"
