"""The charts of the cannon-ball, each drawn in the workbook and in the notebook."""

from __future__ import annotations

from dataclasses import replace

from kfsheet.model.chart import Chart, Series

NAMES = {"a": ("EKF", "line", "bound"), "lin": ("linear filter", "second line", "second band")}


def _claimed(run: str, name: str) -> tuple[Series, ...]:
    """An error or innovation, within the band that its filter claims."""
    label, role, band = NAMES[run]
    return (
        Series("time", name, label if name.startswith("e") else f"innovation {name}", role),
        Series("time", f"{name}_low", "", band),
        Series("time", f"{name}_high", "2 sigma band" + " (linear)" * (run == "lin"), band),
    )


def _over_time(
    title: str,
    label: str,
    series: tuple[Series, ...],
    note: str,
    limits: tuple[float, float] | None = None,
) -> Chart:
    return Chart(title, "time (s)", label, series, note=note, y_limits=limits)


def _in_a_cloud(name: str) -> tuple[Series, ...]:
    """The filter's error among the radar's, within its band."""
    cloud = Series("time", f"e_{name}_obs", "radar alone", "cloud")
    error, low, high = _claimed("a", f"e_{name}_a")
    return cloud, replace(low, label="-2 sigma"), replace(high, label="+2 sigma"), error


FLIGHT = (
    Series("x_obs", "y_obs", "radar", "cloud"),
    Series("x_true", "y_true", "truth", "truth"),
    Series("x_a", "y_a", "EKF", "line"),
)
CHARTS = (
    Chart(
        "The flight",
        "x: distance (m)",
        "y: height (m)",
        FLIGHT,
        note="Radar positions scatter by 500 m and more; the filter lies on the path.",
        where="in_flight",
    ),
    _over_time(
        "Is the filter honest?",
        "NIS",
        (Series("time", "NIS", "NIS", "cloud"),),
        "Normalised innovations squared: 2 in the mean, above 6 in one sweep of 20.",
        (0, 16),
    ),
    _over_time(
        "Range",
        "observed - forecast (m)",
        _claimed("a", "d_r"),
        "Innovations of r: 19 of 20 within the band. The first ones are outside the picture.",
        (-150, 150),
    ),
    _over_time(
        "Angle",
        "observed - forecast (rad)",
        _claimed("a", "d_theta"),
        "Innovations of theta.",
    ),
    _over_time(
        "Distance",
        "error of x (m)",
        _in_a_cloud("x"),
        "Errors: radar alone, and the EKF's.",
    ),
    _over_time(
        "Height",
        "error of y (m)",
        _in_a_cloud("y"),
        "The same for the height.",
    ),
    _over_time(
        "Distance, close up",
        "error of x (m)",
        _claimed("a", "e_x_a"),
        "The band is what the EKF claims.",
        (-60, 60),
    ),
    _over_time(
        "Height, close up", "error of y (m)", _claimed("a", "e_y_a"), "The same.", (-100, 100)
    ),
    _over_time(
        "Horizontal velocity",
        "error of vx (m/s)",
        _claimed("a", "e_vx_a"),
        "No sensor measures a velocity; the filter infers it.",
        (-4, 4),
    ),
    _over_time(
        "Vertical velocity", "error of vy (m/s)", _claimed("a", "e_vy_a"), "The same.", (-10, 10)
    ),
    _over_time(
        "Distance, extended or linear?",
        "error of x (m)",
        _claimed("lin", "e_x_lin") + _claimed("a", "e_x_a")[:1],
        "The same radar, two filters; the band is what the linear one claims.",
        (-60, 60),
    ),
    _over_time(
        "Height, extended or linear?",
        "error of y (m)",
        _claimed("lin", "e_y_lin") + _claimed("a", "e_y_a")[:1],
        "The same for the height.",
        (-100, 100),
    ),
)
