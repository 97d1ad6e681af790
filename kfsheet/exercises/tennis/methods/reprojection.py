"""Fit (3.1) to the pixels themselves: recommendation (1) of section 3.5.4, taken literally.

No depth is invented for a photo that one camera alone took: each pixel is one equation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, number
from kfsheet.exercises.tennis.methods.dynamics import GRAVITY, MASS, TEXTBOOK_DRAG, Ball
from kfsheet.exercises.tennis.methods.shots import SIGMA, Shot
from kfsheet.exercises.tennis.methods.views import Pixels, View, start_from_lines, views_of

STEP = 1e-6  # of the derivatives, in the scales of the unknowns


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
        ``kappa``, ``spin``, ``g`` and ``late`` as far as they were free.
    late : ndarray
        How much later than their clocks say the views of unknown clock were taken, s.
    """

    ball: Ball
    rms: float
    sigma: dict[str, Array]
    late: Array = field(default_factory=lambda: np.zeros(0))


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
    Pixels.of(views_of(shot), kappa, spin, g)  # refuses before a start is looked for
    start = start or start_from_overlap(shot)
    return fit_views(views_of(shot), kappa=kappa, spin=spin, g=g, start=start)


def fit_views(
    views: Sequence[View],
    *,
    kappa: float | None = None,
    spin: str | ArrayLike = "full",
    g: float | None = GRAVITY,
    start: Ball | None = None,
) -> Fit:
    """As :func:`fit_pixels`, for any views: one camera or more, shadows, clocks of their own.

    Parameters
    ----------
    views : sequence of View
        A view whose ``late`` is None has a clock to be found: one unknown more.
    kappa, spin, g
        As for :func:`fit_pixels`.
    start : Ball, optional
        Where to begin; by default what the lines of sight say.

    Raises
    ------
    DataError
        As :func:`fit_pixels`.
    """
    model = Pixels.of(views, kappa, spin, g)
    p, observed = model.unknowns.vector(start or start_from_lines(views)), model.observed
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
    parts = model.unknowns.split(found.x)
    late = parts.get("late", np.zeros(0))
    return Fit(model.unknowns.ball(found.x), rms, model.unknowns.split(spread), late)


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
    views = views_of(shot)
    return views_covariance(views, ball, sigma=sigma, kappa=kappa, spin=spin, g=g)


def views_covariance(
    views: Sequence[View],
    ball: Ball,
    *,
    sigma: float = SIGMA,
    kappa: float | None = None,
    spin: str | ArrayLike = "full",
    g: float | None = GRAVITY,
) -> Array:
    """As :func:`path_covariance`, for :func:`fit_views`, at all times of all views."""
    model = Pixels.of(views, kappa, spin, g)
    p = model.unknowns.vector(ball)
    J, D = _derivative(model.pixels, p), _derivative(model.positions, p)
    inverse = number("sigma", sigma, 0) ** 2 * np.linalg.inv(J.T @ J)
    return np.einsum("ikp,pq,jkq->kij", D, inverse, D)


def leverage(
    views: Sequence[View],
    ball: Ball,
    *,
    kappa: float | None = None,
    spin: str | ArrayLike = "full",
    g: float | None = GRAVITY,
) -> Array:
    """What is left of an error of a pixel in the pixel that the fit shows there: (n,).

        diagonal of J (J'J)^-1 J'

    The errors of the others have their share in it too, but of *this* one only this is left. The
    sum is the number of unknowns: with n pixels, on average unknowns / n.
    """
    model = Pixels.of(views, kappa, spin, g)
    J = _derivative(model.pixels, model.unknowns.vector(ball))
    return np.einsum("np,pq,nq->n", J, np.linalg.inv(J.T @ J), J)
