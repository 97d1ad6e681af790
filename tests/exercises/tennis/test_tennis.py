"""The tennis exercise: its cells against other algorithms, and the filter against the optimum."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import need
from openpyxl import load_workbook
from scipy.integrate import solve_ivp

from kfsheet import check_workbook, evaluate, recalculate, write_workbook
from kfsheet.evaluation.evaluate import run
from kfsheet.exercises.tennis import exercise, read_drive, read_toss, tennis
from kfsheet.exercises.tennis.methods.cameras import triangulate
from kfsheet.exercises.tennis.methods.dynamics import Ball, acceleration, impact
from kfsheet.exercises.tennis.methods.reprojection import fit_pixels, path_covariance
from kfsheet.exercises.tennis.methods.shots import TRUE_DRAG, TRUE_SPIN, simulate
from kfsheet.exercises.tennis_toss import tennis_toss
from kfsheet.workbook.write.layout import Layout

MODELS = {"A": (tennis, read_drive()), "B": (tennis_toss, read_toss())}
STATE = ["x1", "x2", "x3", "vx1", "vx2", "vx3"]


@pytest.fixture(scope="module")
def frames():
    return {name: evaluate(model) for name, (model, _) in MODELS.items()}


@pytest.fixture(params=MODELS)
def name(request):
    return request.param


def photos(shot):
    p, q = shot.pixels_1.T, shot.pixels_2.T
    return {"u1": p[0], "v1": p[1], "u2": q[0], "v2": q[1]}


def without_image_0(shot):
    return replace(shot, pixels_1=np.where(np.arange(101)[:, None] > 0, shot.pixels_1, np.nan))


def test_units_agree():
    assert tennis.check_units() == []


@pytest.fixture(scope="module")
def workbook(tmp_path_factory):
    return write_workbook(exercise, tmp_path_factory.mktemp("built"))


def test_the_workbook_is_what_an_independent_engine_computes(workbook):
    report = check_workbook(workbook, exercise)
    assert report.holds, report.lines()[:3]
    assert report.cells > 30_000


def test_libreoffice_agrees_with_numpy_in_every_column(workbook, frames):
    """As the file stands; that cells follow their inputs, the other engine has shown."""
    need("libreoffice")
    sheets, compared = recalculate(workbook, "libreoffice"), 0
    for section, columns in tennis.sections.items():
        cells, names = sheets[section], [c.name for c in columns]
        places = {text: column for (row, column), text in cells.items() if row == 1}
        for name in set(places) & set(names):
            sheet = [cells.get((row, places[name])) for row in range(4, 105)]
            sheet = [v if isinstance(v, int | float) else np.nan for v in sheet]
            expected = frames["A"][name].to_numpy()
            scale = np.maximum(np.abs(expected), np.sqrt(np.nanmean(expected**2)))
            np.testing.assert_array_equal(np.isnan(sheet), np.isnan(expected), name)
            assert np.nanmax(np.abs(sheet - expected) / scale) < 1e-11, name
            compared += 1
    assert compared == sum(map(len, tennis.sections.values()))


def test_formulas_are_short(workbook):
    """Below 120 characters: long ones have columns for their parts."""
    cells = [cell for sheet in load_workbook(workbook) for row in sheet.iter_rows() for cell in row]
    assert max(len(cell.value) for cell in cells if cell.data_type == "f") < 120


def test_cells_triangulate_as_the_library_does(frames, name):
    frame, (_, shot) = frames[name], MODELS[name]
    s = shot.scene
    x, gap = triangulate(s.camera_1, shot.pixels_1, s.camera_2, shot.pixels_2)
    np.testing.assert_allclose(frame[["x1_tri", "x2_tri", "x3_tri"]], x, rtol=1e-12)
    np.testing.assert_allclose(frame["gap"], gap, rtol=1e-9)


def step(y, dt, drag, spin, g):
    """The midpoint step, written with cross products."""
    middle = y[3:] + dt / 2 * acceleration(y[3:], drag, spin, g)
    return np.r_[y[:3] + dt * middle, y[3:] + dt * acceleration(middle, drag, spin, g)]


def differences(function, y):
    h = 1e-5
    pairs = [(function(y + h * e) - function(y - h * e)) / (2 * h) for e in np.eye(len(y))]
    return np.array(pairs).T


def test_the_cells_are_an_extended_kalman_filter(frames, name):
    """Joint updates with an inverse, and Jacobians by differences, from the same start."""
    frame, (_, shot) = frames[name], MODELS[name]
    cameras = (shot.scene.camera_1, shot.scene.camera_2)
    y, P = frame.loc[0, [f"{n}_a" for n in STATE]].to_numpy(), np.diag([0.01] * 3 + [1.0] * 3)

    def motion(y):
        return step(y, 0.01, TRUE_DRAG, TRUE_SPIN, 9.8)

    def seen(y):
        return np.concatenate([camera.project(y[:3]) for camera in cameras])

    for k in range(1, len(shot.times)):
        F, y = differences(motion, y), motion(y)
        P = F @ P @ F.T
        d = np.r_[shot.pixels_1[k], shot.pixels_2[k]] - seen(y)
        there = np.isfinite(d)
        H = differences(seen, y)[there]
        S = H @ P @ H.T + 0.04 * np.eye(len(H))
        K = P @ H.T @ np.linalg.inv(S)
        y, P = y + K @ d[there], P - K @ S @ K.T
        np.testing.assert_allclose(frame.loc[k, [f"{n}_a" for n in STATE]], y, rtol=1e-7)
        np.testing.assert_allclose(frame.loc[k, "P_x1x1_a"], P[0, 0], rtol=1e-5)
        np.testing.assert_allclose(frame.loc[k, "P_x1vx1_a"], P[0, 3], rtol=1e-4, atol=1e-12)
        assert frame.loc[k, "NIS"] == pytest.approx(d[there] @ np.linalg.solve(S, d[there]), 1e-5)


def test_the_midpoint_step_is_near_enough_to_the_flight(name):
    """A second of steps of 0.01 s against an ODE solver: less than a tenth of a millimetre."""
    ball = MODELS[name][1].scene.ball
    y = np.r_[ball.X, ball.V]
    for _ in range(100):
        y = step(y, 0.01, ball.kappa, ball.spin, ball.g)
    assert np.abs(y[:3] - ball.fly([1.0])[0]).max() < 2e-4


def test_the_flight_sheet_ends_where_an_ode_solver_does(frames, name):
    frame = frames[name]
    last = frame.loc[100, [f"{n}_a" for n in STATE]].to_numpy()
    time, x = impact(Ball(last[:3], last[3:], TRUE_DRAG, TRUE_SPIN))
    scalars = frame.attrs["scalars"]
    assert scalars["impact_time"] == pytest.approx(1 + time, abs=1e-7)
    assert [scalars[f"impact_x{k}"] for k in (1, 2, 3)] == pytest.approx(x, abs=1e-6)


def test_the_steps_of_the_flight_are_runge_and_kuttas():
    """One long step against many short ones; a method of order 2 would err visibly."""
    frame = evaluate(tennis, h_fly=0.05)
    y = frame.loc[0, ["x1_fly", "x2_fly", "x3_fly", "v1_fly", "v2_fly", "v3_fly"]].to_numpy()
    fine = solve_ivp(
        lambda _, y: np.r_[y[3:], acceleration(y[3:], TRUE_DRAG, TRUE_SPIN, 9.8)],
        (0, 0.05),
        y,
        rtol=1e-12,
        atol=1e-12,
    ).y[:3, -1]
    assert np.abs(frame.loc[1, ["x1_fly", "x2_fly", "x3_fly"]] - fine).max() < 1e-7
    coarse = step(y, 0.05, TRUE_DRAG, TRUE_SPIN, 9.8)[:3]
    assert np.abs(coarse - fine).max() > 1e-5


def test_the_filter_is_the_optimum_of_the_pixels_that_it_takes(name):
    """Q is 0, so the last analysis, flown backwards, is the smoothed path; 12 draws.

    It errs as much as the least squares fit of all pixels that knows drag and spin too, and
    differs from it by a quarter of that error; from the fit without image 0, which the filter does
    not take, by a fifth at most, and in depth by a thirtieth.
    """
    model, shot = MODELS[name]
    known = {"kappa": TRUE_DRAG, "spin": TRUE_SPIN}
    ours, best, same = [], [], []
    for seed in range(12):
        noisy = simulate(shot, seed)
        columns, _, _ = run(model, photos(noisy))
        last = np.array([columns[f"{n}_a"][-1] for n in STATE])
        start = Ball(last[:3], last[3:], TRUE_DRAG, TRUE_SPIN).state(-1.0)
        ours.append(start.fly(shot.times))
        best.append(fit_pixels(noisy, **known).ball.fly(shot.times))
        same.append(fit_pixels(without_image_0(noisy), **known).ball.fly(shot.times))

    def rms(differences):
        return np.sqrt(np.mean(np.square(differences), axis=(0, 1)))

    ours, best, same = np.array(ours), np.array(best), np.array(same)
    error = rms(best - shot.truth)
    assert (rms(ours - shot.truth) < 1.05 * error).all()
    assert (rms(ours - best) < 0.25 * error).all()
    assert (rms(ours - same) < 0.2 * error).all()
    assert rms(ours - same)[0] < error[0] / 30


def test_the_filter_errs_as_much_as_it_says(name):
    """NIS by pixel, and the last error by its claimed covariance, over 20 draws."""
    model, shot = MODELS[name]
    ratios, nees = [], []
    for seed in range(20):
        columns, scalars, _ = run(model, photos(simulate(shot, seed)))
        ratios.append(scalars["mean_NIS"])
        e = np.array([columns[f"{n}_a"][-1] for n in STATE[:3]]) - shot.truth[-1]
        P = np.array(
            [[columns[f"P_{min(a, b)}{max(a, b)}_a"][-1] for a in STATE[:3]] for b in STATE[:3]]
        )
        nees.append(e @ np.linalg.solve(P, e))
    assert np.mean(ratios) == pytest.approx(1, abs=0.05)
    assert np.mean(nees) == pytest.approx(3, abs=1.7)  # three standard deviations


def test_wrong_drag_shows_in_the_innovations():
    """The filter cannot explain the pixels with the drag 10 % too low; nor without spin."""
    scalars = evaluate(tennis).attrs["scalars"]
    assert scalars["mean_NIS"] < 1.1
    assert evaluate(tennis, kappa=0.0186).attrs["scalars"]["mean_NIS"] > 1.2
    spinless = evaluate(tennis, lambda_1=0, lambda_2=0, lambda_3=0)
    assert spinless.attrs["scalars"]["mean_NIS"] > 10


def test_a_photo_that_is_missing_is_skipped():
    data = photos(read_drive())
    data = {n: np.where(np.arange(101) == 50, np.nan, v) for n, v in data.items()}
    frame = evaluate(tennis, data)
    for n in STATE:
        assert frame.loc[50, f"{n}_a"] == frame.loc[50, f"{n}_f"]
    assert np.isnan(frame.loc[50, "d_u1"])


def test_without_camera_2_the_depth_is_worth_little():
    """Without its images from 8 on, the claimed error of x1 is more than twice as large."""
    shot = read_drive()
    alone = replace(shot, pixels_2=np.where(np.arange(101)[:, None] < 8, shot.pixels_2, np.nan))
    both, one = evaluate(tennis), evaluate(tennis, photos(alone))
    claimed = [np.sqrt(frame["P_x1x1_a"]) for frame in (both, one)]
    assert (claimed[1] > 2 * claimed[0])[9:].all()
    assert (one["e_a_x1"].abs() < 3 * claimed[1])[8:].all()


def test_the_start_has_little_weight_though_its_pixels_count_twice():
    """Three times its claimed errors hardly move the last analysis, beside its own error."""
    last = [
        evaluate(tennis, **values)[["x1_a", "x2_a", "x3_a"]].iloc[-1]
        for values in ({}, {"s_x": 0.3, "s_v": 3})
    ]
    P = evaluate(tennis).iloc[-1]
    claimed = np.sqrt([P[f"P_{x}{x}_a"] for x in ("x1", "x2", "x3")])
    assert (np.abs(last[1] - last[0]) < 0.05 * claimed).all()


def test_image_0_is_not_used_and_costs_a_hundredth(name):
    """The filter's first row takes no photo: by theory that is worth 1.5 % of the error at most."""
    model, shot = MODELS[name]
    moved = photos(shot)
    moved = {n: np.where(np.arange(101) == 0, v + 5, v) for n, v in moved.items()}
    frame, other = evaluate(model), evaluate(model, moved)
    np.testing.assert_array_equal(frame["x1_a"], other["x1_a"])
    known = {"kappa": TRUE_DRAG, "spin": TRUE_SPIN}
    traces = [
        np.trace(path_covariance(s, s.scene.ball, **known), axis1=1, axis2=2)
        for s in (shot, without_image_0(shot))
    ]
    assert (np.sqrt(traces[1] / traces[0]) < 1.015).all()


@pytest.mark.parametrize(("h_fly", "lands"), [(0.001, False), (0.0016, False), (0.002, True)])
def test_a_flight_that_ends_in_the_air_is_no_impact(frames, name, h_fly, lands):
    """100 steps of h_fly end before the ground or not; an ODE solver says when that is."""
    last = frames[name].loc[100, [f"{n}_a" for n in STATE]].to_numpy()
    time, _ = impact(Ball(last[:3], last[3:], TRUE_DRAG, TRUE_SPIN))
    scalars = evaluate(MODELS[name][0], h_fly=h_fly).attrs["scalars"]
    assert (100 * h_fly > time) == lands == scalars["landed"]
    assert (abs(scalars["impact_x3"] - 0.035) < 1e-6) == lands


def test_an_impact_in_the_air_turns_red_in_the_workbook(workbook):
    _, row, _ = Layout.standard(tennis).scalars["landed"]
    rules = load_workbook(workbook)["Parameters"].conditional_formatting
    (red,) = (found for found in rules if str(found.sqref) == f"F{row}:I{row}")
    assert red.rules[0].formula == [f"$G${row}=0"]
