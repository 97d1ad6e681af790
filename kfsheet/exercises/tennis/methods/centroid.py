"""The centre of intensity of a shaded ball (section 3.4), and what the report does about it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, array, number
from kfsheet.exercises.tennis.methods.cameras import Camera

SAMPLES = 8  # along a side of a pixel


def lambert_shift(phi: ArrayLike) -> Array:
    """Shift of the centre of intensity towards the light, over the radius of the ball.

        (3 pi/16) sin(phi) (1 + cos(phi)) / ((pi - phi) cos(phi) + sin(phi))

    Parameters
    ----------
    phi : array_like
        Between light and camera, seen from the ball: 0 is behind the camera, pi/2 from the side.

    Examples
    --------
    >>> round(float(lambert_shift(np.pi / 2)), 3)
    0.589
    """
    phi = np.asarray(phi, float)
    if not ((phi >= 0) & (phi < np.pi)).all():
        raise DataError("phi must lie from 0 to below pi; at pi the ball is dark")
    light = (np.pi - phi) * np.cos(phi) + np.sin(phi)
    return 3 * np.pi / 16 * np.sin(phi) * (1 + np.cos(phi)) / light


def render(
    shape: tuple[int, int],
    centre: tuple[float, float],
    radius: float,
    *,
    phi: float | None = None,
    ambient: float = 0.0,
    albedo: float = 1.0,
    wall: float = 0.0,
) -> Array:
    """Image of a ball before a wall.

    Parameters
    ----------
    shape : tuple of int
        Lines and pixels in a line.
    centre : tuple of float
        (i, j) of the ball, px; the middle of the first pixel is (0, 0).
    radius : float
        Of the ball, px.
    phi : float, optional
        Angle of a light to the right, rad; None for a ball that is lit uniformly.
    ambient, albedo, wall : float
        Light from everywhere, brightness of the ball, brightness of the wall.

    Returns
    -------
    ndarray
        (lines, pixels): the mean brightness of each pixel, by 8 x 8 samples of Lambert's law.
    """
    number("radius", radius, 0)
    fine = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    j, i = (np.add.outer(np.arange(n), fine).ravel() for n in shape)
    right = (i[None, :] - centre[0]) / radius
    depth = 1 - right**2 - ((j[:, None] - centre[1]) / radius) ** 2
    lit = np.ones_like(depth)
    if phi is not None:
        towards = right * np.sin(phi) + np.sqrt(np.maximum(depth, 0)) * np.cos(phi)
        lit = ambient + np.maximum(0, towards)
    image = np.where(depth > 0, albedo * lit, wall)
    return image.reshape(shape[0], SAMPLES, shape[1], SAMPLES).mean(axis=(1, 3))


def centroid(
    image: ArrayLike, background: ArrayLike = 0.0, threshold: float = 0.0, *, binary: bool = False
) -> Array:
    """Centre of intensity (i, j) of an image minus its background, px.

        (x, y) = sum w_ij (i, j) / sum w_ij,   w = |image - background| where above the threshold

    Parameters
    ----------
    image, background : array_like
        (lines, pixels); the background may be a number.
    threshold : float
        Smaller differences count as noise.
    binary : bool
        Whether every pixel that counts weighs the same: the centre of the silhouette.

    Raises
    ------
    DataError
        If nothing differs from the background.
    """
    image = array("image", image, (None, None))
    w = np.abs(image - np.asarray(background, float))
    w = np.where(w > number("threshold", threshold, -1), w, 0)
    w = (w > 0).astype(float) if binary else w
    if not w.any():
        raise DataError("nothing in the image differs from its background by the threshold")
    j, i = np.indices(image.shape)
    return np.array([(w * i).sum(), (w * j).sum()]) / w.sum()


def position_from_shadow(
    camera: Camera, ball: ArrayLike, shadow: ArrayLike, light: ArrayLike, floor: float = 0.0
) -> Array:
    """Where the ball is, from *one* camera that sees it and its shadow on the floor.

    The line of sight through the shadow meets the floor; from there the light's direction leads
    back to the ball. It meets the line of sight through the ball, but for errors: the midpoint of
    the common perpendicular.

    Parameters
    ----------
    camera : Camera
        Who sees both.
    ball, shadow : array_like
        (..., 2) pixels.
    light : array_like
        (3,) direction in which the light travels, downwards.
    floor : float
        Its height, m.

    Returns
    -------
    ndarray
        (..., 3), m.

    Raises
    ------
    DataError
        If a line of sight does not meet the floor, or the light does not travel down.
    """
    light = array("light", light, (3,))
    if light[2] >= 0:
        raise DataError(f"light is {light.tolist()}; it must travel down, with a negative x3")
    a, b, at = camera.rays(ball), camera.rays(shadow), np.array(camera.position, float)
    reach = (floor - at[2]) / b[..., 2]
    if (reach <= 0).any():
        raise DataError("a line of sight through the shadow does not meet the floor")
    spot = at + reach[..., None] * b
    back = np.broadcast_to(-light / np.linalg.norm(light), a.shape)
    ab, w = (a * back).sum(-1), at - spot
    aw, bw = (a * w).sum(-1), (back * w).sum(-1)
    spread = 1 - ab**2
    near_1 = at + ((ab * bw - aw) / spread)[..., None] * a
    near_2 = spot + ((bw - ab * aw) / spread)[..., None] * back
    return (near_1 + near_2) / 2
