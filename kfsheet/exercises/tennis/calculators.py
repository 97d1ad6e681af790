"""Two calculators as worksheets: where to put the cameras, and what light does to a centroid."""

from __future__ import annotations

from sympy import Abs, And, Max, Min, Mod, Piecewise, asin, cos, floor, pi, sin, sqrt

from kfsheet.exercises.tennis.methods.cameras import ANGLE, PIXELS
from kfsheet.model.expressions import Last, Smallest, Sum, SumProduct, t
from kfsheet.model.recurrence import Recurrence


def add_cameras(m: Recurrence, section: str = "Cameras") -> None:
    """Section 3.2 of the report: the distance that eight pixels allow, and the error diamond.

    A row is an angle between the lines of sight and the line through both cameras.
    """
    m.rows_are(section, "angle")
    r = m.parameter("r_ball", 0.035, "m", "radius of the ball; the ground is that far below it")
    p = m.parameter("n_ball", 8, "", "pixels needed across the ball", sign="positive")
    alpha = m.parameter("alpha", ANGLE, "rad", "visibility angle of the lens", sign="positive")
    n = m.parameter("n_px", PIXELS, "", "resolution, pixels across the image", sign="positive")
    half = m.parameter("half", 5.5, "m", "half the distance of the cameras", sign="positive")
    first = m.parameter("theta_first", 20, "deg", "first angle of the table")
    step = m.parameter("theta_step", 0.5, "deg", "step of the angle")
    m.derived("d_max", 2 * r * n / (alpha * p), "m", "largest distance of a camera to the ball")
    eps = m.derived("eps", alpha / n, "rad", "angle of a pixel")
    best = eps / 2 + pi / 8 + asin(cos(eps) / sqrt(2)) / 2
    m.derived("theta_best", best, "rad", "angle at which the longer diagonal is shortest")
    apex = pi - 2 * asin(1 / sqrt(3))
    m.derived("apex_best", apex, "rad", "angle between the lines of sight for the least rms")
    names = ("theta_deg", "theta", "H", "V", "longer", "rms_cross")
    degrees, theta, H, V, longer, rms = m.columns(*names, section=section)
    m.define(degrees[t], first + t * step, "deg", "line of sight against base line")
    m.define(theta[t], degrees[t] * pi / 180, "rad", "the same in rad")
    a = theta[t]
    m.define(H[t], 2 * half * sin(eps) / sin(2 * a - eps), "m", "diagonal along the base line")
    across = half * sin(eps) / (cos(a) * cos(a - eps))
    m.define(V[t], across, "m", "diagonal across the base line")
    m.define(longer[t], Max(H[t], V[t]), "m", "the longer diagonal: the largest error")
    error = eps * half / (sqrt(2) * sin(a) * cos(a) ** 2)
    m.define(rms[t], error, "m", "rms error of the crossing, if each angle errs by eps")
    m.summary("least_longer", Smallest(longer), "m", "shortest of the longer diagonals")
    m.summary("least_rms", Smallest(rms), "m", "least rms error of the crossing")


WINDOW = 10
"""Pixels along a side of the image of the ball; 101 rows hold it, and one pixel of background."""


def add_centroid(m: Recurrence, section: str = "Centroid") -> None:
    """Section 3.4 of the report: the centre of intensity of a ball that is lit from a side.

    A row is a pixel of an image of 10 x 10; the last row is the first pixel of an eleventh line.
    """
    m.rows_are(section, "pixel")
    _add_light(m)
    m.columns("i_px", "j_px", "n_right", "n_down", "n_depth", "light", "weight", section=section)
    _add_pixels(m)
    i_0, j_0, R, side, pitch = m["i_ball", "j_ball", "radius_px", "window", "pitch"]
    i, j, w = m["i_px", "j_px", "weight"]
    # Pixels that would touch the ball, but have no row, begin at the sides of the image, and on
    # the line of the last row, which is not complete.
    inside = And(Min(i_0, j_0) - R >= -pitch, i_0 + R <= side * pitch, j_0 + R <= Last(j))
    words = "1: the rows hold the whole ball; 0: a part is cut off, the shift is wrong"
    m.summary("ball_fits", Piecewise((1, inside), (0, True)), "", words)
    for name, at, centre, words in (("i", i, i_0, "right"), ("j", j, j_0, "down")):
        found = m.summary(
            f"{name}_centroid", SumProduct(w, at) / Sum(w), "px", f"centre of intensity, {words}"
        )
        m.summary(f"shift_{name}", (found - centre) / R, "", f"its shift over the radius, {words}")


def _add_light(m: Recurrence) -> None:
    """Parameters of the ball, its light and the image; the shift by the report's closed form."""
    words = "pixels along a side of the image; 10 fill the rows, see ball_fits"
    m.parameter("window", WINDOW, "", words, sign="positive")
    m.parameter("i_ball", 4.5, "px", "true centre of the ball, to the right")
    m.parameter("j_ball", 4.5, "px", "true centre of the ball, down")
    m.parameter("radius_px", 4, "px", "radius of the ball in the image", sign="positive")
    angle = m.parameter("phi", 90, "deg", "light: 0 behind the camera, 90 from the right")
    phi = m.derived("phi_rad", angle * pi / 180, "rad", "the same in rad")
    m.parameter("ambient", 0, "", "light from everywhere", sign="nonnegative")
    m.parameter("albedo", 1, "", "brightness of the ball", sign="nonnegative")
    m.parameter("wall", 0, "", "brightness of the background", sign="nonnegative")
    m.parameter("threshold", 0, "", "smallest difference that counts", sign="nonnegative")
    m.parameter("pitch", 1, "px", "distance of two pixels", sign="positive")
    theory = 3 * pi / 16 * sin(phi) * (1 + cos(phi)) / ((pi - phi) * cos(phi) + sin(phi))
    m.derived("shift_theory", theory, "", "shift over radius: closed form, for ambient = wall = 0")


def _add_pixels(m: Recurrence) -> None:
    """Lambert's law, pixel by pixel, and what is left once the background is taken away."""
    side, pitch, i_0, j_0, R = m["window", "pitch", "i_ball", "j_ball", "radius_px"]
    phi, ambient, albedo, wall, least = m["phi_rad", "ambient", "albedo", "wall", "threshold"]
    i, j, a, b, c, light, w = m["i_px", "j_px", "n_right", "n_down", "n_depth", "light", "weight"]
    m.define(i[t], Mod(t, side) * pitch, "px", "pixel, to the right")
    m.define(j[t], floor(t / side) * pitch, "px", "pixel, down")
    m.define(a[t], (i[t] - i_0) / R, "", "normal of the ball there, to the right")
    m.define(b[t], (j[t] - j_0) / R, "", "normal of the ball there, down")
    depth = sqrt(Max(0, 1 - a[t] ** 2 - b[t] ** 2))
    m.define(c[t], depth, "", "normal of the ball there, to the camera; 0 beside the ball")
    lit = albedo * (ambient + Max(0, a[t] * sin(phi) + c[t] * cos(phi)))
    shown = Piecewise((lit, c[t] > 0), (wall, True))
    m.define(light[t], shown, "", "brightness in the image: Lambert's law")
    difference = Abs(light[t] - wall)
    counted = Piecewise((difference, difference > least), (0, True))
    m.define(w[t], counted, "", "what is left of it after subtraction of the background")
