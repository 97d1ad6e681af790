"""Many flights of one shuttlecock: draws, errors, and ratios of medians with their bands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from kfsheet.evaluation.evaluate import evaluate
from kfsheet.exercises.shuttlecock.forecasts import FORECASTS
from kfsheet.exercises.shuttlecock.model import shuttlecock

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Errors = dict[str, np.ndarray]
"""Arrays of (flights, frames) by the name of the column."""

FLIGHTS, FRAMES = 400, 27
KINDS = (*(f"e_fall_{r}" for r in FORECASTS), *(f"e_{a}_{r}" for a in "xyz" for r in ("obs", "a")))
AFTER = (6, 10, 14, 18, 22, 26)
COLOURS = {"raw": "#D55E00", "kf": "#0072B2", "now": "#CC79A7", "ex": "#009E73"}


def draws(seed: int) -> dict[str, np.ndarray]:
    """Standard-normal draws of one flight, from ``RandomState``."""
    return _by_axis(np.random.RandomState(seed).standard_normal((FRAMES, 3)))


def other_draws(seed: int) -> dict[str, np.ndarray]:
    """The same from another generator."""
    return _by_axis(np.random.default_rng(seed).standard_normal((FRAMES, 3)))


def _by_axis(noise: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip(("n_x", "n_y", "n_z"), noise.T, strict=True))


def fly(
    noise: Callable[[int], Mapping[str, np.ndarray]] = draws,
    columns: Sequence[str] = KINDS,
    **parameters: float,
) -> Errors:
    """Fly 400 times; the seeds are 0 to 399.

    Parameters
    ----------
    noise : function of a seed
        The data of one flight.
    columns : sequence of str
        What is wanted of each; where an error has no value, as without a fall point, it is
        infinite.
    **parameters : float
        Those of the model that differ.
    """
    kept = list(columns)
    runs = [
        evaluate(shuttlecock, noise(seed), columns=kept, **parameters) for seed in range(FLIGHTS)
    ]
    found = np.nan_to_num(np.array(runs).transpose(2, 0, 1), nan=np.inf)
    return dict(zip(kept, found, strict=True))


def improvement(flights: Errors) -> dict[str, float]:
    """By what share the filter's positions err less than the cameras', by axis."""
    square = {k: (flights[k] ** 2).mean() for k in KINDS[len(FORECASTS) :]}
    return {a: float(1 - (square[f"e_{a}_a"] / square[f"e_{a}_obs"]) ** 0.5) for a in "xyz"}


def ratio_of_medians(one: np.ndarray, other: np.ndarray, axis: int = 0) -> np.ndarray:
    """Median error of one forecast over that of another, frame by frame."""
    return np.median(one, axis=axis) / np.median(other, axis=axis)


def ratio(one: np.ndarray, other: np.ndarray, frames: Sequence[int] = AFTER) -> np.ndarray:
    """Ratio of medians and its 95 % band: rows of the ratio, the lower and the upper edge.

    The flights are drawn again with replacement (the bootstrap), always in pairs.
    """
    from scipy.stats import bootstrap

    pair = one[:, frames], other[:, frames]
    generator = np.random.RandomState(1)
    again = bootstrap(
        pair, ratio_of_medians, n_resamples=999, paired=True, method="percentile", rng=generator
    )
    return np.array([ratio_of_medians(*pair), *again.confidence_interval])


def cost(flights: Errors, since: int = 6) -> tuple[float, float]:
    """By how much filtering first changes the error of the fit.

    Returns
    -------
    mean, error : float
        Mean of the logarithm of the ratio over flights and frames, and 1.96 standard errors of it.
    """
    each = np.log(flights["e_fall_kf"][:, since:] / flights["e_fall_raw"][:, since:]).mean(axis=1)
    return float(each.mean()), float(1.96 * each.std(ddof=1) / len(each) ** 0.5)


def show_ratio(
    ax: Axes, one: np.ndarray, other: np.ndarray, frames: Sequence[int], color: str, label: str = ""
) -> None:
    """Draw a ratio of medians to the raw fit, with its band."""
    mid, low, high = ratio(one, other, frames)
    ax.fill_between(frames, low, high, alpha=0.2, color=color)
    ax.plot(frames, mid, "o-", ms=3, color=color, label=label or None)
    ax.axhline(1, color="k", lw=1)
    ax.set(xlabel="frame", ylabel="median error / that of the raw fit")
    ax.label_outer()


def show_medians(ax: Axes, flights: Errors, kinds: Sequence[str]) -> None:
    """Draw medians of the error of the fall point, with the band that the ranks of errors give."""
    from scipy.stats import binom

    low, high = binom.interval(0.95, FLIGHTS, 0.5)
    for kind in kinds:
        errors = np.sort(flights[f"e_fall_{kind}"][:, 2:], axis=0)
        edges = errors[[int(low) - 1, int(high)]]
        ax.fill_between(range(2, FRAMES), *edges, alpha=0.3, color=COLOURS[kind])
        middle = np.median(errors, axis=0)
        ax.plot(range(2, FRAMES), middle, label=FORECASTS[kind], color=COLOURS[kind])
    ax.set(xlabel="frame", ylabel="error of the fall point (m)", yscale="log")
    ax.set_yticks([0.03, 0.1, 0.3, 1], labels=["0.03", "0.1", "0.3", "1"])
    ax.legend(frameon=False)


def velocity_errors(flights: Errors) -> dict[str, np.ndarray]:
    """Errors of the velocity upwards (m/s), of the filter and of the fit, which implies one.

    Parameters
    ----------
    flights : dict
        With the columns ``vz_true``, ``vz_a`` and ``v_z_raw``, flown with k/m = 1/s.
    """
    left = np.exp(-np.arange(FRAMES) / 30)  # of a velocity, after so many frames
    fitted = flights["v_z_raw"] * left - 9.80665 * (1 - left)
    true = flights["vz_true"]
    return {"filter": flights["vz_a"] - true, "fit": fitted - true}
