"""Draw the picture of README: one expression seen four ways, and what the filter tells.

python tools/draw_picture.py
"""

from pathlib import Path

import matplotlib.pyplot as plt

from kfsheet import draw, evaluate, excel_code, latex_code, python_code
from kfsheet.exercises.football import exercise, football

TARGET = Path(__file__).parents[1] / "notebooks" / "football.png"


def main() -> None:
    """Draw and save."""
    fig, axes = plt.subplots(
        1, 3, figsize=(13, 3.9), width_ratios=(1, 1.25, 1.1), layout="constrained"
    )
    _four_ways(axes[0])
    draw(exercise.charts[0], evaluate(football, h=0, p=2), axes[1])
    axes[1].legend_.set_ncols(3)
    _innovations(axes[2])
    fig.savefig(TARGET, dpi=110)


def _four_ways(ax: plt.Axes) -> None:
    gain = football.derived_scalars["K_x"].expression
    ways = [
        ("derived", f"$K_x = {latex_code(gain)}$", 17),
        ("evaluated", f"K_x = {python_code(gain)}", 10),
        ("written", f"={excel_code(gain)}", 10),
        ("checked", f"{evaluate(football).attrs['scalars']['K_x']:.12f}", 10),
    ]
    for place, (word, text, size) in zip((0.8, 0.54, 0.3, 0.06), ways, strict=True):
        ax.text(0, place + (0.11 if size > 10 else 0.06), word, color="#595959", fontsize=9)
        family = "sans-serif" if text.startswith("$") else "monospace"
        ax.text(0, place, text, fontsize=size, family=family, va="center")
    ax.set_axis_off()
    ax.set_title("One derivation")


def _innovations(ax: plt.Axes) -> None:
    for label, options, colour in (
        ("as printed", {}, "#D55E00"),
        ("mended", {"h": 0, "p": 2}, "#0072B2"),
    ):
        run = evaluate(football, **options)
        ax.plot(run["time"], run["d_i"], "o-", color=colour, label=label, markersize=4)
    for band in ("d_i_low", "d_i_high"):
        ax.plot(run["time"], run[band], "k--", linewidth=1)
    ax.set(
        title="The filter tells on its model",
        xlabel="time (s)",
        ylabel="innovation in i (px), 2 sigma band",
    )
    ax.grid(alpha=0.3)
    ax.legend(loc="lower right", frameon=False)


if __name__ == "__main__":
    main()
