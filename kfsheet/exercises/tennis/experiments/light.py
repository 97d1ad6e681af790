"""Light of two colours, motion blur, and how far away a centroid is still good (section 3.4)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, number
from kfsheet.exercises.tennis.methods.cameras import Camera
from kfsheet.exercises.tennis.methods.centroid import centroid, lambert_shift, render
from kfsheet.exercises.tennis.methods.dynamics import Ball

OWN, OTHER = np.radians(10), np.pi / 2
"""Angles from a camera to its own light, above it, and to the light of the other camera, rad."""
MARGIN = 2  # of an image around the ball, px


def lambert_light(phi: ArrayLike) -> Array:
    """Light that a camera gets from a ball that is lit from phi, up to a factor: 3.14 at 0."""
    phi = np.asarray(phi, float)
    return (np.pi - phi) * np.cos(phi) + np.sin(phi)


def two_lights(leak: ArrayLike, own: float = OWN, other: float = OTHER) -> Array:
    """Shift of the centre of intensity if the filter lets through a share of the other light.

    Intensities add up, so the shift is the mean of both, weighted by their light.

    Parameters
    ----------
    leak : array_like
        Share of the other camera's light that passes the filter: 1 without filters, 0 at best.
    own, other : float
        Angles from the camera to its own light and to the other's, rad.

    Returns
    -------
    ndarray
        (..., 2) towards the other light and towards the own, in radii of the ball.
    """
    leak = np.asarray(leak, float)
    if not ((leak >= 0) & (leak <= 1)).all():
        raise DataError("leak is a share, from 0 to 1")
    mine, theirs = lambert_light(own), leak * lambert_light(other)
    towards = np.stack([theirs * lambert_shift(other), mine * lambert_shift(own) + 0 * leak], -1)
    return towards / (mine + theirs)[..., None]


def two_lights_rendered(leak: float, radius: float = 10, own: float = OWN) -> Array:
    """As :func:`two_lights`, by rendering: the other light to the right, the own one above."""
    n = int(2 * radius) + 10
    middle = ((n - 1) / 2, (n - 1) / 2)
    other = render((n, n), middle, radius, phi=OTHER)
    # A light to the right becomes one below when lines and pixels change places, then one above.
    mine = render((n, n), middle, radius, phi=own).T[::-1]
    return (centroid(mine + leak * other) - middle) / radius * [1, -1]


def pixel_velocity(camera: Camera, ball: Ball, time: float, h: float = 1e-4) -> Array:
    """How fast a ball moves through an image, (2,), px/s."""
    x = ball.state(time)
    ahead, behind = (camera.project(x.state(way * h).X) for way in (1, -1))
    return (ahead - behind) / (2 * h)


def blur_shift(camera: Camera, ball: Ball, time: float, exposure: float) -> tuple[Array, Array]:
    """How far the centre of intensity of a streak lies from the ball, px.

    The ball shines all through the exposure, so the centre is the mean of where it was seen.

    Parameters
    ----------
    camera, ball : Camera, Ball
        Who sees whom.
    time, exposure : float
        When the exposure begins, and how long it lasts, s.

    Returns
    -------
    from_begin, from_middle : ndarray
        (2,) each: from where the ball was when the exposure began, and in its middle.
    """
    number("exposure", exposure, 0)
    nodes, weights = np.polynomial.legendre.leggauss(5)
    start = ball.state(time)
    seen = camera.project(start.fly(exposure * np.array([*(1 + nodes) / 2])))
    mean = weights @ seen / 2
    return mean - camera.project(start.X), mean - seen[2]  # the third node is the middle


def streak(radius: float, path: ArrayLike, phases: int = 64, **light: float) -> tuple[Array, Array]:
    """Image of a ball that moved by ``path`` pixels, (2,), during the exposure, and where it was.

    Returns
    -------
    image : ndarray
        (lines, pixels).
    middle : ndarray
        (2,) of the ball in the middle of the exposure, px.
    """
    path = np.asarray(path, float)
    size = np.ceil(np.abs(path) + 2 * radius + 2 * MARGIN).astype(int)
    middle = (size - 1) / 2
    share = (np.arange(phases) + 0.5) / phases - 0.5
    images = [render(tuple(size[::-1]), tuple(middle + s * path), radius, **light) for s in share]
    return np.mean(images, axis=0), middle


def centroid_scatter(radius: float, noise: float, draws: int = 200, seed: int = 0) -> float:
    """How much the centroid of a ball scatters if every pixel's brightness errs, px.

    The ball has the brightness 1; the window is cut to the ball, at another place each time. To
    first order the scatter is noise / (2 sqrt(pi)), whatever the radius: more pixels err, but each
    counts less.

    Parameters
    ----------
    radius, noise : float
        Of the ball, px; standard deviation of a pixel's brightness.
    """
    dice = np.random.RandomState(seed)
    n = int(np.ceil(2 * radius)) + 4
    errors = []
    for _ in range(draws):
        middle = (n - 1) / 2 + dice.uniform(-0.5, 0.5, 2)
        inside = render((n, n), tuple(middle), radius)
        image = inside + noise * (inside > 0.5) * dice.standard_normal((n, n))
        errors.append(centroid(image, threshold=-0.5) - middle)
    return float(np.sqrt(np.mean(np.square(errors))))
