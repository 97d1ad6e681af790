"""What cameras see, each at times of its own: all data on the same footing (section 3.5.2).

A :class:`View` is the data of one camera; :class:`Pixels` is what a ball by (3.1) would show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, array
from kfsheet.exercises.tennis.methods.cameras import Camera
from kfsheet.exercises.tennis.methods.dynamics import (
    GRAVITY,
    MASS,
    TEXTBOOK_DRAG,
    Ball,
    acceleration,
    flights,
)
from kfsheet.exercises.tennis.methods.shots import Shot

SPINS = {"none": 0, "across": 2, "full": 3}
"""Free components of lambda: none; the two across V, as the report advises; all three."""
SCALES = {"X": 1.0, "V": 10.0, "kappa": 0.01, "spin": 0.1, "g": 1.0, "late": 0.01}
"""They make all unknowns of order 1."""
ROUNDS, NEAREST = 8, 0.1  # of start_from_lines, and the least distance it reckons with, m


@dataclass(frozen=True)
class View:
    """Photos of one camera: of the ball, or of its shadow on the floor.

    Parameters
    ----------
    camera : Camera
        Who saw it.
    times : ndarray
        (n,) what the camera's clock said, s, rising from 0 or later.
    pixels : ndarray
        (n, 2), px; NaN where there is no photo.
    late : float, optional
        How much later than that the photos were taken, s; None if that is to be found.
    light : array_like, optional
        (3,) direction in which the light travels: the pixels are those of the shadow.
    """

    camera: Camera
    times: Array
    pixels: Array
    late: float | None = 0.0
    light: ArrayLike | None = None

    def __post_init__(self) -> None:
        n = len(array("times", self.times, (None,)))
        array("pixels", self.pixels, (n, 2), gaps=True)
        if self.light is not None and array("light", self.light, (3,))[2] >= 0:
            raise DataError(f"light is {self.light}; it must travel down, with a negative x3")

    @property
    def seen(self) -> Array:
        """Which pixel coordinates (n, 2) there are."""
        return np.isfinite(self.pixels)

    @property
    def onto(self) -> Array:
        """The matrix (3, 3) that leads from the ball to what is seen: itself, or its shadow."""
        if self.light is None:
            return np.eye(3)
        light = np.asarray(self.light, float)
        return np.eye(3) - np.outer(light / light[2], [0, 0, 1.0])

    def image(self, x: Array) -> Array:
        """Pixels (..., 2) that a ball at (..., 3) would show."""
        return self.camera.image(x @ self.onto.T)


def views_of(shot: Shot) -> list[View]:
    """The two views of a shot, whose cameras have one clock."""
    pairs = ((shot.scene.camera_1, shot.pixels_1), (shot.scene.camera_2, shot.pixels_2))
    return [View(camera, shot.times, pixels) for camera, pixels in pairs]


def photograph(view: View, ball: Ball, noise: Array | float = 0.0) -> View:
    """The same view of another ball: what it would show, plus ``noise`` (n, 2), px.

    A photo that is missing stays so; ``late`` counts, an unknown one as 0.
    """
    when = np.asarray(view.times) + (view.late or 0.0)
    pixels = np.where(view.seen, view.image(_flown(ball, when)) + noise, np.nan)
    return View(view.camera, view.times, pixels, view.late, view.light)


def _flown(ball: Ball, when: Array) -> Array:
    """Positions (n, 3) at rising times, of which the first may lie before 0."""
    first = min(float(when[0]), 0.0)
    return ball.state(first).fly(when - first)


def start_from_lines(views: Sequence[View], g: float = GRAVITY) -> Ball:
    """A first guess from lines of sight alone, of one camera or more, at whatever times.

    A line of sight that shows the slope a to the right says (right - a forward).(x - position) = 0,
    and likewise downwards. With x = X + V t + bend(t) these are linear in X and V. The bend begins
    as that of gravity; the next rounds take that of the flight found, with the textbook's drag, and
    weigh every line by 1 over its distance.

    Raises
    ------
    DataError
        If the lines do not determine X and V.
    """
    ball = None
    for _ in range(ROUNDS):
        rows, right = zip(*(_equations(view, ball, g) for view in views), strict=True)
        found, _, rank, _ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right))
        if rank < 6:
            raise DataError("these lines of sight do not tell where the ball starts, nor how fast")
        ball = Ball(found[:3], found[3:], TEXTBOOK_DRAG / MASS, g=g)
    return ball


def _equations(view: View, ball: Ball | None, g: float) -> tuple[Array, Array]:
    """Rows (m, 6) and right sides (m,) of one view, for the pixels that there are."""
    camera, t = view.camera, np.asarray(view.times, float) + (view.late or 0.0)
    bend, weight = -g * t[:, None] ** 2 / 2 * np.array([0, 0, 1.0]), np.ones(len(t))
    if ball is not None:
        x = _flown(ball, t)
        bend = x - ball.X - t[:, None] * ball.V
        weight = 1 / np.maximum(camera.frame(x @ view.onto.T)[:, 2], NEAREST)
    slopes = (np.asarray(view.pixels) - camera.centre) / camera.f
    ways = np.array([camera.right, camera.down]) - slopes[..., None] * np.array(camera.forward)
    normals = ways @ view.onto * weight[:, None, None]
    right = (
        weight[:, None] * (ways @ np.array(camera.position)) - (normals @ bend[..., None])[..., 0]
    )
    rows = np.concatenate([normals, t[:, None, None] * normals], axis=-1)
    return rows[view.seen], right[view.seen]


@dataclass(frozen=True)
class Unknowns:
    """The vector of the optimiser: X, V, then kappa, spin, g and clocks as far as they are free."""

    kappa: float | None
    spin: str | Array
    g: float | None
    clocks: int = 0

    @property
    def blocks(self) -> dict[str, int]:
        """The parts of the vector that are free, and their sizes."""
        free_spin = SPINS[self.spin] if isinstance(self.spin, str) else 0
        sizes = {"X": 3, "V": 3, "kappa": int(self.kappa is None), "spin": free_spin}
        sizes |= {"g": int(self.g is None), "late": self.clocks}
        return {name: n for name, n in sizes.items() if n}

    def vector(self, ball: Ball) -> Array:
        """The unknowns of a ball whose cameras have one clock."""
        values = {"X": ball.X, "V": ball.V, "kappa": ball.kappa, "g": ball.g, "spin": ball.spin}
        values["late"] = 0.0
        if self.blocks.get("spin") == SPINS["across"]:
            values["spin"] = [side @ ball.spin for side in _sides(ball.V)]
        return np.concatenate(
            [np.full(n, values[name]) / SCALES[name] for name, n in self.blocks.items()]
        )

    def split(self, vectors: Array) -> dict[str, Array]:
        """Blocks (n, size) of vectors (n, k), in their units."""
        ends = np.cumsum(list(self.blocks.values()))[:-1]
        parts = zip(self.blocks, np.split(vectors, ends, axis=-1), strict=True)
        return {name: part * SCALES[name] for name, part in parts}

    def balls(self, vectors: Array) -> tuple[Array, Array, Array, Array, Array]:
        """X, V, kappa, spin, g of vectors (n, k)."""
        free = self.split(vectors)
        known = {"kappa": self.kappa, "g": self.g}
        kappa, g = (
            free[name][:, 0] if name in free else np.full(len(vectors), known[name])
            for name in ("kappa", "g")
        )
        return free["X"], free["V"], kappa, self.spins(free), g

    def spins(self, free: dict[str, Array]) -> Array:
        """Lambda (n, 3) for each vector."""
        if "spin" not in free:
            known = np.zeros(3) if isinstance(self.spin, str) else self.spin
            return np.broadcast_to(known, free["V"].shape)
        if self.spin == "full":
            return free["spin"]
        level, up = _sides(free["V"])
        return free["spin"][:, :1] * level + free["spin"][:, 1:] * up

    def ball(self, vector: Array) -> Ball:
        """The ball of one vector."""
        X, V, kappa, spin, g = self.balls(vector[None])
        return Ball(X[0], V[0], kappa[0], spin[0], g[0])


def _sides(V: Array) -> tuple[Array, Array]:
    """Two unit vectors across velocities (..., 3) and each other, the first of them horizontal."""
    level = np.cross(V, [0, 0, 1.0])
    level /= np.linalg.norm(level, axis=-1, keepdims=True)
    return level, np.cross(level, V) / np.linalg.norm(V, axis=-1, keepdims=True)


@dataclass(frozen=True)
class Pixels:
    """What some views would show, as a function of the vector of the optimiser."""

    views: Sequence[View]
    unknowns: Unknowns

    @classmethod
    def of(
        cls, views: Sequence[View], kappa: float | None, spin: str | ArrayLike, g: float | None
    ) -> Pixels:
        """For these data; refuses what cannot be told from them."""
        if isinstance(spin, str) and spin not in SPINS:
            raise DataError(f"spin is {spin!r}; it must be one of {', '.join(SPINS)}, or known")
        spin = spin if isinstance(spin, str) else array("spin", spin, (3,))
        clocks = sum(view.late is None for view in views)
        model = cls(views, Unknowns(kappa, spin, g, clocks))
        if model.observed.size < (n := sum(model.unknowns.blocks.values())):
            raise DataError(f"{model.observed.size} pixels cannot tell {n} unknowns")
        return model

    @property
    def observed(self) -> Array:
        """Pixel coordinates (n,) of the photos that there are."""
        return np.concatenate([view.pixels[view.seen] for view in self.views])

    @property
    def times(self) -> Array:
        """All times of all clocks, in order."""
        return np.unique(np.concatenate([view.times for view in self.views]))

    def positions(self, vectors: Array) -> Array:
        """(k, times, 3) for vectors (k, unknowns)."""
        return flights(self.times, *self.unknowns.balls(vectors))[..., :3]

    def pixels(self, vectors: Array) -> Array:
        """(k, n) pixels that should have been observed."""
        balls = self.unknowns.balls(vectors)
        states, late = flights(self.times, *balls), self.late(vectors)
        shown = []
        for view, delay in zip(self.views, late, strict=True):
            at = states[:, np.searchsorted(self.times, view.times)]
            shown.append(view.image(_later(at, delay, *balls[2:]))[:, view.seen])
        return np.concatenate(shown, axis=1)

    def late(self, vectors: Array) -> list[Array]:
        """How late each view was taken, (k,), s."""
        free = iter(self.unknowns.split(vectors)["late"].T) if self.unknowns.clocks else iter(())
        known = np.zeros(len(vectors))
        return [next(free) if v.late is None else known + v.late for v in self.views]


def _later(states: Array, delay: Array, kappa: Array, spin: Array, g: Array) -> Array:
    """Positions (k, n, 3) a little after states (k, n, 6): x + v delay + a delay^2/2.

    What is left out is micrometres if the delay is ten milliseconds.
    """
    x, v = states[..., :3], states[..., 3:]
    if not delay.any():
        return x
    a = acceleration(v, kappa[:, None], spin[:, None], g[:, None])
    d = delay[:, None, None]
    return x + v * d + a * d**2 / 2
