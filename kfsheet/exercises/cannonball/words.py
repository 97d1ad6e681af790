"""What a reader of the cannon-ball's workbook sees beside the numbers: words and questions."""

from __future__ import annotations

from kfsheet.model.exercise import Question

ABOUT = (
    "A ball is fired at {v_0} m/s and {angle} degrees. A radar {x_R} m downrange measures its "
    "angle (error {sigma_theta} rad) and its range (error {sigma_r} m) ten times a second. There "
    "is no drag; the filters know gravity, but start with positions and velocities that are wrong.",
    "Two filters see the same radar. The extended Kalman filter (sheet EKF) takes angle and range "
    "as they are and linearises them at each forecast: the columns H_. The linear filter (sheet "
    "Linear) is given positions computed from angle and range, one axis at a time.",
    "Try this: on the sheet Parameters, make the radar worse (sigma_theta = 0.03) or the barrel "
    "lower (angle = 35) and look at the Charts. Then set Phi_s to 10: the filters now distrust "
    "their model, never rest, and follow the noise. mean_NIS tells whether a filter errs as much "
    "as it says: two observations, so 2 is expected.",
    "Everything is live. Rows after the landing are grey and leave the statistics. A ball shot at "
    "more than 45 degrees is still in the air in the last row: landed, the first of the results, "
    "is then 0 and red, and the statistics cover only a part of the flight. Make dt larger.",
)
SECTIONS = {
    "Truth": "the flight without errors, stepped as the source steps it",
    "Radar": "angle and range: truth plus noise from fixed draws; positions computed from them",
    "EKF": "the extended filter: forecast, innovations one after the other, gain, analysis",
    "Linear": "the linear filter on computed positions (names end in _lin)",
    "Errors": "estimates minus truth, and the bands of 2 sigma that the filters claim",
}


QUESTIONS = (
    Question("x_f", 1, "One step of the motion without drag, from the analysis before."),
    Question("y_f", 1, "As x_f, with gravity."),
    Question("vy_f", 1, "Velocity one step later."),
    Question("d_theta", 2, "Observed minus predicted angle; wrap it to (-pi, pi]."),
    Question("H_theta_x", 2, "Derivative of the angle; mind the sign."),
    Question("H_theta_y", 2, "Derivative of the angle with respect to y."),
    Question("H_r_x", 1, "Derivative of the range with respect to x."),
    Question("H_r_y", 1, "Derivative of the range with respect to y."),
    Question("S_theta", 2, "H P H' + s_theta^2 with the covariance of the forecast."),
    Question("K_x_theta", 2, "P H' / S, first element."),
    Question("K_y_theta", 2, "P H' / S, third element."),
    Question("P_xx_1", 2, "P - K S K', first element."),
    Question("x_a", 1, "The state after both observations."),
    Question("y_a", 1, "The state after both observations."),
)
TASK = (
    "Step t is a sweep of the radar; dt is the time between two. The state is (x, vx, y, vy): "
    "distance from the cannon, height, and their velocities. Names that end in _f are of the "
    "forecast, in _1 of the state after the first observation, in _a of the analysis; d is an "
    "innovation. P_xy_f is the covariance of x and y in the forecast, and so on.",
    "Model. No drag: vx stays, vy falls at the rate g, x and y follow their velocities. A step dt "
    "of this, solved exactly, leads from x_a, vx_a, y_a, vy_a of the sweep before to the "
    "forecast. Sweep 0 has none before it: there x_f is x_true with the error e_x, y_f is y_true "
    "with e_y, vy_f is vy_true with e_vy.",
    "Radar. It stands at (x_R, y_R). It measures the range r, the length of the line to the ball, "
    "and the angle theta of that line with the direction in which x grows: nearly pi at first, "
    "when the ball is far on the left. The columns theta_obs and r_obs hold what it measured, "
    "with standard deviations sigma_theta and sigma_r; nothing in sweep 0, nothing after the "
    "landing. The filter goes by the deviations that it is told, s_theta and s_r: the true ones "
    "times belief_theta and belief_r, which are 1 for an honest filter.",
    "Innovation. d_theta is theta_obs less the angle at which the radar would see the forecast; "
    "it is brought into (-pi, pi], since full turns do not count. Without theta_obs it has no "
    "value.",
    "H. H_theta_x, H_theta_y, H_r_x and H_r_y are the derivatives of theta and r with respect to "
    "x and y, taken at the forecast. Those with respect to velocities are 0. They have a value in "
    "every sweep from 1 on, whether or not there is an echo.",
    "The angle first. With H = (H_theta_x, 0, H_theta_y, 0) and the forecast's covariance P, of "
    "which P_xx_f, P_xy_f and P_yy_f are all that you need: S_theta = H P H' + s_theta^2. The "
    "gain K = P H' / S_theta has K_x_theta as its element for x and K_y_theta as that for y; both "
    "are 0 where d_theta has no value. The covariance is now P - K S_theta K', with P_xx_1 as the "
    "variance of x, and the state is x_1, y_1.",
    "Then the range. The angle has moved the state, and d_r_left is what that left of the "
    "innovation in r. Its gains are K_x_r and K_y_r. Without a range the analysis is x_1, y_1; in "
    "sweep 0 it is the forecast.",
)
