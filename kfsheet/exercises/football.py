"""A football kick filmed by one camera: the smallest Kalman filter that teaches something.

The model steps the ball with mean velocities u, w; the camera sees pixels. The source keeps the
covariance of the forecast fixed, so both gains are constants. Its equations are kept as printed,
behind two switches: ``h`` = 1/2 and ``p`` = 1 are the printed model, ``h`` = 0 the consistent one.
"""

from __future__ import annotations

from pathlib import Path

from sympy import Abs, Expr, Piecewise, diag, sign, sqrt

from kfsheet.algebra import analysis
from kfsheet.charts import Chart, Series
from kfsheet.errors import DataError
from kfsheet.exercise import Exercise, Question
from kfsheet.expressions import RMS, Last, Mean, Missing, Std, t, when_observed
from kfsheet.recurrence import Recurrence
from kfsheet.tables import read_table

DATA = Path(__file__).parent / "data"
STEP = 0.1  # s, between two photos


def build_model(
    camera: str | Path = DATA / "football_camera.csv",
    truth: str | Path = DATA / "football_truth.csv",
) -> Recurrence:
    """The football reanalysis for a table of photos and the trajectory behind them.

    Parameters
    ----------
    camera : path
        CSV with columns ``photo, t, i, j``: number, time in s, pixels; an empty pixel is a
        missing photo.
    truth : path
        CSV with columns ``photo, t, x, z``: number, time in s, metres.

    Raises
    ------
    DataError
        If a table is not as described.
    """
    photos = read_table(camera, ("photo", "t", "i", "j"), times="t", may_be_missing=("i", "j"))
    flight = read_table(truth, ("photo", "t", "x", "z"), times="t")

    _check_times(camera, photos, truth, flight)

    m = Recurrence("football", title="Reanalysis of a football kick", step="photo")

    dt = m.parameter("dt", STEP, "s", "time between two photos", sign="positive")
    g = m.parameter("g", 9.80665, "m/s2", "gravity")
    f = m.parameter("f", 0.03, "s/m", "friction (the unit is the source's)", sign="nonnegative")
    a = m.parameter("a", 44.2, "px/m", "pixels per metre", sign="positive")
    j_0 = m.parameter("j_0", 500, "px", "vertical pixel of the ground")
    b_x = m.parameter("b_x", 0.01, "m2", "variance of the forecast of x", sign="nonnegative")
    b_z = m.parameter("b_z", 0.01, "m2", "variance of the forecast of z", sign="nonnegative")
    r_i = m.parameter("r_i", 9, "px2", "variance of the camera in i", sign="nonnegative")
    r_j = m.parameter("r_j", 9, "px2", "variance of the camera in j", sign="nonnegative")
    x_0 = m.parameter("x_0", 23.4, "m", "start, distance to the goal line")
    z_0 = m.parameter("z_0", 0.11, "m", "start, height")
    u_0 = m.parameter("u_0", -22, "m/s", "start, horizontal velocity")
    w_0 = m.parameter("w_0", 10.5, "m/s", "start, vertical velocity")
    h = m.parameter("h", 0.5, "", "half-step terms: 1/2 as printed, 0 consistent")
    p = m.parameter("p", 1, "", "power of dt in the friction of x, z: 1 as printed, 2 consistent")

    def friction(v: Expr) -> Expr:
        return f * sign(v) * v**2

    m.time(t * dt, "s", "time since the kick")
    page = "Reanalysis"
    i = m.data(
        "i", photos["i"], "px", "photo, pixels to the right", section=page, may_be_missing=True
    )
    j = m.data("j", photos["j"], "px", "photo, pixels down", section=page, may_be_missing=True)
    u, w, x_f, z_f, d_i, d_j, x_a, z_a = m.columns(
        "u", "w", "x_f", "z_f", "d_i", "d_j", "x_a", "z_a", section=page
    )

    # The gain, derived: B, R diagonal, and an observation operator that is affine in x and z.
    pixels = [a * x_f[t], j_0 - a * z_f[t]]
    A = analysis([x_f[t], z_f[t]], pixels, [i[t], j[t]], diag(b_x, b_z), diag(r_i, r_j))
    K_x = m.derived("K_x", A.K[0, 0], "m/px", "gain: metres in x for a pixel in i")
    K_z = m.derived("K_z", A.K[1, 1], "m/px", "gain: metres in z for a pixel in j (down)")
    sigma_d_i = m.derived("sigma_d_i", sqrt(A.S[0, 0]), "px", "theory: standard deviation of d_i")
    sigma_d_j = m.derived("sigma_d_j", sqrt(A.S[1, 1]), "px", "theory: standard deviation of d_j")
    p_x = m.derived("p_x", A.P_a[0, 0], "m2", "theory: variance of the analysis of x")
    p_z = m.derived("p_z", A.P_a[1, 1], "m2", "theory: variance of the analysis of z")

    def throw(x: Expr, z: Expr, u: Expr, w: Expr, x_new: Expr, z_new: Expr, words: str) -> None:
        """One step of the model from the positions x, z to x_new, z_new."""
        m.define(
            u[t],
            (x[t - 1] - x[t - 2]) / dt - friction(u[t - 1]) * dt,
            "m/s",
            f"{words}, mean horizontal velocity of the step",
            start=[u_0, u_0 - friction(u[t - 1]) * dt],
        )
        m.define(
            w[t],
            (z[t - 1] - z[t - 2]) / dt - friction(w[t - 1]) * dt - g * dt,
            "m/s",
            f"{words}, mean vertical velocity of the step",
            start=[w_0, w_0 - friction(w[t - 1]) * dt - g * dt],
        )
        m.define(
            x_new[t],
            x[t - 1] + u[t] * dt - h * friction(u[t]) * dt**p,
            "m",
            f"{words}, distance to the goal line",
            start=[x_0],
        )
        m.define(
            z_new[t],
            z[t - 1] + w[t] * dt - h * friction(w[t]) * dt**p - h * g * dt**2,
            "m",
            f"{words}, height",
            start=[z_0],
        )

    throw(x_a, z_a, u, w, x_f, z_f, "forecast")
    for d, y, seen, K, x, x_new, words in (
        (d_i, i, A.innovation[0], K_x, x_f, x_a, "in i (right)"),
        (d_j, j, A.innovation[1], K_z, z_f, z_a, "in j (down)"),
    ):
        innovation = when_observed(y[t], seen)
        m.define(d[t], innovation, "px", f"innovation {words}", start=[Missing])
        corrected = when_observed(d[t], x[t] + K * d[t], x[t])
        name = f"analysis, {'distance to the goal line' if x is x_f else 'height'}"
        m.define(x_new[t], corrected, "m", name, start=[x[t]])

    page = "Free run"
    free = m.columns("u_free", "w_free", "x_free", "z_free", section=page)
    u_free, w_free, x_free, z_free = free
    throw(x_free, z_free, u_free, w_free, x_free, z_free, "no assimilation")

    page = "Errors"
    x_true = m.data("x_true", flight["x"], "m", "truth, distance to the goal line", section=page)
    z_true = m.data("z_true", flight["z"], "m", "truth, height", section=page)
    x_cam, z_cam = m.columns("x_cam", "z_cam", section=page)
    m.define(x_cam[t], when_observed(i[t], i[t] / a), "m", "camera alone, distance")
    m.define(z_cam[t], when_observed(j[t], (j_0 - j[t]) / a), "m", "camera alone, height")
    for run, x, z, words in (
        ("a", x_a, z_a, "analysis"),
        ("cam", x_cam, z_cam, "camera alone"),
        ("free", x_free, z_free, "free run"),
    ):
        for axis, column, true in (("x", x, x_true), ("z", z, z_true)):
            (e,) = m.columns(f"e_{axis}_{run}", section=page)
            error = column[t] - true[t]
            seen = when_observed(column[t], error) if run == "cam" else error
            m.define(e[t], seen, "m", f"error of {axis}, {words}")
            m.summary(f"rms_{axis}_{run}", RMS(e), "m", f"rms error of {axis}, {words}")

    m.summary("mean_d_i", Mean(d_i), "px", "mean innovation in i; theory: 0")
    m.summary("std_d_i", Std(d_i), "px", "standard deviation of d_i; theory: sigma_d_i")
    m.summary("mean_d_j", Mean(d_j), "px", "mean innovation in j; theory: 0")
    m.summary("std_d_j", Std(d_j), "px", "standard deviation of d_j; theory: sigma_d_j")

    page = "Pixel frame"
    for run, x, z, words in (
        ("f", x_f, z_f, "forecast"),
        ("a", x_a, z_a, "analysis"),
        ("true", x_true, z_true, "truth"),
    ):
        i_run, j_run = m.columns(f"i_{run}", f"j_{run}", section=page)
        m.define(i_run[t], a * x[t], "px", f"{words}, pixels to the right")
        m.define(j_run[t], j_0 - a * z[t], "px", f"{words}, pixels down")
    for d, sigma in (("d_i", sigma_d_i), ("d_j", sigma_d_j)):
        low, high = m.columns(f"{d}_low", f"{d}_high", section=page)
        m.define(low[t], -2 * sigma, "px", f"band of {d}: -2 sigma")
        m.define(high[t], 2 * sigma, "px", f"band of {d}: +2 sigma")

    page = "Goal line"
    u_next, w_next, wait, s_wait, z_goal, slope, s_goal = m.columns(
        "u_next", "w_next", "wait", "s_wait", "z_goal", "slope", "s_goal", section=page
    )
    step_x = (x_a[t] - x_a[t - 1]) / dt - friction(u[t]) * dt
    step_z = (z_a[t] - z_a[t - 1]) / dt - friction(w[t]) * dt - g * dt
    m.define(u_next[t], step_x, "m/s", "mean horizontal velocity of the next step", start=[u_0])
    m.define(w_next[t], step_z, "m/s", "mean vertical velocity of the next step", start=[w_0])
    approaching = u_next[t] < 0
    m.define(
        wait[t],
        Piecewise((-x_a[t] / u_next[t], approaching), (Missing, True)),
        "s",
        "time left until the goal line, at this velocity",
    )
    # Within the next step w_next is the mean velocity; gravity bends the path around it.
    bend = g * wait[t] * (dt - wait[t]) / 2
    height = z_a[t] + w_next[t] * wait[t] + bend
    m.define(
        z_goal[t],
        when_observed(wait[t], height),
        "m",
        "height at the goal line, forecast from this photo on",
    )
    slope_then = (w_next[t] + g * (dt / 2 - wait[t])) / u_next[t]
    m.define(slope[t], when_observed(wait[t], slope_then), "", "slope of the path at the goal line")
    # Error propagation: x_a and z_a of this photo and of the one before, taken as independent.
    # Their errors are in fact positively correlated, so both spreads are on the safe side.
    spread = (1 + wait[t] / dt) ** 2 + (wait[t] / dt) ** 2
    m.define(
        s_wait[t],
        when_observed(wait[t], sqrt(spread * p_x) / Abs(u_next[t])),
        "s",
        "standard deviation of wait, as if analyses erred independently",
    )
    m.define(
        s_goal[t],
        when_observed((wait[t], slope[t]), sqrt(spread * (p_z + slope[t] ** 2 * p_x))),
        "m",
        "standard deviation of z_goal, as if analyses erred independently",
    )
    m.summary("goal_wait", Last(wait), "s", "goal line: time after the last photo")
    m.summary("goal_wait_sigma", Last(s_wait), "s", "goal line: standard deviation of that time")
    m.summary("goal_height", Last(z_goal), "m", "goal line: height of the ball")
    m.summary("goal_sigma", Last(s_goal), "m", "goal line: standard deviation of the height")
    return m


def _check_times(camera: object, photos: dict, truth: object, flight: dict) -> None:
    """Photos come at even steps: a missing one is a row without pixels, not a missing row."""
    for path, table in ((camera, photos), (truth, flight)):
        for row, (number, time) in enumerate(zip(table["photo"], table["t"], strict=True)):
            if number != row or abs(time - row * STEP) > 1e-9:
                raise DataError(
                    f"{path}: row {row} is photo {number:g} at {time:g} s; it must be photo {row} "
                    f"at {row * STEP:g} s; leave i and j empty where there is no photo"
                )


football = build_model()

ABOUT = (
    "A football is kicked from 23.4 m towards the goal line at x = 0 and photographed ten times a "
    "second. Each photo gives two pixels, with an error of 3 pixels; a simple model of the flight "
    "gives a forecast, with an error of 0.1 m. The filter weighs one against the other.",
    "Try this: on the sheet Parameters, change r_i and r_j from 9 to 900 (a camera with an error "
    "of 30 pixels instead of 3). The gains K_x and K_z fall, and the analysis leans on the model. "
    "Then look at the innovations on the sheet Charts: they should scatter about zero, within two "
    "standard deviations. As printed in the source, the model does not pass that test.",
    "Then delete a photo (a green cell on the sheet Reanalysis): the analysis of that row is the "
    "forecast. The photos are simulated with quadratic drag in fine steps, so the filter's model "
    "is not the truth.",
)
SECTIONS = {
    "Reanalysis": "photos, forecast, innovation, analysis: one row per photo",
    "Free run": "the same model without the photos",
    "Errors": "truth, the camera alone, and what each estimate is wrong by",
    "Pixel frame": "everything as the camera sees it, and the 2 sigma bands of the innovations",
    "Goal line": "when and how high the ball will cross x = 0, forecast anew from every photo",
}
CHARTS = (
    Chart(
        "The kick, in metres",
        "x: distance to the goal line (m)",
        "z: height (m)",
        (
            Series("x_true", "z_true", "truth", "truth"),
            Series("x_free", "z_free", "free run", "free"),
            Series("x_cam", "z_cam", "camera", "observation"),
            Series("x_f", "z_f", "forecast", "forecast"),
            Series("x_a", "z_a", "analysis", "analysis"),
        ),
        note="The ball flies from right to left. The free run is the model without photos.",
    ),
    Chart(
        "The kick, as the camera sees it",
        "i: pixels to the right",
        "j: pixels down",
        (
            Series("i_true", "j_true", "truth", "truth"),
            Series("i", "j", "camera", "observation"),
            Series("i_f", "j_f", "forecast", "forecast"),
            Series("i_a", "j_a", "analysis", "analysis"),
        ),
        note="The origin of the pixels is the top left corner.",
        origin_top_left=True,
    ),
    Chart(
        "Innovations in i",
        "time (s)",
        "d_i: observation - forecast (px)",
        (
            Series("time", "d_i", "innovation d_i", "first"),
            Series("time", "d_i_low", "", "band"),
            Series("time", "d_i_high", "2 sigma band", "band"),
        ),
        note="A sound filter's innovations scatter about zero, 19 of 20 inside the band.",
    ),
    Chart(
        "Innovations in j",
        "time (s)",
        "d_j: observation - forecast (px)",
        (
            Series("time", "d_j", "innovation d_j", "second"),
            Series("time", "d_j_low", "", "second band"),
            Series("time", "d_j_high", "2 sigma band", "second band"),
        ),
        note="The same for the vertical pixel, which counts downwards.",
    ),
    Chart(
        "Errors of x",
        "time (s)",
        "estimate - truth (m)",
        (
            Series("time", "e_x_cam", "camera alone", "observation"),
            Series("time", "e_x_a", "analysis", "analysis"),
        ),
        note="With the model as printed, the analysis of x is worse than the camera alone.",
    ),
    Chart(
        "Height at the goal line, forecast from each photo",
        "time of the photo (s)",
        "z_goal (m)",
        (Series("time", "z_goal", "z_goal", "analysis"),),
        note="The forecast settles as the ball comes closer.",
    ),
)
QUESTIONS = (
    Question("K_x", 2, "Simplify B H' (R + H B H')^-1 for diagonal B and R."),
    Question("K_z", 2, "The linear part of j = j_0 - a z has a sign."),
    Question("u", 2, "Mean velocity of the step, from the two analyses before it."),
    Question("w", 2, "As u, with gravity."),
    Question("x_f", 2, "One step of the model from the analysis before."),
    Question("z_f", 2, "As x_f, with gravity."),
    Question("d_i", 1, "Observation minus what the camera would see of the forecast."),
    Question("d_j", 1, "The whole of H, also its constant part."),
    Question("x_a", 2, "Forecast plus gain times innovation."),
    Question("z_a", 2, "As x_a; mind the sign of K_z."),
)
exercise = Exercise(
    model=football,
    about=ABOUT,
    source="Course exercise 'Reanalysis of a football kick using the Kalman Filter'",
    charts=CHARTS,
    questions=QUESTIONS,
    notebook="notebooks/01_football.ipynb",
    sections=SECTIONS,
)
