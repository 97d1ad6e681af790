"""Frames in which the cameras take something else for the shuttlecock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kfsheet.errors import DataError

Seed = int | Sequence[int]
"""Of a ``numpy.random.RandomState``."""


def struck_frames(seed: Seed, frames: int, share: float = 0.1) -> np.ndarray:
    """Which frames are outliers, as True or False: each with the probability ``share``.

    Parameters
    ----------
    seed : int or sequence of int
        Of a ``numpy.random.RandomState``, one for each flight: ``(1, flight)``. Pairs are mixed
        better than neighbouring integers, whose first draws are not quite independent.
    frames : int
        How many there are, at least 1.
    share : float
        From 0 to 1.

    Raises
    ------
    DataError
        If an argument is out of its range.
    """
    if not frames >= 1:
        raise DataError(f"there are {frames} frames; a flight has at least 1")
    if not 0 <= share <= 1:
        raise DataError(f"share is {share}; it is a probability, from 0 to 1")
    return _generator(seed).random_sample(frames) < share


def with_outliers(
    draws: Mapping[str, Sequence[float]], seed: Seed, share: float = 0.1, scale: float = 8
) -> dict[str, np.ndarray]:
    """Draws of noise, and in some frames a second draw, ``scale`` times as large, added to them.

    All axes of a frame are struck together, each by a draw of its own. A struck position then errs
    with a standard deviation of sqrt(1 + scale^2) of the ordinary ones.

    Parameters
    ----------
    draws : mapping of str to sequence of float
        Standard-normal draws of each axis, by column: ``n_x``, ``n_y``, ``n_z``.
    seed, share
        As of :func:`struck_frames`, which says which frames they are.
    scale : float
        Standard deviation of the error that comes on top, in units of the ordinary one; from 0.

    Raises
    ------
    DataError
        If an argument is out of its range, or the columns differ in length.
    """
    lengths = {len(column) for column in draws.values()}
    if len(lengths) != 1:
        raise DataError(f"columns of {sorted(lengths)} draws; give one draw a frame on every axis")
    if not 0 <= scale < np.inf:
        raise DataError(f"scale is {scale}; it is a standard deviation, 0 or more")
    (frames,) = lengths
    struck = struck_frames(seed, frames, share)
    generator = _generator(seed)
    generator.random_sample(frames)  # those that chose the frames
    more = scale * struck * generator.standard_normal((len(draws), frames))
    return {name: np.add(n, extra) for (name, n), extra in zip(draws.items(), more, strict=True)}


def _generator(seed: Seed) -> np.random.RandomState:
    try:
        return np.random.RandomState(seed)
    except (TypeError, ValueError):
        message = f"seed is {seed!r}; it must be of whole numbers from 0 to 2**32 - 1"
        raise DataError(message) from None
