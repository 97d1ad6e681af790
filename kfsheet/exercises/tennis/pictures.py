"""Pictures of the tennis notebooks: the scene with its symbols, and spreads of draws as dots."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from kfsheet.exercises.tennis.methods.dynamics import Ball, impact
from kfsheet.exercises.tennis.methods.shots import Shot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIDEWAYS = 0.28  # how far dots lie from the middle of their column at most


def draw_scene(ax: Axes, shot: Shot, impact: ArrayLike) -> None:
    """Both cameras, the flight and where it comes down, from above, with the symbols.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    shot : Shot
        The photos.
    impact : array_like
        (3,) where the ball comes down, m.
    """
    one, two = shot.scene.camera_1.position, shot.scene.camera_2.position
    x, seen = shot.truth, shot.overlap
    ax.plot(x[:, 0], x[:, 1], "0.6", lw=1.5, zorder=1)
    ax.plot(*x[seen, :2].T, "o", ms=4, color="tab:orange", label="images 5 to 12: both cameras")
    ax.plot(*impact[:2], "x", ms=9, mew=2, color="tab:red", label="impact")
    for place, k in ((one, seen[0]), (one, 100), (two, seen[0]), (two, seen[-1])):
        ax.plot(*zip(place[:2], x[k, :2], strict=True), ":", color="tab:blue", lw=1)
    arrow = {"arrowstyle": "->", "color": "tab:blue", "lw": 1.8}
    for name, place, way, where in (
        ("camera 1, 101 images", one, (2.2, 0), (-0.6, -1.6)),
        ("camera 2, 8 images", two, (0, 1.6), (0.7, 0.1)),
    ):
        end = (place[0] + way[0], place[1] + way[1])
        ax.annotate("", end, place[:2], arrowprops=arrow)
        ax.plot(*place[:2], "s", ms=9, color="tab:blue")
        ax.text(place[0] + where[0], place[1] + where[1], name, color="tab:blue")
    ax.annotate("", x[20, :2] + [0, 0.4], x[0, :2] + [0, 0.4], arrowprops={"arrowstyle": "->"})
    ax.text(x[20, 0] + 0.2, x[20, 1] + 0.3, "V")
    ax.text(x[0, 0] - 0.5, x[0, 1] + 0.3, "X")
    ax.text(x[70, 0], x[70, 1] + 0.35, "$c_D$, $\\Omega$, $g$ bend it", color="0.35")
    ax.set(xlabel="$x_1$: away from camera 1 (m)", ylabel="$x_2$: away from camera 2 (m)")
    ax.set_ylim(-0.9, max(8.5, float(impact[1]) + 1.5))
    ax.grid(alpha=0.3)
    ax.legend(loc="lower right")


def draw_spread(
    ax: Axes,
    spreads: Mapping[str, ArrayLike],
    theory: Mapping[str, float] | None = None,
    unit: str = "rms error of a draw (mm)",
) -> None:
    """A column of dots for each name, one dot a draw; a bar at the root mean square.

    Parameters
    ----------
    ax : Axes
        Where to draw; the scale is logarithmic.
    spreads : mapping
        Name -> (draws,) values above 0.
    theory : mapping, optional
        Name -> what the root mean square should be: a ring.
    unit : str
        Of the axis.
    """
    for n, (name, values) in enumerate(spreads.items()):
        values = np.asarray(values, float)
        # In the order of the draws, to and fro: dots of one height do not hide each other.
        offset = SIDEWAYS * np.sin(2.4 * np.arange(len(values)))
        ax.plot(n + offset, values, ".", color="tab:blue", alpha=0.6)
        ax.plot(n + np.array([-0.38, 0.38]), [np.sqrt(np.mean(values**2))] * 2, "k-", lw=2)
        if theory and name in theory:
            ax.plot(n + 0.44, theory[name], "o", mfc="none", mec="tab:red", ms=8)
    ax.set_yscale("log")
    _plain_numbers(ax)
    ax.set_xticks(range(len(spreads)), list(spreads))
    ax.set_ylabel(unit)
    ax.grid(alpha=0.3, axis="y", which="both")


def _plain_numbers(ax: Axes) -> None:
    """1, 2, 5, 10 along the logarithmic axis instead of powers."""
    from matplotlib.ticker import LogLocator, NullFormatter

    ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter(NullFormatter())


def draw_values(ax: Axes, values: Mapping[str, float], unit: str) -> None:
    """A dot with its number for each name, from above, on a logarithmic scale."""
    names = list(values)
    for n, name in enumerate(names):
        ax.plot(values[name], n, "o", color="tab:blue", ms=7)
        ax.annotate(
            f"{values[name]:,.0f}" if values[name] >= 10 else f"{values[name]:.1f}",
            (values[name], n),
            xytext=(8, -4),
            textcoords="offset points",
        )
    ax.set_yticks(range(len(names)), names)
    ax.invert_yaxis()
    ax.set_xscale("log")
    ax.margins(x=0.15, y=0.08)
    ax.set_xlabel(unit)
    ax.grid(alpha=0.3, which="both")


def draw_before_after(ax: Axes, before: ArrayLike, after: ArrayLike) -> None:
    """Spreads of (draws, 3) rms errors of the coordinates, two columns for each, mm."""
    both = {"first": np.asarray(before), "after": np.asarray(after)}
    columns = {f"x{k + 1} {what}": e[:, k] for k in range(3) for what, e in both.items()}
    draw_spread(ax, columns)


def draw_foretold(ax: Axes, shot: Shot, ball: Ball, images: int) -> None:
    """Side view of a flight foretold from the first images, beside the truth; its miss as title."""
    time, x = impact(ball)
    true, path = impact(shot.scene.ball)[1], ball.fly(np.linspace(0, time, 50))
    ax.plot(*shot.truth[:, [0, 2]].T, "0.6", lw=4, label="truth")
    ax.plot(path[:, 0], path[:, 2], "--", label=f"foretold from {images} images")
    ax.plot(shot.truth[:images, 0], shot.truth[:images, 2], ".", color="k", ms=3, label="seen")
    ax.plot(true[0], true[2], "x", color="tab:red", ms=10, label="true impact")
    ax.set(xlabel="x1 (m)", ylabel="height x3 (m)", title=f"misses by {x[0] - true[0]:.2f} m")
    ax.grid(alpha=0.3)
    ax.legend()
