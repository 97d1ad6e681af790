"""Charts as specifications: drawn natively in the workbook and by matplotlib in the notebook."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from kfsheet.errors import ModelError
from kfsheet.printing.sentence import Verdict

if TYPE_CHECKING:
    from kfsheet.model.recurrence import Recurrence


@dataclass(frozen=True)
class Look:
    """How a series is drawn: colour as RRGGBB, line ('', 'solid', 'dash'), marker, width in pt."""

    colour: str
    line: str = "solid"
    marker: str = ""
    width: float = 1.75
    size: int = 5  # of a marker, in pt


# By role, so that truth looks like truth on every chart; colours that the colour-blind tell apart.
LOOKS = {
    "truth": Look("222222", width=1.5),
    "observation": Look("E69F00", line="", marker="circle"),
    "forecast": Look("009E73", line="", marker="diamond"),
    "analysis": Look("0072B2", marker="circle"),
    "free": Look("CC79A7", line="dash"),
    "first": Look("0072B2", marker="circle"),
    "second": Look("D55E00", marker="diamond"),
    "line": Look("0072B2", width=1.25),
    "second line": Look("D55E00", width=1.25),
    "cloud": Look("E69F00", line="", marker="circle", size=2),  # hundreds of observations
    "bound": Look("222222", line="dash", width=1.25),
    "band": Look("0072B2", line="dash", width=1.0),
    "second band": Look("D55E00", line="dash", width=1.0),
}


@dataclass(frozen=True)
class Series:
    """Column ``y`` against column ``x``.

    Parameters
    ----------
    x, y : str
        Names of columns; ``time`` is the clock.
    label : str
        What the legend says; a series without label, ``""``, stays out of it.
    role : str
        What it shows, which decides how it is drawn: one of ``LOOKS``, as ``"truth"``.
    """

    x: str
    y: str
    label: str
    role: str


@dataclass(frozen=True)
class Chart:
    """One chart: axes with units, and the sentence that says what to look for.

    Parameters
    ----------
    title : str
        Above the chart.
    x_label, y_label : str
        Of the axes, with units, as in ``"time (s)"``.
    series : tuple of Series
        What is drawn, the last on top.
    note : str or Verdict
        The sentence above it: what to look for, or what is to be seen in the run.
    origin_top_left : bool
        Whether y grows downwards, as in a photo.
    y_limits : tuple of (lowest, highest), optional
        Range of y, where a few large values would hide the rest.
    where : str
        A column that is 0 in rows that are not drawn: what a ball would do underground.
    """

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    note: str | Verdict = ""
    origin_top_left: bool = False
    y_limits: tuple[float, float] | None = None
    where: str = ""

    def check(self, model: Recurrence) -> None:
        """Refuse a chart of columns or roles that do not exist."""
        if not isinstance(self.series, tuple) or not self.series:
            raise ModelError(f"chart {self.title!r}: series must be a tuple of at least one Series")
        if self.where:
            model.column(self.where)
        if isinstance(self.note, Verdict):
            self.note.check(model.scalars(), model.name)
        for series in self.series:
            model.column(series.x), model.column(series.y)
            if series.role not in LOOKS:
                raise ModelError(
                    f"chart {self.title!r}: no role {series.role!r}; there is {', '.join(LOOKS)}"
                )
