"""Error cones: the nearest point that agrees with a photo, or with two (section 3.6.1)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, array, number
from kfsheet.exercises.tennis.methods.cameras import Camera

ROUNDS, CLOSE = 10_000, 1e-9  # of Dykstra's algorithm, and its tolerance in m


@dataclass(frozen=True)
class Cones:
    """Circular cones of one camera, one for each photo.

    Parameters
    ----------
    apex : ndarray
        (3,) the pinhole, m.
    axes : ndarray
        (n, 3) unit vectors; NaN where there is no photo: all of space.
    half_angle : float
        Between axis and surface, rad, below pi/2.
    """

    apex: Array
    axes: Array
    half_angle: float

    @classmethod
    def of(cls, camera: Camera, pixels: ArrayLike, radius: float) -> Cones:
        """The cones around lines of sight, ``radius`` pixels wide at the middle of the image."""
        angle = np.arctan(number("radius", radius, 0) / camera.f)
        return cls(np.array(camera.position, float), camera.rays(pixels), float(angle))

    def rows(self, which: Array) -> Cones:
        """The cones of some photos only."""
        return replace(self, axes=self.axes[which])

    def project(self, x: ArrayLike) -> Array:
        """The nearest points (n, 3) of the cones to points (n, 3).

        With q = x - apex, its part s along the axis and its distance r from it: q lies inside if
        r <= s tan(angle). Else the nearest generator has the direction
        e = cos(angle) axis + sin(angle) across, and the nearest point on it lies at max(0, q.e).
        """
        x = array("x", x, self.axes.shape)
        q = x - self.apex
        s = (q * self.axes).sum(-1, keepdims=True)
        across = q - s * self.axes
        r = np.linalg.norm(across, axis=-1, keepdims=True)
        across = across / np.where(r > 0, r, 1)
        generator = np.cos(self.half_angle) * self.axes + np.sin(self.half_angle) * across
        reach = np.maximum(0, (q * generator).sum(-1, keepdims=True))
        outside = r > s * np.tan(self.half_angle)  # False where there is no photo
        return np.where(outside, self.apex + reach * generator, x)


def project_on_both(one: Cones, two: Cones, x: ArrayLike) -> Array:
    """The nearest points (n, 3) of the intersections of two cones to points (n, 3).

    Where a photo is missing, its cone is all of space, and the other alone counts.

    Raises
    ------
    DataError
        If the cones of an image do not meet; it is named by its row.
    """
    x = array("x", x, one.axes.shape)
    nearest = two.project(one.project(x))
    both = np.flatnonzero(np.isfinite(one.axes + two.axes).all(axis=-1))
    if both.size:
        nearest[both], apart = _dykstra(one.rows(both), two.rows(both), x[both])
        if apart.max() >= CLOSE:
            image = both[apart.argmax()]
            raise DataError(f"the error cones of image {image} do not meet; enlarge the radius")
    return nearest


def _dykstra(one: Cones, two: Cones, x: Array) -> tuple[Array, Array]:
    """Dykstra's algorithm: the points, and how far they are from lying in both cones.

    Projecting in turn on one and the other would end in *some* common point. Dykstra carries
    along what each projection took away, and ends in the nearest.
    """
    taken_1, taken_2, y = np.zeros_like(x), np.zeros_like(x), x
    for _ in range(ROUNDS):
        y = one.project(x + taken_1)
        taken_1 = x + taken_1 - y
        x = two.project(y + taken_2)
        taken_2 = y + taken_2 - x
        if np.abs(x - y).max() < CLOSE:
            break
    return x, np.abs(x - y).max(axis=-1)
