"""The iterative method of section 3.6, as the report prints it: depths invented, then believed.

First a flight without spin through the triangulated points. Then, again and again: move each
computed position to the nearest point that agrees with the photos
(:mod:`kfsheet.exercises.tennis.methods.cones`), and fit the closed form (3.5) to those points, with
weights, in eleven parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, number
from kfsheet.exercises.tennis.methods.closed_form import closed_form
from kfsheet.exercises.tennis.methods.cones import Cones, project_on_both
from kfsheet.exercises.tennis.methods.dynamics import GRAVITY, MASS, TEXTBOOK_DRAG, Ball
from kfsheet.exercises.tennis.methods.shots import Shot

SCALE = np.array([1, 1, 1, 10, 10, 10, 0.1, 0.1, 0.1, 0.01, 10])
"""Size of X, V, lambda, c_D/m and g, to make the parameters of the fit of order 1."""
STEP, THIN = 1e-5, 1e-9  # of derivatives, in those sizes; and of a cone that is a ray, px


@dataclass(frozen=True)
class Iteration:
    """One turn of the loop.

    Parameters
    ----------
    n : int
        Number of the turn; 0 is the first estimate.
    ball : Ball
        Parameters that the fit found.
    x : ndarray
        (images, 3) positions of the fit, m.
    pseudo : ndarray
        The same, moved into the error cones: what the next turn believes.
    moved : float
        Root mean square change of ``x`` since the turn before, m.
    """

    n: int
    ball: Ball
    x: Array
    pseudo: Array
    moved: float


@dataclass(frozen=True)
class Loop:
    """What the loop did, and why it stopped: 'g', 'stable' or 'limit'."""

    turns: list[Iteration]
    reason: str

    @property
    def last(self) -> Iteration:
        """The last turn."""
        return self.turns[-1]


def into_cones(shot: Shot, x: Array, radius: float) -> Array:
    """Positions (images, 3), each moved to the nearest that lies in the error cones of its photos.

    Parameters
    ----------
    shot : Shot
        The photos.
    x : ndarray
        (images, 3), m.
    radius : float
        Of the cones, px.
    """
    scene = shot.scene
    one = Cones.of(scene.camera_1, shot.pixels_1, radius)
    two = Cones.of(scene.camera_2, shot.pixels_2, radius)
    return project_on_both(one, two, x)


def weights(shot: Shot, x: Array) -> Array:
    """The report's weights (images,), which sum up to 1.

    C_2/2 before the overlap, C_2 in it, and C_2 x1(b)/x1(k) in the images k after it, of which b
    is the first.
    """
    first, last = shot.overlap[[0, -1]]
    w = np.ones(len(x))
    w[:first] = 0.5
    if last + 1 < len(x):
        w[last + 1 :] = x[last + 1, 0] / x[last + 1 :, 0]
    return w / w.sum()


def first_estimate(shot: Shot, g: float = GRAVITY) -> Ball:
    """Section 3.6.1: X and V of (3.5) without spin, with the textbook's drag, from the overlap.

    Raises
    ------
    DataError
        If there are fewer than three triangulated points.
    """
    seen, points = shot.overlap, shot.triangulated()
    if len(seen) < 3:
        raise DataError("the loop begins with triangulated points, and needs at least three")
    kappa = TEXTBOOK_DRAG / MASS

    def residuals(p: Array) -> Array:
        x = closed_form(shot.times[seen], p[:3], p[3:], kappa, np.zeros(3), g)
        return (x - points[seen]).ravel()

    slope, level = np.polyfit(shot.times[seen], points[seen], 1)
    found = least_squares(residuals, [*level, *slope], method="lm", x_scale=SCALE[:6])
    return Ball(found.x[:3], found.x[3:], kappa, np.zeros(3), g)


def _vector(ball: Ball, fit_g: bool) -> Array:
    vector = np.concatenate([ball.X, ball.V, ball.spin, [ball.kappa, ball.g]]) / SCALE
    return vector if fit_g else vector[:-1]


def positions_of(times: Array, vectors: Array, known_g: float) -> Array:
    """(3.5) for vectors of scaled parameters: (..., 3n), image by image.

    Vectors (..., 11) end with g; vectors (..., 10) leave it out, and ``known_g`` holds.
    """
    p = vectors * SCALE[: vectors.shape[-1]]
    g = p[..., 10] if p.shape[-1] == len(SCALE) else known_g
    x = closed_form(times, p[..., :3], p[..., 3:6], p[..., 9], p[..., 6:9], g)
    return x.reshape(*p.shape[:-1], -1)


def derivative(function: Callable[[Array], Array], p: Array) -> Array:
    """Central differences of a function that takes many vectors at once."""
    step = STEP * np.eye(len(p))
    ahead, behind = np.split(function(np.concatenate([p + step, p - step])), 2)
    return (ahead - behind).T / (2 * STEP)


def fit_closed_form(times: Array, x: Array, w: Array, start: Ball, *, fit_g: bool = True) -> Ball:
    """Weighted least squares of (3.5) in eleven parameters: X, V, lambda, c_D/m and g.

    Parameters
    ----------
    times, x, w : ndarray
        (n,), (n, 3) and (n,): the sum of w |x - (3.5)|^2 is made least.
    start : Ball
        Where to begin.
    fit_g : bool
        Whether g is free; otherwise it stays that of ``start``.
    """
    root = np.repeat(np.sqrt(w), 3)

    def residuals(p: Array) -> Array:
        return (positions_of(times, p, start.g) - x.ravel()) * root

    def jacobian(p: Array) -> Array:
        return derivative(lambda many: positions_of(times, many, start.g), p) * root[:, None]

    p = _vector(start, fit_g)
    p = least_squares(residuals, p, jacobian, method="lm", xtol=1e-12, ftol=1e-12).x
    p = p * SCALE[: len(p)]
    return Ball(p[:3], p[3:6], p[9], p[6:9], p[10] if fit_g else start.g)


def iterate(
    shot: Shot,
    *,
    radius: float = 0.6,
    g: float = GRAVITY,
    start: Ball | None = None,
    weigh: Callable[[Shot, Array], Array] = weights,
    fit_g: bool = True,
    limit: int = 20,
    g_tolerance: float = 0.0,
    stable: float = 0.0,
) -> Loop:
    """Run the loop of section 3.6.

    Parameters
    ----------
    shot : Shot
        The photos.
    radius : float
        Of the error cones, px.
    g : float
        Gravity of the first estimate, m/s2; afterwards it is fitted.
    start : Ball, optional
        Another first estimate; by default that of section 3.6.1.
    weigh : callable
        What :func:`weights` are to be replaced by, with the same arguments.
    fit_g : bool
        False keeps ``g`` as it is, in all turns: the report's loop without its freedom of scale.
    limit : int
        Largest number of turns.
    g_tolerance : float
        Stop when the fitted g is that near to 9.8, m/s2; section 3.6.3.
    stable : float
        Stop when the positions move by less, root mean square, m.

    Raises
    ------
    DataError
        If an argument is out of range, or the error cones of an image do not meet.
    """
    if not isinstance(limit, int) or limit < 1:
        raise DataError(f"limit is {limit!r}; give a whole number of turns from 1 up")
    number("g_tolerance", g_tolerance, -1), number("stable", stable, -1)
    ball, turns, reason = start or first_estimate(shot, g), [], "limit"
    for n in range(limit + 1):
        if turns:
            believed = turns[-1].pseudo
            ball = fit_closed_form(shot.times, believed, weigh(shot, believed), ball, fit_g=fit_g)
        x = closed_form(shot.times, ball.X, ball.V, ball.kappa, ball.spin, ball.g)
        moved = np.sqrt(np.mean((x - turns[-1].x) ** 2)) if turns else np.inf
        turns.append(Iteration(n, ball, x, into_cones(shot, x, radius), float(moved)))
        if n and abs(ball.g - GRAVITY) < g_tolerance:
            reason = "g"
        elif moved < stable:
            reason = "stable"
        if reason != "limit":
            break
    return Loop(turns, reason)


def modes(shot: Shot, ball: Ball, *, fit_g: bool = True) -> Array:
    """What is left, after one turn, of a small change of the parameters: the eigenvalues.

    A fit of pseudo-positions y to (3.5) with the Jacobian J turns a change dy into
    dp = (J'WJ)^-1 J'W dy, and a change dp moves the pseudo-positions by D dp. Cones as thin as
    rays are the best case: within a cone a point stays where it is, and nothing is corrected.

    Parameters
    ----------
    shot : Shot
        The photos.
    ball : Ball
        Where the loop has settled.
    fit_g : bool
        Whether g is free, as for :func:`fit_closed_form`.

    Returns
    -------
    ndarray
        (11,) moduli, or (10,) without g, of the eigenvalues of (J'WJ)^-1 J'W D, the largest first;
        the loop forgets a mode the faster, the smaller it is, and one of 1 never.
    """
    values = np.linalg.eigvals(_turn(shot, ball, fit_g)[1])
    return np.sort(np.abs(values))[::-1]


def slowest_mode(shot: Shot, ball: Ball, *, fit_g: bool = True) -> Array:
    """How the flight moves in the mode that the loop forgets last; arguments as for :func:`modes`.

    Returns
    -------
    ndarray
        (images, 3) of movements, where the last x1 moves by 1.
    """
    J, turn = _turn(shot, ball, fit_g)
    values, vectors = np.linalg.eig(turn)
    path = (J @ vectors[:, np.argmax(np.abs(values))].real).reshape(-1, 3)
    return path / path[-1, 0]


def _turn(shot: Shot, ball: Ball, fit_g: bool) -> tuple[Array, Array]:
    """The Jacobian J of (3.5) in the scaled parameters, and what a turn makes of a change."""
    rays = Cones.of(shot.scene.camera_1, shot.pixels_1, THIN)
    both, seen = shot.overlap, shot.triangulated()

    def positions(vectors: Array) -> Array:
        return positions_of(shot.times, vectors, ball.g)

    def believed(vectors: Array) -> Array:
        x = positions(vectors).reshape(len(vectors), -1, 3)
        moved = np.stack([rays.project(one) for one in x])
        moved[:, both] = seen[both]
        return moved.reshape(len(x), -1)

    p = _vector(ball, fit_g)
    root = np.repeat(np.sqrt(weights(shot, positions(p).reshape(-1, 3))), 3)[:, None]
    J, D = derivative(positions, p), derivative(believed, p)
    return J, np.linalg.lstsq(J * root, D * root, rcond=None)[0]
