"""Cameras, triangulation, calibration and centroid of the tennis report, against other means."""

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.optimize import minimize, minimize_scalar
from sympy import Rational, diff, exp, pi, simplify, sin, symbols, tan

from kfsheet.errors import DataError
from kfsheet.exercises.tennis import read_drive, read_toss
from kfsheet.exercises.tennis.methods import calibration as cal
from kfsheet.exercises.tennis.methods import centroid as cen
from kfsheet.exercises.tennis.methods.cameras import (
    FOCAL_LENGTH,
    Camera,
    best_angle,
    best_apex,
    error_diamond,
    largest_distance,
    looking_along_x1,
    rms_error,
    triangulate,
    triangulate_weighted,
)
from kfsheet.exercises.tennis.methods.shots import DRIVE, TOSS, simulate
from kfsheet.exercises.tennis.methods.symbolic import diamond_from_lines

EPS = 8.4e-4


def test_eight_pixels_allow_ten_metres():
    assert largest_distance() == pytest.approx(10.4167, abs=5e-5)


def test_a_pixel_is_0_0481_degrees_and_not_0_02():
    assert np.degrees(0.42 / 500) == pytest.approx(0.0481, abs=5e-5)


def test_the_diamond_is_that_of_four_crossing_lines():
    """Corners by intersecting lines, no formula of the report."""
    theta, m = 0.7, 5.5

    def crossing(a, b):
        # From (0, 0) at angle a, and from (2m, 0) at angle pi - b.
        A = np.array([[np.sin(a), -np.cos(a)], [np.sin(b), np.cos(b)]])
        return np.linalg.solve(A, [0, 2 * m * np.sin(b)])

    low, high = theta - EPS, theta
    across = crossing(high, high) - crossing(low, low)
    along = crossing(low, high) - crossing(high, low)
    H, V = error_diamond(theta, m, EPS)
    np.testing.assert_allclose([H, V], [along[0], across[1]], rtol=1e-9)


def test_at_45_degrees_the_diamond_is_9_24_by_9_2322_mm():
    H, V = error_diamond(np.pi / 4)
    assert pytest.approx([9.2400, 9.2322], abs=5e-5) == [H * 1e3, V * 1e3]


def test_the_best_angle_is_45_024_degrees_by_search_too():
    found = minimize_scalar(
        lambda a: max(error_diamond(a)),
        bounds=(0.5, 1.1),
        method="bounded",
        options={"xatol": 1e-9},
    )
    assert best_angle() == pytest.approx(found.x, abs=1e-7)
    assert np.degrees(best_angle()) == pytest.approx(45.024, abs=5e-4)


def test_the_proof_of_the_report_loses_a_minus_and_argues_from_the_wrong_term():
    """Its quotient falls only while 2 theta - eps < 90 degrees, a hair beyond 45."""
    a, e = symbols("theta epsilon", positive=True)
    quotient = (tan(a) - tan(a - e)) / (tan(a) + tan(a - e))
    assert simplify((quotient - sin(e) / sin(2 * a - e)).rewrite(exp)) == 0
    slope = diff(sin(e) / sin(2 * a - e), a)
    assert slope.subs(a, pi / 4 + e / 2).equals(0)
    # -sin(2 theta)/2 is negative on all of (0, pi/2), yet beyond 45 degrees the quotient grows.
    later = {a: pi / 3, e: Rational(1, 1000)}
    assert (-sin(2 * a) / 2).subs(later) < 0 < slope.subs(later)


def test_the_two_lines_of_the_report_lead_to_the_diagonal():
    """Its printed corner and quotient, from its two lines; and the sine form that is used here."""
    a, e, m = symbols("theta epsilon m", positive=True)
    corner, diagonal = diamond_from_lines(a, e, m)
    assert simplify(corner - 2 * m * tan(a - e) / (tan(a) + tan(a - e))) == 0
    printed = 2 * m * (tan(a) - tan(a - e)) / (tan(a) + tan(a - e))
    assert simplify(diagonal - printed) == 0
    assert simplify((printed - 2 * m * sin(e) / sin(2 * a - e)).rewrite(exp)) == 0


def test_by_rms_the_best_apex_is_109_5_degrees():
    assert np.degrees(best_apex()) == pytest.approx(109.47, abs=0.01)


def test_the_rms_error_is_that_of_a_simulation():
    m, theta, sigma = 5.5, 0.6, 1e-4
    draws = theta + sigma * np.random.RandomState(1).standard_normal((40_000, 2))
    a, b = np.tan(draws).T
    x = 2 * m * b / (a + b)
    y = a * x
    spread = np.sqrt(np.mean((x - m) ** 2 + (y - m * np.tan(theta)) ** 2))
    assert rms_error(theta, m, sigma) == pytest.approx(spread, rel=0.02)


def test_a_camera_sees_what_lies_right_and_down_right_and_down_in_its_image():
    camera = looking_along_x1((0, 5.3, 1.8))
    u, v = camera.project([10, 5.3 - 1, 1.8 - 2])
    assert [u, v] == pytest.approx([250 + 117.292, 250 + 234.585], abs=1e-3)
    assert pytest.approx(1172.92, abs=5e-3) == FOCAL_LENGTH


@pytest.mark.parametrize("scene", [DRIVE, TOSS])
def test_lines_of_sight_lead_back_to_the_point(scene):
    x = np.random.RandomState(0).uniform([6, 5, 1], [9, 6, 2], (20, 3))
    for camera in (scene.camera_1, scene.camera_2):
        at, depth = np.array(camera.position), camera.frame(x)[:, 2:]
        rays = camera.rays(camera.project(x))
        np.testing.assert_allclose(at + rays * depth / (rays @ camera.forward)[:, None], x)


def test_what_lies_behind_a_camera_is_refused():
    with pytest.raises(DataError, match="behind"):
        DRIVE.camera_1.project([-1, 5, 1])
    with pytest.raises(DataError, match="orthogonal"):
        Camera((0, 0, 0), (1, 0, 0), (1, 0, 0), (0, 0, 1))


def test_image_5_of_the_drive_is_where_an_independent_calculation_puts_it():
    shot = read_drive()
    s = shot.scene
    x, gap = triangulate(s.camera_1, shot.pixels_1, s.camera_2, shot.pixels_2)
    assert x[5] == pytest.approx([6.90283, 5.64774, 1.47162], abs=5e-6)
    assert gap[5] == pytest.approx(2.087e-3, abs=5e-7)
    assert np.isnan(x[13]).all()
    assert list(shot.overlap) == list(range(5, 13))


@pytest.mark.parametrize(
    ("shot", "figures"), [(read_drive(), (0.98, 1.47, 0.80)), (read_toss(), (0.95, 0.66, 0.56))]
)
def test_triangulation_errs_by_a_millimetre(shot, figures):
    errors = [simulate(shot, seed).triangulated()[5:13] - shot.truth[5:13] for seed in range(40)]
    rms = 1e3 * np.sqrt(np.mean(np.square(errors), axis=(0, 1)))
    np.testing.assert_allclose(rms, figures, rtol=0.12)


def test_the_midpoint_and_the_weighted_point_minimise_what_they_claim():
    shot = read_drive()
    s, k, ratio = shot.scene, 7, (1.0, 3.0)
    p, q = shot.pixels_1[k], shot.pixels_2[k]
    middle, _ = triangulate(s.camera_1, p, s.camera_2, q)

    def distances(x):
        return [
            np.linalg.norm(np.cross(c.rays(w), x - np.array(c.position)))
            for c, w in ((s.camera_1, p), (s.camera_2, q))
        ]

    def best(weight):
        return minimize(
            lambda x: sum((w * d) ** 2 for w, d in zip(weight, distances(x), strict=True)),
            middle,
            method="Nelder-Mead",
            options={"xatol": 1e-10, "fatol": 1e-20, "maxiter": 10_000},
        ).x

    np.testing.assert_allclose(middle, best([1, 1]), atol=1e-6)
    away = [np.linalg.norm(middle - np.array(c.position)) for c in (s.camera_1, s.camera_2)]
    weighted = triangulate_weighted(s.camera_1, p, s.camera_2, q, ratio)
    np.testing.assert_allclose(
        weighted, best([1 / (r * d) for r, d in zip(ratio, away, strict=True)]), atol=1e-6
    )


def test_parallel_lines_of_sight_are_refused():
    one, two = looking_along_x1((0, 0, 0)), looking_along_x1((0, 1, 0))
    with pytest.raises(DataError, match="parallel"):
        triangulate(one, [250, 250], two, [250, 250])


# -- calibration ---------------------------------------------------------------------------


def test_degree_2_is_not_enough_even_for_a_perfect_lens():
    """The report says that it is: 5.8e-4 rad is more than half a pixel, 3 gives 3.5e-6."""
    angles = cal.grid()
    rms = [cal.calibrate(cal.pixels_of(angles), angles, d).fit_rms for d in (2, 3, 4)]
    assert rms[0] == pytest.approx(5.8e-4, rel=0.02)
    assert rms[1] == pytest.approx(3.5e-6, rel=0.02)
    assert rms[2] == pytest.approx(rms[1])  # tan is odd: degree 4 adds nothing
    assert rms[0] / EPS > 0.6


def test_distortion_is_that_of_brown_and_conrady():
    """Against the radius: a barrel alone moves points along their radius, by k1 r^3."""
    z = np.array([[0.1, 0.2]])
    moved = cal.Distortion(k1=-0.3)(z) - z
    assert np.cross([*moved[0], 0], [*z[0], 0])[2] == pytest.approx(0)
    assert np.linalg.norm(moved) == pytest.approx(0.3 * np.linalg.norm(z) ** 3)


def test_a_distorted_lens_needs_degree_3_and_held_out_points_agree():
    lens = cal.Distortion(-0.3, 0.1, 1e-3, -5e-4)
    angles, held_out = cal.grid(9), cal.grid(20)
    for degree, worst in ((2, 1e-3), (3, 1e-5), (4, 1e-5)):
        found = cal.calibrate(cal.pixels_of(angles, lens), angles, degree)
        assert found.rms(cal.pixels_of(held_out, lens), held_out) < worst
        assert found.rms(cal.pixels_of(held_out, lens), held_out) < 1.5 * found.fit_rms
    assert cal.calibrate(cal.pixels_of(angles, lens), angles, 2).fit_rms > 5e-4


def test_a_grid_over_the_centre_fits_well_extrapolates_badly_and_is_found_out():
    centre, held_out = cal.grid(extent=0.3), cal.grid(20)
    found = cal.calibrate(cal.pixels_of(centre), centre, 3)
    assert found.rms(cal.pixels_of(held_out), held_out) > 1000 * found.fit_rms
    assert cal.extrapolated(found) > 0.5
    whole = cal.grid()
    assert cal.extrapolated(cal.calibrate(cal.pixels_of(whole), whole, 3)) == 0


def test_leverage_is_the_variance_of_a_prediction():
    angles = cal.grid(6)
    pixels, where = cal.pixels_of(angles), np.array([[400.0, 120.0]])
    found = cal.calibrate(pixels, angles, 3)
    noise = np.random.RandomState(3).standard_normal((2000, *angles.shape))
    spread = [cal.calibrate(pixels, angles + e, 3).angles(where) for e in noise]
    assert np.var(spread, axis=0).mean() == pytest.approx(found.leverage(where)[0], rel=0.1)


def test_a_misread_mark_is_found_and_nothing_else():
    angles = cal.grid()
    pixels = cal.pixels_of(angles)
    measured = angles + 1e-5 * np.random.RandomState(2).standard_normal(angles.shape)
    assert cal.suspicious(pixels, measured).size == 0
    measured[40] += [3e-4, 0]
    assert cal.suspicious(pixels, measured).tolist() == [40]


def test_points_on_a_line_cannot_calibrate():
    line = np.column_stack([np.linspace(-0.2, 0.2, 30), np.zeros(30)])
    with pytest.raises(DataError, match="line"):
        cal.calibrate(cal.pixels_of(line), line, 2)


# -- centroid ------------------------------------------------------------------------------


@pytest.mark.parametrize("phi", [0.3, np.pi / 2, 2.5])
def test_the_closed_form_is_the_integral_of_lamberts_law(phi):
    """Over the lit part of the half sphere that the camera sees, in spherical angles."""

    def light(a, b):
        return max(0.0, np.cos(b) * np.cos(a - phi)) * np.cos(b) ** 2 * np.cos(a)

    edges = (-np.pi / 2, np.pi / 2, lambda b: max(-np.pi / 2, phi - np.pi / 2), lambda b: np.pi / 2)
    total = dblquad(light, *edges)[0]
    moment = dblquad(lambda a, b: light(a, b) * np.cos(b) * np.sin(a), *edges)[0]
    assert cen.lambert_shift(phi) == pytest.approx(moment / total, rel=1e-7)


def test_side_light_moves_the_centroid_by_0_589_radii():
    assert cen.lambert_shift(np.pi / 2) == pytest.approx(3 * np.pi / 16)
    assert cen.lambert_shift(np.pi / 2) == pytest.approx(0.589, abs=5e-4)


@pytest.mark.parametrize("phi", [0.0, 0.7, np.pi / 2, 2.0])
def test_a_rendered_ball_shows_the_shift(phi):
    image = cen.render((30, 40), (19.3, 14.6), 11, phi=phi)
    shift = (cen.centroid(image) - [19.3, 14.6]) / 11
    assert shift == pytest.approx([cen.lambert_shift(phi), 0], abs=2e-3)


def test_a_uniform_ball_before_any_background_has_its_centroid_in_the_middle():
    wall = np.random.RandomState(0).uniform(0, 0.3, (24, 24))
    ball = cen.render((24, 24), (11.25, 12.5), 7, albedo=0.9)
    mask = cen.render((24, 24), (11.25, 12.5), 7)
    image = ball + (1 - mask) * wall
    assert cen.centroid(image, wall, 0.31, binary=True) == pytest.approx([11.25, 12.5], abs=0.1)
    assert cen.centroid(ball) == pytest.approx([11.25, 12.5], abs=0.02)


def shift_of(threshold=0.0, *, binary=False, **light):
    image = cen.render((30, 30), (14.5, 14.5), 10, **light)
    found = cen.centroid(image, light.get("wall", 0.0), threshold, binary=binary)
    return (found[0] - 14.5) / 10


def test_the_mitigations_of_the_report_help_as_much_as_they_do():
    """Light by the camera; a black ball before a white wall; and a silhouette, for comparison."""
    side = shift_of(phi=np.pi / 2)
    assert shift_of(phi=np.radians(10)) < side / 8
    assert abs(shift_of(phi=np.pi / 2, albedo=0.05, wall=1.0)) < side / 30
    # A light from the other side, or from everywhere, helps less.
    assert side / 4 < shift_of(phi=np.pi / 2, ambient=0.5) < side / 2
    # The silhouette loses the dark half: the shift of a half disc is 4/(3 pi) = 0.424.
    assert shift_of(0.01, phi=np.pi / 2, binary=True) == pytest.approx(4 / (3 * np.pi), rel=0.1)


def test_a_shadow_gives_the_depth_to_one_camera():
    camera, light = DRIVE.camera_1, np.array([1.0, 0.2, -1.5])
    x = read_drive().truth[5:40:5]
    shadow = x + (x[:, 2:] / 1.5) * light
    exact = cen.position_from_shadow(camera, camera.project(x), camera.project(shadow), light)
    np.testing.assert_allclose(exact, x, atol=1e-9)
    with pytest.raises(DataError, match="down"):
        cen.position_from_shadow(camera, [250, 250], [250, 300], [1, 0, 1])


def test_nothing_to_see_is_refused():
    with pytest.raises(DataError, match="background"):
        cen.centroid(np.zeros((4, 4)))
