"""The three fine tunings of section 3.6.4: other weights, first and later; spin and drag first."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from kfsheet.exercises.tennis.methods.arguments import Array
from kfsheet.exercises.tennis.methods.closed_form import closed_form
from kfsheet.exercises.tennis.methods.dynamics import GRAVITY, Ball
from kfsheet.exercises.tennis.methods.loop import (
    SCALE,
    derivative,
    first_estimate,
    positions_of,
    weights,
)
from kfsheet.exercises.tennis.methods.shots import SIGMA, Shot, simulate

STEP = 1e-3  # of a derivative, px


def point_errors(shot: Shot, sigma: float = SIGMA) -> Array:
    """Standard deviations (n, 3) of triangulated points; NaN where a photo is missing, m.

    A small change of each of the four pixels moves the midpoint; the squares add up.
    """
    exact, variance = simulate(shot, 0, sigma=1e-9), 0.0
    for camera in ("pixels_1", "pixels_2"):
        for way in np.eye(2):
            moved = replace(exact, **{camera: getattr(exact, camera) + STEP * way})
            variance = variance + ((moved.triangulated() - exact.triangulated()) / STEP) ** 2
    return sigma * np.sqrt(variance)


def weighted_first_estimate(shot: Shot, start: Ball | None = None) -> Ball:
    """Fine tuning 1: the first estimate, each coordinate of a point weighed by 1 over its error.

    Parameters
    ----------
    shot : Shot
        The photos.
    start : Ball, optional
        The drag, spin and gravity to reckon with, and where to begin; by default those of
        :func:`kfsheet.exercises.tennis.methods.loop.first_estimate`.
    """
    start = start or first_estimate(shot)
    seen, points = shot.overlap, shot.triangulated()
    error = point_errors(shot)[seen]

    def residuals(p: Array) -> Array:
        x = closed_form(shot.times[seen], p[:3], p[3:], start.kappa, start.spin, start.g)
        return ((x - points[seen]) / error).ravel()

    at = [*start.X, *start.V]
    found = least_squares(residuals, at, method="lm", x_scale=SCALE[:6]).x
    return replace(start, X=found[:3], V=found[3:])


def equal_weights(shot: Shot, x: Array) -> Array:
    """All images alike."""
    return np.full(len(x), 1 / len(x))


def square_weights(shot: Shot, x: Array) -> Array:
    """Over the square of the distance, as an error that grows with it wants."""
    w = x[:, 0] ** -2.0
    return w / w.sum()


def overlap_weights(shot: Shot, x: Array) -> Array:
    """The report's, with a thousand times as much for the images that both cameras have."""
    w = weights(shot, x)
    w[shot.overlap] *= 1000
    return w / w.sum()


PROFILES = {
    "the report's": weights,
    "all alike": equal_weights,
    "1 / distance squared": square_weights,
    "overlap 1000 times": overlap_weights,
}
"""Fine tuning 2: weight profiles for the loop's fits."""


def from_camera_1(shot: Shot, g: float = GRAVITY) -> Ball:
    """Fine tuning 3: spin and drag by (3.5) from camera 1 alone, then the first estimate with them.

    Camera 1's pixels are fitted with gravity known, which fixes the scale; of what is found, spin
    and drag are kept, and X and V come from the overlap, as in section 3.6.1.
    """
    first, camera = first_estimate(shot, g), shot.scene.camera_1
    observed = shot.pixels_1

    def residuals(p: Array) -> Array:
        x = positions_of(shot.times, p, g).reshape(*p.shape[:-1], -1, 3)
        return (camera.image(x) - observed).reshape(*p.shape[:-1], -1)

    p = np.concatenate([first.X, first.V, first.spin, [first.kappa]]) / SCALE[:10]
    slopes = partial(derivative, residuals)
    q = least_squares(residuals, p, slopes, method="lm").x * SCALE[:10]
    known = Ball(first.X, first.V, q[9], q[6:9], g)
    return weighted_first_estimate(shot, known)
