"""What a reader of the tennis workbooks sees beside the numbers: words and questions."""

from __future__ import annotations

from kfsheet.model.exercise import Question

ABOUT = (
    "A tennis ball flies away from camera 1, which takes 101 images of it in a second. Camera 2 at "
    "the side has it in images 5 to 12 only. Each pixel errs by {sigma_px} px. Where is the ball "
    "in the other images, and where will it come down?",
    "Triangulation needs both cameras. The filter (sheet Kalman filter) takes every pixel by "
    "itself, and carries position and velocity by the equation of the flight with drag and spin. "
    "The sheet Flight goes on to the ground; if h_fly is too short for it, landed is 0 and red.",
    "The filter starts from a parabola through the triangulated points, so the pixels of images 5 "
    "to 12 count twice. But the start claims s_x and s_v as its errors, some fifty times its own, "
    "and so has little weight. In its first row the filter takes no photo.",
    "Try this: on the sheet Parameters, set kappa to 0.0186 (drag measured 10 % too low): the "
    "innovations of camera 1 leave their band, mean_NIS rises, and the impact moves. Or delete the "
    "photos of camera 2 from image 7 on, and see what the depth x1 then is worth. Or empty all "
    "photos from image 30 on: the sheet then foretells the impact from the first 30 images.",
    "The sheets Cameras and Centroid are calculators: where to put two cameras, and what light "
    "from the side does to the centre of intensity of a ball eight pixels wide (phi, ambient, "
    "albedo, wall, threshold); if its image cuts the ball off, ball_fits is 0 and red. Geometry, "
    "noise and ball are ours: the source prints none.",
)
SECTIONS = {
    "Cameras": "the error diamond of two lines of sight, for each angle",
    "Centroid": "a shaded ball of 8 pixels, pixel by pixel, and its centre of intensity",
    "Photos": "pixels of both cameras; an empty cell is a photo that is missing",
    "Triangulation": "closest points of two lines of sight, their midpoint, the gap; the start",
    "Kalman filter": "a midpoint step of the flight, then up to four pixels, one after the other; "
    "the first row is the start, and takes none",
    "Flight": "steps of Runge and Kutta from the last analysis to the ground",
    "Errors": "estimates minus truth, and the bands that the filter claims for its innovations",
}
QUESTIONS = (
    Question("d_max", 1, "A pixel sees a share of alpha; n_ball of them must fit into the ball."),
    Question("p1", 1, "Right is -x2 for camera 1; mind the sign."),
    Question("s1", 3, "Both closest points: the connecting line is orthogonal to both lines."),
    Question("x1_tri", 1, "The middle of the closest points."),
    Question("vm1", 2, "Velocity after half a step: drag, spin."),
    Question("x1_f", 1, "One step with the velocity of its middle."),
    Question("vx3_f", 2, "One step with the acceleration of its middle; mind gravity."),
    Question("d_u1", 2, "Observed minus predicted pixel."),
    Question("H_u1_x1", 2, "Derivative of the pixel with respect to the depth."),
    Question("w2_1", 1, "Velocity after half a step with the first acceleration."),
)
TASK = (
    "Step t is an image; dt is the time between two. Axis 1 points away from camera 1, axis 2 "
    "away from camera 2, axis 3 up: (x1, x2, x3) is a position, (vx1, vx2, vx3) its velocity. "
    "Names that end in _f are of the forecast, in _a of the analysis; d is an innovation.",
    "Distance. The lens sees the angle alpha across n_px pixels. One pixel sees its share of that "
    "angle; at a distance of so many metres it covers the distance times its angle (in rad). "
    "d_max is the distance at which n_ball pixels just cover the ball, whose radius is r_ball.",
    "Cameras. Camera 1 stands at (c1_x, c1_y, c1_z) and looks along axis 1; right in its image is "
    "-x2. Camera 2 stands at (c2_x, c2_y, c2_z) and looks along axis 2; right is +x1. Down is "
    "-x3. What is straight ahead has u_c as its pixel; for the rest, pixel less u_c is f_px times "
    "the way to the right (u) or down (v) over the way ahead, both from the camera.",
    "Lines of sight. That of camera 1 leaves it in the direction (1, p1, q1), that of camera 2 in "
    "the direction (p2, 1, q2); the pixels u1, v1, u2, v2 give these slopes. s1 and s2 times the "
    "direction lead to the points where the lines are closest, y1_1 and y2_1 being their first "
    "coordinates; x1_tri belongs to the point midway. Given are products: a11, a12, a22 of the "
    "directions 1 and 2, b1 and b2 of direction 1 or 2 and the way from camera 1 to camera 2, and "
    "a_det = a11 a22 - a12^2. What rests on a pixel that is missing has no value.",
    "Flight. A velocity v changes at the rate a(v) = -kappa |v| v + lambda x v - (0, 0, g), with "
    "the vector product x and lambda = (lambda_1, lambda_2, lambda_3). The filter takes a "
    "midpoint step. Its first half: from the velocity v of the image before (vx1_a, vx2_a, vx3_a; "
    "|v| is speed), half a step of dt at the rate a(v) leads to the velocity in the middle (vm1, "
    "vm2, vm3; its length is speed_m). Then the whole step at once: the position goes from x1_a "
    "to x1_f with the velocity of the middle, the velocity from vx3_a to vx3_f at the rate a of "
    "the middle. In image 0 the forecast is the start: x1_0 and v3_0, on the sheet Parameters.",
    "Innovation. d_u1 is u1 less the pixel in which camera 1 would see the forecast (x1_f, x2_f, "
    "x3_f); without u1 it has no value. H_u1_x1 is the derivative of the pixel u1 with respect to "
    "x1, at the forecast.",
    "To the ground. On the sheet Flight a row is a step of Runge and Kutta, h_step long. Stage 1 "
    "has the velocity v1_fly, v2_fly, v3_fly and its rates k1_1, k1_2, k1_3. Stage 2 is half a "
    "step on: w2_1, w2_2, w2_3 are the velocity there, by the rates of stage 1.",
)
