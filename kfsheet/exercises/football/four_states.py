"""The football as it would be filtered today: velocity in the state, a covariance that evolves.

    dV/dt = -f |V| V - g

A step takes half of gravity, then all of the drag, then the other half of gravity; drag alone has
the solution V/(1 + f |V| dt). A photo of x then corrects u too, since their errors are correlated.
"""

from __future__ import annotations

from sympy import Expr, Matrix, Symbol, diag, sqrt

from kfsheet.estimation.algebra import discrete_noise
from kfsheet.estimation.kalman import add_filter
from kfsheet.estimation.state_space import Intermediate, Observation, State, StateSpace
from kfsheet.model.expressions import RMS, Mean, t
from kfsheet.model.recurrence import Recurrence

PAGE = "Four states"


def add_four_states(m: Recurrence) -> None:
    """The worksheet "Four states": an extended Kalman filter of x, z, u, w, and its errors."""
    add_filter(m, four_states(m), section=PAGE, suffix="_ekf")
    for axis in "xz":
        e, low, high = m.columns(f"e_{axis}_ekf", f"{axis}_low", f"{axis}_high", section=PAGE)
        claimed = sqrt(m[f"P_{axis}{axis}_a_ekf"][t])
        error = m[f"{axis}_a_ekf"][t] - m[f"{axis}_true"][t]
        m.define(e[t], error, "m", f"error of {axis}, four states")
        m.define(low[t], -2 * claimed, "m", f"band of the error of {axis}: -2 sigma, as claimed")
        m.define(high[t], 2 * claimed, "m", f"band of the error of {axis}: +2 sigma, as claimed")
        m.summary(f"rms_{axis}_ekf", RMS(e), "m", f"rms error of {axis}, four states")
    m.summary("mean_NIS", Mean(m["NIS_ekf"]), "", "four states: mean NIS; theory: 2")


def four_states(m: Recurrence) -> StateSpace:
    """State, transition, noise and camera of the football with its velocity in the state.

    Parameters
    ----------
    m : Recurrence
        It has the parameters and the photos.
    """
    dt, g, f, a, j_0 = m["dt", "g", "f", "a", "j_0"]
    x, z, u, w, V, slow = (Symbol(name, real=True) for name in ("x", "z", "u", "w", "V", "slow"))
    w_half = w - g * dt / 2
    u_new, w_new = u * slow, w_half * slow - g * dt / 2
    on_the_way = {
        V: Intermediate("m/s", "speed in the middle of the step", sqrt(u**2 + w_half**2)),
        slow: Intermediate("", "share of the velocity that drag leaves", 1 / (1 + f * V * dt)),
    }
    transition = [x + (u + u_new) * dt / 2, z + (w + w_new) * dt / 2, u_new, w_new]
    i, j = m["i", "j"]
    seen = [
        Observation("i", i[t], a * x, m["r_i"], "px"),
        Observation("j", j[t], j_0 - a * z, m["r_j"], "px"),
    ]
    state = _state(m, x, z, u, w)
    return StateSpace(state, transition, _noise(m["q"], dt), seen, on_the_way)


def _state(m: Recurrence, *symbols: Symbol) -> dict[Symbol, State]:
    place, speed = m["s_pos"] ** 2, m["s_vel"] ** 2
    words = (
        ("m", "distance to the goal line", m["x_0"], place),
        ("m", "height", m["z_0"], place),
        ("m/s", "horizontal velocity", m["u_0"], speed),
        ("m/s", "vertical velocity", m["w_0"], speed),
    )
    return {s: State(*what) for s, what in zip(symbols, words, strict=True)}


def _noise(q: Expr, dt: Expr) -> Matrix:
    """Of x, z, u, w: white noise of the acceleration, the same and independent on both axes."""
    dynamics = Matrix([[0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 0], [0, 0, 0, 0]])
    return discrete_noise(dynamics, diag(0, 0, q, q), dt)
