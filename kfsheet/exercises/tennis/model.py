"""A tennis ball before two cameras: triangulation, an extended Kalman filter, and the impact.

Camera 1 sees the whole flight from behind, camera 2 eight images of it from the side. The filter
takes every pixel by itself, so that an image of one camera alone is worth what it is worth.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

from sympy import Piecewise, Symbol, diag, sqrt, zeros

from kfsheet.estimation.kalman import add_filter
from kfsheet.estimation.state_space import Intermediate, Observation, State, StateSpace
from kfsheet.exercises.tennis.calculators import add_cameras, add_centroid
from kfsheet.exercises.tennis.charts import CHARTS
from kfsheet.exercises.tennis.methods.cameras import FOCAL_LENGTH, PIXELS
from kfsheet.exercises.tennis.methods.dynamics import GRAVITY
from kfsheet.exercises.tennis.methods.shots import (
    DRIVE,
    SIGMA,
    TOSS,
    Scene,
    Shot,
    read_shot,
    simulate,
)
from kfsheet.exercises.tennis.track import (
    AXES,
    add_flight,
    add_start,
    add_triangulation,
    length,
    push,
)
from kfsheet.exercises.tennis.words import ABOUT, QUESTIONS, SECTIONS, TASK
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import (
    RMS,
    Last,
    Missing,
    Observed,
    Sum,
    t,
    when_observed,
)
from kfsheet.model.recurrence import Recurrence

if TYPE_CHECKING:
    from numpy.random import RandomState

DATA = Path(__file__).parent / "data"
PHOTOS = {
    # pixel: words, camera, its coordinate
    "u1": ("camera 1, pixels to the right", 1, 0),
    "v1": ("camera 1, pixels down", 1, 1),
    "u2": ("camera 2, pixels to the right", 2, 0),
    "v2": ("camera 2, pixels down", 2, 1),
}


def read_drive() -> Shot:
    """Shot A, a drive: 101 images, of which camera 2 has eight."""
    return read_shot(DATA / "tennis_drive.csv", DRIVE)


def read_toss() -> Shot:
    """Shot B, a slow toss, photographed likewise."""
    return read_shot(DATA / "tennis_toss.csv", TOSS)


def build_model(shot: Shot | None = None, name: str = "tennis") -> Recurrence:
    """The tennis ball, from the placing of the cameras to the impact.

    Parameters
    ----------
    shot : Shot, optional
        Photos, truth and cameras; the drive by default.
    name : str
        Name of the recurrence and of its workbook.
    """
    shot = shot or read_drive()
    m = Recurrence(name, title="A tennis ball before two cameras", step="image")
    _parameters(m, shot.scene)
    add_cameras(m)
    add_centroid(m)
    _photos(m, shot)
    add_triangulation(m)
    add_start(m)
    add_filter(m, flight_model(m), section="Kalman filter")
    add_flight(m)
    _errors(m, shot)
    return m


def _parameters(m: Recurrence, scene: Scene) -> None:
    dt = m.parameter("dt", 0.01, "s", "time between two images", sign="positive")
    m.parameter("g", GRAVITY, "m/s2", "gravity")
    m.parameter("kappa", scene.ball.kappa, "1/m", "drag c_D/m", sign="nonnegative")
    for k, value in enumerate(scene.ball.spin, 1):
        m.parameter(f"lambda_{k}", value, "1/s", f"lift c_L Omega/m, component {k}")
    m.parameter("f_px", FOCAL_LENGTH, "px", "focal length of both cameras", sign="positive")
    m.parameter("u_c", PIXELS / 2, "px", "pixel straight ahead, in u and in v")
    for k, camera in ((1, scene.camera_1), (2, scene.camera_2)):
        for axis, value in zip("xyz", camera.position, strict=True):
            m.parameter(f"c{k}_{axis}", value, "m", f"camera {k}, position {axis}")
    m.parameter("sigma_px", SIGMA, "px", "error of a pixel", sign="positive")
    m.parameter("s_x", 0.1, "m", "start, claimed error of the position", sign="positive")
    m.parameter("s_v", 1, "m/s", "start, claimed error of the velocity", sign="positive")
    rounded = "start, rounded to this part of the claimed error"
    m.parameter("n_round", 100, "", rounded, sign="positive")
    m.parameter("Phi_s", 0, "m2/s3", "noise of the model, spectral density", sign="nonnegative")
    m.parameter("h_fly", 0.01, "s", "longest step of the flight to the ground", sign="positive")
    m.parameter("h_ground", 1e-6, "m", "height that counts as on the ground", sign="positive")
    shown = "largest innovation sigma that charts show as a band, in sigma_px"
    m.parameter("n_band", 3.5, "", shown, sign="positive")
    m.time(t * dt, "s", "time since the first image")


def _photos(m: Recurrence, shot: Shot) -> None:
    for name, (words, camera, way) in PHOTOS.items():
        pixels = (shot.pixels_1, shot.pixels_2)[camera - 1][:, way]
        m.data(name, pixels, "px", words, section="Photos", may_be_missing=True)


def flight_model(m: Recurrence) -> StateSpace:
    """Position and velocity; a midpoint step of (3.1); a pixel as an observation.

    v_m = v + a(v) dt/2,   x <- x + v_m dt,   v <- v + a(v_m) dt
    """
    dt, f, u_c, Phi_s, r = *m["dt", "f_px", "u_c", "Phi_s"], m["sigma_px"] ** 2
    x = {k: Symbol(f"x{k}", real=True) for k in AXES}
    v = {k: Symbol(f"vx{k}", real=True) for k in AXES}
    state = {x[k]: State("m", words, m[f"x{k}_0"], m["s_x"] ** 2) for k, words in AXES.items()} | {
        v[k]: State("m/s", f"velocity {w}", m[f"v{k}_0"], m["s_v"] ** 2) for k, w in AXES.items()
    }
    speed, speed_m = Symbol("speed", real=True), Symbol("speed_m", real=True)
    half = {k: Symbol(f"vm{k}", real=True) for k in AXES}
    at_half = [
        v[k] + dt / 2 * a for k, a in zip(AXES, push(m, list(v.values()), speed), strict=True)
    ]
    intermediates = {
        speed: Intermediate("m/s", "speed at the start of the step", length(list(v.values()))),
        **{
            half[k]: Intermediate("m/s", f"velocity in the middle of the step, {AXES[k]}", rule)
            for k, rule in zip(AXES, at_half, strict=True)
        },
        speed_m: Intermediate("m/s", "speed in the middle", length(list(half.values()))),
    }
    bend = push(m, list(half.values()), speed_m)
    transition = [x[k] + half[k] * dt for k in AXES]
    transition += [v[k] + dt * a for k, a in zip(AXES, bend, strict=True)]
    depth_1, depth_2 = x[1] - m["c1_x"], x[2] - m["c2_y"]
    predicted = {
        "u1": u_c - f * (x[2] - m["c1_y"]) / depth_1,
        "v1": u_c - f * (x[3] - m["c1_z"]) / depth_1,
        "u2": u_c + f * (x[1] - m["c2_x"]) / depth_2,
        "v2": u_c - f * (x[3] - m["c2_z"]) / depth_2,
    }
    seen = [Observation(name, m[name][t], h, r, "px") for name, h in predicted.items()]
    Q = diag(zeros(3, 3), *[Phi_s * dt] * 3)
    return StateSpace(state, transition, Q, seen, intermediates)


def _errors(m: Recurrence, shot: Shot) -> None:
    page = "Errors"
    for k, words in AXES.items():
        true = m.data(f"x{k}_true", shot.truth[:, k - 1], "m", f"truth, {words}", section=page)
        for run, what in (("tri", "triangulation"), ("a", "filter")):
            (e,) = m.columns(f"e_{run}_x{k}", section=page)
            estimate = m[f"x{k}_{run}"][t]
            error = estimate - true[t]
            seen = when_observed(estimate, error) if run == "tri" else error
            m.define(e[t], seen, "m", f"error of x{k}, {what}")
            m.summary(f"rms_{run}_x{k}", RMS(e), "m", f"rms error of x{k}, {what}")
            if run == "a":
                m.summary(f"end_x{k}", Last(e), "m", f"error of x{k} in the last image, filter")
    for name in PHOTOS:
        variance = m["S_u1" if name == "u1" else f"S_{name}_f"][t]
        low, high = m.columns(f"d_{name}_low", f"d_{name}_high", section=page)
        # The band of the start, hundreds of pixels wide, would make the chart of the rest a line.
        settled = variance < (m["n_band"] * m["sigma_px"]) ** 2
        band = Piecewise(
            (2 * sqrt(variance), Observed(m[f"d_{name}"][t]) & settled), (Missing, True)
        )
        words = f"band of d_{name}, once it is narrow"
        m.define(high[t], band, "px", f"{words}: +2 sigma", start=[Missing])
        m.define(low[t], when_observed(high[t], -high[t]), "px", f"{words}: -2 sigma")
    one, two, seen = m.columns("n_1", "n_2", "n_seen", section=page)
    for column, (u, v) in ((one, ("u1", "v1")), (two, ("u2", "v2"))):
        number = when_observed(m[u][t], 1, 0) + when_observed(m[v][t], 1, 0)
        words = f"pixels of camera {u[-1]} that the filter was given; none in its first row"
        m.define(column[t], number, "", words, start=[0])
    m.define(seen[t], one[t] + two[t], "", "pixels of both")
    ratio = Sum(m["NIS"]) / Sum(seen)
    m.summary("mean_NIS", ratio, "", "NIS for one pixel; an honest filter: 1")


tennis = build_model()


def exercise_of(model: Recurrence, shot: Shot) -> Exercise:
    """The exercise of a shot: the same words, charts and questions."""

    def photographed_again(dice: RandomState, p: Mapping[str, float]) -> dict[str, list]:
        """The same flight, photographed with other errors."""
        again = simulate(shot, dice.randint(2**31), p["sigma_px"])
        pixels = {
            name: (again.pixels_1, again.pixels_2)[camera - 1][:, way]
            for name, (_, camera, way) in PHOTOS.items()
        }
        return {
            name: [None if isnan(v) else round(v, 3) for v in values.tolist()]
            for name, values in pixels.items()
        }

    return Exercise(
        model=model,
        about=ABOUT,
        source="Workshop report, chapter 3: The Tennis Ball Problem",
        charts=CHARTS,
        questions=QUESTIONS,
        task=TASK,
        notebook="notebooks/04_tennis.ipynb",
        sections=SECTIONS,
        alarm=("ball_fits", "landed"),
        vary={"sigma_px": (0.15, 0.3), "s_x": (0.08, 0.15), "s_v": (0.8, 1.5)},
        draw=photographed_again,
        ranges=dict.fromkeys(("u1", "v1", "u2", "v2"), (0, 2000)),  # pixels of an image
        sealed=("Triangulation", "Kalman filter", "Flight"),
    )


exercise = exercise_of(tennis, read_drive())
