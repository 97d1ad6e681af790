"""What a study of many runs is asked for, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from kfsheet.errors import DataError, ModelError

if TYPE_CHECKING:
    import pandas as pd

    from kfsheet.recurrence import Recurrence


@dataclass(frozen=True)
class Draws:
    """Standard-normal draws for data columns, other ones for every member.

    Member k draws from ``numpy.random.RandomState((seed, k))``, column after column; so a member
    has the same draws however many there are, and whoever computes it.

    Parameters
    ----------
    columns : sequence of str
        The data columns.
    seed : int
        From 0 to 2**32 - 1.
    """

    columns: tuple[str, ...]
    seed: int = 0

    def __init__(self, *columns: str, seed: int = 0) -> None:
        if not columns or not all(isinstance(name, str) for name in columns):
            raise DataError("Draws needs the names of data columns: Draws('n_theta', seed=1)")
        if not isinstance(seed, int) or not 0 <= seed < 2**32:
            raise DataError(f"seed is {seed!r}; it must be a whole number from 0 to 2**32 - 1")
        object.__setattr__(self, "columns", columns)
        object.__setattr__(self, "seed", seed)

    def of(self, member: int, rows: int) -> np.ndarray:
        """The draws of a member, one row a column: shape (columns, rows)."""
        state = np.random.RandomState((self.seed, member))
        return state.standard_normal((len(self.columns), rows))


@dataclass(frozen=True)
class NEES:
    """Normalised estimation error squared, e' P^-1 e, from the columns of a filter.

    Parameters
    ----------
    states : sequence of str
        Names of the state: ``("x", "vx")``.
    errors : str
        Pattern of the columns of the errors: ``"e_{}_a"``.
    covariance : str
        Pattern of the columns of the covariance, upper triangle: ``"P_{}{}_a"``. An entry that
        has no column is 0.
    """

    states: tuple[str, ...]
    errors: str = "e_{}_a"
    covariance: str = "P_{}{}_a"

    def error_columns(self) -> list[str]:
        """Names of the columns of the errors."""
        return [self.errors.format(state) for state in self.states]

    def covariance_columns(self, model: Recurrence) -> dict[tuple[int, int], str]:
        """Names of the columns of the covariance that the model has, by place."""
        known = {c.name for c in model.all_columns()}
        names = {
            (i, j): self.covariance.format(a, b)
            for i, a in enumerate(self.states)
            for j, b in enumerate(self.states)
            if i <= j
        }
        if missing := [n for (i, j), n in names.items() if i == j and n not in known]:
            raise ModelError(f"NEES needs the column {missing[0]}, which {model.name} lacks")
        return {place: name for place, name in names.items() if name in known}


@dataclass
class Study:
    """What many runs say: statistics over the members.

    Attributes
    ----------
    members : int
        How many runs.
    rows : dict of str to DataFrame
        For each column asked for, and each NEES, the statistics of every step over the members:
        ``mean``, ``rms``, ``std`` (n - 1) and ``count``, members without a value left out.
    scalars : DataFrame
        For each scalar of the model ``mean``, ``rms``, ``std``, ``count`` and the quantiles asked.
    """

    members: int
    rows: dict[str, pd.DataFrame]
    scalars: pd.DataFrame
