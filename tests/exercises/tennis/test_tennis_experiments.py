"""Lens, lasers, light, regimes and fine tunings: what the report proposes, and what it brings."""

from dataclasses import replace

import numpy as np
import pytest

from kfsheet.errors import DataError
from kfsheet.exercises.tennis import pictures, read_drive, read_toss
from kfsheet.exercises.tennis.experiments import lens, light, placing, regimes, tuning
from kfsheet.exercises.tennis.methods import loop
from kfsheet.exercises.tennis.methods.cameras import FOCAL_LENGTH, triangulate
from kfsheet.exercises.tennis.methods.centroid import centroid
from kfsheet.exercises.tennis.methods.closed_form import closed_form
from kfsheet.exercises.tennis.methods.dynamics import impact
from kfsheet.exercises.tennis.methods.reprojection import fit_pixels
from kfsheet.exercises.tennis.methods.shots import SIGMA, TRUE_DRAG, simulate

SHOTS = {"A": read_drive(), "B": read_toss()}
A = SHOTS["A"]


def rms_mm(errors):
    return 1e3 * np.sqrt(np.nanmean(np.square(errors), axis=(0, 1)))


# -- where cameras lose the depth (3.2) ------------------------------------------------------------


@pytest.mark.parametrize("apex", [0.05, 0.8, np.pi / 2, 2.2, 3.09])
def test_the_errors_of_a_crossing_are_those_of_triangulated_draws(apex):
    target = np.array([8.0, 1.0, 1.5])
    one, two = placing.cameras_around(target, apex)
    noise = 1e-2 * np.random.RandomState(1).standard_normal((2, 4000, 2))
    x, _ = triangulate(one, one.project(target) + noise[0], two, two.project(target) + noise[1])
    along, across = placing.crossing_errors(apex, 7.0, 1e-2 / FOCAL_LENGTH)
    np.testing.assert_allclose(np.std(x - target, axis=0)[:2], [along, across], rtol=0.06)


def test_cameras_side_by_side_and_opposite_lose_the_depth():
    """Half a metre apart at 7 m, and half a metre from opposite: 20 times the error sideways."""
    apex = 2 * np.arcsin(0.25 / 7)
    for angle, lost in ((apex, 0), (np.pi - apex, 1)):
        errors = placing.crossing_errors(angle)
        assert errors[lost] > 20 * errors[1 - lost]
        assert errors[lost] > 0.1
    for nothing in (0, np.pi):
        with pytest.raises(DataError, match="do not cross"):
            placing.crossing_errors(nothing)


def test_a_camera_looks_where_it_is_told_to():
    camera = placing.looking_at((0, 0, 2), (5, 5, 1))
    assert camera.project([5, 5, 1]) == pytest.approx([250, 250])
    u, v = camera.project([6, 4, 1.2])
    assert u > 250 > v
    with pytest.raises(DataError, match="upright"):
        placing.looking_at((0, 0, 2), (0, 0, 1))


# -- a calibration that is used (3.3) -----------------------------------------------------------


def test_the_lens_moves_corners_by_pixels_and_a_perfect_calibration_undoes_it():
    clean = lens.through_lens(A, lens.BARREL, 0, sigma=0)
    moved = np.linalg.norm(clean.pixels_2 - simulate(A, 0, 1e-9).pixels_2, axis=1)
    assert 1 < np.nanmax(moved) < 10
    known = [lens.measured_calibration(lens.BARREL, 5, 0, n=15, sigma=0)] * 2
    back = lens.straightened(clean, known)
    assert np.nanmax(np.abs(back.pixels_2 - simulate(A, 0, 1e-9).pixels_2)) < 0.01
    assert np.isnan(back.pixels_2).sum() == np.isnan(A.pixels_2).sum()


def test_an_ignored_lens_costs_millimetres_degree_2_little_less_and_degree_3_heals_it():
    """The drive, whose camera 2 uses the edge of its image; the given noise, twenty draws."""
    errors = {}
    for degree in (None, 2, 3, 4):
        draws = [lens.through_lens(A, lens.BARREL, seed) for seed in range(20)]
        if degree:
            pairs = [
                [lens.measured_calibration(lens.BARREL, degree, 1000 + 2 * k + i) for i in (0, 1)]
                for k in range(20)
            ]
            draws = [lens.straightened(d, pair) for d, pair in zip(draws, pairs, strict=True)]
        paths = [fit_pixels(d, kappa=TRUE_DRAG).ball.fly(d.times) for d in draws[:8]]
        errors[degree] = (
            rms_mm([d.triangulated() - A.truth for d in draws])[0],
            rms_mm(np.array(paths) - A.truth)[0],
        )
    ideal = rms_mm([simulate(A, k).triangulated() - A.truth for k in range(20)])[0]
    assert errors[None][0] > 4 * ideal
    assert errors[2][0] > 2.5 * ideal
    assert errors[3][0] < 1.2 * ideal > errors[4][0] / 1.2
    assert errors[None][1] > 40 > 30 > errors[2][1] / 2 > 10 > errors[3][1]


def test_two_spots_on_a_wall_tell_how_a_camera_points():
    """Exactly, whatever the wall: an inclined one too."""
    real = lens.turned(A.scene.camera_2, 0.02, -0.03, 0.05)
    for normal in (None, np.array([0.3, 0.9, 0.1]) / np.sqrt(0.91)):
        spots = lens.laser_spots(real, normal=normal)
        found = lens.camera_from_spots(A.scene.camera_2, spots)
        for axis in ("right", "down", "forward"):
            np.testing.assert_allclose(getattr(found, axis), getattr(real, axis), atol=1e-12)
    with pytest.raises(DataError, match="in front"):
        lens.laser_spots(real, wall=-5)


def test_a_camera_turned_to_the_right_sees_things_move_to_the_left():
    camera, x = A.scene.camera_1, A.truth[50]
    u, v = camera.project(x)
    assert lens.turned(camera, 0.01, 0, 0).project(x)[0] < u - 10
    assert lens.turned(camera, 0, 0.01, 0).project(x)[1] > v + 10
    # Rolled clockwise, seen from behind: what is right of the middle climbs.
    right = np.add(camera.position, [10, -1, 0])
    assert lens.turned(camera, 0, 0, 0.1).project(right)[1] < camera.project(right)[1]


def test_lasers_let_a_calibration_be_used_at_another_place():
    """Cameras set up half a degree askew; spots measured to a millimetre. Twenty set-ups."""
    errors = {"no lasers": [], "lasers": []}
    for seed in range(20):
        dice = np.random.RandomState(seed)
        planned = (A.scene.camera_1, A.scene.camera_2)
        real = [lens.turned(c, *np.radians(0.5) * dice.standard_normal(3)) for c in planned]
        draw = lens.through_lens(
            replace(A, scene=replace(A.scene, camera_1=real[0], camera_2=real[1])),
            lens.BARREL,
            seed,
        )
        known = [lens.measured_calibration(lens.BARREL, 3, 2 * seed + i) for i in (0, 1)]
        straight = lens.straightened(draw, known)
        spots = [lens.laser_spots(c) + 1e-3 * dice.standard_normal((2, 3)) for c in real]
        told = [lens.camera_from_spots(c, s) for c, s in zip(planned, spots, strict=True)]
        for name, (one, two) in (("no lasers", planned), ("lasers", told)):
            scene = replace(A.scene, camera_1=one, camera_2=two)
            errors[name].append(replace(straight, scene=scene).triangulated() - A.truth)
    without, with_lasers = (rms_mm(errors[name]) for name in ("no lasers", "lasers"))
    assert (without > 40).all()
    assert (with_lasers < 3).all()


# -- light (3.4) ----------------------------------------------------------------------------------


@pytest.mark.parametrize("leak", [0.0, 0.1, 1.0])
def test_two_lights_shift_the_centroid_as_rendered(leak):
    closed, rendered = light.two_lights(leak), light.two_lights_rendered(leak)
    np.testing.assert_allclose(rendered, closed, atol=3e-3)


def test_filters_are_worth_what_they_keep_out():
    """Without them the other light moves the centroid by 0.14 radii; a tenth of it by 0.02."""
    none, tenth, perfect = light.two_lights([1, 0.1, 0])
    assert none[0] == pytest.approx(0.144, abs=0.002)
    assert tenth[0] < none[0] / 7
    assert perfect[0] == 0
    assert perfect[1] == pytest.approx(0.066, abs=0.001)
    with pytest.raises(DataError, match="share"):
        light.two_lights(2)


def test_a_streak_has_its_centroid_where_the_ball_was_in_the_middle():
    image, middle = light.streak(4, (12.0, -3.0))
    assert centroid(image) == pytest.approx(middle, abs=0.01)


@pytest.mark.parametrize("exposure", [1e-3, 5e-3])
def test_blur_moves_the_centroid_by_half_the_way_from_the_begin_and_nothing_from_the_middle(
    exposure,
):
    camera, ball = A.scene.camera_2, A.scene.ball
    from_begin, from_middle = light.blur_shift(camera, ball, 0.08, exposure)
    speed = light.pixel_velocity(camera, ball, 0.08 + exposure / 2)
    np.testing.assert_allclose(from_begin, speed * exposure / 2, rtol=5e-3, atol=2e-3)
    assert np.linalg.norm(from_middle) < 0.02
    fine = np.linspace(0.08, 0.08 + exposure, 2001)
    seen = camera.project(ball.fly(fine))
    mean = (seen[:-1] + seen[1:]).mean(axis=0) / 2
    assert from_begin == pytest.approx(mean - seen[0], abs=1e-4)


def test_at_70_microseconds_the_begin_of_an_exposure_is_a_pixel_error_off():
    speed = np.linalg.norm(light.pixel_velocity(A.scene.camera_2, A.scene.ball, 0.08))
    assert 2 * SIGMA / speed == pytest.approx(7e-5, rel=0.1)


def test_a_centroid_scatters_by_the_same_fraction_of_a_pixel_however_large_the_ball():
    """So in metres its error grows with the distance, as the report says, and not faster."""
    found = [light.centroid_scatter(radius, 0.1) for radius in (3.0, 5.0, 10.0)]
    np.testing.assert_allclose(found, 0.1 / (2 * np.sqrt(np.pi)), rtol=0.2)


@pytest.mark.parametrize("name", SHOTS)
def test_across_the_line_of_sight_accuracy_decays_linearly_and_in_depth_with_the_square(name):
    """Two cameras 2 m apart, a ball at 5, 10 and 20 m; the slopes in a log-log plot."""
    distances, found = np.array([5.0, 10, 20]), []
    for d in distances:
        target = np.array([10.0, 0, 1.5])
        one, two = placing.cameras_around(target, 2 * np.arcsin(1 / d), d)
        noise = SIGMA / 10 * np.random.RandomState(0).standard_normal((2, 2000, 2))
        x, _ = triangulate(one, one.project(target) + noise[0], two, two.project(target) + noise[1])
        found.append(np.std(x - target, axis=0))
    slopes = np.polyfit(np.log(distances), np.log(found), 1)[0]
    assert slopes == pytest.approx([2, 1, 1], abs=0.1)


# -- regimes (3.5.1, 3.5.2) -----------------------------------------------------------------------


def test_the_slow_laws_are_out_by_hundreds_and_the_fast_ones_fit():
    for shot in SHOTS.values():
        speed = np.linalg.norm(shot.scene.ball.V)
        assert regimes.reynolds(speed) > 4e4
        assert regimes.fast_drag(speed) > 800 * regimes.slow_drag(speed)
    assert 0.4 < regimes.drag_coefficient() < 0.5  # a sphere's, in any textbook
    # Stokes: C_d = 24 / Re, an independent way to write 6 pi mu a v.
    stokes = 24 / regimes.reynolds(2.0) * regimes.DENSITY * np.pi * 0.035**2 * 2.0**2 / 2
    assert regimes.slow_drag(2.0) == pytest.approx(stokes)


def test_angular_drag_takes_minutes_and_the_flight_a_second():
    omega = regimes.rate_of_spin(A.scene.ball)
    assert 20 < omega < 30
    assert min(regimes.spin_lasts(omega).values()) > 300
    # Both laws of the torque meet where a ball turns slowly: 32.1 against Stokes's 16 pi, nearly.
    slow = regimes.spin_lasts(1e-4)
    assert slow["fast"] / slow["slow"] == pytest.approx(16 * np.pi / 32.1, rel=0.1)
    assert 0.035 * omega / np.linalg.norm(A.scene.ball.V) < 0.03


def test_the_time_scales_are_1_66_and_5_03_seconds_and_the_parabola_is_metres_off_after_one():
    scales = [regimes.time_scales(shot.scene.ball)["drag"] for shot in SHOTS.values()]
    assert scales == pytest.approx([1.66, 5.03], abs=0.005)
    off = {
        name: np.linalg.norm(regimes.parabola(s.scene.ball, s.times) - s.truth, axis=1)
        for name, s in SHOTS.items()
    }
    assert [off["A"][12], off["B"][12]] == pytest.approx([6.6e-3, 0.9e-3], rel=0.05)
    assert [off["A"][100], off["B"][100]] == pytest.approx([2.70, 0.376], rel=0.01)


# -- fine tuning (3.6.4) ------------------------------------------------------------------------


def paths_after(draws, turns, **options):
    starts = options.pop("starts", [None] * len(draws))
    runs = [
        loop.iterate(d, start=start, limit=turns, **options)
        for d, start in zip(draws, starts, strict=True)
    ]
    return np.array([run.last.x for run in runs])


@pytest.mark.parametrize("name", SHOTS)
def test_weights_in_the_first_fit_change_a_hundredth_of_the_error(name):
    shot = SHOTS[name]
    draws = [simulate(shot, seed) for seed in range(8)]
    starts = [tuning.weighted_first_estimate(d) for d in draws]
    plain, weighed = paths_after(draws, 5), paths_after(draws, 5, starts=starts)
    assert rms_mm(weighed - plain)[0] < 0.02 * rms_mm(plain - shot.truth)[0]


@pytest.mark.parametrize("profile", tuning.PROFILES.values(), ids=tuning.PROFILES)
def test_no_profile_of_weights_mends_the_depth(profile):
    draws = [simulate(A, seed) for seed in range(8)]
    plain, other = paths_after(draws, 5), paths_after(draws, 5, weigh=profile)
    ratio = rms_mm(other - A.truth)[0] / rms_mm(plain - A.truth)[0]
    assert ratio == pytest.approx(1, abs=0.02)
    assert profile(A, A.truth).sum() == pytest.approx(1)


@pytest.mark.parametrize(("name", "worse"), [("A", 3), ("B", 1.1)])
def test_spin_and_drag_from_camera_1_mend_x2_of_the_first_estimate_and_spoil_the_depth(name, worse):
    shot = SHOTS[name]
    draws = [simulate(shot, seed) for seed in range(12)]
    firsts = {
        what: [method(d) for d in draws]
        for what, method in (("plain", loop.first_estimate), ("tuned", tuning.from_camera_1))
    }
    error = {
        what: rms_mm(
            [closed_form(shot.times, b.X, b.V, b.kappa, b.spin, b.g) - shot.truth for b in balls]
        )
        for what, balls in firsts.items()
    }
    assert error["tuned"][1] < error["plain"][1] / 1.5
    assert error["tuned"][0] > worse * error["plain"][0]


def test_point_errors_are_those_of_draws():
    found = tuning.point_errors(A)[A.overlap]
    scatter = np.std([simulate(A, k).triangulated()[A.overlap] for k in range(300)], axis=0)
    np.testing.assert_allclose(found, scatter, rtol=0.15)


# -- pictures -----------------------------------------------------------------------------------


def test_the_sketch_shows_both_cameras_the_overlap_and_the_impact():
    plt = pytest.importorskip("matplotlib.pyplot")
    _, ax = plt.subplots()
    pictures.draw_scene(ax, A, impact(A.scene.ball)[1])
    words = {text.get_text() for text in ax.texts}
    assert {"X", "V", "camera 1, 101 images", "camera 2, 8 images"} <= words
    seen = next(line for line in ax.lines if str(line.get_label()).startswith("images 5"))
    assert len(seen.get_xdata()) == len(A.overlap)
    plt.close()


def test_a_spread_shows_a_dot_for_each_draw_and_a_bar_at_the_root_mean_square():
    plt = pytest.importorskip("matplotlib.pyplot")
    _, ax = plt.subplots()
    pictures.draw_spread(ax, {"a": [3.0, 4.0, 5.0], "b": [1.0, 1.0]}, {"a": 4.2})
    dots, bar, ring, *_ = ax.lines
    assert dots.get_ydata().tolist() == [3, 4, 5]
    assert bar.get_ydata()[0] == pytest.approx(np.sqrt(50 / 3))
    assert ring.get_ydata() == pytest.approx([4.2])
    pictures.draw_values(ax, {"much": 1234.0, "little": 1.26}, "mm")
    assert {"1,234", "1.3"} <= {text.get_text() for text in ax.texts}
    plt.close()
