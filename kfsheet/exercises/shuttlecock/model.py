"""A shuttlecock seen by two cameras: three small filters and the point where it will fall.

A robot that kicks the shuttlecock back must know where and when it lands. With drag that is
proportional to the velocity the three axes do not depend on each other, and the track is a straight
line in a distorted time X. The source filters the positions first and fits the track to what the
filter says; here the fit also gets the positions as they are, and two filters forecast from their
latest state.
"""

from __future__ import annotations

from pathlib import Path

from sympy import Matrix, sqrt

from kfsheet.estimation.drag import distorted, flight
from kfsheet.estimation.kalman import add_filter
from kfsheet.exercises.shuttlecock.charts import CHARTS
from kfsheet.exercises.shuttlecock.filters import AXES, WAYS, exact_model, joint_model
from kfsheet.exercises.shuttlecock.forecasts import (
    FORECASTS,
    add_fit,
    add_landing,
    add_latest,
    add_regressors,
    add_theory,
)
from kfsheet.exercises.shuttlecock.words import ABOUT, QUESTIONS, SECTIONS, TASK
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import RMS, Last, Mean, t
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.tables import Table, read_table

DATA = Path(__file__).parent / "data"


def build_model(draws: str | Path = DATA / "shuttlecock_draws.csv") -> Recurrence:
    """The shuttlecock with filters, fits and forecasts.

    Parameters
    ----------
    draws : path
        CSV with columns ``frame, n_x, n_y, n_z``: number, and three standard-normal draws.

    Raises
    ------
    DataError
        If the table is not as described.
    """
    noise = read_table(draws, ("frame", *(f"n_{axis}" for axis in AXES)), times="frame")
    m = Recurrence("shuttlecock", title="The fall point of a shuttlecock", step="frame")
    _parameters(m)
    _truth(m)
    _camera(m, noise)
    add_filter(m, joint_model(m), section="Kalman")
    add_regressors(m, "Fit raw")
    add_theory(m, "Fit raw")
    add_fit(m, "Fit raw", "raw", FORECASTS["raw"], "obs")
    add_fit(m, "Fit filtered", "kf", FORECASTS["kf"], "a")
    add_latest(m, "Latest state", "now", FORECASTS["now"])
    add_filter(m, exact_model(m), section="Exact filter", suffix="_ex")
    add_latest(m, "Exact filter", "ex", FORECASTS["ex"], "_ex")
    _errors(m)
    return m


def _parameters(m: Recurrence) -> None:
    fps = m.parameter("fps", 30, "1/s", "frames in a second", sign="positive")
    k_m = m.parameter("k_m", 1, "1/s", "drag over mass (assumed: none given)", sign="positive")
    m.parameter(
        "k_2", 0, "1/m", "drag over mass, quadratic, of the truth alone", sign="nonnegative"
    )
    m.parameter("f_lin", 1, "", "linear drag of the truth, in units of k_m", sign="nonnegative")
    f_k = m.parameter(
        "f_k", 1, "", "drag that filters and fits assume, in units of k_m", sign="positive"
    )
    m.parameter("g", 9.80665, "m/s2", "gravity", sign="positive")
    for axis, p, v in (("x", 0, 1.5), ("y", 0, 0.8), ("z", 0.5, 4)):
        m.parameter(f"p_{axis}", p, "m", f"start, {AXES[axis]}")
        m.parameter(f"v_{axis}", v, "m/s", f"start, velocity {WAYS[axis]}")
    m.parameter("z_fall", 0, "m", "height at which it is to be kicked back")
    m.parameter("SNR", 25, "", "power of the signal over that of the noise", sign="positive")
    m.parameter("q", 0.04, "m2", "Q of the filter, in m2, (m/s)2 and (m/s2)2", sign="nonnegative")
    m.parameter("f_q", 1, "", "1: Q as it is; 0: on the acceleration only", sign="nonnegative")
    m.parameter("s_q", 1, "s", "second that makes the units of Q fit", sign="positive")
    m.parameter("r_obs", 0.04, "m2", "R of the filter", sign="positive")
    m.parameter(
        "belief_r", 1, "", "exact filter, claimed over true error of the cameras", sign="positive"
    )
    m.parameter("f_start", 1, "", "start, variance of a position, in units of R", sign="positive")
    m.parameter("var_v", 25, "m2/s2", "start, variance of a velocity", sign="positive")
    m.parameter("var_a", 25, "m2/s4", "start, variance of an acceleration", sign="positive")
    m.parameter("Phi_s", 0, "m2/s3", "exact filter, spectral density", sign="nonnegative")
    m.parameter("gate", 1000, "", "exact filter, sigmas beyond which it ignores", sign="positive")
    dt = m.derived("dt", 1 / fps, "s", "time between two frames")
    k_fit = m.derived("k_fit", f_k * k_m, "1/s", "drag over mass that filters and fits assume")
    m.derived("X_dt", distorted(k_fit, dt), "s", "distorted time between two frames")
    m.time(t * dt, "s", "time since the first frame")


def _truth(m: Recurrence) -> None:
    """Exact steps of linear drag; quadratic drag enters as the linear one of the same force."""
    page, dt = "Truth", m["dt"]
    k_eff, k_step, X = m.columns("k_eff", "k_step", "X_step", section=page)
    position = m.columns(*(f"{axis}_true" for axis in AXES), section=page)
    velocity = m.columns(*(f"v{axis}_true" for axis in AXES), section=page)
    speed = sqrt(sum(v[t] ** 2 for v in velocity))
    m.define(
        k_eff[t], m["f_lin"] * m["k_m"] + m["k_2"] * speed, "1/s", "drag over mass at this speed"
    )
    middle = (3 * k_eff[t - 1] - k_eff[t - 2]) / 2
    m.define(k_step[t], middle, "1/s", "the same, half a step ago", start=[k_eff[t], k_eff[t - 1]])
    m.define(X[t], distorted(k_step[t], dt), "s", "distorted time of the step")
    for axis, p, v in zip(AXES, position, velocity, strict=True):
        g = m["g"] if axis == "z" else 0
        moved = flight(k_step[t], g, dt, X[t]) * Matrix([p[t - 1], v[t - 1], 1])
        m.define(p[t], moved[0], "m", f"truth, {AXES[axis]}", start=[m[f"p_{axis}"]])
        what = f"truth, velocity {WAYS[axis]}"
        m.define(v[t], moved[1], "m/s", what, start=[m[f"v_{axis}"]])
    here, fast = [p[t] for p in position], [v[t] for v in velocity]
    now = {"k": k_eff[t], "since": m["time"][t]}
    add_landing(m, page, "true", "truth", here, fast, **now, certain=True)
    for name, unit, what in (("t", "s", "time"), ("x", "m", AXES["x"]), ("y", "m", AXES["y"])):
        m.summary(f"{name}_fall", Last(m[f"{name}_fall_true"]), unit, f"truth, fall: {what}")


def _camera(m: Recurrence, noise: Table) -> None:
    page = "Camera"
    for axis, words in AXES.items():
        n, true = f"n_{axis}", m[f"{axis}_true"]
        draw = m.data(n, noise[n], "", "standard-normal draw", section=page)
        variance = m.summary(
            f"var_{axis}", RMS(true) ** 2 / m["SNR"], "m2", f"variance of the noise, {words}"
        )
        what = f"exact filter, claimed variance of the noise, {words}"
        m.summary(f"r_{axis}", m["belief_r"] ** 2 * variance, "m2", what)
        seen, low, high = m.columns(f"{axis}_obs", f"{axis}_low", f"{axis}_high", section=page)
        m.define(seen[t], true[t] + sqrt(variance) * draw[t], "m", f"seen by the cameras, {words}")
        band = "19 of 20 frames lie between: truth"
        m.define(low[t], true[t] - 2 * sqrt(variance), "m", f"{band} - 2 sigma")
        m.define(high[t], true[t] + 2 * sqrt(variance), "m", f"{band} + 2 sigma")


def _errors(m: Recurrence) -> None:
    page = "Errors"
    for run, words in (("obs", "cameras"), ("a", "filter"), ("a_ex", "exact filter")):
        for axis in AXES:
            (e,) = m.columns(f"e_{axis}_{run}", section=page)
            error = m[f"{axis}_{run}"][t] - m[f"{axis}_true"][t]
            m.define(e[t], error, "m", f"error of {axis}, {words}")
            m.summary(f"rms_{axis}_{run}", RMS(e), "m", f"rms error of {axis}, {words}")
    for run, words in (("", "filter"), ("_ex", "exact filter")):
        m.summary(f"mean_NIS{run}", Mean(m[f"NIS{run}"]), "", f"mean NIS, {words}; expected: 3")


shuttlecock = build_model()

exercise = Exercise(
    model=shuttlecock,
    about=ABOUT,
    source="Man, Zhao, Hu, 'Application of Kalman Filter in Track Prediction of Shuttlecock', "
    "IEEE ROBIO (2009)",
    charts=CHARTS,
    questions=QUESTIONS,
    task=TASK,
    notebook="notebooks/03_shuttlecock.ipynb",
    sections=SECTIONS,
    vary={"v_x": (1.2, 1.8), "v_y": (0.6, 1.0), "v_z": (3.7, 4.2), "k_m": (0.85, 1.15)},
    noise=("n_x", "n_y", "n_z"),
    frozen=("Truth", "Fit filtered", "Latest state", "Exact filter"),
    veiled=("y_fall_raw",),  # of its line X at the fall can be told, which x_fall_raw is about
)
