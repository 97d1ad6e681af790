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

from kfsheet.tennis.dynamics import GRAVITY
from kfsheet.tennis.inputs import Array, array, number

SERIES = 20  # terms that give phi to rounding for |z| <= 1


def phi(order: int, z: ArrayLike) -> Array:
    """Entire functions phi1(z) = (e^z - 1)/z and phi2(z) = (e^z - 1 - z)/z^2, elementwise.

    Parameters
    ----------
    order : {1, 2}
        Which of the two.
    z : array_like
        Complex.
    """
    z = np.asarray(z, complex)
    series = np.polyval([1 / factorial(n + order) for n in reversed(range(SERIES))], z)
    far = np.where(np.abs(z) > 1, z, 1)
    direct = (np.exp(far) - 1) / far if order == 1 else (np.exp(far) - 1 - far) / far**2
    return np.where(np.abs(z) > 1, direct, series)


def closed_form(
    times: ArrayLike,
    X: ArrayLike,
    V: ArrayLike,
    kappa: float,
    spin: ArrayLike,
    g: float = GRAVITY,
) -> Array:
    """Positions (n, 3) at times (n,), by (3.5) in its regular form, m.

    Parameters
    ----------
    times : array_like
        (n,), s.
    X, V : array_like
        (3,) position in m and velocity in m/s at t = 0.
    kappa : float
        Drag c_D/m, 1/m; it acts with the speed |V| of the start.
    spin : array_like
        (3,) lift lambda = c_L Omega/m, 1/s.
    g : float
        Gravity, m/s2.

    Examples
    --------
    >>> closed_form([1], [0, 0, 0], [3, 0, 4.9], 0, [0, 0, 0]).tolist()
    [[3.0, 0.0, 0.0]]
    """
    times, X = array("times", times, (None,)), array("X", X, (3,))
    V, spin = array("V", V, (3,)), array("spin", spin, (3,))
    decay = number("kappa", kappa) * np.linalg.norm(V)
    turn = np.linalg.norm(spin)
    axis = spin / turn if turn else np.array([1.0, 0, 0])
    down = np.array([0, 0, number("g", g)])

    def apply(order: int, vector: Array) -> Array:
        """phi(Bt) of a vector: its part along the axis, and the part that turns around it."""
        straight = phi(order, -decay * times).real
        turning = phi(order, (-decay + 1j * turn) * times)
        along = (vector @ axis) * axis
        across = vector - along
        return (
            straight[:, None] * along
            + turning.real[:, None] * across
            + turning.imag[:, None] * np.cross(axis, vector)
        )

    return X + times[:, None] * apply(1, V) - times[:, None] ** 2 * apply(2, down)
