"""The flight of the ball: equation (3.1), solved numerically, and the fit of (3.2) to points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from kfsheet.errors import DataError
from kfsheet.exercises.tennis.methods.arguments import Array, array, number

MASS, DIAMETER, GRAVITY = 0.058, 0.07, 9.8
"""Of the ball in kg and m, and of the place in m/s2."""
TEXTBOOK_DRAG = 0.22 * DIAMETER**2
"""C_D of a sphere, kg/m; section 3.6.1."""
AFTER, BEFORE = [1, 2, 0], [2, 0, 1]  # axes of a cross product


@dataclass(frozen=True)
class Ball:
    """Where a ball starts, and what moves it: the parameters of (3.1).

    Parameters
    ----------
    X, V : array_like
        Position in m and velocity in m/s at t = 0.
    kappa : float
        Drag c_D / m, 1/m.
    spin : array_like
        Lift lambda = c_L Omega / m, 1/s.
    g : float
        Gravity, m/s2.
    """

    X: Array
    V: Array
    kappa: float = 0.0
    spin: Array = (0.0, 0.0, 0.0)
    g: float = GRAVITY

    def __post_init__(self) -> None:
        for name in ("X", "V", "spin"):
            object.__setattr__(self, name, array(name, getattr(self, name), (3,)))
        for name in ("kappa", "g"):
            object.__setattr__(self, name, number(name, getattr(self, name)))

    @property
    def c_D(self) -> float:
        """Drag coefficient of the report, kg/m."""
        return self.kappa * MASS

    def fly(self, times: ArrayLike) -> Array:
        """Positions (n, 3) at times (n,), by (3.1); see :func:`flights`."""
        return flights(times, self.X[None], self.V[None], self.kappa, self.spin, self.g)[0, :, :3]

    def state(self, time: float) -> Ball:
        """The same ball at a later (or earlier) time, as a start."""
        time = number("time", time)
        if time == 0:
            return self
        x = flights([time], self.X[None], self.V[None], self.kappa, self.spin, self.g)[0, 0]
        return replace(self, X=x[:3], V=x[3:])

    def scaled(self, s: float, camera: ArrayLike) -> Ball:
        """The ball that a camera at ``camera`` cannot tell from this one: all lengths s times.

        V -> s V, g -> s g, c_D -> c_D/s; the spin stays. The scale gauge.
        """
        s, at = number("s", s, 0), array("camera", camera, (3,))
        return Ball(at + s * (self.X - at), s * self.V, self.kappa / s, self.spin, s * self.g)


def acceleration(v: ArrayLike, kappa: ArrayLike, spin: ArrayLike, g: ArrayLike) -> Array:
    """Right-hand side of (3.1) over m.

        dv/dt = -kappa |v| v + lambda x v - g k

    Parameters
    ----------
    v : array_like
        (..., 3) velocities, m/s.
    kappa, g : array_like
        Drag c_D/m in 1/m and gravity in m/s2; a number, or one for each velocity.
    spin : array_like
        Lambda = c_L Omega/m in 1/s, (3,) or (..., 3).
    """
    v, spin = array("v", v, (3,)), array("spin", spin, (3,))
    return _push(v, array("kappa", kappa, ()), spin, array("g", g, ()))


def _push(v: Array, kappa: Array, spin: Array, g: Array) -> Array:
    """As :func:`acceleration`, without a look at the arguments: a solver calls it often."""
    speed = np.sqrt((v * v).sum(axis=-1))
    # The cross product in full: np.cross would take most of the time of a fit.
    a = spin[..., AFTER] * v[..., BEFORE] - spin[..., BEFORE] * v[..., AFTER]
    a -= (kappa * speed)[..., None] * v
    a[..., 2] -= g
    return a


def flights(
    times: ArrayLike,
    X: ArrayLike,
    V: ArrayLike,
    kappa: ArrayLike,
    spin: ArrayLike,
    g: ArrayLike = GRAVITY,
) -> Array:
    """Solve (3.1) for several balls at once, with an error below a nanometre.

    Parameters
    ----------
    times : array_like
        (n,) seconds since the start, rising (or all falling below 0: backwards).
    X, V : array_like
        (p, 3) starts, m and m/s.
    kappa, spin, g : array_like
        As for :func:`acceleration`.

    Returns
    -------
    ndarray
        (p, n, 6): positions and velocities.

    Raises
    ------
    DataError
        If the times do not rise, or a shape does not fit.
    """
    times = np.atleast_1d(array("times", times, (None,)))
    X, V = array("X", X, (None, 3)), array("V", V, (None, 3))
    kappa, spin, g = array("kappa", kappa, ()), array("spin", spin, (3,)), array("g", g, ())
    way = np.sign(times[-1])
    if (np.diff(times) * way <= 0).any() or times[0] * way < 0 or len(X) != len(V):
        raise DataError("times must move away from 0 in order, and X and V have as many rows")
    if times[-1] == 0:
        return np.concatenate([X, V], axis=-1)[:, None]

    def rate(_: float, y: Array) -> Array:
        v = y.reshape(len(X), 6)[:, 3:]
        return np.concatenate([v, _push(v, kappa, spin, g)], axis=-1).ravel()

    start = np.concatenate([X, V], axis=-1).ravel()
    found = solve_ivp(rate, (0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-10, atol=1e-10)
    return found.y.T.reshape(len(times), len(X), 6).transpose(1, 0, 2)


def impact(ball: Ball, ground: float = DIAMETER / 2, longest: float = 60.0) -> tuple[float, Array]:
    """When and where the ball comes down on ``ground``, by (3.1).

    Parameters
    ----------
    ball : Ball
        From its start on.
    ground : float
        Height of its centre then, m.
    longest : float
        When to give up, s.

    Returns
    -------
    time : float
        Seconds after the start.
    x : ndarray
        (3,) position, m.

    Raises
    ------
    DataError
        If it does not come down within ``longest``.
    """
    number("ground", ground), number("longest", longest, 0)

    def height(_: float, y: Array) -> float:
        return y[2] - ground

    def rate(_: float, y: Array) -> Array:
        return np.concatenate([y[3:], _push(y[3:], ball.kappa, ball.spin, ball.g)])

    height.terminal, height.direction = True, -1
    start = np.concatenate([ball.X, ball.V])
    found = solve_ivp(rate, (0, longest), start, "DOP853", events=height, rtol=1e-10, atol=1e-10)
    if not found.t_events[0].size:
        raise DataError(f"the ball does not come down to {ground:g} m within {longest:g} s")
    return float(found.t_events[0][0]), found.y_events[0][0][:3]


@dataclass(frozen=True)
class NineQuantities:
    """What the quadratic (3.2) tells: X, V, c_D and c_L Omega x V, list (3.3).

    ``across`` is lambda x V = c_L Omega x V / m in m/s2; it is orthogonal to V, so the nine numbers
    say two things about the spin, and nothing about its part along V.
    """

    X: Array
    V: Array
    kappa: float
    across: Array

    @property
    def spin(self) -> Array:
        """The shortest lambda with lambda x V = across, 1/s."""
        return np.cross(self.V, self.across) / (self.V @ self.V)


def nine_quantities(times: ArrayLike, x: ArrayLike, g: float = GRAVITY) -> NineQuantities:
    """Fit (3.2) to points and take the coefficients apart; section 3.5.2.

        x = X + V t + A t^2/2,   A + g k = -kappa |V| V + lambda x V

    Both parts of A + g k are told apart by their direction: along V, and across it.

    Parameters
    ----------
    times : array_like
        (n,), s.
    x : array_like
        (n, 3) points, m, at least three.
    g : float
        Gravity, known, m/s2.
    """
    times, x = array("times", times, (None,)), array("x", x, (None, 3))
    if len(times) != len(x) or len(np.unique(times)) < 3:
        raise DataError(f"a quadratic needs points at three times; there are {len(times)} times")
    powers = np.stack([np.ones_like(times), times, times**2 / 2], axis=1)
    X, V, A = np.linalg.lstsq(powers, x, rcond=None)[0]
    push = A + np.array([0, 0, number("g", g)])
    along = push @ V / (V @ V)
    return NineQuantities(X, V, -along / np.linalg.norm(V), push - along * V)
