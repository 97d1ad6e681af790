"""What a reader of the cannon-ball's workbook sees beside the numbers: words, charts, questions."""

from __future__ import annotations

from kfsheet.charts import Chart, Series
from kfsheet.exercise import Question

ABOUT = (
    "A ball is fired at 915 m/s and 45 degrees. A radar 30 km downrange measures its angle "
    "(error 0.01 rad) and its range (error 30.48 m) ten times a second. There is no drag; the "
    "filters know gravity, but start with positions and velocities that are wrong.",
    "Two filters see the same radar. The extended Kalman filter (sheet EKF) takes angle and range "
    "as they are and linearises them at each forecast: the columns H_. The linear filter (sheet "
    "Linear) is given positions computed from angle and range, one axis at a time.",
    "Try this: on the sheet Parameters, make the radar worse (sigma_theta = 0.03) or the barrel "
    "lower (angle = 35) and look at the Charts. Then set Phi_s to 10: the filters now distrust "
    "their model, never rest, and follow the noise. mean_NIS tells whether a filter errs as much "
    "as it says: two observations, so 2 is expected.",
    "Everything is live. Rows after the landing are grey and leave the statistics. An elevation "
    "above 45 degrees flies longer than the table; make dt larger.",
)
SECTIONS = {
    "Truth": "the flight without errors, stepped as the source steps it",
    "Radar": "angle and range: truth plus noise from fixed draws; positions computed from them",
    "EKF": "the extended filter: forecast, innovations one after the other, gain, analysis",
    "Linear": "the linear filter on computed positions (names end in _lin)",
    "Errors": "estimates minus truth, and the 2 sigma bands that the extended filter claims",
}


def _residuals(
    title: str,
    label: str,
    name: str,
    raw: str = "",
    note: str = "",
    limits: tuple[float, float] | None = None,
) -> Chart:
    band = (
        Series("time", f"{name}_low", "", "bound"),
        Series("time", f"{name}_high", "2 sigma band", "bound"),
    )
    cloud = (Series("time", raw, "radar alone", "cloud"),) if raw else ()
    line = Series("time", name, "EKF" if name.startswith("e") else f"innovation {name}", "line")
    return Chart(title, "time (s)", label, (*cloud, line, *band), note=note, y_limits=limits)


CHARTS = (
    Chart(
        "The flight",
        "x: distance (m)",
        "y: height (m)",
        (
            Series("x_obs", "y_obs", "radar", "cloud"),
            Series("x_true", "y_true", "truth", "truth"),
            Series("x_a", "y_a", "EKF", "line"),
        ),
        note="Radar positions scatter by 500 m and more; the filter lies on the path.",
    ),
    _residuals(
        "Range",
        "observed - forecast (m)",
        "d_r",
        note="Innovations of r: 19 of 20 within the band. The first ones are outside the picture.",
        limits=(-150, 150),
    ),
    _residuals("Angle", "observed - forecast (rad)", "d_theta", note="Innovations of theta."),
    _residuals(
        "Distance", "error of x (m)", "e_x_a", "e_x_obs", "Errors: radar alone, and the EKF's."
    ),
    _residuals("Height", "error of y (m)", "e_y_a", "e_y_obs", "The same for the height."),
    _residuals(
        "Distance, close up",
        "error of x (m)",
        "e_x_a",
        note="The band is what the EKF claims.",
        limits=(-60, 60),
    ),
    _residuals("Height, close up", "error of y (m)", "e_y_a", note="The same.", limits=(-100, 100)),
    Chart(
        "Extended or linear?",
        "time (s)",
        "error of y (m)",
        (
            Series("time", "e_y_lin", "linear filter", "second line"),
            Series("time", "e_y_a", "EKF", "line"),
        ),
        note="The same radar, two filters.",
        y_limits=(-200, 200),
    ),
)
QUESTIONS = (
    Question("x_f", 1, "One step of the motion without drag, from the analysis before."),
    Question("y_f", 1, "As x_f, with gravity."),
    Question("vy_f", 1, "Velocity one step later."),
    Question("d_theta", 2, "Observed minus predicted angle; wrap it to (-pi, pi]."),
    Question("H_theta_x", 2, "Derivative of the angle; mind the sign."),
    Question("H_theta_y", 2, "Derivative of the angle with respect to y."),
    Question("H_r_x", 1, "Derivative of the range with respect to x."),
    Question("H_r_y", 1, "Derivative of the range with respect to y."),
    Question("S_theta", 2, "H P H' + r with the covariance of the forecast."),
    Question("K_x_theta", 2, "P H' / S, first element."),
    Question("K_y_theta", 2, "P H' / S, third element."),
    Question("P_xx_1", 2, "P - K S K', first element."),
    Question("x_a", 1, "The state after both observations."),
    Question("y_a", 1, "The state after both observations."),
)
