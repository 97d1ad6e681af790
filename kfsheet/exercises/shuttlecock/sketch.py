"""The set-up of the shuttlecock as a drawing, with the symbols of the model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

VELOCITY = np.array([1.5, 0.8, 4.0])


def flight_points(time: np.ndarray) -> np.ndarray:
    """Positions (m) of the kick of the workbook, with a drag over mass of 1/s."""
    X, g = 1 - np.exp(-time), 9.80665
    return np.column_stack([1.5 * X, 0.8 * X, 0.5 + (4 + g) * X - g * time])


def draw_setup(ax: Axes) -> Axes:
    """Two cameras, the track, the fall point and the robot, from the side.

    Parameters
    ----------
    ax : Axes
        Where to draw; axes in m.
    """
    track = flight_points(np.linspace(0, 0.8676, 80))
    frames = flight_points(np.arange(27) / 30)
    ball = frames[7]
    for x in (-0.75, -0.55):
        ax.plot([x, ball[0]], [1.05, ball[2]], color="#56B4E9", lw=0.8)
        ax.plot(x, 1.05, "s", color="#0072B2", ms=10)
    ax.text(-0.95, 1.2, "two cameras,\n30 frames/s", color="#0072B2", va="bottom")
    ax.plot(track[:, 0], track[:, 2], color="0.6", ls="--")
    ax.plot(frames[:8, 0], frames[:8, 2], "o", color="#E69F00", ms=4)
    ax.plot(*ball[[0, 2]], "ko", ms=7)
    ax.text(ball[0] - 0.04, ball[2] + 0.08, "$(x, y, z)$", ha="right")
    arrows = (((0.35, 0.22), "$v$", "#0072B2"), ((-0.28, -0.18), "$-k v$", "#D55E00"))
    for (dx, dz), label, colour in (*arrows, ((0, -0.35), "$-m g$", "0.3")):
        tip = ball[0] + dx, ball[2] + dz
        ax.annotate(
            "", tip, ball[[0, 2]], arrowprops={"arrowstyle": "->", "color": colour, "lw": 2}
        )
        ax.text(tip[0] + 0.03, tip[1] - 0.03, label, color=colour)
    ax.plot(track[-1, 0], 0, "x", color="#009E73", ms=12, mew=3)
    ax.text(track[-1, 0] + 0.06, 0.06, r"fall: where and when?", color="#009E73")
    ax.axhline(0, color="0.3", lw=1)
    ax.text(1.75, -0.16, "robot", ha="center")
    ax.plot([1.75, 1.6], [0, 0.18], color="k", lw=4)
    ax.set(xlabel="x: distance ahead (m)", ylabel="z: height (m)", xlim=(-1, 2), ylim=(-0.25, 1.65))
    ax.set_aspect("equal")
    return ax


def draw_angles(ax: Axes) -> Axes:
    """The velocity and its angles theta and phi, the source's Fig. 3, on a 3-d axis.

    Parameters
    ----------
    ax : Axes
        Made with ``projection="3d"``; axes in m/s.
    """
    vx, vy, vz = VELOCITY
    for tip, label, colour in (
        ((vx, vy, vz), "$v$", "#0072B2"),
        ((vx, 0, 0), "$v_x$", "0.3"),
        ((0, vy, 0), "$v_y$", "0.3"),
        ((0, 0, vz), "$v_z$", "0.3"),
    ):
        ax.plot(*([0, a] for a in tip), color=colour, lw=2)
        ax.text(*(1.08 * a for a in tip), label, color=colour)
    ax.plot([0, vx], [0, vy], [0, 0], color="0.5", ls=":")
    ax.plot([vx, vx], [vy, vy], [0, vz], color="0.5", ls=":")
    theta = np.linspace(0, np.arctan2(vy, vx), 20)
    ax.plot(0.9 * np.cos(theta), 0.9 * np.sin(theta), 0 * theta, color="#D55E00")
    ax.text(1.0, 0.28, 0, r"$\theta$", color="#D55E00")
    flat = np.hypot(vx, vy)
    phi = np.linspace(0, np.arctan2(flat, vz), 20)
    ax.plot(
        2 * np.sin(phi) * vx / flat, 2 * np.sin(phi) * vy / flat, 2 * np.cos(phi), color="#D55E00"
    )
    ax.text(0.35, 0.2, 2.1, r"$\varphi$", color="#D55E00")
    ax.set(xlabel="x (m/s)", ylabel="y (m/s)", zlabel="z (m/s)")
    return ax
