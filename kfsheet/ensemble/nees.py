"""Normalised estimation error squared: which columns it reads, and its arithmetic."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, combinations, combinations_with_replacement
from typing import TYPE_CHECKING

import numpy as np

from kfsheet.errors import DataError, ModelError

if TYPE_CHECKING:
    from kfsheet.model.recurrence import Recurrence


@dataclass(frozen=True)
class NEES:
    """Normalised estimation error squared, e' P^-1 e, from the columns of a filter.

    In a row whose P has no inverse, as where a state is known exactly, it has no value.

    Parameters
    ----------
    states : sequence of str
        Names of the state, in any order: ``("x", "vx")``.
    errors : str
        Pattern of the columns of the errors: ``"e_{}_a"``.
    covariance : str
        Pattern of the columns of the covariance, of which one triangle is enough:
        ``"P_{}{}_a"``. States that no chain of such columns connects are independent.
    independent : sequence of pairs of str, optional
        Further pairs whose covariance is 0 and has no column.
    """

    states: tuple[str, ...]
    errors: str = "e_{}_a"
    covariance: str = "P_{}{}_a"
    independent: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        states = self.states
        fine = isinstance(states, (list, tuple)) and states
        if not fine or not all(isinstance(s, str) for s in states):
            raise DataError(f"NEES is given {states!r}; give the names of the states: ('x', 'vx')")
        if len(set(states)) < len(states):
            raise DataError(f"NEES names a state twice: {', '.join(states)}")

    def error_columns(self, model: Recurrence) -> list[str]:
        """Names of the columns of the errors.

        Raises
        ------
        ModelError
            If the model lacks one.
        """
        names = [self.errors.format(state) for state in self.states]
        known = {c.name for c in model.all_columns()}
        if missing := [name for name in names if name not in known]:
            raise ModelError(
                f"NEES reads the column {missing[0]}, which {model.name} lacks; define the errors, "
                "and name them as in errors='e_{}_a'"
            )
        return names

    def covariance_columns(self, model: Recurrence) -> dict[tuple[int, int], str]:
        """Names of the columns of the covariance that the model has, by place, upper triangle.

        Raises
        ------
        ModelError
            If a variance has no column, or a covariance of two states that are not independent.
        """
        known = {c.name for c in model.all_columns()}
        found = {}
        for i, j in combinations_with_replacement(range(len(self.states)), 2):
            a, b = self.states[i], self.states[j]
            names = self.covariance.format(a, b), self.covariance.format(b, a)
            if name := next((n for n in names if n in known), None):
                found[i, j] = name
            elif i == j:
                raise ModelError(f"NEES needs the column {names[0]}, which {model.name} lacks")
        declared = {frozenset(pair) for pair in self.independent}
        for i, j in _connected(found):
            a, b = self.states[i], self.states[j]
            if (i, j) not in found and frozenset({a, b}) not in declared:
                raise ModelError(
                    f"{model.name} has neither {self.covariance.format(a, b)} nor "
                    f"{self.covariance.format(b, a)}; if that covariance is 0, give NEES "
                    f"independent=[({a!r}, {b!r})]"
                )
        return found


def _connected(pairs: Iterable[tuple[int, int]]) -> Iterator[tuple[int, int]]:
    """Pairs i < j that a chain of ``pairs`` connects."""
    groups: list[set[int]] = []
    for pair in pairs:
        touched = [g for g in groups if g & {*pair}]
        groups = [g for g in groups if not g & {*pair}] + [{*pair}.union(*touched)]
    return chain.from_iterable(combinations(sorted(group), 2) for group in groups)


SINGULAR, NEGATIVE = 1e-14, -1e-9  # of a pivot, as a share of the variance


def normalised(
    errors: Sequence[np.ndarray], covariance: Mapping[tuple[int, int], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """E' P^-1 e by elimination, for arrays of errors and of entries of P.

    Parameters
    ----------
    errors : sequence of ndarray
        The n errors, of any one shape.
    covariance : mapping
        Entries of the upper triangle by place, of that shape; those left out are 0.

    Returns
    -------
    values : ndarray
        NaN where something is missing or P is singular to rounding.
    wrong : ndarray
        Where P is no covariance: a pivot is negative beyond rounding.

    Notes
    -----
    P = L D L' and w = L^-1 e give the sum of w_i^2 / d_i.
    """
    n, e = len(errors), [np.array(part) for part in errors]
    P = {place: np.array(entry) for place, entry in covariance.items()}
    variances = [covariance[i, i] for i in range(n)]
    total, wrong = np.zeros(e[0].shape), np.zeros(e[0].shape, dtype=bool)
    for i in range(n):
        pivot = P[i, i]
        wrong |= (pivot < NEGATIVE * np.abs(variances[i])) | (variances[i] < 0)
        pivot[pivot <= SINGULAR * variances[i]] = np.nan
        total += e[i] * e[i] / pivot
        later = [j for j in range(i + 1, n) if (i, j) in P]
        for j in later:
            share = P[i, j] / pivot
            e[j] -= share * e[i]
            for k in later:
                if k >= j:
                    P[j, k] = P.get((j, k), 0.0) - share * P[i, k]
    return total, wrong
