"""Cameras: where to put them (section 3.2), what they see, and where two lines of sight meet."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, array, number

PIXELS, ANGLE = 500, 0.42
"""Resolution R in px and visibility angle alpha in rad of the report's camera."""
FOCAL_LENGTH = PIXELS / 2 / math.tan(ANGLE / 2)
"""Of an ideal pinhole that sees ``ANGLE`` on ``PIXELS``, px."""


@dataclass(frozen=True)
class Camera:
    """An ideal pinhole camera.

        u = centre + f (x - position).right / depth,   depth = (x - position).forward
        v = centre + f (x - position).down  / depth

    Parameters
    ----------
    position : tuple of 3 floats
        Of the pinhole, m.
    right, down, forward : tuple of 3 floats
        Unit vectors, orthogonal to each other.
    f, centre : float
        Focal length, and both pixels of the point straight ahead, px.

    Examples
    --------
    >>> from kfsheet.exercises.tennis.methods.cameras import looking_along_x1
    >>> looking_along_x1((0, 0, 0)).project([10, 0, 0]).tolist()
    [250.0, 250.0]
    """

    position: tuple[float, float, float]
    right: tuple[float, float, float]
    down: tuple[float, float, float]
    forward: tuple[float, float, float]
    f: float = FOCAL_LENGTH
    centre: float = PIXELS / 2

    def __post_init__(self) -> None:
        array("position", self.position, (3,))
        axes = array("right, down, forward", [self.right, self.down, self.forward], (3, 3))
        if not np.allclose(axes @ axes.T, np.eye(3), atol=1e-9):
            raise DataError(
                "right, down and forward must be unit vectors, orthogonal to each other"
            )
        number("f", self.f, 0)

    def frame(self, x: ArrayLike) -> Array:
        """Coordinates (right, down, depth) of points, (..., 3), m."""
        away = array("x", x, (3,), gaps=True) - np.array(self.position)
        return away @ np.array([self.right, self.down, self.forward]).T

    def project(self, x: ArrayLike) -> Array:
        """Pixels (u, v) of points, (..., 2).

        Raises
        ------
        DataError
            If a point does not lie in front of the camera.
        """
        if (self.frame(x)[..., 2] <= 0).any():
            raise DataError(f"a point lies behind the camera at {self.position}")
        return self.image(x)

    def image(self, x: ArrayLike) -> Array:
        """As :meth:`project`, for points behind the camera too: an optimiser may try some."""
        seen = self.frame(x)
        return self.centre + self.f * seen[..., :2] / seen[..., 2:]

    def rays(self, pixels: ArrayLike) -> Array:
        """Unit vectors, (..., 3), from the pinhole through pixels, (..., 2)."""
        image = (array("pixels", pixels, (2,), gaps=True) - self.centre) / self.f
        ahead = np.concatenate([image, np.ones((*image.shape[:-1], 1))], axis=-1)
        lines = ahead @ np.array([self.right, self.down, self.forward])
        return lines / np.linalg.norm(lines, axis=-1, keepdims=True)


def looking_along_x1(position: tuple[float, float, float]) -> Camera:
    """Camera 1: right is -x2, down is -x3."""
    return Camera(position, (0, -1, 0), (0, 0, -1), (1, 0, 0))


def looking_along_x2(position: tuple[float, float, float]) -> Camera:
    """Camera 2: right is +x1, down is -x3."""
    return Camera(position, (1, 0, 0), (0, 0, -1), (0, 1, 0))


def largest_distance(
    r: float = 0.035, R: float = PIXELS, alpha: float = ANGLE, p: float = 8
) -> float:
    """Distance d = 2 r R / (alpha p) at which a ball of radius r still covers p pixels, m.

    Parameters
    ----------
    r : float
        Radius of the ball, m.
    R, p : float
        Resolution and pixels needed across the ball.
    alpha : float
        Visibility angle, rad.

    Examples
    --------
    >>> round(largest_distance(), 4)
    10.4167
    """
    for name, value in (("r", r), ("R", R), ("alpha", alpha), ("p", p)):
        number(name, value, 0)
    return 2 * r * R / (alpha * p)


def error_diamond(
    theta: ArrayLike, m: float = 5.5, eps: float = ANGLE / PIXELS
) -> tuple[Array, Array]:
    """Diagonals of the diamond in which two lines of sight, each sure to a pixel, cross.

        H = 2 m sin(eps) / sin(2 theta - eps)
        V = m sin(eps) / (cos(theta) cos(theta - eps))

    Parameters
    ----------
    theta : array_like
        Angle between a line of sight and the line through both cameras, rad.
    m : float
        Half the distance of the cameras, m.
    eps : float
        Angle of a pixel, rad.

    Returns
    -------
    H, V : ndarray
        Along and across the line through the cameras, m.
    """
    theta = np.asarray(theta, float)
    number("m", m, 0), number("eps", eps, 0, np.pi / 2)
    if not ((theta > eps) & (theta < np.pi / 2)).all():
        raise DataError("theta must lie between eps and pi/2: the lines of sight must cross")
    horizontal = 2 * m * np.sin(eps) / np.sin(2 * theta - eps)
    return horizontal, m * np.sin(eps) / (np.cos(theta) * np.cos(theta - eps))


def best_angle(eps: float = ANGLE / PIXELS) -> float:
    """Angle theta at which the longer diagonal is shortest, rad: there H = V.

    H falls and V grows until 2 theta - eps = pi/2; they meet just before, where
    sin(z) - cos(z) = cos(eps) with z = 2 theta - eps.

    >>> round(float(np.degrees(best_angle())), 3)
    45.024
    """
    eps = number("eps", eps, 0, np.pi / 2)
    return eps / 2 + np.pi / 8 + np.arcsin(np.cos(eps) / np.sqrt(2)) / 2


def rms_error(theta: ArrayLike, m: float = 5.5, sigma: float = ANGLE / PIXELS) -> Array:
    """Root mean square error of the crossing, in the plane of the cameras, m.

    The cameras stand 2 m apart and err by sigma in angle, independently, each seeing the ball at
    the distance m / cos(theta):

        rms = sigma m / (sqrt(2) sin(theta) cos(theta)^2)

    Its minimum lies at sin(theta)^2 = 1/3: an apex of 109.5 degrees, not 90.
    """
    theta = np.asarray(theta, float)
    number("m", m, 0), number("sigma", sigma, 0)
    if not ((theta > 0) & (theta < np.pi / 2)).all():
        raise DataError("theta must lie between 0 and pi/2: the lines of sight must cross")
    return sigma * m / (np.sqrt(2) * np.sin(theta) * np.cos(theta) ** 2)


def best_apex(m: float = 5.5) -> float:
    """Angle between the lines of sight at which :func:`rms_error` is least, rad."""
    found = minimize_scalar(
        lambda theta: float(rms_error(theta, m)), (0.1, 0.6, 1.5), options={"xtol": 1e-10}
    )
    return np.pi - 2 * found.x


def triangulate(
    camera_1: Camera, pixels_1: ArrayLike, camera_2: Camera, pixels_2: ArrayLike
) -> tuple[Array, Array]:
    """Midpoint of the common perpendicular of two lines of sight, and its length, the gap.

    Parameters
    ----------
    camera_1, camera_2 : Camera
        Who sees.
    pixels_1, pixels_2 : array_like
        (..., 2) pixels; NaN is a photo that is missing.

    Returns
    -------
    x : ndarray
        (..., 3) points, m; NaN where a photo is missing.
    gap : ndarray
        (...) distances between the lines, m.

    Raises
    ------
    DataError
        If two lines of sight are parallel.
    """
    a, b = camera_1.rays(pixels_1), camera_2.rays(pixels_2)
    apart = np.array(camera_1.position, float) - np.array(camera_2.position, float)
    ab, aw, bw = (a * b).sum(-1), a @ apart, b @ apart
    spread = 1 - ab**2
    if (spread < 1e-12).any():
        raise DataError("two lines of sight are parallel; the depth is lost")
    near_1 = np.array(camera_1.position) + ((ab * bw - aw) / spread)[..., None] * a
    near_2 = np.array(camera_2.position) + ((bw - ab * aw) / spread)[..., None] * b
    return (near_1 + near_2) / 2, np.linalg.norm(near_1 - near_2, axis=-1)


def triangulate_weighted(
    camera_1: Camera,
    pixels_1: ArrayLike,
    camera_2: Camera,
    pixels_2: ArrayLike,
    sigma: tuple[float, float] = (1.0, 1.0),
) -> Array:
    """Point that minimises the squared distances to both lines, each over its error there.

    A line of sight errs by sigma_j times the distance to its camera, so that of the nearer
    camera counts more. Each line contributes (I - a a') / (sigma_j distance)^2 to the normal
    equations; the distances are those of the midpoint.

    Parameters
    ----------
    camera_1, pixels_1, camera_2, pixels_2
        As for :func:`triangulate`.
    sigma : tuple of 2 floats
        Angular errors of the cameras; only their ratio matters.

    Returns
    -------
    ndarray
        (..., 3) points, m; NaN where a photo is missing.
    """
    middle, _ = triangulate(camera_1, pixels_1, camera_2, pixels_2)
    N, right = np.zeros((*middle.shape, 3)), np.zeros(middle.shape)
    for camera, pixels, error in zip(
        (camera_1, camera_2), (pixels_1, pixels_2), sigma, strict=True
    ):
        number("sigma", error, 0)
        a, at = camera.rays(pixels), np.array(camera.position, float)
        across = np.eye(3) - a[..., :, None] * a[..., None, :]
        weight = 1 / (error * np.linalg.norm(middle - at, axis=-1)) ** 2
        N += weight[..., None, None] * across
        right += weight[..., None] * (across @ at)
    seen = np.isfinite(right).all(axis=-1)
    points = np.full(middle.shape, np.nan)
    points[seen] = np.linalg.solve(N[seen], right[seen][..., None])[..., 0]
    return points
