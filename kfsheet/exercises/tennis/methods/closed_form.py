"""Equation (3.5): the flight with drag linearised to c_D |V| v, solved in closed form.

    x'' = B x' - g k,   B = A/m = -kappa |V| I + [lambda]x
    x(t) = X + m A^-1 g t - (e^(At/m) - I)(m^2 A^-2 g - m A^-1 V)            as printed
         = X + t phi1(Bt) V - t^2 phi2(Bt) g k                               the same, regular

with phi1(z) = (e^z - 1)/z and phi2(z) = (e^z - 1 - z)/z^2, which are entire: the second form needs
no inverse of A and holds at c_D = 0 and at Omega = 0 too. Since [lambda]x has the eigenvalues 0
and +-i |lambda|, a function of B is a function of two numbers.
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numpy.typing import ArrayLike

from kfsheet.exercises.tennis.methods.arguments import Array, array
from kfsheet.exercises.tennis.methods.dynamics import GRAVITY

COEFFICIENTS = [1 / factorial(n + 2) for n in reversed(range(18))]
"""Of phi2; these terms give it to rounding for |z| <= 1."""


def phi(z: ArrayLike) -> tuple[Array, Array]:
    """Entire functions phi1(z) = (e^z - 1)/z = 1 + z phi2(z) and phi2(z) = (e^z - 1 - z)/z^2.

    Parameters
    ----------
    z : array_like
        Real or complex; the functions are taken elementwise.
    """
    z = np.asarray(z)
    far = np.abs(z) > 1
    second = np.array(np.polyval(COEFFICIENTS, np.where(far, 0, z)))
    w = z[far]
    second[far] = (np.exp(w) - 1 - w) / w**2
    return 1 + z * second, second


def closed_form(
    times: ArrayLike,
    X: ArrayLike,
    V: ArrayLike,
    kappa: ArrayLike,
    spin: ArrayLike,
    g: ArrayLike = GRAVITY,
) -> Array:
    """Positions at times (n,), by (3.5) in its regular form, m.

    Parameters
    ----------
    times : array_like
        (n,), s.
    X, V : array_like
        (..., 3) positions in m and velocities in m/s at t = 0; one ball, or many at once.
    kappa : array_like
        (...) drag c_D/m, 1/m; it acts with the speed |V| of the start.
    spin : array_like
        (..., 3) lift lambda = c_L Omega/m, 1/s.
    g : array_like
        (...) gravity, m/s2.

    Returns
    -------
    ndarray
        (..., n, 3).

    Examples
    --------
    >>> closed_form([1], [0, 0, 0], [3, 0, 4.9], 0, [0, 0, 0]).tolist()
    [[3.0, 0.0, 0.0]]
    """
    times, X = array("times", times, (None,)), array("X", X, (3,))
    V, spin = array("V", V, (3,)), array("spin", spin, (3,))
    decay = array("kappa", kappa, ()) * np.linalg.norm(V, axis=-1)
    down = array("g", g, ())[..., None] * np.array([0, 0, 1.0])
    turn = np.linalg.norm(spin, axis=-1)
    axis = spin / np.where(turn > 0, turn, 1)[..., None]  # 0 without spin: all is across it
    real = np.multiply.outer(-decay, times)
    straight = phi(real)
    turning = phi(real + 1j * np.multiply.outer(turn, times))

    def apply(order: int, vector: Array) -> Array:
        """phi(Bt) of a vector: its part along the axis, and the part that turns around it."""
        along = (vector * axis).sum(axis=-1, keepdims=True) * axis
        turned = turning[order - 1][..., None]
        return (
            straight[order - 1][..., None] * along[..., None, :]
            + turned.real * (vector - along)[..., None, :]
            + turned.imag * np.cross(axis, vector)[..., None, :]
        )

    t = times[:, None]
    return X[..., None, :] + t * apply(1, V) - t**2 * apply(2, down)
