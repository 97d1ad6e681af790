"""A football kick filmed by one camera: the smallest Kalman filter that teaches something.

The model steps the ball with mean velocities u, w; the camera sees pixels. The source keeps the
covariance of the forecast fixed, so both gains are constants. Its equations are kept as printed,
behind two switches: ``h`` = 1/2 and ``p`` = 1 are the printed model, ``h`` = 0 and ``p`` = 2 the
consistent one. ``along`` and ``first`` mend two more errors, in the free run alone, so that the
source's sheet stays as simple as it is. Beside it stands the filter of
:mod:`kfsheet.exercises.football.four_states`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sympy import Expr, IndexedBase, S, diag, sign, sqrt

from kfsheet.errors import DataError
from kfsheet.estimation.algebra import analysis
from kfsheet.exercises.football.charts import CHARTS
from kfsheet.exercises.football.four_states import add_four_states
from kfsheet.exercises.football.goal_line import add_goal_line
from kfsheet.exercises.football.kick import draw_kick
from kfsheet.exercises.football.words import ABOUT, QUESTIONS, SECTIONS, TASK
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import RMS, Mean, Missing, Std, t, when_observed
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.tables import Table, read_table

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
    add_goal_line(m)
    add_four_states(m)
    return m


def _parameters(m: Recurrence) -> None:
    dt = m.parameter("dt", STEP, "s", "time between two photos", sign="positive")
    m.parameter("g", 9.80665, "m/s2", "gravity")
    m.parameter("f", 0.03, "s/m", "friction (the unit is the source's)", sign="nonnegative")
    m.parameter("a", 44.2, "px/m", "pixels per metre", sign="positive")
    m.parameter("j_0", 500, "px", "vertical pixel of the ground")
    m.parameter("b_x", 0.01, "m2", "variance of the forecast of x, as believed", sign="nonnegative")
    m.parameter("b_z", 0.01, "m2", "variance of the forecast of z, as believed", sign="nonnegative")
    m.parameter("r_i", 9, "px2", "variance of the camera in i, as believed", sign="nonnegative")
    m.parameter("r_j", 9, "px2", "variance of the camera in j, as believed", sign="nonnegative")
    m.parameter("x_0", 23.4, "m", "start, distance to the goal line")
    m.parameter("z_0", 0.11, "m", "start, height")
    m.parameter("u_0", -22, "m/s", "start, horizontal velocity")
    m.parameter("w_0", 10.5, "m/s", "start, vertical velocity")
    m.parameter("h", 0.5, "", "half-step terms: 1/2 as printed, 0 consistent")
    m.parameter("p", 1, "", "power of dt in the friction of x, z: 1 as printed, 2 consistent")
    m.parameter("along", 0, "", "free run, friction: 0 per axis as printed, 1 drag f |V| V")
    m.parameter("first", 1, "", "free run, share of a step that photo 1 counts: 1, right is 1/2")
    m.parameter("q", 0.1, "m2/s3", "four states: what a step adds, (0.1 m/s)^2/dt", sign="positive")
    m.parameter("s_pos", 0.1, "m", "four states: start, error of the position", sign="positive")
    m.parameter("s_vel", 1, "m/s", "four states: start, error of the velocity", sign="positive")
    m.time(t * dt, "s", "time since the kick")


def _as_printed(m: Recurrence, v: Expr, other: Expr) -> Expr:
    """Friction of a velocity, each axis for itself, whatever the other one's velocity is."""
    return m["f"] * sign(v) * v**2


def _switched(m: Recurrence, v: Expr, other: Expr) -> Expr:
    """The same for along = 0; for along = 1 the drag f |V| V of a ball on its path."""
    return m["f"] * v * sqrt(v**2 + m["along"] * other**2)


def _throw(
    m: Recurrence,
    names: str,
    positions: tuple[IndexedBase, IndexedBase],
    words: str,
    friction: Callable[[Recurrence, Expr, Expr], Expr] = _as_printed,
    first: Expr = S.One,
) -> None:
    """One step of the model: columns u, w, x, z by their ``names``, from ``positions`` before.

    ``first`` is the share of a step's friction and gravity that photo 1 counts.
    """
    dt, g, h, p = m["dt", "g", "h", "p"]
    u, w, x_new, z_new = m[tuple(names.split())]
    x, z = positions
    slower_u = friction(m, u[t - 1], w[t - 1]) * dt
    slower_w = friction(m, w[t - 1], u[t - 1]) * dt + g * dt
    m.define(
        u[t],
        (x[t - 1] - x[t - 2]) / dt - slower_u,
        "m/s",
        f"{words}, mean horizontal velocity of the step",
        start=[m["u_0"], m["u_0"] - first * slower_u],
    )
    m.define(
        w[t],
        (z[t - 1] - z[t - 2]) / dt - slower_w,
        "m/s",
        f"{words}, mean vertical velocity of the step",
        start=[m["w_0"], m["w_0"] - first * slower_w],
    )
    m.define(
        x_new[t],
        x[t - 1] + u[t] * dt - h * friction(m, u[t], w[t]) * dt**p,
        "m",
        f"{words}, distance to the goal line",
        start=[m["x_0"]],
    )
    m.define(
        z_new[t],
        z[t - 1] + w[t] * dt - h * friction(m, w[t], u[t]) * dt**p - h * g * dt**2,
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

    _throw(m, "u w x_f z_f", (x_a, z_a), "forecast")
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
    """The same model without photos; two more of its errors can be mended here.

    The worksheet "Reanalysis" stays as the source prints it.
    """
    names = "u_free w_free x_free z_free"
    _, _, *positions = m.columns(*names.split(), section="Free run")
    _throw(m, names, tuple(positions), "no assimilation", _switched, m["first"])


def _errors(m: Recurrence, flight: Table) -> None:
    page = "Errors"
    i, j, a, j_0 = m["i", "j", "a", "j_0"]
    x_true = m.data("x_true", flight["x"], "m", "truth, distance to the goal line", section=page)
    z_true = m.data("z_true", flight["z"], "m", "truth, height", section=page)
    x_cam, z_cam = m.columns("x_cam", "z_cam", section=page)
    m.define(x_cam[t], when_observed(i[t], i[t] / a), "m", "camera alone, distance")
    m.define(z_cam[t], when_observed(j[t], (j_0 - j[t]) / a), "m", "camera alone, height")
    runs = {"a": "analysis", "cam": "camera alone", "free": "free run", "f": "forecast"}
    for run, words in runs.items():
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
    frozen=("Free run", "Four states"),
    draw=draw_kick,
    ranges={"i": (0, 2000), "j": (0, 2000)},  # pixels of a photo
)
