"""Does a filter err as much as it says? One test, for whatever is known of many runs.

Errors of neighbouring steps tell the same story again: a flight that errs, errs for long. So the
share of the steps within some bounds is no test, though it looks like one; runs are independent,
steps are not. Here every run is one number, such as its mean NEES, and the mean of these numbers is
judged by their own spread.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kfsheet.errors import DataError


@dataclass(frozen=True)
class Consistency:
    """What many runs say of a statistic whose mean is known, if the filter is honest.

    Attributes
    ----------
    mean, low, high : float
        Mean over the runs, and the interval that holds the true mean, 19 times of 20.
    expected : float
        What an honest filter would have.
    p : float
        How often chance alone would lead as far away from it, or further.
    """

    mean: float
    low: float
    high: float
    expected: float
    p: float

    @property
    def holds(self) -> bool:
        """Whether the interval holds what is expected."""
        return self.low <= self.expected <= self.high

    def __str__(self) -> str:
        """In words: ``3.98 (3.81 to 4.15), expected 4: honest, as far as this tells``."""
        verdict = "honest, as far as this tells" if self.holds else "not honest"
        band = f"{self.mean:.3g} ({self.low:.3g} to {self.high:.3g})"
        return f"{band}, expected {self.expected:g}: {verdict}"


def consistency(of_runs: Sequence[float], expected: float) -> Consistency:
    """Judge a filter by one number for each independent run.

        mean +- t_{n-1} s / sqrt(n)

    Parameters
    ----------
    of_runs : sequence of float
        For each run its mean NEES, or its mean NIS; at least 2.
    expected : float
        Their mean if the filter is honest: the number of states for the NEES, of observations for
        the NIS.

    Raises
    ------
    DataError
        If there are fewer than 2 runs, or one has no number.

    Examples
    --------
    >>> print(consistency([1.9, 2.2, 2.0, 1.8], 2))
    1.98 (1.7 to 2.25), expected 2: honest, as far as this tells
    """
    from scipy.stats import t

    values = np.asarray(of_runs, float)
    n = len(values) if values.ndim == 1 else 0
    if n < 2 or not np.isfinite(values).all():
        raise DataError(f"consistency is given {n} runs; give one number each, of at least 2")
    mean, error = float(values.mean()), float(values.std(ddof=1)) / n**0.5
    if not error:
        raise DataError(f"all {n} runs have the same number, {mean:g}: they are not independent")
    half = float(t.ppf(0.975, n - 1)) * error
    p = 2 * float(t.sf(abs(mean - expected) / error, n - 1))
    return Consistency(mean, mean - half, mean + half, float(expected), p)
