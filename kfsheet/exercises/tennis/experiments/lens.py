"""A calibration that is used: photos through a distorted lens, straightened (section 3.3).

And the two lasers beside the lens, which tell where its axis points, wherever the camera stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, array, number
from kfsheet.exercises.tennis.methods.calibration import (
    Calibration,
    Distortion,
    calibrate,
    grid,
    pixels_of,
)
from kfsheet.exercises.tennis.methods.cameras import Camera
from kfsheet.exercises.tennis.methods.shots import SIGMA, Shot

BARREL = Distortion(-0.3, 0.1, 1e-3, -5e-4)
"""A lens whose corners are half a dozen pixels off."""


def through_lens(shot: Shot, lens: Distortion, seed: int, sigma: float = SIGMA) -> Shot:
    """The same flight, photographed through a distorted lens, in the same images.

    The draws are those of :func:`kfsheet.exercises.tennis.methods.shots.simulate`, so that
    differences are the lens's.
    """
    noise = sigma * np.random.RandomState(seed).standard_normal((2, len(shot.times), 2))
    photos = []
    for camera, old, error in zip(_cameras(shot), _photos(shot), noise, strict=True):
        image = (camera.project(shot.truth) - camera.centre) / camera.f
        photos.append(np.where(np.isfinite(old), camera.centre + camera.f * lens(image), np.nan))
        photos[-1] = photos[-1] + error
    return replace(shot, pixels_1=photos[0], pixels_2=photos[1])


def measured_calibration(
    lens: Distortion, degree: int, seed: int, n: int = 9, sigma: float = SIGMA
) -> Calibration:
    """Polynomials from a photo of n x n marks at known angles, whose pixels err by ``sigma``."""
    angles = grid(n)
    pixels = pixels_of(angles, lens)
    noise = sigma * np.random.RandomState(seed).standard_normal(pixels.shape)
    return calibrate(pixels + noise, angles, degree)


def straightened(shot: Shot, calibrations: Sequence[Calibration]) -> Shot:
    """The photos as ideal pinholes would have taken them: pixels to angles, angles to pixels."""
    photos = []
    for camera, old, known in zip(_cameras(shot), _photos(shot), calibrations, strict=True):
        seen = np.isfinite(old).all(axis=1)
        new = np.full(old.shape, np.nan)
        new[seen] = camera.centre + camera.f * np.tan(known.angles(old[seen]))
        photos.append(new)
    return replace(shot, pixels_1=photos[0], pixels_2=photos[1])


def _cameras(shot: Shot) -> tuple[Camera, Camera]:
    return shot.scene.camera_1, shot.scene.camera_2


def _photos(shot: Shot) -> tuple[Array, Array]:
    return shot.pixels_1, shot.pixels_2


def turned(camera: Camera, yaw: float, pitch: float, roll: float) -> Camera:
    """The camera as it really stands: turned to the right, then up, then about its axis, rad."""
    axes = np.array([camera.right, camera.down, camera.forward])
    for angle, (a, b) in ((yaw, (2, 0)), (pitch, (1, 2)), (roll, (0, 1))):
        turn = np.eye(3)
        turn[a, a] = turn[b, b] = np.cos(angle)
        turn[a, b], turn[b, a] = np.sin(angle), -np.sin(angle)
        axes = turn @ axes
    return replace(camera, **dict(zip(("right", "down", "forward"), map(tuple, axes), strict=True)))


def laser_spots(
    camera: Camera, wall: float = 15.0, half: float = 0.25, normal: ArrayLike | None = None
) -> Array:
    """Where two lasers, ``half`` above the lens and below it, parallel to its axis, meet a wall.

    Parameters
    ----------
    camera : Camera
        As it really stands.
    wall : float
        How far from the origin the wall stands, along its ``normal``, m.
    half : float
        Half the length of the bar that carries the lasers, m.
    normal : array_like, optional
        (3,) unit vector across the wall; by default axis 1 or 2, whichever the camera looks along.

    Returns
    -------
    ndarray
        (2, 3): the upper spot and the lower.
    """
    ahead, up = np.array(camera.forward), -np.array(camera.down)
    if normal is None:
        normal = np.eye(3)[np.argmax(np.abs(ahead))]
    normal = array("normal", normal, (3,))
    starts = np.array(camera.position) + np.outer([half, -half], up)
    reach = (wall - starts @ normal) / (ahead @ normal)
    if (reach <= 0).any():
        raise DataError("the lasers do not meet the wall: it must stand in front of the camera")
    return starts + reach[:, None] * ahead


def camera_from_spots(camera: Camera, spots: ArrayLike) -> Camera:
    """How a camera points, from its place and the two spots of its lasers, as measured.

    The lasers are parallel to the axis, on either side of it: whatever the wall, the axis goes
    through the middle of both spots, and what is left of their difference across it is up.

    Parameters
    ----------
    camera : Camera
        Its place, focal length and centre count; its axes are found anew.
    spots : array_like
        (2, 3) the upper spot and the lower, m.
    """
    upper, lower = array("spots", spots, (2, 3))
    ahead = (upper + lower) / 2 - np.array(camera.position)
    number("the way to the spots", float(np.linalg.norm(ahead)), 0)
    ahead /= np.linalg.norm(ahead)
    up = (upper - lower) - ((upper - lower) @ ahead) * ahead
    number("the distance of the spots", float(np.linalg.norm(up)), 0)
    up /= np.linalg.norm(up)
    right = np.cross(ahead, up)
    return replace(camera, right=tuple(right), down=tuple(-up), forward=tuple(ahead))
