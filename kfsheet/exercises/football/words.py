"""What a reader of the football's workbook sees beside the numbers: words and questions."""

from __future__ import annotations

from kfsheet.model.exercise import Question

ABOUT = (
    "A football is kicked from {x_0} m towards the goal line at x = 0 and photographed ten times a "
    "second. Each photo gives two pixels, with an error of 3 pixels. A simple model extrapolates "
    "the last two positions to a forecast, which the source believes to err by 0.1 m. The filter "
    "weighs one against the other.",
    "Try this: on the sheet Parameters, change r_i and r_j from 9 to 900. This tells the filter "
    "that the camera errs by 30 pixels; the photos stay as good as they are. The gains K_x and K_z "
    "come closer to 0, and the analysis leans on the model.",
    "Then look at the innovations on the sheet Charts: they should scatter about zero, 19 of 20 "
    "within two standard deviations. As printed in the source, 14 of the 15 d_i lie outside; with "
    "h = 0 and p = 2, which mends two misprints, all 15 d_i and 14 of the 15 d_j lie inside.",
    "Then delete a photo (a green cell on the sheet Reanalysis): the analysis of that row is the "
    "forecast. The photos are simulated with drag f |V| V along the path, in fine steps, so the "
    "model is not the truth. Friction on each axis for itself, and a first step that counts all of "
    "gravity and drag where half is due, are two errors that cancel in part: on the sheet Free run "
    "along = 1 mends the first of them, first = 0.5 the second.",
    "The sheet Four states filters the same photos as one would today: with the velocity in the "
    "state, drag along the path, and a covariance that follows from step to step. Its claims are "
    "q, s_pos and s_vel. Over 400 kicks with the parameters as built, but h = 0 and p = 2, the "
    "camera errs by 0.068 m, the source's scheme by 0.055 m, the four states by 0.044 m.",
)
SECTIONS = {
    "Reanalysis": "photos, forecast, innovation, analysis: one row per photo",
    "Free run": "the same model without the photos; two switches mend two more of its errors",
    "Errors": "truth, the camera alone, and what each estimate is wrong by",
    "Pixel frame": "everything as the camera sees it, and the 2 sigma bands of the innovations",
    "Goal line": "when and how high the ball will cross x = 0, forecast anew from every photo",
    "Four states": "the same photos, filtered with the velocity in the state",
}
QUESTIONS = (
    Question("K_x", 2, "Simplify B H' (R + H B H')^-1 for diagonal B and R."),
    Question("K_z", 2, "The linear part of j = j_0 - a z has a sign."),
    Question("u", 2, "Mean velocity of the step, from the two analyses before it."),
    Question("w", 2, "As u, with gravity."),
    Question("x_f", 2, "One step of the model from the analysis before."),
    Question("z_f", 2, "As x_f, with gravity."),
    Question("d_i", 1, "Observation minus what the camera would see of the forecast."),
    Question("d_j", 1, "The whole of H, also its constant part."),
    Question("x_a", 2, "Forecast plus gain times innovation."),
    Question("z_a", 2, "As x_a; mind the sign of K_z."),
)
TASK = (
    "Step t is a photo; dt is the time between two. Distances x and heights z are in metres, "
    "pixels in px. A subscript f is the forecast, a the analysis, d an innovation.",
    "Model. Mean velocities of the step that ends in photo t: u(t) = (x_a(t-1) - x_a(t-2))/dt - f "
    "|u(t-1)| u(t-1) dt, and w(t) likewise from z_a, less g dt. In photo 0 they are u_0 and w_0; "
    "in photo 1, which has no two analyses before it, u_0 and w_0 take the place of the fraction.",
    "Forecast. x_f(t) = x_a(t-1) + u(t) dt - h f |u(t)| u(t) dt^p, and z_f(t) likewise from w, "
    "less h g dt^2; in photo 0 they are x_0 and z_0. The switches h and p are parameters.",
    "Camera. It sees i = a x and j = j_0 - a z, with variances r_i and r_j; the forecast errs "
    "with variances b_x and b_z. So H is a for x and -a for z, B and R are diagonal, and the "
    "innovations d_i and d_j are the pixel seen less the pixel of the forecast. Without a photo "
    "there is no innovation, and the analysis is the forecast.",
    "Analysis. The gain is K = B H' (R + H B H')^-1: K_x takes d_i to x_a, K_z takes d_j to z_a.",
)
