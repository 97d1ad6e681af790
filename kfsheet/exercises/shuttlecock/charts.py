"""The charts of the shuttlecock, each drawn in the workbook and in the notebook."""

from __future__ import annotations

from kfsheet.exercises.shuttlecock.filters import AXES
from kfsheet.exercises.shuttlecock.forecasts import FORECASTS
from kfsheet.model.chart import Chart, Series


def _axis_chart(axis: str, note: str) -> Chart:
    series = (
        Series("time", f"{axis}_low", "", "bound"),
        Series("time", f"{axis}_high", "truth ± 2 sigma", "bound"),
        Series("time", f"{axis}_true", "truth", "truth"),
        Series("time", f"{axis}_obs", "cameras", "observation"),
        Series("time", f"{axis}_a", "filter", "analysis"),
    )
    title = AXES[axis].capitalize()
    return Chart(title, "time (s)", f"{axis}: {AXES[axis]} (m)", series, note=note)


def _error_chart(title: str, runs: dict[str, str], note: str) -> Chart:
    series = tuple(Series("time", f"e_fall_{run}", FORECASTS[run], runs[run]) for run in runs)
    theory = Series("time", "e_theory", "theory of the fit, rms", "bound")
    words = "time of the frame (s)", "error of the fall point (m)"
    # Two frames make a fit that may err by many metres; the rest would be a flat line.
    return Chart(title, *words, (theory, *series), note=note, y_limits=(0, 1.5))


CHARTS = (
    _axis_chart("x", "19 of 20 camera positions lie in the band; the filter's scatter less."),
    _axis_chart("y", "The noise is in proportion to the signal on each axis."),
    _axis_chart("z", "The shuttlecock falls just after the last frame."),
    Chart(
        "Velocity upwards",
        "time (s)",
        "vz (m/s)",
        (
            Series("time", "vz_true", "truth", "truth"),
            Series("time", "vz_a", "filter", "line"),
            Series("time", "vz_a_ex", "exact filter", "forecast"),
        ),
        note="Neither filter is told a velocity; both start at 0.",
    ),
    _error_chart(
        "The fall point, from fits",
        {"raw": "second", "kf": "first"},
        "Does filtering first help? The notebook flies 400 times. Theory: if the model is right.",
    ),
    _error_chart(
        "The fall point, from latest states",
        {"raw": "second", "now": "free", "ex": "forecast"},
        "The exact filter soon is the fit, frame by frame; the three-state filter forgets.",
    ),
)
