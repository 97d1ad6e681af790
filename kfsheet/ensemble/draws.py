"""Standard-normal draws for data columns, other ones for every member."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any

import numpy as np

from kfsheet.errors import DataError


def is_whole(value: object) -> bool:
    """Whether a value is a whole number, of Python or NumPy, and not True or False."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def check_mapping(what: str, value: Any) -> Any:
    """``value``, refused unless it gives values by name."""
    if not hasattr(value, "items"):
        kind = type(value).__name__
        raise DataError(f"{what} is a {kind}; give values by name, as {{'name': ...}}")
    return value


@dataclass(frozen=True)
class Draws:
    """Standard-normal draws for data columns, other ones for every member.

    Member k draws from ``numpy.random.RandomState((seed, k))``, column after column; so a member
    has the same draws however many there are, and whoever computes it.

    Parameters
    ----------
    *columns : str
        The data columns.
    seed : int
        From 0 to 2**32 - 1.
    data : mapping, optional
        Values of other data columns, as :func:`kfsheet.evaluate` takes them: gaps, for example.

    Raises
    ------
    DataError
        For no name, a name that comes twice, a seed out of range, or a column that is both drawn
        and given.
    """

    columns: tuple[str, ...]
    seed: int = 0
    data: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def __init__(self, *columns: str, seed: int = 0, data: Mapping[str, Any] | None = None) -> None:
        if not columns or not all(isinstance(name, str) for name in columns):
            raise DataError("Draws needs the names of data columns: Draws('n_theta', seed=1)")
        if len(set(columns)) < len(columns):
            raise DataError(f"Draws names a column twice: {', '.join(columns)}")
        if not is_whole(seed) or not 0 <= seed < 2**32:
            raise DataError(f"seed is {seed!r}; it must be a whole number from 0 to 2**32 - 1")
        given = check_mapping("data", data or {})
        if both := sorted(set(given) & set(columns)):
            raise DataError(f"{both[0]} is drawn and given; do one or the other")
        object.__setattr__(self, "columns", columns)
        object.__setattr__(self, "seed", int(seed))
        object.__setattr__(self, "data", given)

    def of(self, member: int, rows: int) -> np.ndarray:
        """The draws of a member, one row a column: shape (columns, rows)."""
        return self.block(member, member + 1, rows)[:, 0]

    def block(self, first: int, last: int, rows: int) -> np.ndarray:
        """The draws of members from ``first`` to before ``last``: (columns, members, rows)."""
        found = np.empty((len(self.columns), last - first, rows))
        state = np.random.RandomState(0)  # a new one for each would cost more than its draws
        for k, member in enumerate(range(first, last)):
            state.seed((self.seed, member))
            found[:, k] = state.standard_normal((len(self.columns), rows))
        return found
