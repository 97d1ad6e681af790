"""Fit (3.1) to the pixels themselves: recommendation (1) of section 3.5.4, taken literally.

No depth is invented for a photo that one camera alone took: each pixel is one equation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, array, number
from kfsheet.exercises.tennis.methods.dynamics import GRAVITY, MASS, TEXTBOOK_DRAG, Ball, flights
from kfsheet.exercises.tennis.methods.shots import SIGMA, Shot

SPINS = {"none": 0, "across": 2, "full": 3}
"""Free components of lambda: none; the two across V, as the report advises; all three."""
SCALES = {"X": 1.0, "V": 10.0, "kappa": 0.01, "spin": 0.1, "g": 1.0}  # make all of order 1
STEP = 1e-6  # of the derivatives, in those scales


@dataclass(frozen=True)
class Fit:
    """What a fit of pixels found.

    Parameters
    ----------
    ball : Ball
        The optimum.
    rms : float
        Root mean square of the residuals, px.
    sigma : dict
        Standard deviations that residuals of this size lead to: of ``X`` and ``V`` (3,), and of
        ``kappa``, ``spin`` and ``g`` as far as they were free.
    """

    ball: Ball
    rms: float
    sigma: dict[str, Array]


@dataclass(frozen=True)
class _Unknowns:
    """The vector of the optimiser: X, V, then kappa, spin and g as far as they are free."""

    kappa: float | None
    spin: str | Array
    g: float | None

    @property
    def blocks(self) -> dict[str, int]:
        free_spin = SPINS[self.spin] if isinstance(self.spin, str) else 0
        sizes = {"X": 3, "V": 3, "kappa": int(self.kappa is None), "spin": free_spin}
        return {name: n for name, n in {**sizes, "g": int(self.g is None)}.items() if n}

    def vector(self, ball: Ball) -> Array:
        values = {"X": ball.X, "V": ball.V, "kappa": ball.kappa, "g": ball.g, "spin": ball.spin}
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
        X, V, kappa, spin, g = self.balls(vector[None])
        return Ball(X[0], V[0], kappa[0], spin[0], g[0])


def _sides(V: Array) -> tuple[Array, Array]:
    """Two unit vectors across velocities (..., 3) and each other, the first of them horizontal."""
    level = np.cross(V, [0, 0, 1.0])
    level /= np.linalg.norm(level, axis=-1, keepdims=True)
    return level, np.cross(level, V) / np.linalg.norm(V, axis=-1, keepdims=True)


@dataclass(frozen=True)
class _Model:
    """What a shot would show, as a function of the vector of the optimiser."""

    shot: Shot
    unknowns: _Unknowns

    @classmethod
    def of(cls, shot: Shot, kappa: float | None, spin: str | ArrayLike, g: float | None) -> _Model:
        if isinstance(spin, str) and spin not in SPINS:
            raise DataError(f"spin is {spin!r}; it must be one of {', '.join(SPINS)}, or known")
        spin = spin if isinstance(spin, str) else array("spin", spin, (3,))
        model = cls(shot, _Unknowns(kappa, spin, g))
        if model.observed.size < (n := sum(model.unknowns.blocks.values())):
            raise DataError(f"{model.observed.size} pixels cannot tell {n} unknowns")
        return model

    @property
    def observed(self) -> Array:
        """Pixel coordinates (n,) of the photos that there are."""
        both = np.stack([self.shot.pixels_1, self.shot.pixels_2])
        return both[np.isfinite(both)]

    def positions(self, vectors: Array) -> Array:
        """(k, images, 3) for vectors (k, unknowns)."""
        return flights(self.shot.times, *self.unknowns.balls(vectors))[..., :3]

    def pixels(self, vectors: Array) -> Array:
        """(k, n) pixels that should have been observed."""
        shot, x = self.shot, self.positions(vectors)
        cameras = (shot.scene.camera_1, shot.scene.camera_2)
        seen = np.isfinite(np.stack([shot.pixels_1, shot.pixels_2]))
        return np.stack([camera.image(x) for camera in cameras], axis=1)[:, seen]


def _derivative(function: Callable[[Array], Array], p: Array) -> Array:
    """Central differences (..., unknowns); all moved balls fly together, in one call."""
    step = STEP * np.eye(len(p))
    ahead, behind = np.split(function(np.concatenate([p + step, p - step])), 2)
    return np.moveaxis(ahead - behind, 0, -1) / (2 * STEP)


def start_from_overlap(shot: Shot) -> Ball:
    """A first guess: a parabola without spin through the triangulated points.

    Raises
    ------
    DataError
        If the cameras see the ball together in fewer than two images.
    """
    seen = shot.overlap
    if len(seen) < 2:
        raise DataError("both cameras must see the ball together in at least two images")
    t = shot.times[seen]
    straight = shot.triangulated()[seen] + np.outer(t**2, [0, 0, GRAVITY / 2])
    V, X = np.polyfit(t, straight, 1)
    return Ball(X, V, TEXTBOOK_DRAG / MASS)


def fit_pixels(
    shot: Shot,
    *,
    kappa: float | None = None,
    spin: str | ArrayLike = "full",
    g: float | None = GRAVITY,
    start: Ball | None = None,
) -> Fit:
    """Least squares of pixels minus the pixels of a ball that obeys (3.1).

    Parameters
    ----------
    shot : Shot
        The photos; missing ones are left out.
    kappa, g : float, optional
        Known drag c_D/m and gravity; None leaves them free.
    spin : {'full', 'across', 'none'} or array_like
        Which components of the spin are free: all, the two across V, none of a ball that has no
        spin; or the known spin lambda = c_L Omega/m, (3,).
    start : Ball, optional
        Where to begin; by default a parabola through the triangulated points.

    Raises
    ------
    DataError
        If there are fewer pixels than unknowns, or ``spin`` is another word.
    """
    model = _Model.of(shot, kappa, spin, g)
    p, observed = model.unknowns.vector(start or start_from_overlap(shot)), model.observed
    found = least_squares(
        lambda p: model.pixels(p[None])[0] - observed,
        p,
        lambda p: _derivative(model.pixels, p),
        method="lm",
        xtol=1e-12,
        ftol=1e-12,
    )
    rms = float(np.sqrt(np.mean(found.fun**2)))
    spread = rms * np.sqrt(np.diag(np.linalg.pinv(found.jac.T @ found.jac)))
    return Fit(model.unknowns.ball(found.x), rms, model.unknowns.split(spread))


def path_covariance(
    shot: Shot,
    ball: Ball,
    *,
    sigma: float = SIGMA,
    kappa: float | None = None,
    spin: str | ArrayLike = "full",
    g: float | None = GRAVITY,
) -> Array:
    """How well :func:`fit_pixels` can know the path, before any photo is taken.

        C = sigma^2 D (J'J)^-1 D',   J = d pixels / d unknowns,   D = d positions / d unknowns

    To first order no unbiased estimate does better (Cramer and Rao).

    Parameters
    ----------
    shot : Shot
        Cameras and times, and which photos there are; their values do not matter.
    ball : Ball
        The true flight, at which the derivatives are taken.
    sigma : float
        Error of a pixel coordinate, px.
    kappa, spin, g
        What is free and what is known, as for :func:`fit_pixels`.

    Returns
    -------
    ndarray
        (3, images, images): the covariance of each coordinate along the path, m2.

    Raises
    ------
    DataError
        As :func:`fit_pixels`.
    """
    model = _Model.of(shot, kappa, spin, g)
    p = model.unknowns.vector(ball)
    J, D = _derivative(model.pixels, p), _derivative(model.positions, p)
    inverse = number("sigma", sigma, 0) ** 2 * np.linalg.inv(J.T @ J)
    return np.einsum("ikp,pq,jkq->kij", D, inverse, D)
