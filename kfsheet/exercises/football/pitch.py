"""The set-up as a picture: the pitch, the ball's way, the camera and its pixels."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kfsheet.exercises.football.kick import flight
from kfsheet.exercises.football.model import football

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GREY, BLUE, ORANGE = "#595959", "#0072B2", "#E69F00"
METRES = {"xlabel": "x: distance to the goal line (m)", "ylabel": "z: height (m)"}


def draw_pitch(ax: Axes) -> Axes:
    """Draw what is known, what is photographed, and what the symbols mean."""
    p = football.defaults()
    x, z = flight(p)
    ax.plot(x, z, color=GREY, linewidth=1)
    ax.plot(x[1:], z[1:], "o", color=ORANGE, markersize=5)
    ax.plot(x[0], z[0], "o", color="black", markersize=9)
    ax.plot([0, 0], [0, 2.44], color="black", linewidth=4)
    ax.axhline(0, color="#009E73", linewidth=2)
    ax.text(0.3, 0.3, "goal, 2.44 m", color="black")
    arrow = {"arrowstyle": "->", "color": "black", "linewidth": 1.5}
    ax.annotate("", (x[0] - 3.6, z[0] + 1.72), (x[0], z[0]), arrowprops=arrow)
    ax.text(x[0], -0.6, "start $x_0, z_0, u_0, w_0$", ha="center")
    ax.text(x[7], z[7] + 0.25, "a photo every $\\Delta t$ = 0.1 s", color="#9A6B00", ha="center")
    _pixels(ax, p["j_0"] / p["a"])
    ax.set(**METRES, xlim=(-1.5, 27), ylim=(-0.9, 12.2))
    ax.grid(alpha=0.3)
    return ax


def _pixels(ax: Axes, top: float) -> None:
    """The frame of a photo: its origin is the top left corner, and j counts down."""
    arrow = {"arrowstyle": "->", "color": BLUE, "linewidth": 1.5}
    ax.plot([0, 26.5, 26.5, 0, 0], [0, 0, top, top, 0], color=BLUE, linewidth=0.8, linestyle=":")
    ax.annotate("", (4, top), (0, top), arrowprops=arrow)
    ax.annotate("", (0, top - 4), (0, top), arrowprops=arrow)
    ax.text(4.2, top - 0.15, "$i = a\\,x$ to the right", color=BLUE)
    ax.text(0.3, top - 4.2, "$j = j_0 - a\\,z$ down", color=BLUE)
    words = "seen by the camera: $a$ = 44.2 pixels a metre, $j_0$ = 500"
    ax.text(10.5, top - 1.4, words, color=BLUE)
