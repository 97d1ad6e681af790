"""What a reader of the shuttlecock's workbook sees beside the numbers: words and questions."""

from __future__ import annotations

from kfsheet.model.exercise import Question

ABOUT = (
    "A robot is to kick a shuttlecock back. Two cameras see it {fps} times a second, with errors "
    "whose power is 1/{SNR} of the signal's; the robot needs the place and the moment of the fall, "
    "and early. The source of this exercise filters the positions, then fits the track to them, "
    "and claims that the fall point settles faster and better than without the filter.",
    "Look at both fits on the sheet Charts: 'Fit raw' takes the positions as the cameras saw them, "
    "'Fit filtered' as the filter of the sheet Kalman corrected them. The filter's positions are "
    "indeed better than the cameras'. Are its fall points?",
    "Try this on the sheet Parameters: set f_k to 2 (filters and fits now believe in twice the "
    "drag) or k_2 to 0.2 (quadratic drag in the truth); then let the exact filter doubt: set Phi_s "
    "to 0.05 or 0.5. Or type 15 over one of the green draws on the sheet Camera, an outlier, and "
    "set gate to 3. When does a filter win?",
    "Everything is live. The filter's state has nine elements, but covariances between the axes "
    "stay 0, so they have no columns and it is three filters of three. The drag k_m is an "
    "assumption: the source gives none. From 0.001 upwards fall times are right within 1E-8 s; "
    "rounding adds some 1E-15/k_m^2 s, so a drag below 0.00001 means nothing.",
)
SECTIONS = {
    "Truth": "the flight, in exact steps of linear drag, and its fall point",
    "Camera": "truth plus noise from fixed draws; its variance is the signal's power over SNR",
    "Kalman": "the source's filter: position, velocity and acceleration of three axes",
    "Fit raw": "least squares on the positions seen so far, and the fall point (names end in _raw)",
    "Fit filtered": "the same on the filter's positions (names end in _kf)",
    "Latest state": "the fall point from the filter's latest state alone (names end in _now)",
    "Exact filter": "position and velocity, exact transition, honest variances (names end in _ex)",
    "Errors": "positions minus truth; the errors of fall points stand beside the forecasts",
}


QUESTIONS = (
    Question("z_f", 1, "One step at constant acceleration."),
    Question("vz_f", 1, "As z_f."),
    Question("az_f", 2, "Drag at the new velocity, and gravity: once."),
    Question("d_z", 1, "Observed minus forecast."),
    Question("S_z", 1, "Variance of d_z: H P H' + R."),
    Question("K_z_z", 1, "P H' / S, first element."),
    Question("K_vz_z", 1, "P H' / S, second element."),
    Question("z_a", 1, "Forecast plus gain times innovation."),
    Question("P_zz_a", 2, "P - K S K', first element."),
    Question("drop", 2, "The part of the height that does not depend on p_z and v_z."),
    Question("v_z_raw", 2, "Solve the two normal equations for the slope."),
    Question("p_z_raw", 2, "Solve the two normal equations for the constant."),
    Question("W_1_raw", 2, "From W_0, one step of Newton's method for w exp(-W) - W = 0."),
    Question("t_fall_raw", 1, "From W back to seconds."),
    Question("x_fall_raw", 1, "The track at t_fall."),
)
TASK = (
    "Step t is a frame; dt is the time between two, k_fit the drag over mass. Of the filter only "
    "the height is asked: its state is z, its velocity vz and its acceleration az. Names that end "
    "in _f are of the forecast, in _a of the analysis; d_z is an innovation; P_zvz_f is the "
    "covariance of z and vz in the forecast. x and y go the same way, without gravity.",
    "Forecast. Over the step from the frame before (z_a, vz_a, az_a) the acceleration counts as "
    "constant; that gives z_f and vz_f. az_f is what acts at the new velocity: drag, which is "
    "k_fit times the velocity, against it, and gravity g. In frame 0 z_f is z_obs.",
    "Analysis. The cameras see the height itself, z_obs, with the variance r_obs: H = (1, 0, 0). "
    "With the forecast's covariance P, whose first column is P_zz_f, P_zvz_f, P_zaz_f: S_z is the "
    "variance H P H' + r_obs, K = P H' / S_z the gain with the elements K_z_z and K_vz_z. The "
    "analysis z_a moves by gain times innovation, and K S_z K' is taken away from P; P_zz_a is "
    "what is left of its first element. Frame 0 has no innovation: its analysis is the forecast, "
    "the variance too.",
    "Track. With linear drag, in the distorted time X = (1 - exp(-k_fit time))/k_fit of the sheet "
    "Fit raw, x is the straight line p_x_raw + v_x_raw X, and z is p_z_raw + v_z_raw X + drop. "
    "drop is the height of a thing let go at height 0 at time 0 (column time), under g and the "
    "same drag: its velocity is -g X. X itself grows at the rate exp(-k_fit time) = 1 - k_fit X.",
    "Fit. The line p_z_raw + v_z_raw X through the n = t + 1 heights z_obs - drop of the frames 0 "
    "to t (the column frame) by least squares, from frame 1 on. Its normal equations hold n and "
    "the sums over these frames that stand beside it: sum_X, sum_XX (of X^2), sum_z_raw (of the "
    "heights), sum_Xz_raw (of X times the heights).",
    "Fall. The track comes down to z_fall at the time t_fall_raw = (c + W)/k_fit, with c_raw for "
    "c and W for the root of f(W) = w exp(-W) - W, w_raw for w. W_0_raw is a first guess, W_1_raw "
    "to W_4_raw are a step of Newton's method each, and W_4_raw counts as W. x_fall_raw is where "
    "the track then is. A track that stays below z_fall has no first guess, and then the rest of "
    "the row has no value either.",
)
