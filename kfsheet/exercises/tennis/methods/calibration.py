"""Calibration (section 3.3): polynomials from pixels to ray angles, and when not to trust them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, array, number
from kfsheet.exercises.tennis.methods.cameras import ANGLE, FOCAL_LENGTH, PIXELS

CENTRE = PIXELS / 2
FARTHEST = 2.0
"""Leverage beyond which a polynomial is extrapolated: it errs more than a measurement would."""


@dataclass(frozen=True)
class Distortion:
    """Lens distortion after Brown and Conrady, of image coordinates over the focal length.

        x' = x (1 + k1 r^2 + k2 r^4) + 2 p1 x y + p2 (r^2 + 2 x^2)
        y' = y (1 + k1 r^2 + k2 r^4) + p1 (r^2 + 2 y^2) + 2 p2 x y

    Parameters
    ----------
    k1, k2 : float
        Radial; a negative k1 is a barrel.
    p1, p2 : float
        Tangential.
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    def __call__(self, image: Array) -> Array:
        """Distorted coordinates (..., 2) of undistorted ones."""
        x, y = image[..., 0], image[..., 1]
        r2 = x**2 + y**2
        radial = 1 + self.k1 * r2 + self.k2 * r2**2
        right = x * radial + 2 * self.p1 * x * y + self.p2 * (r2 + 2 * x**2)
        down = y * radial + self.p1 * (r2 + 2 * y**2) + 2 * self.p2 * x * y
        return np.stack([right, down], axis=-1)


PERFECT = Distortion()


def grid(n: int = 9, extent: float = 0.98) -> Array:
    """Ray angles (n*n, 2) of a square grid that fills ``extent`` of the visibility angle, rad."""
    if not isinstance(n, int) or n < 2:
        raise DataError(f"the grid has {n!r} points along a side; give a whole number from 2 up")
    side = np.linspace(-1, 1, n) * number("extent", extent, 0) * ANGLE / 2
    return np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)


def pixels_of(angles: ArrayLike, distortion: Distortion = PERFECT) -> Array:
    """Pixels (n, 2) at which rays of angles (n, 2) show, (alpha to the right, beta down)."""
    image = np.tan(array("angles", angles, (None, 2)))
    return CENTRE + FOCAL_LENGTH * distortion(image)


@dataclass(frozen=True)
class Calibration:
    """Polynomials of one degree, from pixels to both angles.

    Parameters
    ----------
    degree : int
        All monomials u^a v^b with a + b up to it.
    coefficients : ndarray
        (monomials, 2).
    fit_rms : float
        Root mean square residual of the points it was made from, rad.
    inverse : ndarray
        (monomials, monomials) inverse of the normal matrix, for the leverage.
    """

    degree: int
    coefficients: Array
    fit_rms: float
    inverse: Array

    def angles(self, pixels: ArrayLike) -> Array:
        """Ray angles (n, 2) of pixels (n, 2), rad."""
        return _monomials(pixels, self.degree) @ self.coefficients

    def rms(self, pixels: ArrayLike, angles: ArrayLike) -> float:
        """Root mean square error on points that were held out, rad."""
        return float(np.sqrt(np.mean((self.angles(pixels) - array("angles", angles, (2,))) ** 2)))

    def leverage(self, pixels: ArrayLike) -> Array:
        """Variance of the fitted angle at pixels (n, 2), in units of that of a measured one.

        At most 1 at the points of the fit; it grows without bound where none are near.
        """
        M = _monomials(pixels, self.degree)
        return np.einsum("ni,ij,nj->n", M, self.inverse, M)


def _monomials(pixels: ArrayLike, degree: int) -> Array:
    z = (array("pixels", pixels, (None, 2)) - CENTRE) / CENTRE  # powers of 500 lose digits
    powers = [(a, b) for a in range(degree + 1) for b in range(degree + 1 - a)]
    return np.stack([z[:, 0] ** a * z[:, 1] ** b for a, b in powers], axis=1)


def calibrate(pixels: ArrayLike, angles: ArrayLike, degree: int = 4) -> Calibration:
    """Least squares of polynomials through points of known angles.

    Parameters
    ----------
    pixels, angles : array_like
        (n, 2) each, px and rad.
    degree : int
        1 to 8; the report takes 4 "to be on the safe side".

    Raises
    ------
    DataError
        If there are fewer points than monomials, or they do not determine the polynomial: all on
        a line, say.
    """
    if not isinstance(degree, int) or not 1 <= degree <= 8:
        raise DataError(f"degree is {degree!r}; it must be a whole number from 1 to 8")
    M, angles = _monomials(pixels, degree), array("angles", angles, (len(pixels), 2))
    coefficients, _, rank, _ = np.linalg.lstsq(M, angles, rcond=1e-10)
    if rank < M.shape[1]:
        raise DataError(
            f"{len(M)} points cannot tell the {M.shape[1]} coefficients of degree {degree}; "
            "take more, and not all on a line"
        )
    rms = float(np.sqrt(np.mean((M @ coefficients - angles) ** 2)))
    return Calibration(degree, coefficients, rms, np.linalg.inv(M.T @ M))


def extrapolated(calibration: Calibration, n: int = 21) -> float:
    """Share of the image in which a calibration is extrapolated: detection of bad data.

    A small residual says nothing of where there were no points; the leverage does, and needs no
    further measurement. Above 2 the fitted angle errs 1.4 times as much as a measured one.

    Parameters
    ----------
    calibration : Calibration
        To be judged.
    n : int
        The image is looked at in n x n pixels.
    """
    side = np.linspace(0, PIXELS, n)
    image = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    return float(np.mean(calibration.leverage(image) > FARTHEST))


def suspicious(pixels: ArrayLike, angles: ArrayLike, degree: int = 4, limit: float = 5.0) -> Array:
    """Indices of points that the others contradict: a misread mark of the grid.

    Each residual is compared with its standard deviation, estimated from the other points.

    Parameters
    ----------
    pixels, angles, degree
        As for :func:`calibrate`.
    limit : float
        In standard deviations.
    """
    found = calibrate(pixels, angles, degree)
    h = found.leverage(pixels)[:, None]
    e = array("angles", angles, (None, 2)) - found.angles(pixels)
    free = len(h) - len(found.inverse)
    if free < 2:
        raise DataError(f"{len(h)} points are too few to judge one by the others; take more")
    rest = ((e**2).sum(axis=0) - e**2 / (1 - h)) / (free - 1)
    return np.flatnonzero((np.abs(e) > limit * np.sqrt(rest * (1 - h))).any(axis=1))
