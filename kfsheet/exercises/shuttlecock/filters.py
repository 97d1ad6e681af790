"""Two filters of the shuttlecock: three states for each axis, as the source has it, and two."""

from __future__ import annotations

from sympy import Expr, Matrix, Symbol, diag

from kfsheet.errors import ModelError
from kfsheet.estimation.algebra import discrete_noise
from kfsheet.estimation.drag import flight
from kfsheet.estimation.state_space import Observation, State, StateSpace
from kfsheet.model.expressions import t
from kfsheet.model.recurrence import Recurrence

AXES = {"x": "distance ahead", "y": "distance sideways", "z": "height"}
WAYS = {"x": "ahead", "y": "sideways", "z": "upwards"}  # of velocities and accelerations


def joint_model(m: Recurrence, axes: str = "xyz") -> StateSpace:
    """The source's filter, equations (9) to (14): position, velocity, acceleration of each axis.

        p_f = p + v T + a T^2/2
        v_f = v + a T
        a_f = -k v_f,    on the z axis -k v_f - g

    The acceleration is that of linear drag at the new velocity, and gravity enters there alone.
    The source's "Q = 0.04" is q on all three states, or with f_q = 0 on the acceleration alone.

    Parameters
    ----------
    m : Recurrence
        It has the parameters, and the positions that the cameras saw.
    axes : str
        Some of "xyz": three states for each.

    Raises
    ------
    ModelError
        If an axis is none of x, y and z.
    """
    if not axes or set(axes) - set(AXES):
        raise ModelError(f"the axes are {axes!r}; give some of {', '.join(AXES)}")
    dt, k, g, q, f_q, s_q, r_obs = m["dt", "k_fit", "g", "q", "f_q", "s_q", "r_obs"]
    state, transition, seen = {}, [], []
    for axis in axes:
        words = AXES[axis]
        p, v, a = (Symbol(f"{letter}{axis}", real=True) for letter in ("", "v", "a"))
        state[p] = State("m", words, m[f"{axis}_obs"][t], m["f_start"] * r_obs)
        state[v] = State("m/s", f"velocity {WAYS[axis]}", 0, m["var_v"])
        state[a] = State("m/s2", f"acceleration {WAYS[axis]}", 0, m["var_a"])
        v_new = v + a * dt
        a_new = -k * v_new - (g if axis == "z" else 0)
        transition += [p + v * dt + a * dt**2 / 2, v_new, a_new.expand()]
        seen.append(Observation(axis, m[f"{axis}_obs"][t], p, r_obs, "m"))
    Q = diag(*[f_q * q, f_q * q / s_q**2, q / s_q**4] * len(axes))
    return StateSpace(state, transition, Q, seen)


def exact_model(m: Recurrence) -> StateSpace:
    """Position and velocity alone, with the exact transition and the variance of the noise.

        p_f = p + v X
        v_f = v (1 - k X),    X = (1 - exp(-k T))/k,

    and on the z axis what gravity adds; see :func:`kfsheet.estimation.drag.flight`. The spectral
    density ``Phi_s`` says how much the filter doubts this, ``belief_r`` what it is told of the
    cameras' errors, and ``gate`` which observations it ignores.

    Parameters
    ----------
    m : Recurrence
        It has the parameters, and the positions that the cameras saw.
    """
    dt, k, X = m["dt", "k_fit", "X_dt"]
    state: dict[Symbol, State] = {}
    transition: list[Expr] = []
    seen = []
    for axis, words in AXES.items():
        p, v = (Symbol(f"{letter}{axis}", real=True) for letter in ("", "v"))
        variance = m[f"r_{axis}"]
        state[p] = State("m", words, m[f"{axis}_obs"][t], variance)
        state[v] = State("m/s", f"velocity {WAYS[axis]}", 0, m["var_v"])
        g = m["g"] if axis == "z" else 0
        transition += list(flight(k, g, dt, X) * Matrix([p, v, 1]))
        seen.append(Observation(axis, m[f"{axis}_obs"][t], p, variance, "m", gate=m["gate"]))
    Q = discrete_noise(Matrix([[0, 1], [0, 0]]), diag(0, m["Phi_s"]), dt)
    return StateSpace(state, transition, diag(Q, Q, Q), seen)
