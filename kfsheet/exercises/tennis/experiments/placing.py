"""Where two cameras lose the depth: opposite each other, and side by side (section 3.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, number
from kfsheet.exercises.tennis.methods.cameras import ANGLE, PIXELS, Camera


def crossing_errors(
    apex: ArrayLike, distance: ArrayLike = 7.0, sigma: float = ANGLE / PIXELS
) -> tuple[Array, Array]:
    """How well two lines of sight tell where they cross, in the plane of the cameras.

        along = d sigma / sqrt(1 - cos(apex)),   across = d sigma / sqrt(1 + cos(apex))

    Each camera measures across its line of sight, with the error d sigma. Along the bisector of
    the lines the information of both is (1 - cos(apex)) / (d sigma)^2: it vanishes for cameras
    side by side, as that across it does for cameras opposite each other.

    Parameters
    ----------
    apex : array_like
        Angle at the ball between both cameras, rad, between 0 and pi.
    distance : array_like
        Of each camera to the ball, m.
    sigma : float
        Error of an angle, rad.

    Returns
    -------
    along, across : ndarray
        Standard deviations along the bisector and across it, m.

    Examples
    --------
    >>> along, across = crossing_errors(np.pi / 2)
    >>> bool(np.isclose(along, across))
    True
    """
    apex = np.asarray(apex, float)
    if not ((apex > 0) & (apex < np.pi)).all():
        raise DataError("apex must lie between 0 and pi: there the lines of sight do not cross")
    d = np.asarray(distance, float) * number("sigma", sigma, 0)
    if not (d > 0).all():
        raise DataError("distance must be above 0")
    return d / np.sqrt(1 - np.cos(apex)), d / np.sqrt(1 + np.cos(apex))


def looking_at(position: ArrayLike, target: ArrayLike) -> Camera:
    """A camera that points at a target, held upright."""
    forward = np.asarray(target, float) - np.asarray(position, float)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1.0])
    if np.linalg.norm(right) < 1e-9:
        raise DataError("a camera that looks straight up or down has no upright position")
    right /= np.linalg.norm(right)
    axes = (tuple(axis.tolist()) for axis in (right, np.cross(forward, right), forward))
    return Camera(tuple(float(x) for x in np.asarray(position)), *axes)


def cameras_around(target: ArrayLike, apex: float, distance: float = 7.0) -> tuple[Camera, Camera]:
    """Two cameras at the height of a target, which see it from directions ``apex`` apart.

    The bisector of both directions is axis 1; the cameras stand on the side of lower x1.
    """
    target, half = np.asarray(target, float), number("apex", apex, 0, np.pi) / 2
    one, two = (
        looking_at(target - distance * np.array([np.cos(half), way * np.sin(half), 0]), target)
        for way in (1, -1)
    )
    return one, two
