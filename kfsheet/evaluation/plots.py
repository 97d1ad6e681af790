"""Chart specifications drawn by matplotlib: the same charts as in the workbook."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kfsheet.errors import DataError, EngineError
from kfsheet.model.chart import LOOKS, Chart

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

MARKERS = {"circle": "o", "diamond": "D", "": ""}
LINES = {"solid": "-", "dash": "--", "": ""}


def draw(chart: Chart, frame: pd.DataFrame, ax: Axes | None = None) -> Axes:
    """Draw a chart of an exercise from the columns of a run.

    Parameters
    ----------
    chart : Chart
        The specification.
    frame : pandas.DataFrame
        What :func:`kfsheet.evaluate` returned.
    ax : matplotlib axes, optional
        Where to draw; a new figure by default.

    Raises
    ------
    DataError
        If the frame lacks a column of the chart.
    EngineError
        If matplotlib is not installed.
    """
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        raise EngineError('drawing needs matplotlib: pip install "kfsheet[plots]"') from None
    wanted = {name for series in chart.series for name in (series.x, series.y)}
    wanted |= {chart.where} - {""}
    if missing := sorted(wanted - set(frame.columns)):
        raise DataError(f"chart {chart.title!r} needs column {missing[0]}, which the frame lacks")
    ax = ax or plt.subplots(figsize=(7, 4), layout="constrained")[1]
    if chart.where:
        frame = frame.where(frame[chart.where] != 0)
    for series in chart.series:
        look = LOOKS[series.role]
        ax.plot(
            frame[series.x],
            frame[series.y],
            color=f"#{look.colour}",
            linestyle=LINES[look.line],
            marker=MARKERS[look.marker],
            markersize=look.size - 1,
            linewidth=look.width,
            label=series.label or "_",
        )
    if chart.y_limits:
        ax.set_ylim(*chart.y_limits)
    if chart.origin_top_left:
        ax.set_ylim(ax.get_ylim()[1], 0)
        ax.set_xlim(left=0)
    ax.set(title=chart.title, xlabel=chart.x_label, ylabel=chart.y_label)
    ax.grid(alpha=0.3)
    # Below, as in the workbook: inside, it would hide what the chart is about.
    place = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16), "ncols": len(chart.series)}
    ax.legend(**place, frameon=False, fontsize="small", columnspacing=1.2)
    return ax
