"""A simulated kick: the flight behind the photos, and the photos of a camera that errs.

The flight knows what the filter's model simplifies: drag f |V| V along the path, in fine steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.random import RandomState

PHOTOS = 16
PARTS = 10  # of a step; with them the path is right to a millionth of a metre


def flight(p: Mapping[str, float], photos: int = PHOTOS) -> tuple[list[float], list[float]]:
    """Where the ball is at every photo, x and z in m.

        dV/dt = -f |V| V - g

    Parameters
    ----------
    p : mapping
        Values of ``x_0, z_0, u_0, w_0`` (start), ``f`` (1/m), ``g`` and ``dt``.
    photos : int
        How many, the first at the start.
    """
    state = np.array([p["x_0"], p["z_0"], p["u_0"], p["w_0"]])
    path = [state]
    for _ in range(photos - 1):
        for _ in range(PARTS):
            state = _runge_kutta(state, p["dt"] / PARTS, p["f"], p["g"])
        path.append(state)
    x, z, _, _ = np.array(path).T
    return x.tolist(), z.tolist()


def _runge_kutta(state: np.ndarray, h: float, f: float, g: float) -> np.ndarray:
    def rate(s: np.ndarray) -> np.ndarray:
        u, w = s[2:]
        drag = f * hypot(u, w)
        return np.array([u, w, -drag * u, -drag * w - g])

    first = rate(state)
    second = rate(state + h / 2 * first)
    third = rate(state + h / 2 * second)
    return state + h / 6 * (first + 2 * second + 2 * third + rate(state + h * third))


def photographed(
    x: Sequence[float], z: Sequence[float], p: Mapping[str, float], dice: RandomState
) -> dict[str, list[float]]:
    """Pixels ``i`` and ``j`` of a flight, to a tenth.

    Parameters
    ----------
    x, z : sequence of float
        The flight, m.
    p : mapping
        Values of ``a``, ``j_0``, and what the camera really does: ``r_i``, ``r_j`` in px2.
    dice : RandomState
        Two standard-normal draws a photo are taken from it.
    """
    n_i, n_j = dice.normal(size=(2, len(x)))
    i = p["a"] * np.array(x) + p["r_i"] ** 0.5 * n_i
    j = p["j_0"] - p["a"] * np.array(z) + p["r_j"] ** 0.5 * n_j
    return {"i": i.round(1).tolist(), "j": j.round(1).tolist()}


def model_error(p: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """What one step of the model misses of x and z, m: from three true positions, h = 0 and p = 2.

    Neither photos nor analyses are in it; it is what the source's equations alone do wrong.
    """
    missed = []
    for path, gravity in zip(map(np.array, flight(p)), (0, p["g"]), strict=True):
        v = np.diff(path) / p["dt"]
        slower = p["f"] * np.abs(v) * v + gravity
        missed.append(-np.diff(v) * p["dt"] - slower[:-1] * p["dt"] ** 2)
    return missed[0], missed[1]


def tilted(
    x: Sequence[float], z: Sequence[float], degrees: float, camera: float
) -> tuple[np.ndarray, np.ndarray]:
    """A flight as a camera sees it whose picture plane is not the plane of the flight, m.

    The planes meet at the goal line; away from it the ball is farther from the camera, so all of
    it looks smaller.

    Parameters
    ----------
    x, z : sequence of float
        The flight, m.
    degrees : float
        Angle between both planes.
    camera : float
        Distance of the camera from the goal line, m; ``float("inf")`` for one far away.
    """
    way, height, angle = np.array(x), np.array(z), np.radians(degrees)
    smaller = 1 / (1 + way * np.sin(angle) / camera)
    return way * np.cos(angle) * smaller, height * smaller


def draw_kick(dice: RandomState, p: Mapping[str, float]) -> dict[str, list[float | None]]:
    """Another kick, simulated like the first one; one pixel of each kind is not observed."""
    x, z = flight(p)
    seen: dict[str, list[float | None]] = {**photographed(x, z, p, dice)}
    for pixels in seen.values():
        pixels[dice.randint(3, PHOTOS - 3)] = None
    return {**seen, "x_true": np.round(x, 6).tolist(), "z_true": np.round(z, 6).tolist()}
