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

from kfsheet.charts import Chart, Series
from kfsheet.drag import distorted, flight
from kfsheet.exercise import Exercise, Question
from kfsheet.expressions import RMS, Last, Mean, t
from kfsheet.kalman import add_filter
from kfsheet.recurrence import Recurrence
from kfsheet.shuttlecock.filters import AXES, WAYS, exact_model, joint_model
from kfsheet.shuttlecock.forecasts import (
    NEWTON_STEPS,
    add_fit,
    add_landing,
    add_latest,
    add_regressors,
    add_theory,
)
from kfsheet.tables import Table, read_table

DATA = Path(__file__).parent / "data"
FORECASTS = {
    "raw": "fit to the cameras",
    "kf": "fit to the filter",
    "now": "latest state of the filter",
    "ex": "latest state of the exact filter",
}


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
    m.parameter("s_q", 1, "s", "second that makes the units of Q fit", sign="positive")
    m.parameter("r_obs", 0.04, "m2", "R of the filter", sign="positive")
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
    m.define(k_eff[t], m["k_m"] + m["k_2"] * speed, "1/s", "drag over mass at this speed")
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

ABOUT = (
    "A robot is to kick a shuttlecock back. Two cameras see it 30 times a second with errors of 6 "
    "to 17 cm; the robot needs the place and the moment of the fall, and early. The source of this "
    "exercise filters the positions, then fits the track to them, and claims that the fall point "
    "settles faster and better than without the filter.",
    "Look at both fits on the sheet Charts: 'Fit raw' takes the positions as the cameras saw them, "
    "'Fit filtered' as the filter of the sheet Kalman corrected them. The filter's positions are "
    "indeed better than the cameras'. Are its fall points?",
    "Try this on the sheet Parameters: set f_k to 2 (filters and fits now believe in twice the "
    "drag) or k_2 to 0.2 (quadratic drag in the truth); then let the exact filter doubt: set Phi_s "
    "to 0.05 or 0.5. Or type 15 over one of the green draws on the sheet Camera, an outlier, and "
    "set gate to 3. When does a filter win?",
    "Everything is live. The filter's state has nine elements, but covariances between the axes "
    "stay 0, so they have no columns and it is three filters of three. The drag k_m is an "
    "assumption: the source gives none. From 0.001 upwards fall times are right within 1E-8 s; "
    "rounding adds some 1E-15/k_m^2 s, so a drag below 0.00001 means nothing.",
)
SECTIONS = {
    "Truth": "the flight, in exact steps of linear drag, and its fall point",
    "Camera": "truth plus noise from fixed draws; its variance is the signal's power over SNR",
    "Kalman": "the source's filter: position, velocity and acceleration of three axes",
    "Fit raw": "least squares on the positions seen so far, and the fall point (names end in _raw)",
    "Fit filtered": "the same on the filter's positions (names end in _kf)",
    "Latest state": "the fall point from the filter's latest state alone (names end in _now)",
    "Exact filter": "position and velocity, exact transition, honest variances (names end in _ex)",
    "Errors": "positions minus truth; the errors of fall points stand beside the forecasts",
}


def _axis_chart(axis: str, note: str) -> Chart:
    series = (
        Series("time", f"{axis}_low", "", "bound"),
        Series("time", f"{axis}_high", "truth ± 2 sigma", "bound"),
        Series("time", f"{axis}_true", "truth", "truth"),
        Series("time", f"{axis}_obs", "cameras", "observation"),
        Series("time", f"{axis}_a", "filter", "analysis"),
    )
    title = AXES[axis].capitalize()
    return Chart(title, "time (s)", f"{axis}: {AXES[axis]} (m)", series, note=note)


def _error_chart(title: str, runs: dict[str, str], note: str) -> Chart:
    series = tuple(Series("time", f"e_fall_{run}", FORECASTS[run], runs[run]) for run in runs)
    theory = Series("time", "e_theory", "theory of the fit, rms", "bound")
    words = "time of the frame (s)", "error of the fall point (m)"
    # Two frames make a fit that may err by many metres; the rest would be a flat line.
    return Chart(title, *words, (theory, *series), note=note, y_limits=(0, 1.5))


CHARTS = (
    _axis_chart("x", "19 of 20 camera positions lie in the band; the filter's scatter less."),
    _axis_chart("y", "The noise is in proportion to the signal on each axis."),
    _axis_chart("z", "The shuttlecock falls just after the last frame."),
    Chart(
        "Velocity upwards",
        "time (s)",
        "vz (m/s)",
        (
            Series("time", "vz_true", "truth", "truth"),
            Series("time", "vz_a", "filter", "line"),
            Series("time", "vz_a_ex", "exact filter", "forecast"),
        ),
        note="Neither filter is told a velocity; both start at 0.",
    ),
    _error_chart(
        "The fall point, from fits",
        {"raw": "second", "kf": "first"},
        "Does filtering first help? The notebook flies 400 times. Theory: if the model is right.",
    ),
    _error_chart(
        "The fall point, from latest states",
        {"raw": "second", "now": "free", "ex": "forecast"},
        "The exact filter soon is the fit, frame by frame; the three-state filter forgets.",
    ),
)
QUESTIONS = (
    Question("z_f", 1, "One step at constant acceleration."),
    Question("vz_f", 1, "As z_f."),
    Question("az_f", 2, "Drag at the new velocity, and gravity: once."),
    Question("d_z", 1, "Observed minus forecast."),
    Question("S_z", 1, "Variance of d_z: H P H' + R."),
    Question("K_z_z", 1, "P H' / S, first element."),
    Question("K_vz_z", 1, "P H' / S, second element."),
    Question("z_a", 1, "Forecast plus gain times innovation."),
    Question("P_zz_a", 2, "P - K S K', first element."),
    Question("drop", 2, "The part of the height that does not depend on p_z and v_z."),
    Question("v_z_raw", 2, "Solve the two normal equations for the slope."),
    Question("p_z_raw", 2, "Solve the two normal equations for the constant."),
    Question("W_1_raw", 2, "From W_0, one step of Newton's method for w exp(-W) - W = 0."),
    Question("t_fall_raw", 1, "From W back to seconds."),
    Question("x_fall_raw", 1, "The track at t_fall."),
)
TASK = (
    "Step t is a frame; dt is the time between two, k_fit the drag over mass. Of the filter only "
    "the height is asked: its state is z, its velocity vz and its acceleration az. Names that end "
    "in _f are of the forecast, in _a of the analysis; d_z is an innovation; P_zvz_f is the "
    "covariance of z and vz in the forecast. x and y go the same way, without gravity.",
    "Forecast. Over the step from the frame before (z_a, vz_a, az_a) the acceleration counts as "
    "constant; that gives z_f and vz_f. az_f is what acts at the new velocity: drag, which is "
    "k_fit times the velocity, against it, and gravity g. In frame 0 z_f is z_obs.",
    "Analysis. The cameras see the height itself, z_obs, with the variance r_obs: H = (1, 0, 0). "
    "With the forecast's covariance P, whose first column is P_zz_f, P_zvz_f, P_zaz_f: S_z is the "
    "variance H P H' + r_obs, K = P H' / S_z the gain with the elements K_z_z and K_vz_z. The "
    "analysis z_a moves by gain times innovation, and K S_z K' is taken away from P; P_zz_a is "
    "what is left of its first element. Frame 0 has no innovation: its analysis is the forecast, "
    "the variance too.",
    "Track. With linear drag, in the distorted time X = (1 - exp(-k_fit time))/k_fit of the sheet "
    "Fit raw, x is the straight line p_x_raw + v_x_raw X, and z is p_z_raw + v_z_raw X + drop. "
    "drop is the height of a thing let go at height 0 at time 0 (column time), under g and the "
    "same drag: its velocity is -g X. X itself grows at the rate exp(-k_fit time) = 1 - k_fit X.",
    "Fit. The line p_z_raw + v_z_raw X through the n = t + 1 heights z_obs - drop of the frames 0 "
    "to t (the column frame) by least squares, from frame 1 on. Its normal equations hold n and "
    "the sums over these frames that stand beside it: sum_X, sum_XX (of X^2), sum_z_raw (of the "
    "heights), sum_Xz_raw (of X times the heights).",
    "Fall. The track comes down to z_fall at the time t_fall_raw = (c + W)/k_fit, with c_raw for "
    "c and W for the root of f(W) = w exp(-W) - W, w_raw for w. W_0_raw is a first guess, W_1_raw "
    "to W_4_raw are a step of Newton's method each, and W_4_raw counts as W. x_fall_raw is where "
    "the track then is. A track that stays below z_fall has no first guess, and then the rest of "
    "the row has no value either.",
)
ASKED_OF_Z = (
    *("z_f", "vz_f", "az_f", "d_z", "S_z", "K_z_z", "K_vz_z", "z_a", "P_zz_a"),
    *("p_z_raw", "v_z_raw"),
)
# What is asked of z stands beside it for x and y, and one step of Newton's is like another.
TWINS = (
    *(name.replace("z", axis) for axis in "xy" for name in ASKED_OF_Z),
    "y_fall_raw",
    *(f"W_{n}_raw" for n in range(2, NEWTON_STEPS + 1)),
)
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
    veiled=TWINS,
)
