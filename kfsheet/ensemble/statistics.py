"""Statistics over many members, of groups that come one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

STATISTICS = ("mean", "rms", "std", "count")


@dataclass
class Sums:
    """Counts, means and squared deviations from them over members.

    Deviations, not squares: of a distance of kilometres that varies by millimetres, the squares
    would keep no figure of the variance.
    """

    count: np.ndarray
    mean: np.ndarray
    squares: np.ndarray

    @classmethod
    def of(cls, values: np.ndarray) -> Sums:
        """Sums over the first axis, values that are missing left out.

        A mean square beyond 1e308 becomes infinite without a word, as the deviation then is.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            total = values.sum(axis=0)
            if np.isfinite(total).all():
                mean, far = total / len(values), values - total / len(values)
                count = np.full(mean.shape, len(values))
                return cls(count, mean, np.einsum("k...,k...->...", far, far))
            missing = np.isnan(values)
            count = len(values) - missing.sum(axis=0)
            mean = np.where(missing, 0.0, values).sum(axis=0) / np.maximum(count, 1)
            far = np.where(missing, 0.0, values - mean)
            return cls(count, mean, (far**2).sum(axis=0))

    @classmethod
    def together(cls, parts: Sequence[Sums]) -> Sums:
        """Sums of several quantities as those of one, along the first axis of each."""
        if len(parts) == 1:
            return parts[0]
        return cls(
            np.concatenate([part.count for part in parts]),
            np.concatenate([part.mean for part in parts]),
            np.concatenate([part.squares for part in parts]),
        )

    def add(self, other: Sums) -> None:
        """Add another group's (Chan, Golub and LeVeque, 1979)."""
        count = self.count + other.count
        share = other.count / np.maximum(count, 1)
        with np.errstate(over="ignore", invalid="ignore"):
            far = other.mean - self.mean
            self.squares = self.squares + other.squares + far**2 * self.count * share
            self.mean = self.mean + far * share
        self.count = count

    def statistics(self, at: int | slice = slice(None)) -> dict[str, np.ndarray]:
        """Mean, root mean square, deviation (n - 1) and count; NaN where nothing is left."""
        count, mean, squares = self.count[at], self.mean[at], self.squares[at]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            mean = np.where(count > 0, mean, np.nan)
            spread, size = np.sqrt(squares / (count - 1)), np.sqrt(mean**2 + squares / count)
        return dict(zip(STATISTICS, (mean, size, spread, count), strict=True))
