"""A shot: two cameras and what they saw, read from a table or simulated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kfsheet.exercises.tennis.methods.arguments import Array, number
from kfsheet.exercises.tennis.methods.cameras import (
    Camera,
    looking_along_x1,
    looking_along_x2,
    triangulate,
)
from kfsheet.exercises.tennis.methods.dynamics import MASS, Ball
from kfsheet.model.tables import read_table

TRUE_DRAG, TRUE_SPIN = 0.0012 / MASS, (0.02, 0.05, 0.04)
"""c_D/m in 1/m and c_L Omega/m in 1/s of the simulated balls."""
SIGMA = 0.2
"""Error of a pixel coordinate, px."""


@dataclass(frozen=True)
class Scene:
    """Where the cameras stand, and how the simulated ball starts."""

    camera_1: Camera
    camera_2: Camera
    ball: Ball


DRIVE = Scene(
    looking_along_x1((0, 5.3, 1.8)),
    looking_along_x2((7.855, 0, 1.8)),
    Ball((5.5, 5.6, 1.2), (28.5, 1, 5.8), TRUE_DRAG, TRUE_SPIN),
)
"""A: a drive."""
TOSS = Scene(
    looking_along_x1((0, 5.3, 1.7)),
    looking_along_x2((3.5, 0, 1.7)),
    Ball((2.8, 5.5, 1.3), (8.2, 0.5, 5), TRUE_DRAG, TRUE_SPIN),
)
"""B: a slow toss."""


@dataclass(frozen=True)
class Shot:
    """Photos of a flight; a missing one is NaN.

    Parameters
    ----------
    scene : Scene
        Where it was taken.
    times : ndarray
        (n,), s.
    truth : ndarray
        (n, 3) positions, m.
    pixels_1, pixels_2 : ndarray
        (n, 2), px.
    """

    scene: Scene
    times: Array
    truth: Array
    pixels_1: Array
    pixels_2: Array

    @property
    def overlap(self) -> Array:
        """Indices of the images in which both cameras see the ball."""
        return np.flatnonzero(np.isfinite(self.pixels_1 + self.pixels_2).all(axis=1))

    def triangulated(self) -> Array:
        """Positions (n, 3) by triangulation, NaN outside the overlap."""
        s = self.scene
        return triangulate(s.camera_1, self.pixels_1, s.camera_2, self.pixels_2)[0]

    def first(self, n: int) -> Shot:
        """The first n images only."""
        names = ("times", "truth", "pixels_1", "pixels_2")
        return replace(self, **{name: getattr(self, name)[:n] for name in names})

    def rms(self, x: Array) -> Array:
        """Root mean square errors (3,) of positions (n, 3), m."""
        return np.sqrt(np.nanmean((x - self.truth) ** 2, axis=0))


def read_shot(path: str | Path, scene: Scene) -> Shot:
    """Read a CSV with the columns ``k, t, x1, x2, x3, u1, v1, u2, v2``.

    Raises
    ------
    DataError
        If the table is not as described; only u2 and v2 may be empty.
    """
    names = ("k", "t", "x1", "x2", "x3", "u1", "v1", "u2", "v2")
    table = read_table(path, names, times="t", may_be_missing=("u2", "v2"))
    x, p, q = (
        np.column_stack([table[name] for name in group])
        for group in (("x1", "x2", "x3"), ("u1", "v1"), ("u2", "v2"))
    )
    return Shot(scene, np.array(table["t"]), x, p, q)


def simulate(shot: Shot, seed: int, sigma: float = SIGMA) -> Shot:
    """The same flight, photographed with other errors, in the same images.

    Parameters
    ----------
    shot : Shot
        Gives the truth, and which images there are.
    seed : int
        Of the pseudo-random numbers.
    sigma : float
        Standard deviation of the error of a pixel coordinate.
    """
    draws = np.random.RandomState(seed).standard_normal((2, len(shot.times), 2))
    noise = number("sigma", sigma, 0) * draws
    seen = [c.project(shot.truth) for c in (shot.scene.camera_1, shot.scene.camera_2)]
    one, two = (
        np.where(np.isfinite(old), new + error, np.nan)
        for old, new, error in zip((shot.pixels_1, shot.pixels_2), seen, noise, strict=True)
    )
    return replace(shot, pixels_1=one, pixels_2=two)
