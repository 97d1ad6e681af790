"""Views on the same footing: clocks, one camera, shadows, misread photos; against the report."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from kfsheet.errors import DataError
from kfsheet.exercises.tennis import read_drive, read_toss
from kfsheet.exercises.tennis.experiments.footing import (
    LAMP,
    between,
    dead_reckoning,
    drawn,
    fit_with_distances,
    misread,
    path_errors,
    path_rms,
    photographs,
    shadow_of,
    with_clock,
    worth,
)
from kfsheet.exercises.tennis.methods.dynamics import Ball
from kfsheet.exercises.tennis.methods.reprojection import fit_pixels, fit_views, leverage
from kfsheet.exercises.tennis.methods.shots import TRUE_DRAG, TRUE_SPIN, simulate
from kfsheet.exercises.tennis.methods.views import View, photograph, start_from_lines, views_of

SHOTS = {"A": read_drive(), "B": read_toss()}
DRAG, BOTH = {"kappa": TRUE_DRAG}, {"kappa": TRUE_DRAG, "spin": TRUE_SPIN}


@pytest.fixture(params=SHOTS)
def shot(request):
    return SHOTS[request.param]


def rms_mm(errors):
    return 1e3 * np.sqrt(np.mean(np.square(errors), axis=tuple(range(np.ndim(errors) - 1))))


def test_views_of_a_shot_are_fitted_as_the_shot_is(shot):
    one, other = fit_pixels(shot, **DRAG).ball, fit_views(views_of(shot), **DRAG).ball
    np.testing.assert_allclose(one.X, other.X, atol=1e-5)
    np.testing.assert_allclose(one.V, other.V, atol=1e-4)


def test_lines_of_sight_alone_lead_near_the_start(shot):
    """Both cameras at different times; and a scene without spin, whose drag is the textbook's."""
    found = start_from_lines(photographs(shot, between(shot)))
    assert np.abs(found.X - shot.scene.ball.X).max() < 0.3
    assert np.abs(found.V - shot.scene.ball.V).max() < 1.5
    plain = replace(shot.scene.ball, kappa=found.kappa, spin=(0, 0, 0))
    exact = start_from_lines([photograph(view, plain) for view in between(shot)])
    np.testing.assert_allclose([exact.X, exact.V], [plain.X, plain.V], atol=1e-4)


def test_one_photo_is_no_start(shot):
    view = views_of(shot)[0]
    only = replace(view, pixels=np.where(np.arange(101)[:, None] == 3, view.pixels, np.nan))
    with pytest.raises(DataError, match="do not tell"):
        start_from_lines([only])
    with pytest.raises(DataError, match="travel down"):
        View(view.camera, view.times, view.pixels, light=(1, 0, 1))


# -- clocks (3.5.2: "synchronization of the cameras would not be necessary") ---------------------


def test_cameras_that_take_turns_tell_as_much_as_cameras_that_take_photos_together(shot):
    """Camera 2 half a step later, at known times: no coordinate loses a hundredth."""
    assert (path_rms(shot, between(shot)) < 1.01 * path_rms(shot, views_of(shot))).all()


def test_cameras_that_take_turns_cannot_be_triangulated_but_fitted(shot):
    """Forty draws would do the same: twelve keep within the band of chi-square."""
    views = between(shot)
    errors = [path_errors(shot, drawn(views, shot.scene.ball, k), views, **DRAG) for k in range(12)]
    ratio = rms_mm(errors) / (1e3 * path_rms(shot, views, **DRAG))
    assert (ratio > 0.45).all()
    assert (ratio < 1.7).all()


def test_an_unknown_clock_costs_an_eighth_and_an_ignored_one_many_times_the_error(shot):
    known, unknown = (path_rms(shot, with_clock(shot, late), **DRAG)[0] for late in (0.0, None))
    assert known < unknown < 1.15 * known
    late = photographs(shot, with_clock(shot, 5e-3))
    ignored = rms_mm(path_errors(shot, late, with_clock(shot, 0.0), **DRAG))
    found = rms_mm(path_errors(shot, late, with_clock(shot, None), **DRAG))
    assert ignored[0] > 20e3 * known
    assert (found < 0.01).all()


def test_the_fit_finds_how_late_a_camera_was(shot):
    """To first order by the flights; the positions between are taken from a Taylor series."""
    views = photographs(shot, with_clock(shot, -4e-3))
    told = [replace(view, late=None if n else 0.0) for n, view in enumerate(views)]
    fit = fit_views(told, start=shot.scene.ball)
    assert fit.late == pytest.approx([-4e-3], abs=1e-6)
    assert set(fit.sigma) == {"X", "V", "kappa", "spin", "late"}


# -- one camera ("indeed, in principle a single camera could suffice") ------------------------


def test_one_camera_suffices_if_spin_is_known_as_well_as_g_and_drag(shot):
    """With the spin free, a part of it looks like gravity, and the scale is lost again."""
    one = views_of(shot)[:1]
    both = path_rms(shot, views_of(shot), **DRAG)[0]
    spin_free, all_known = path_rms(shot, one, **DRAG)[0], path_rms(shot, one, **BOTH)[0]
    assert all_known < 5 * both
    assert spin_free > 35 * both
    assert path_rms(shot, one)[0] > 1.5 * spin_free
    assert path_rms(shot, one, **BOTH, g=None)[0] > 40 * all_known


def test_one_camera_finds_the_ball_in_draws_too(shot):
    one = photographs(shot, views_of(shot)[:1])
    errors = [path_errors(shot, drawn(one, shot.scene.ball, k), one, **BOTH) for k in range(12)]
    ratio = rms_mm(errors) / (1e3 * path_rms(shot, one, **BOTH))
    assert (ratio > 0.45).all()
    assert (ratio < 1.7).all()


# -- the shadow as a second estimate (3.4.2) ---------------------------------------------------


def test_a_shadow_view_is_what_an_image_of_the_floor_shows(shot):
    x, light, camera = shot.scene.ball.fly(shot.times), np.array(LAMP), shot.scene.camera_1
    spot = camera.project(x - x[:, 2:] * light / light[2])
    pixels = shadow_of(shot).pixels
    seen = np.isfinite(pixels)
    np.testing.assert_allclose(pixels[seen], spot[seen], atol=1e-6)
    assert 40 < seen.all(axis=1).sum() < 95


def test_the_shadow_is_worth_as_much_as_a_measured_drag(shot):
    views, shadow = views_of(shot), shadow_of(shot)
    free, measured = path_rms(shot, views)[0], path_rms(shot, views, **DRAG)[0]
    assert path_rms(shot, [*views, shadow])[0] < 1.1 * measured < free / 6
    assert path_rms(shot, [views[0], shadow])[0] < 1.2 * measured


def test_the_shadow_helps_in_draws_too(shot):
    views = [*photographs(shot, views_of(shot)), shadow_of(shot)]
    errors = [path_errors(shot, drawn(views, shot.scene.ball, k), views) for k in range(12)]
    ratio = rms_mm(errors) / (1e3 * path_rms(shot, views))
    assert (ratio > 0.45).all()
    assert (ratio < 1.7).all()


def test_a_light_that_is_a_degree_off_costs_more_than_the_shadow_brings(shot):
    """A tenth of a degree about costs what the shadow leaves."""
    views = [*photographs(shot, views_of(shot)), shadow_of(shot)]
    error = {}
    for degrees in (0.1, 1.0):
        a, (x, y, z) = np.radians(degrees), LAMP
        light = (x * np.cos(a) + z * np.sin(a), y, z * np.cos(a) - x * np.sin(a))
        told = [*views[:2], replace(views[2], light=light)]
        error[degrees] = rms_mm(path_errors(shot, views, told))[0]
    assert error[0.1] < 3e3 * path_rms(shot, views)[0]
    assert error[1.0] > 1e3 * path_rms(shot, views_of(shot))[0] / 2


# -- errors correct themselves ------------------------------------------------------------------


def test_what_is_left_of_a_misread_pixel_is_its_leverage(shot):
    """One equation among 218: against a fit of pixels of which one is moved by a hundredth."""
    views = photographs(shot, views_of(shot))
    left = leverage(views, shot.scene.ball)
    assert left.sum() == pytest.approx(10)
    moved = [replace(view, pixels=view.pixels.copy()) for view in views]
    moved[0].pixels[60, 0] += 0.01
    ball = fit_views(moved, start=shot.scene.ball).ball
    shown = photograph(views[0], ball).pixels[60, 0] - views[0].pixels[60, 0]
    assert shown / 0.01 == pytest.approx(left[120], rel=0.02)
    assert np.median(left) < 0.04


def test_a_misread_photo_moves_the_fit_an_eighth_of_what_it_moves_its_point(shot):
    wrong = misread(shot, 9, (5, 0))
    point = np.linalg.norm((wrong.triangulated() - shot.triangulated())[9])
    paths = [fit_pixels(s, **DRAG).ball.fly(shot.times) for s in (wrong, shot)]
    assert np.linalg.norm((paths[0] - paths[1])[9]) < point / 6
    assert np.linalg.norm(paths[0] - paths[1], axis=1).max() < 1.1 * point


def test_two_points_accumulate_errors_and_the_fit_does_not(shot):
    """True drag and spin for both: the fit errs less at the end than reckoning after half."""
    draws = [simulate(shot, seed) for seed in range(20)]
    reckoned = np.array([dead_reckoning(d) - shot.truth for d in draws])
    fitted = np.array([fit_pixels(d, **BOTH).ball.fly(d.times) - shot.truth for d in draws])
    grown = [rms_mm(e[:, 100]) / rms_mm(e[:, 8]) for e in (reckoned, fitted)]
    assert (grown[0] > 10).all()
    assert (rms_mm(fitted[:, 100]) < rms_mm(reckoned[:, 50])).all()


# -- 3.5.4 (1) to the letter ----------------------------------------------------------------------


def test_distances_as_unknowns_lead_to_the_fit_of_pixels(shot):
    """Weighed by 1 over the distance, it differs by a thirtieth of its error, from draw to draw."""
    draws = [simulate(shot, seed) for seed in range(6)]
    pixels = np.array([fit_pixels(d, **DRAG).ball.fly(d.times) for d in draws])
    literal = np.array([fit_with_distances(d, **DRAG).fly(d.times) for d in draws])
    plain = np.array([fit_with_distances(d, weigh=False, **DRAG).fly(d.times) for d in draws])
    error = rms_mm(pixels - shot.truth)
    assert (rms_mm(literal - pixels) < error / 15).all()
    assert rms_mm(plain - shot.truth)[0] > rms_mm(literal - shot.truth)[0]


def test_eliminated_distances_are_those_that_an_optimiser_finds():
    """Shot B's first 20 images with every distance a parameter of its own."""
    shot = SHOTS["B"].first(20)
    views = views_of(shot)
    seen = [view.seen.all(axis=1) for view in views]
    lines = [v.camera.rays(v.pixels[s]) for v, s in zip(views, seen, strict=True)]
    corners = [np.array(view.camera.position) for view in views]

    def ways(p):
        x = Ball(p[:3], p[3:6], TRUE_DRAG, p[6:9] / 10).fly(shot.times)
        parts, q = [], p[9:]
        for line, corner, which in zip(lines, corners, seen, strict=True):
            s, q = q[: len(line), None], q[len(line) :]
            parts.append(x[which] - corner - s * line)
        return np.concatenate(parts).ravel()

    b = shot.scene.ball
    x = b.fly(shot.times)
    far = [np.linalg.norm(x[s] - c, axis=1) for s, c in zip(seen, corners, strict=True)]
    p = np.concatenate([b.X, b.V, 10 * b.spin, *far])
    found = least_squares(ways, p, method="lm", xtol=1e-14, ftol=1e-14).x
    ours = fit_with_distances(shot, weigh=False, **DRAG)
    np.testing.assert_allclose(found[:3], ours.X, atol=2e-5)
    np.testing.assert_allclose(found[3:6], ours.V, atol=5e-4)


# -- what the notebook's picture says ------------------------------------------------------------


def test_what_a_piece_of_knowledge_is_worth(shot):
    both, turns, unknown, shadow, drag, one, spin, one_shadow = worth(shot).values()
    assert abs(turns / both - 1) < 0.07
    assert 1 < unknown / both < 1.2
    assert max(shadow, drag, one_shadow) < both / 6
    assert spin < both / 2 < both * 5 < one
