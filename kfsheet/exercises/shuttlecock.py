"""A shuttlecock seen by two cameras: three small filters and the point where it will fall.

A robot that kicks the shuttlecock back must know where and when it lands. With drag that is
proportional to the velocity the three axes do not depend on each other, and the track is a straight
line in a distorted time X. The source filters the positions first and fits the track to what the
filter says; here the fit also gets the positions as they are, and two filters forecast from their
latest state.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from sympy import Expr, Matrix, Max, Piecewise, Symbol, diag, exp, sqrt, symbols

from kfsheet.algebra import discrete_noise
from kfsheet.charts import Chart, Series
from kfsheet.drag import distorted, fall_argument, fall_asymptote, flight, lambert_step
from kfsheet.errors import ModelError
from kfsheet.exercise import Exercise, Question
from kfsheet.expressions import RMS, Last, Mean, Missing, t, when_observed
from kfsheet.fitting import least_squares
from kfsheet.kalman import Observation, State, StateSpace, add_filter
from kfsheet.recurrence import Recurrence
from kfsheet.tables import Table, read_table

DATA = Path(__file__).parent / "data"
AXES = {"x": "distance ahead", "y": "distance sideways", "z": "height"}
WAYS = {"x": "ahead", "y": "sideways", "z": "upwards"}  # of velocities and accelerations
NEWTON_STEPS = 8  # enough for weak drag; with the source's numbers five are
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
    _cameras(m, noise)
    add_filter(m, joint_model(m), section="Kalman")
    _fit(m, "Fit raw", "raw", "obs")
    _fit(m, "Fit filtered", "kf", "a")
    _latest(m, "Latest state", "now", "")
    add_filter(m, exact_model(m), section="Exact filter", suffix="_ex")
    _latest(m, "Exact filter", "ex", "_ex")
    _errors(m)
    return m


def _parameters(m: Recurrence) -> None:
    fps = m.parameter("fps", 30, "1/s", "frames in a second", sign="positive")
    k_m = m.parameter("k_m", 1, "1/s", "drag over mass (assumed: none given)", sign="positive")
    m.parameter(
        "k_2", 0, "1/m", "drag over mass, quadratic, of the truth alone", sign="nonnegative"
    )
    e_k = m.parameter("e_k", 0, "1/s", "error of the drag over mass that filters and fits assume")
    m.parameter("g", 9.80665, "m/s2", "gravity", sign="positive")
    for axis, p, v in (("x", 0, 1.5), ("y", 0, 0.8), ("z", 0.5, 4)):
        m.parameter(f"p_{axis}", p, "m", f"start, {AXES[axis]}")
        m.parameter(f"v_{axis}", v, "m/s", f"start, velocity {WAYS[axis]}")
    m.parameter("z_fall", 0, "m", "height at which it is to be kicked back")
    m.parameter("SNR", 25, "", "power of the signal over that of the noise", sign="positive")
    m.parameter("q", 0.04, "m2", "Q of the filter, in m2, (m/s)2 and (m/s2)2", sign="nonnegative")
    m.parameter("s_q", 1, "s", "second that makes the units of Q fit", sign="positive")
    m.parameter("r_obs", 0.04, "m2", "R of the filter", sign="positive")
    m.parameter("var_v", 25, "m2/s2", "start, variance of a velocity", sign="positive")
    m.parameter("var_a", 25, "m2/s4", "start, variance of an acceleration", sign="positive")
    m.parameter("Phi_s", 0, "m2/s3", "exact filter, spectral density", sign="nonnegative")
    m.parameter("gate", 1000, "", "exact filter, sigmas beyond which it ignores", sign="positive")
    dt = m.derived("dt", 1 / fps, "s", "time between two frames")
    k_fit = m.derived("k_fit", k_m + e_k, "1/s", "drag over mass that filters and fits assume")
    m.derived("X_dt", distorted(k_fit, dt), "s", "distorted time between two frames")
    m.time(t * dt, "s", "time since the first frame")


# -- when and where it falls --------------------------------------------------------------------


def _landing(
    m: Recurrence,
    page: str,
    run: str,
    p: Sequence[Expr],
    v: Sequence[Expr],
    *,
    k: Expr,
    since: Expr,
    start: Sequence[Expr] = (),
) -> None:
    """When and where a flight from position p with velocity v at the time ``since`` ends."""
    words, at_least = FORECASTS.get(run, "truth"), -exp(-1)
    steps = [f"W_{n}" for n in range(1, NEWTON_STEPS + 1)]
    names = ["c", "w", *steps, "t_fall", "x_fall", "y_fall"]
    m.columns(*(f"{name}_{run}" for name in names), section=page)

    def put(name: str, rule: Expr, unit: str, what: str, read: str = "") -> Expr:
        cell = m[f"{name}_{run}"][t]
        if read and run != "true":
            rule = when_observed(m[f"{read}_{run}"][t], rule)
        m.define(cell, rule, unit, f"{words}: {what}", start=start)
        return cell

    c = fall_asymptote(k, m["g"], p[2] - m["z_fall"], v[2])
    c = put("c", c, "", "when the asymptote of the flight ends, times k")
    w = fall_argument(k, m["g"], v[2], c)
    # The truth must have an end: where it stays below z_fall, its highest point.
    w = put("w", Max(w, at_least) if run == "true" else w, "", "argument of Lambert's W")
    first = lambert_step(0, w)
    if run != "true":
        first = Piecewise((first, w >= at_least), (Missing, True))
    W = put("W_1", first, "", "W(w), first step of Newton's method")
    for before, name in pairwise(steps):
        W = put(name, lambert_step(W, w), "", f"W(w), step {name[2:]}", before)
    end = put("t_fall", since + (c + W) / k, "s", "time of the fall", steps[-1])
    for n, axis in enumerate(("x", "y")):
        place = p[n] + v[n] * distorted(k, end - since)
        put(f"{axis}_fall", place, "m", f"fall point, {AXES[axis]}", "t_fall")


def _landing_error(m: Recurrence, page: str, run: str, start: Sequence[Expr] = ()) -> None:
    (e,) = m.columns(f"e_fall_{run}", section=page)
    ahead, aside = m[f"x_fall_{run}"][t], m[f"y_fall_{run}"][t]
    error = sqrt((ahead - m["x_fall"]) ** 2 + (aside - m["y_fall"]) ** 2)
    words = f"{FORECASTS[run]}: distance from the true fall point"
    m.define(e[t], when_observed((ahead, aside), error), "m", words, start=start)
    m.summary(f"last_{run}", Last(e), "m", f"{words}, last frame")


# -- truth and cameras ---------------------------------------------------------------------------


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
    _landing(m, page, "true", here, fast, k=k_eff[t], since=m["time"][t])
    for name, unit, what in (("t", "s", "time"), ("x", "m", AXES["x"]), ("y", "m", AXES["y"])):
        m.summary(f"{name}_fall", Last(m[f"{name}_fall_true"]), unit, f"truth, fall: {what}")


def _cameras(m: Recurrence, noise: Table) -> None:
    page = "Cameras"
    for axis, words in AXES.items():
        n, true = f"n_{axis}", m[f"{axis}_true"]
        draw = m.data(n, noise[n], "", "standard-normal draw", section=page)
        variance = m.summary(
            f"var_{axis}", RMS(true) ** 2 / m["SNR"], "m2", f"variance of the noise, {words}"
        )
        (seen,) = m.columns(f"{axis}_obs", section=page)
        m.define(seen[t], true[t] + sqrt(variance) * draw[t], "m", f"seen by the cameras, {words}")


# -- filters -------------------------------------------------------------------------------------


def joint_model(m: Recurrence, axes: str = "xyz") -> StateSpace:
    """The source's filter, equations (9) to (14): position, velocity, acceleration of each axis.

    The acceleration is that of linear drag at the new velocity, and gravity enters there alone.

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
    dt, k, g, q, s_q, r_obs = m["dt", "k_fit", "g", "q", "s_q", "r_obs"]
    state, transition, seen = {}, [], []
    for axis in axes:
        words = AXES[axis]
        p, v, a = (Symbol(f"{letter}{axis}", real=True) for letter in ("", "v", "a"))
        state[p] = State("m", words, m[f"{axis}_obs"][t], r_obs)
        state[v] = State("m/s", f"velocity {WAYS[axis]}", 0, m["var_v"])
        state[a] = State("m/s2", f"acceleration {WAYS[axis]}", 0, m["var_a"])
        v_new = v + a * dt
        a_new = -k * v_new - (g if axis == "z" else 0)
        transition += [p + v * dt + a * dt**2 / 2, v_new, a_new.expand()]
        seen.append(Observation(axis, m[f"{axis}_obs"][t], p, r_obs, "m"))
    Q = diag(*[q, q / s_q**2, q / s_q**4] * len(axes))
    return StateSpace(state, transition, Q, seen)


def exact_model(m: Recurrence) -> StateSpace:
    """Position and velocity alone, with the exact transition and the variance of the noise."""
    dt, k, X = m["dt", "k_fit", "X_dt"]
    state, transition, seen = {}, [], []
    for axis, words in AXES.items():
        p, v = (Symbol(f"{letter}{axis}", real=True) for letter in ("", "v"))
        variance = m[f"var_{axis}"]
        state[p] = State("m", words, m[f"{axis}_obs"][t], variance)
        state[v] = State("m/s", f"velocity {WAYS[axis]}", 0, m["var_v"])
        g = m["g"] if axis == "z" else 0
        transition += list(flight(k, g, dt, X) * Matrix([p, v, 1]))
        seen.append(Observation(axis, m[f"{axis}_obs"][t], p, variance, "m", gate=m["gate"]))
    Q = discrete_noise(Matrix([[0, 1], [0, 0]]), diag(0, m["Phi_s"]), dt)
    return StateSpace(state, transition, diag(Q, Q, Q), seen)


# -- fits and forecasts --------------------------------------------------------------------------


def track_fit() -> tuple[dict[str, Expr], dict[str, Symbol]]:
    """Position and velocity at the start by least squares, equations (7) and (8).

    Returns
    -------
    solution, sums : dict
        ``p`` and ``v`` as formulas of the sums ``n, X, XX, y, Xy``; the symbols of these sums.
    """
    p, v, X, y = symbols("p v X y", real=True)
    sums = dict(zip("n X XX y Xy".split(), symbols("n S_X S_XX S_y S_Xy", real=True), strict=True))
    monomials = dict(zip((1, X, X**2, y, X * y), sums.values(), strict=True))
    solution = least_squares(p + v * X, [p, v], y, monomials)
    return {"p": solution[p], "v": solution[v]}, sums


def _fit(m: Recurrence, page: str, run: str, positions: str) -> None:
    """The fit to the positions of the frames 0..t, from running sums, and its fall point."""
    if run == "raw":
        _regressors(m, page)
    solution, sums = track_fit()
    found: dict[str, list[Expr]] = {"p": [], "v": []}
    for axis, words in AXES.items():
        y = m[f"{axis}_{positions}"][t] - (m["drop"][t] if axis == "z" else 0)
        S_y = _running_sum(m, page, f"sum_{axis}_{run}", y, "m", f"sum of {words}, without gravity")
        S_Xy = _running_sum(
            m, page, f"sum_X{axis}_{run}", m["X"][t] * y, "m s", f"sum of X times {words}"
        )
        cells = (t + 1, m["sum_X"][t], m["sum_XX"][t], S_y, S_Xy)
        at = dict(zip(sums.values(), cells, strict=True))
        for letter, unit, what in (("p", "m", words), ("v", "m/s", f"velocity {WAYS[axis]}")):
            (column,) = m.columns(f"{letter}_{axis}_{run}", section=page)
            rule = solution[letter].xreplace(at)
            m.define(column[t], rule, unit, f"{FORECASTS[run]}: start, {what}", start=[Missing])
            found[letter].append(column[t])
    _landing(m, page, run, found["p"], found["v"], k=m["k_fit"], since=0, start=[Missing])
    _landing_error(m, page, run, start=[Missing])


def _regressors(m: Recurrence, page: str) -> None:
    k, g, time = m["k_fit"], m["g"], m["time"][t]
    X, drop = m.columns("X", "drop", section=page)
    m.define(X[t], distorted(k, time), "s", "distorted time, in which the track is linear")
    m.define(drop[t], flight(k, g, time, X[t])[0, 2], "m", "what gravity alone does to the height")
    _running_sum(m, page, "sum_X", X[t], "s", "sum of X")
    _running_sum(m, page, "sum_XX", X[t] ** 2, "s2", "sum of the squares of X")


def _running_sum(m: Recurrence, page: str, name: str, term: Expr, unit: str, words: str) -> Expr:
    (total,) = m.columns(name, section=page)
    m.define(total[t], total[t - 1] + term, unit, words, start=[term])
    return total[t]


def _latest(m: Recurrence, page: str, run: str, suffix: str) -> None:
    """The fall point from a filter's analysis alone."""
    p = [m[f"{axis}_a{suffix}"][t] for axis in AXES]
    v = [m[f"v{axis}_a{suffix}"][t] for axis in AXES]
    _landing(m, page, run, p, v, k=m["k_fit"], since=m["time"][t])
    _landing_error(m, page, run)


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
    "Try this on the sheet Parameters: set e_k to 1 (filters and fits now believe in twice the "
    "drag) or k_2 to 0.2 (quadratic drag in the truth), and Phi_s to 0.5. Or type 15 over one of "
    "the green draws on the sheet Cameras, an outlier, and set gate to 3. When does a filter win?",
    "Everything is live. The filter's state has nine elements, but covariances between the axes "
    "stay 0, so they have no columns and it is three filters of three. The drag k_m is an "
    "assumption: the source gives none.",
)
SECTIONS = {
    "Truth": "the flight, in exact steps of linear drag, and its fall point",
    "Cameras": "truth plus noise from fixed draws; its variance is the signal's power over SNR",
    "Kalman": "the source's filter: position, velocity and acceleration of three axes",
    "Fit raw": "least squares on the positions seen so far, and the fall point (names end in _raw)",
    "Fit filtered": "the same on the filter's positions (names end in _kf)",
    "Latest state": "the fall point from the filter's latest state alone (names end in _now)",
    "Exact filter": "position and velocity, exact transition, honest variances (names end in _ex)",
    "Errors": "positions minus truth; the errors of fall points stand beside the forecasts",
}


def _axis_chart(axis: str, note: str) -> Chart:
    series = (
        Series("time", f"{axis}_true", "truth", "truth"),
        Series("time", f"{axis}_obs", "cameras", "observation"),
        Series("time", f"{axis}_a", "filter", "analysis"),
    )
    title = AXES[axis].capitalize()
    return Chart(title, "time (s)", f"{axis}: {AXES[axis]} (m)", series, note=note)


def _error_chart(title: str, runs: dict[str, str], note: str) -> Chart:
    series = tuple(Series("time", f"e_fall_{run}", FORECASTS[run], runs[run]) for run in runs)
    return Chart(title, "time of the frame (s)", "error of the fall point (m)", series, note=note)


CHARTS = (
    _axis_chart("x", "The filter's positions scatter less than the cameras'."),
    _axis_chart("y", "The noise is in proportion to the signal on each axis."),
    _axis_chart("z", "The shuttlecock falls just after the last frame."),
    Chart(
        "Velocity upwards",
        "time (s)",
        "vz (m/s)",
        (
            Series("time", "vz_true", "truth", "truth"),
            Series("time", "vz_a", "filter", "line"),
            Series("time", "vz_a_ex", "exact filter", "second line"),
        ),
        note="Neither filter is told a velocity; both start at 0.",
    ),
    _error_chart(
        "The fall point, from fits",
        {"raw": "first", "kf": "second"},
        "Does filtering first help the fit? One flight does not tell: the notebook flies 400.",
    ),
    _error_chart(
        "The fall point, from latest states",
        {"raw": "first", "now": "free", "ex": "second line"},
        "The exact filter is the fit, frame by frame; the three-state filter forgets.",
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
    Question("W_1_raw", 2, "One step of Newton's method from 0."),
    Question("t_fall_raw", 1, "From W back to seconds."),
    Question("x_fall_raw", 1, "The track at t_fall."),
)
exercise = Exercise(
    model=shuttlecock,
    about=ABOUT,
    source="Man, Zhao, Hu, 'Application of Kalman Filter in Track Prediction of Shuttlecock', "
    "IEEE ROBIO (2009)",
    charts=CHARTS,
    questions=QUESTIONS,
    notebook="notebooks/03_shuttlecock.ipynb",
    sections=SECTIONS,
    vary={"v_x": (1.2, 1.8), "v_y": (0.6, 1.0), "v_z": (3.7, 4.2), "k_m": (0.85, 1.15)},
    noise=("n_x", "n_y", "n_z"),
)
