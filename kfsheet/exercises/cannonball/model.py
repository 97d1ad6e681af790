"""A cannon-ball tracked by a radar that measures angle and range: an extended Kalman filter.

The radar's angle and range are no linear functions of the position. The extended filter
linearises them at each forecast; the linear filter, with which the source compares it, is given
positions computed from angle and range instead, one axis at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sympy import Expr, Matrix, Piecewise, Symbol, atan2, cos, diag, pi, sin, sqrt

from kfsheet.estimation.algebra import discrete_noise, transition_matrix
from kfsheet.estimation.kalman import add_filter
from kfsheet.estimation.state_space import Observation, State, StateSpace
from kfsheet.exercises.cannonball.charts import CHARTS
from kfsheet.exercises.cannonball.words import ABOUT, QUESTIONS, SECTIONS, TASK
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import RMS, Last, Mean, Missing, Sum, t, when_observed
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.tables import Table, read_table

DATA = Path(__file__).parent / "data"
DYNAMICS = Matrix([[0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
"""F of dx/dt = F x for x = (x, vx, y, vy)."""
STATE = (
    # name, unit, error of the start, claimed error of the start, words
    ("x", "m", 304.8, 304.8, "distance"),
    ("vx", "m/s", -30.48, 30.48, "horizontal velocity"),
    ("y", "m", -304.8, 304.8, "height"),
    ("vy", "m/s", 30.48, 30.48, "vertical velocity"),
)
Arctangent = Callable[[Expr, Expr], Expr]


def build_model(
    draws: str | Path = DATA / "cannonball_draws.csv",
    *,
    arctangent: Arctangent = atan2,
    wrap: bool = True,
) -> Recurrence:
    """The cannon-ball with both filters.

    Parameters
    ----------
    draws : path
        CSV with columns ``sweep, n_theta, n_r``: number, and two standard-normal draws.
    arctangent : function of (y, x)
        The angle that radar and filter take; ``lambda y, x: atan(y / x)`` is the source's.
    wrap : bool
        Whether the innovation of the angle is wrapped to (-pi, pi].

    Raises
    ------
    DataError
        If the table is not as described.
    """
    noise = read_table(draws, ("sweep", "n_theta", "n_r"), times="sweep")
    m = Recurrence("cannonball", title="A cannon-ball, tracked by radar", step="sweep")
    _parameters(m)
    _truth(m)
    _radar(m, noise, arctangent)
    add_filter(m, extended_model(m, arctangent, wrap), section="EKF")
    add_filter(m, linear_model(m), section="Linear", suffix="_lin")
    _errors(m)
    return m


def _parameters(m: Recurrence) -> None:
    m.parameter("v_0", 915, "m/s", "muzzle velocity", sign="positive")
    m.parameter("angle", 45, "deg", "elevation of the barrel")
    m.parameter("g", 9.80665, "m/s2", "gravity")
    dt = m.parameter("dt", 0.1, "s", "time between two sweeps", sign="positive")
    m.parameter("x_R", 30480, "m", "radar, distance from the cannon")
    m.parameter("y_R", 0, "m", "radar, height")
    m.parameter("sigma_theta", 0.01, "rad", "radar, error of the angle", sign="positive")
    m.parameter("sigma_r", 30.48, "m", "radar, error of the range", sign="positive")
    for kind, words in (("theta", "angle"), ("r", "range")):
        what = f"filters, claimed over true error of the {words}"
        m.parameter(f"belief_{kind}", 1, "", what, sign="positive")
    m.parameter("Phi_s", 0, "m2/s3", "noise of the model, spectral density", sign="nonnegative")
    for name, unit, error, deviation, words in STATE:
        m.parameter(f"e_{name}", error, unit, f"start, error of the {words}")
        m.parameter(
            f"s_{name}", deviation, unit, f"start, claimed error of the {words}", sign="positive"
        )
    for kind, unit, words in (("theta", "rad", "angle"), ("r", "m", "range")):
        claimed = m[f"belief_{kind}"] * m[f"sigma_{kind}"]
        m.derived(f"s_{kind}", claimed, unit, f"radar, claimed error of the {words}")
    m.time(t * dt, "s", "time since the shot")


def _truth(m: Recurrence) -> None:
    v_0, g, dt = m["v_0", "g", "dt"]
    angle = m["angle"] * pi / 180
    page = "Truth"
    x, vx, y, vy = m.columns("x_true", "vx_true", "y_true", "vy_true", section=page)
    (in_flight,) = m.columns("in_flight", section="Radar")
    m.define(x[t], x[t - 1] + vx[t - 1] * dt, "m", "truth, distance", start=[0])
    m.define(vx[t], vx[t - 1], "m/s", "truth, horizontal velocity", start=[v_0 * cos(angle)])
    trapezium = (vy[t - 1] + vy[t]) * dt / 2
    m.define(y[t], y[t - 1] + trapezium, "m", "truth, height (trapezium)", start=[0])
    m.define(vy[t], vy[t - 1] - g * dt, "m/s", "truth, vertical velocity", start=[v_0 * sin(angle)])
    up = Piecewise((in_flight[t - 1], y[t] >= 0), (0, True))
    m.define(in_flight[t], up, "", "1 until the ball lands, then 0", start=[1])
    _landing(m)


def _landing(m: Recurrence) -> None:
    """Whether the table is long enough: one more step would bring the ball below 0."""
    y, vy, g, dt = m["y_true", "vy_true", "g", "dt"]
    next_y = Last(y) + Last(vy) * dt - g * dt**2 / 2
    words = "1: the ball lands; 0: still in the air, make dt larger: 2 v_0 sin(angle)/(g 1319)"
    m.summary("landed", Piecewise((1, next_y < 0), (0, True)), "", words)
    m.summary("flight", Sum(m["in_flight"]), "", "rows with the ball in the air")


def _while_flying(m: Recurrence, value: Expr) -> Expr:
    return Piecewise((value, m["in_flight"][t] > 0), (Missing, True))


def _radar(m: Recurrence, noise: Table, arctangent: Arctangent) -> None:
    page = "Radar"
    x, y, x_R, y_R = m["x_true", "y_true", "x_R", "y_R"]
    n_theta = m.data("n_theta", noise["n_theta"], "", "standard-normal draw", section=page)
    n_r = m.data("n_r", noise["n_r"], "", "standard-normal draw", section=page)
    theta, r, theta_obs, r_obs, x_obs, y_obs, r_x, r_y = m.columns(
        "theta", "r", "theta_obs", "r_obs", "x_obs", "y_obs", "r_x", "r_y", section=page
    )
    # No echo of the shot: of a ball that lies in the radar there is no angle.
    shot = [Missing]
    m.define(theta[t], arctangent(y[t] - y_R, x[t] - x_R), "rad", "truth, angle", start=shot)
    m.define(r[t], sqrt((x[t] - x_R) ** 2 + (y[t] - y_R) ** 2), "m", "truth, range", start=shot)
    for kind, true, seen, draw in (("theta", theta, theta_obs, n_theta), ("r", r, r_obs, n_r)):
        measured = _while_flying(m, true[t] + m[f"sigma_{kind}"] * draw[t])
        unit, words = ("rad", "angle") if kind == "theta" else ("m", "range")
        m.define(seen[t], measured, unit, f"measured {words}: truth + noise", start=shot)
    angle, reach, both = theta_obs[t], r_obs[t], (theta_obs[t], r_obs[t])
    position = Matrix([x_R + reach * cos(angle), y_R + reach * sin(angle)])
    m.define(x_obs[t], when_observed(both, position[0]), "m", "measured position, distance")
    m.define(y_obs[t], when_observed(both, position[1]), "m", "measured position, height")
    claimed = diag(m["s_theta"] ** 2, m["s_r"] ** 2)
    spread = position.jacobian(both) * claimed * position.jacobian(both).T
    m.define(r_x[t], when_observed(both, spread[0, 0]), "m2", "claimed variance of x_obs")
    m.define(r_y[t], when_observed(both, spread[1, 1]), "m2", "claimed variance of y_obs")


def _motion(m: Recurrence) -> tuple[dict[Symbol, State], list[Expr], Matrix]:
    """State, transition and Q, which both filters share."""
    dt, g, Phi_s = m["dt", "g", "Phi_s"]
    state = {
        Symbol(name, real=True): State(
            unit, words, m[f"{name}_true"][t] + m[f"e_{name}"], m[f"s_{name}"] ** 2
        )
        for name, unit, _, _, words in STATE
    }
    x = Matrix(list(state))
    fall = Matrix([0, 0, -g * dt**2 / 2, -g * dt])
    Q = discrete_noise(DYNAMICS, diag(0, Phi_s, 0, Phi_s), dt)
    return state, list(transition_matrix(DYNAMICS, dt) * x + fall), Q


def extended_model(m: Recurrence, arctangent: Arctangent = atan2, wrap: bool = True) -> StateSpace:
    """Angle and range, as they are; see :func:`build_model`."""
    state, transition, Q = _motion(m)
    x, _, y, _ = state
    right, up = x - m["x_R"], y - m["y_R"]
    angle = arctangent(up, right)
    observations = [
        Observation("theta", m["theta_obs"][t], angle, m["s_theta"] ** 2, "rad", angle=wrap),
        Observation("r", m["r_obs"][t], sqrt(right**2 + up**2), m["s_r"] ** 2, "m"),
    ]
    return StateSpace(state, transition, Q, observations)


def linear_model(m: Recurrence) -> StateSpace:
    """Positions computed from angle and range, each axis by itself, their correlation neglected."""
    state, transition, Q = _motion(m)
    x, _, y, _ = state
    observations = [
        Observation("x", m["x_obs"][t], x, m["r_x"][t], "m"),
        Observation("y", m["y_obs"][t], y, m["r_y"][t], "m"),
    ]
    return StateSpace(state, transition, Q, observations)


def _errors(m: Recurrence) -> None:
    """Estimates minus truth from the first echo on: the start is given, no filter's doing."""
    page, shot = "Errors", [Missing]
    runs = (("a", "EKF", ""), ("lin", "linear filter", "_a"), ("obs", "radar alone", ""))
    for run, words, stage in runs:
        for name, unit, _, _, what in STATE:
            if run == "obs" and name.startswith("v"):
                continue
            (e,) = m.columns(f"e_{name}_{run}", section=page)
            estimate = m[f"{name}{stage}_{run}"]
            error = _while_flying(m, estimate[t] - m[f"{name}_true"][t])
            if run == "obs":
                error = when_observed(estimate[t], estimate[t] - m[f"{name}_true"][t])
            m.define(e[t], error, unit, f"error of the {what}, {words}", start=shot)
            if not name.startswith("v"):
                m.summary(f"rms_{name}_{run}", RMS(e), "m", f"rms error of the {what}, {words}")
    _bands(m, page)
    for run, words in (("", "EKF"), ("_lin", "linear filter")):
        nis = m[f"NIS{run}"]
        m.summary(f"mean_NIS{run}", Mean(nis), "", f"mean NIS, {words}; expected: 2")


def _bands(m: Recurrence, page: str) -> None:
    """Twice the deviation that a filter claims, on both sides of 0."""
    for name, variance, unit in (
        ("d_theta", "S_theta", "rad"),
        ("d_r", "S_r_f", "m"),
        ("e_x_a", "P_xx_a", "m"),
        ("e_vx_a", "P_vxvx_a", "m/s"),
        ("e_y_a", "P_yy_a", "m"),
        ("e_vy_a", "P_vyvy_a", "m/s"),
        ("e_x_lin", "P_xx_a_lin", "m"),
        ("e_y_lin", "P_yy_a_lin", "m"),
    ):
        low, high = m.columns(f"{name}_low", f"{name}_high", section=page)
        band, words = _while_flying(m, 2 * sqrt(m[variance][t])), f"theory for {name}: 2 sigma"
        start = [Missing] if name.startswith("d") else []
        m.define(high[t], band, unit, words, start=start)
        m.define(low[t], when_observed(high[t], -high[t]), unit, f"{words} below 0")


cannonball = build_model()
exercise = Exercise(
    model=cannonball,
    about=ABOUT,
    source="I. Curnick, 'Kalman Filtering a Cannon Ball' (2025), after Zarchan and Musoff",
    charts=CHARTS,
    questions=QUESTIONS,
    task=TASK,
    notebook="notebooks/02_cannonball.ipynb",
    sections=SECTIONS,
    greyed="in_flight",
    alarm=("landed",),
    vary={
        "v_0": (850, 910),
        "angle": (40, 45),
        "x_R": (27_000, 33_000),
        "sigma_theta": (0.006, 0.015),
        "sigma_r": (20, 40),
    },
    noise=("n_theta", "n_r"),
    frozen=("Linear",),
    sealed=("EKF",),
)
