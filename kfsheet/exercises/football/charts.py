"""The charts of the football, each drawn in the workbook and in the notebook."""

from __future__ import annotations

from kfsheet.model.chart import Chart, Series

CHARTS = (
    Chart(
        "The kick, in metres",
        "x: distance to the goal line (m)",
        "z: height (m)",
        (
            Series("x_true", "z_true", "truth", "truth"),
            Series("x_free", "z_free", "free run", "free"),
            Series("x_cam", "z_cam", "camera", "observation"),
            Series("x_f", "z_f", "forecast", "forecast"),
            Series("x_a", "z_a", "analysis", "analysis"),
        ),
        note="The ball flies from right to left. The free run is the model without photos.",
    ),
    Chart(
        "The kick, as the camera sees it",
        "i: to the right (px)",
        "j: down (px)",
        (
            Series("i_true", "j_true", "truth", "truth"),
            Series("i", "j", "camera", "observation"),
            Series("i_f", "j_f", "forecast", "forecast"),
            Series("i_a", "j_a", "analysis", "analysis"),
        ),
        note="The origin of the pixels is the top left corner.",
        origin_top_left=True,
    ),
    Chart(
        "Innovations in i",
        "time (s)",
        "d_i: observation - forecast (px)",
        (
            Series("time", "d_i", "innovation d_i", "first"),
            Series("time", "d_i_low", "", "band"),
            Series("time", "d_i_high", "2 sigma band", "band"),
        ),
        note="A sound filter's innovations scatter about zero, 19 of 20 inside the band.",
    ),
    Chart(
        "Innovations in j",
        "time (s)",
        "d_j: observation - forecast (px)",
        (
            Series("time", "d_j", "innovation d_j", "second"),
            Series("time", "d_j_low", "", "second band"),
            Series("time", "d_j_high", "2 sigma band", "second band"),
        ),
        note="The same for the vertical pixel, which counts downwards.",
    ),
    Chart(
        "Errors of x",
        "time (s)",
        "estimate - truth (m)",
        (
            Series("time", "e_x_cam", "camera alone", "observation"),
            Series("time", "e_x_a", "analysis", "analysis"),
            Series("time", "e_x_ekf", "four states", "second"),
        ),
        note="As printed and as built, the analysis of x is worse than the camera alone.",
    ),
    Chart(
        "Height at the goal line, forecast from each photo",
        "time of the photo (s)",
        "z_goal (m)",
        (Series("time", "z_goal", "z_goal", "analysis"),),
        note="The nearer the ball, the less is left to forecast.",
    ),
    Chart(
        "Four states: error of x and what the filter claims",
        "time (s)",
        "estimate - truth (m)",
        (
            Series("time", "e_x_ekf", "four states", "second"),
            Series("time", "x_low", "", "second band"),
            Series("time", "x_high", "2 sigma, as claimed", "second band"),
        ),
        note="The band is what the covariance says; as built, it settles after a few photos.",
    ),
    Chart(
        "Four states: the gains of a pixel in i",
        "time (s)",
        "gain (m/px, m/s/px)",
        (
            Series("time", "K_x_i_ekf", "K_x: metres of x", "first"),
            Series("time", "K_u_i_ekf", "K_u: metres a second of u", "second"),
        ),
        note="A photo shows a place; through the correlation of their errors it corrects u too.",
    ),
)
