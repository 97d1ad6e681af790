"""The set-up of the cannon-ball as a drawing, with the symbols of the model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RADAR, BALL = 30.48, 1.6
"""Where the radar stands (km), and where the ball is drawn (x = v_x times so many tens of s)."""


def draw_setup(ax: Axes) -> Axes:
    """Cannon, flight and radar, and what the radar measures of the ball.

    Parameters
    ----------
    ax : Axes
        Where to draw; axes in km.
    """
    v = 0.915 / math.sqrt(2)  # km/s
    time = np.linspace(0, 2 * v / 0.00980665, 200)
    ax.plot(v * time, v * time - 0.00980665 * time**2 / 2, color="0.6", ls="--")
    x, y = v * 10 * BALL, v * 10 * BALL - 0.00980665 * (10 * BALL) ** 2 / 2
    ax.plot([RADAR, x], [0, y], color="#D55E00", lw=1.5)
    ax.plot([RADAR, RADAR + 9], [0, 0], color="#D55E00", lw=1, ls=":")
    turn = np.linspace(0, math.atan2(y, x - RADAR), 60)
    ax.plot(RADAR + 5 * np.cos(turn), 5 * np.sin(turn), color="#D55E00", lw=1)
    ax.text(RADAR + 4.5, 4.5, r"$\theta$", color="#D55E00", fontsize=14)
    ax.text((x + RADAR) / 2, y / 2 + 1.2, "$r$", color="#D55E00", fontsize=14)
    arrow = {"arrowstyle": "->", "color": "#0072B2"}
    for tip, label, shift in (((x + 7, y), "$v_x$", (0.3, -2.2)), ((x, y + 6), "$v_y$", (-3.2, 0))):
        ax.annotate("", tip, (x, y), arrowprops=arrow)
        ax.text(tip[0] + shift[0], tip[1] + shift[1], label, color="#0072B2", fontsize=12)
    ax.plot(x, y, "ko", ms=7)
    ax.text(x - 1, y + 0.8, "$(x, y)$", ha="right")
    ax.plot(0, 0, "ks", ms=8)
    ax.text(0, -3.6, "cannon, $45°$", ha="center")
    ax.plot(RADAR, 0, "^", color="#D55E00", ms=12)
    ax.text(RADAR, -3.6, "radar $(x_R, y_R)$", ha="center")
    ax.set(xlabel="distance (km)", ylabel="height (km)", xlim=(-6, 88), ylim=(-6, 25))
    ax.set_aspect("equal")
    return ax
