"""A football kick filmed by one camera: the smallest Kalman filter that teaches something.

The model steps the ball with mean velocities u, w; the camera sees pixels. The source keeps the
covariance of the forecast fixed, so both gains are constants. Its equations are kept as printed,
behind two switches: ``h`` = 1/2 and ``p`` = 1 are the printed model, ``h`` = 0 the consistent one.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING

from sympy import Abs, Expr, IndexedBase, Piecewise, diag, sign, sqrt

from kfsheet.errors import DataError
from kfsheet.estimation.algebra import analysis
from kfsheet.exercises.football.charts import CHARTS
from kfsheet.exercises.football.words import ABOUT, QUESTIONS, SECTIONS, TASK
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import RMS, Last, Mean, Missing, Std, t, when_observed
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.tables import Table, read_table

if TYPE_CHECKING:
    from numpy.random import RandomState

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
    _parameters(m)
    _reanalysis(m, photos)
    _free_run(m)
    _errors(m, flight)
    _pixel_frame(m)
    _goal_line(m)
    return m


def _parameters(m: Recurrence) -> None:
    dt = m.parameter("dt", STEP, "s", "time between two photos", sign="positive")
    m.parameter("g", 9.80665, "m/s2", "gravity")
    m.parameter("f", 0.03, "s/m", "friction (the unit is the source's)", sign="nonnegative")
    m.parameter("a", 44.2, "px/m", "pixels per metre", sign="positive")
    m.parameter("j_0", 500, "px", "vertical pixel of the ground")
    m.parameter("b_x", 0.01, "m2", "variance of the forecast of x", sign="nonnegative")
    m.parameter("b_z", 0.01, "m2", "variance of the forecast of z", sign="nonnegative")
    m.parameter("r_i", 9, "px2", "variance of the camera in i", sign="nonnegative")
    m.parameter("r_j", 9, "px2", "variance of the camera in j", sign="nonnegative")
    m.parameter("x_0", 23.4, "m", "start, distance to the goal line")
    m.parameter("z_0", 0.11, "m", "start, height")
    m.parameter("u_0", -22, "m/s", "start, horizontal velocity")
    m.parameter("w_0", 10.5, "m/s", "start, vertical velocity")
    m.parameter("h", 0.5, "", "half-step terms: 1/2 as printed, 0 consistent")
    m.parameter("p", 1, "", "power of dt in the friction of x, z: 1 as printed, 2 consistent")
    m.time(t * dt, "s", "time since the kick")


def _friction(m: Recurrence, v: Expr) -> Expr:
    return m["f"] * sign(v) * v**2


def _throw(
    m: Recurrence, names: str, x: IndexedBase, z: IndexedBase, x_new: str, z_new: str, words: str
) -> None:
    """One step of the model, from the positions x, z of the rows before to x_new, z_new."""
    dt, g, h, p = m["dt", "g", "h", "p"]
    u, w = m[tuple(names.split())]
    slower_u, slower_w = _friction(m, u[t - 1]) * dt, _friction(m, w[t - 1]) * dt + g * dt
    m.define(
        u[t],
        (x[t - 1] - x[t - 2]) / dt - slower_u,
        "m/s",
        f"{words}, mean horizontal velocity of the step",
        start=[m["u_0"], m["u_0"] - slower_u],
    )
    m.define(
        w[t],
        (z[t - 1] - z[t - 2]) / dt - slower_w,
        "m/s",
        f"{words}, mean vertical velocity of the step",
        start=[m["w_0"], m["w_0"] - slower_w],
    )
    m.define(
        m[x_new][t],
        x[t - 1] + u[t] * dt - h * _friction(m, u[t]) * dt**p,
        "m",
        f"{words}, distance to the goal line",
        start=[m["x_0"]],
    )
    m.define(
        m[z_new][t],
        z[t - 1] + w[t] * dt - h * _friction(m, w[t]) * dt**p - h * g * dt**2,
        "m",
        f"{words}, height",
        start=[m["z_0"]],
    )


def _reanalysis(m: Recurrence, photos: Table) -> None:
    a, j_0, b_x, b_z, r_i, r_j = m["a", "j_0", "b_x", "b_z", "r_i", "r_j"]
    page = "Reanalysis"
    gaps = {"section": page, "may_be_missing": True}
    i = m.data("i", photos["i"], "px", "photo, pixels to the right", **gaps)
    j = m.data("j", photos["j"], "px", "photo, pixels down", **gaps)
    _, _, x_f, z_f, d_i, d_j, x_a, z_a = m.columns(
        "u", "w", "x_f", "z_f", "d_i", "d_j", "x_a", "z_a", section=page
    )

    # The gain, derived: B, R diagonal, and an observation operator that is affine in x and z.
    pixels = [a * x_f[t], j_0 - a * z_f[t]]
    A = analysis([x_f[t], z_f[t]], pixels, [i[t], j[t]], diag(b_x, b_z), diag(r_i, r_j))
    K_x = m.derived("K_x", A.K[0, 0], "m/px", "gain: metres in x for a pixel in i")
    K_z = m.derived("K_z", A.K[1, 1], "m/px", "gain: metres in z for a pixel in j (down)")
    m.derived("sigma_d_i", sqrt(A.S[0, 0]), "px", "theory: standard deviation of d_i")
    m.derived("sigma_d_j", sqrt(A.S[1, 1]), "px", "theory: standard deviation of d_j")
    m.derived("p_x", A.P_a[0, 0], "m2", "theory: variance of the analysis of x")
    m.derived("p_z", A.P_a[1, 1], "m2", "theory: variance of the analysis of z")

    _throw(m, "u w", x_a, z_a, "x_f", "z_f", "forecast")
    for d, y, seen, K, x, x_new, way, what in (
        (d_i, i, A.innovation[0], K_x, x_f, x_a, "right", "distance to the goal line"),
        (d_j, j, A.innovation[1], K_z, z_f, z_a, "down", "height"),
    ):
        innovation, corrected = when_observed(y[t], seen), x[t] + K * d[t]
        m.define(d[t], innovation, "px", f"innovation in {y} ({way})", start=[Missing])
        m.define(
            x_new[t], when_observed(d[t], corrected, x[t]), "m", f"analysis, {what}", start=[x[t]]
        )
    for d, sigma in (("d_i", "sigma_d_i"), ("d_j", "sigma_d_j")):
        m.summary(f"mean_{d}", Mean(m[d]), "px", f"mean innovation {d}; theory: 0")
        m.summary(f"std_{d}", Std(m[d]), "px", f"standard deviation of {d}; theory: {sigma}")


def _free_run(m: Recurrence) -> None:
    columns = m.columns("u_free", "w_free", "x_free", "z_free", section="Free run")
    _throw(m, "u_free w_free", *columns[2:], "x_free", "z_free", "no assimilation")


def _errors(m: Recurrence, flight: Table) -> None:
    page = "Errors"
    i, j, a, j_0 = m["i", "j", "a", "j_0"]
    x_true = m.data("x_true", flight["x"], "m", "truth, distance to the goal line", section=page)
    z_true = m.data("z_true", flight["z"], "m", "truth, height", section=page)
    x_cam, z_cam = m.columns("x_cam", "z_cam", section=page)
    m.define(x_cam[t], when_observed(i[t], i[t] / a), "m", "camera alone, distance")
    m.define(z_cam[t], when_observed(j[t], (j_0 - j[t]) / a), "m", "camera alone, height")
    for run, words in (("a", "analysis"), ("cam", "camera alone"), ("free", "free run")):
        for axis, true in (("x", x_true), ("z", z_true)):
            column = m[f"{axis}_{run}"]
            (e,) = m.columns(f"e_{axis}_{run}", section=page)
            error = column[t] - true[t]
            seen = when_observed(column[t], error) if run == "cam" else error
            m.define(e[t], seen, "m", f"error of {axis}, {words}")
            m.summary(f"rms_{axis}_{run}", RMS(e), "m", f"rms error of {axis}, {words}")


def _pixel_frame(m: Recurrence) -> None:
    page = "Pixel frame"
    for run, words in (("f", "forecast"), ("a", "analysis"), ("true", "truth")):
        i_run, j_run = m.columns(f"i_{run}", f"j_{run}", section=page)
        x, z = m[f"x_{run}", f"z_{run}"]
        m.define(i_run[t], m["a"] * x[t], "px", f"{words}, pixels to the right")
        m.define(j_run[t], m["j_0"] - m["a"] * z[t], "px", f"{words}, pixels down")
    for d in ("d_i", "d_j"):
        low, high = m.columns(f"{d}_low", f"{d}_high", section=page)
        m.define(low[t], -2 * m[f"sigma_{d}"], "px", f"band of {d}: -2 sigma")
        m.define(high[t], 2 * m[f"sigma_{d}"], "px", f"band of {d}: +2 sigma")


def _goal_line(m: Recurrence) -> None:
    """When and how high the ball will cross x = 0, forecast anew from every photo."""
    names = "u_next", "w_next", "wait", "s_wait", "z_goal", "slope", "s_goal"
    m.columns(*names, section="Goal line")
    _crossing(m)
    _spread_of_crossing(m)
    wait, s_wait, z_goal, s_goal = m["wait", "s_wait", "z_goal", "s_goal"]
    m.summary("goal_wait", Last(wait), "s", "goal line: time after the last photo")
    m.summary("goal_wait_sigma", Last(s_wait), "s", "goal line: standard deviation of that time")
    m.summary("goal_height", Last(z_goal), "m", "goal line: height of the ball")
    m.summary("goal_sigma", Last(s_goal), "m", "goal line: standard deviation of the height")


def _crossing(m: Recurrence) -> None:
    """The time left, the height and the slope there, from the latest two analyses."""
    dt, g, u, w, x_a, z_a = m["dt", "g", "u", "w", "x_a", "z_a"]
    u_next, w_next, wait, z_goal, slope = m["u_next", "w_next", "wait", "z_goal", "slope"]
    step_x = (x_a[t] - x_a[t - 1]) / dt - _friction(m, u[t]) * dt
    step_z = (z_a[t] - z_a[t - 1]) / dt - _friction(m, w[t]) * dt - g * dt
    start_x, start_z = [m["u_0"]], [m["w_0"]]
    m.define(u_next[t], step_x, "m/s", "mean horizontal velocity of the next step", start=start_x)
    m.define(w_next[t], step_z, "m/s", "mean vertical velocity of the next step", start=start_z)
    m.define(
        wait[t],
        Piecewise((-x_a[t] / u_next[t], u_next[t] < 0), (Missing, True)),
        "s",
        "time left until the goal line, at this velocity",
    )
    # Within the next step w_next is the mean velocity; gravity bends the path around it.
    bend = g * wait[t] * (dt - wait[t]) / 2
    m.define(
        z_goal[t],
        when_observed(wait[t], z_a[t] + w_next[t] * wait[t] + bend),
        "m",
        "height at the goal line, forecast from this photo on",
    )
    slope_then = (w_next[t] + g * (dt / 2 - wait[t])) / u_next[t]
    m.define(slope[t], when_observed(wait[t], slope_then), "", "slope of the path at the goal line")


def _spread_of_crossing(m: Recurrence) -> None:
    """Standard deviations of the time left and of the height, to first order in the errors."""
    dt, u_next, wait, s_wait, slope, s_goal = m["dt", "u_next", "wait", "s_wait", "slope", "s_goal"]
    # Error propagation: x_a and z_a of this photo and of the one before, taken as independent.
    # Their errors are in fact positively correlated, so both spreads are on the safe side.
    spread = (1 + wait[t] / dt) ** 2 + (wait[t] / dt) ** 2
    in_time, in_height = spread * m["p_x"], spread * (m["p_z"] + slope[t] ** 2 * m["p_x"])
    m.define(
        s_wait[t],
        when_observed(wait[t], sqrt(in_time) / Abs(u_next[t])),
        "s",
        "standard deviation of wait, as if analyses erred independently",
    )
    m.define(
        s_goal[t],
        when_observed((wait[t], slope[t]), sqrt(in_height)),
        "m",
        "standard deviation of z_goal, as if analyses erred independently",
    )


def _check_times(camera: object, photos: Table, truth: object, flight: Table) -> None:
    """Photos come at even steps: a missing one is a row without pixels, not a missing row."""
    for path, table in ((camera, photos), (truth, flight)):
        for row, (number, time) in enumerate(zip(table["photo"], table["t"], strict=True)):
            if number != row or abs(time - row * STEP) > 1e-9:
                raise DataError(
                    f"{path}: row {row} is photo {number:g} at {time:g} s; it must be photo {row} "
                    f"at {row * STEP:g} s; leave i and j empty where there is no photo"
                )


football = build_model()


def draw_kick(dice: RandomState, p: Mapping[str, float]) -> dict[str, list[float | None]]:
    """Another kick, simulated like the first one; one pixel of each kind is not observed."""
    x, z = _flight(p)
    n_i, n_j = dice.normal(size=(2, football.rows))
    i = [p["a"] * v + p["r_i"] ** 0.5 * n for v, n in zip(x, n_i, strict=True)]
    j = [p["j_0"] - p["a"] * v + p["r_j"] ** 0.5 * n for v, n in zip(z, n_j, strict=True)]
    seen = {"i": [round(v, 1) for v in i], "j": [round(v, 1) for v in j]}
    for pixels in seen.values():
        pixels[dice.randint(3, football.rows - 3)] = None
    return {**seen, "x_true": [round(v, 6) for v in x], "z_true": [round(v, 6) for v in z]}


def _flight(p: Mapping[str, float], parts: int = 100) -> tuple[list[float], list[float]]:
    """Quadratic drag f along the path, in fine steps, from the start values."""
    x, z, u, w = p["x_0"], p["z_0"], p["u_0"], p["w_0"]
    h = p["dt"] / parts
    path = [(x, z)]
    for _ in range(football.rows - 1):
        for _ in range(parts):
            speed = hypot(u, w)
            du, dw = -p["f"] * speed * u * h, -(p["f"] * speed * w + p["g"]) * h
            x, z = x + (u + du / 2) * h, z + (w + dw / 2) * h
            u, w = u + du, w + dw
        path.append((x, z))
    return [p[0] for p in path], [p[1] for p in path]


exercise = Exercise(
    model=football,
    about=ABOUT,
    source="Course exercise 'Reanalysis of a football kick using the Kalman Filter'",
    charts=CHARTS,
    questions=QUESTIONS,
    task=TASK,
    notebook="notebooks/01_football.ipynb",
    sections=SECTIONS,
    vary={
        "x_0": (22.5, 25),
        "u_0": (-23, -20),
        "w_0": (9.5, 11.5),
        "a": (40, 50),
        "j_0": (480, 520),
        "b_x": (0.006, 0.02),
        "b_z": (0.006, 0.02),
    },
    frozen=("Free run",),
    draw=draw_kick,
    ranges={"i": (0, 2000), "j": (0, 2000)},  # pixels of a photo
)
