"""The football exercise against a filter written with matrices, and the figures of its lesson."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kfsheet import DataError, evaluate
from kfsheet.exercises.football import DATA, build_model, exercise, football
from kfsheet.exercises.football.typical import other_kicks

PHOTOS = pd.read_csv(DATA / "football_camera.csv")
TRUTH = pd.read_csv(DATA / "football_truth.csv")
A, J_0, DT, G, F = 44.2, 500.0, 0.1, 9.80665, 0.03
MODES = {"as printed": (0.5, 1), "power mended": (0.5, 2), "consistent": (0, 2)}


def matrix_filter(h, p, B, R, pixels):
    """The exercise as a vector recursion with a matrix inverse; shares no code with kfsheet."""
    H, c = np.array([[A, 0], [0, -A]]), np.array([0, J_0])
    K = B @ H.T @ np.linalg.inv(H @ B @ H.T + R)
    gravity, velocity = np.array([0, G]), np.array([-22.0, 10.5])
    states, innovations = [np.array([23.4, 0.11])], [np.full(2, np.nan)]
    for n in range(1, len(pixels)):
        mean = velocity if n == 1 else (states[-1] - states[-2]) / DT
        velocity = mean - F * np.sign(velocity) * velocity**2 * DT - gravity * DT
        drop = h * F * np.sign(velocity) * velocity**2 * DT**p + h * gravity * DT**2
        forecast = states[-1] + velocity * DT - drop
        innovations.append(pixels[n] - c - H @ forecast)
        states.append(forecast + K @ innovations[-1])
    return np.array(states), np.array(innovations)


@pytest.mark.parametrize("mode", MODES)
def test_every_row_equals_the_matrix_filter(mode):
    h, p = MODES[mode]
    frame = evaluate(football, h=h, p=p)
    B, R = np.diag([0.01, 0.01]), np.diag([9.0, 9.0])
    states, innovations = matrix_filter(h, p, B, R, PHOTOS[["i", "j"]].to_numpy())
    assert np.allclose(frame[["x_a", "z_a"]], states, rtol=1e-12)
    assert np.allclose(frame[["d_i", "d_j"]], innovations, rtol=1e-9, equal_nan=True)


@pytest.mark.parametrize(
    ("mode", "mean_i", "mean_j", "error_x", "error_z"),
    [
        ("as printed", -22.94, -4.41, 0.181, 0.057),
        ("power mended", -2.67, -3.35, 0.055, 0.052),
        ("consistent", -0.40, -0.07, 0.048, 0.049),
    ],
)
def test_the_figures_of_the_lesson_are_those_of_the_matrix_filter(
    mode, mean_i, mean_j, error_x, error_z
):
    h, p = MODES[mode]
    found = evaluate(football, h=h, p=p).attrs["scalars"]
    B, R, photos = np.diag([0.01, 0.01]), np.diag([9.0, 9.0]), PHOTOS[["i", "j"]].to_numpy()
    states, innovations = matrix_filter(h, p, B, R, photos)
    means = np.nanmean(innovations, axis=0)
    errors = np.sqrt(((states - TRUTH[["x", "z"]].to_numpy()) ** 2).mean(axis=0))
    assert means == pytest.approx([found["mean_d_i"], found["mean_d_j"]], abs=1e-9)
    assert means == pytest.approx([mean_i, mean_j], abs=0.006)
    assert errors == pytest.approx([found["rms_x_a"], found["rms_z_a"]], abs=1e-12)
    assert errors == pytest.approx([error_x, error_z], abs=6e-4)
    assert found["rms_x_cam"] == pytest.approx(0.066, abs=5e-4)
    assert found["rms_z_cam"] == pytest.approx(0.061, abs=5e-4)


def test_as_printed_the_analysis_of_x_is_worse_than_the_camera_and_mended_it_is_better():
    printed = evaluate(football).attrs["scalars"]
    mended = evaluate(football, h=0, p=2).attrs["scalars"]
    assert printed["rms_x_a"] > printed["rms_x_cam"] > mended["rms_x_a"]
    assert printed["rms_x_free"] > 10 * mended["rms_x_free"]


def test_that_is_no_chance_over_other_kicks():
    """As printed worse than the camera in each of 200 kicks; mended better in nine of ten."""
    kicks = [other_kicks(200)[pixel] for pixel in "ij"]
    better = {"as printed": 0, "consistent": 0}
    for mode in better:
        h, p = MODES[mode]
        for i, j in zip(*kicks, strict=True):
            s = evaluate(football, {"i": i, "j": j}, h=h, p=p).attrs["scalars"]
            better[mode] += s["rms_x_a"] < s["rms_x_cam"]
    assert better["as printed"] == 0
    assert better["consistent"] > 0.85 * 200


def test_the_unit_check_finds_the_friction_term_in_both_units():
    def names(**what):
        return {problem.name for problem in football.check_units(**what)}

    wrong = names()
    # The four states need f in 1/m, and only there the printed terms are not to blame.
    assert {n for n in wrong if not n.endswith("_ekf")} == {
        *("u", "w", "u_free", "w_free", "u_next", "w_next")
    }
    assert "slow_ekf" in wrong
    assert names(units={"f": "1/m"}) == {"x_f", "z_f", "x_free", "z_free"}
    assert names(units={"f": "1/m"}, values={"p": 2}) == set()


def test_a_worse_camera_makes_the_analysis_lean_on_the_model():
    sharp, blurred = evaluate(football), evaluate(football, r_i=900, r_j=900)
    assert blurred.attrs["scalars"]["K_x"] < sharp.attrs["scalars"]["K_x"] / 20
    lean = [(f["x_a"] - f["x_f"]).abs() / f["d_i"].abs() for f in (sharp, blurred)]
    assert lean[1].max() < lean[0].min()


@pytest.mark.parametrize(
    ("along", "first", "x", "z"),
    [(0, 1, 0.39, 0.34), (0, 0.5, 0.02, 0.81), (1, 0.5, 0.22, 0.19)],
)
def test_two_errors_of_the_free_run_cancel_in_part(along, first, x, z):
    """Oracle: the free run written anew, with the errors mended or not."""
    path = free_run(along, first, DT)
    errors = np.sqrt(((path - TRUTH[["x", "z"]].to_numpy()) ** 2).mean(axis=0))
    found = evaluate(football, h=0, p=2, along=along, first=first)
    assert np.allclose(found[["x_free", "z_free"]], path, rtol=1e-12)
    assert errors == pytest.approx([x, z], abs=0.005)


def free_run(along, first, dt):
    place, mean, path = np.array([23.4, 0.11]), np.array([-22, 10.5]), []
    for n in range(round(1.5 / dt) + 1):
        path.append(place)
        speed = np.hypot(*mean) if along else np.abs(mean)
        change = (F * speed * mean + [0, G]) * dt
        mean = mean - change * (first if n == 0 else 1)
        place = place + mean * dt
    return np.array(path)[:: round(DT / dt)]


def test_what_is_left_with_both_mended_comes_from_the_length_of_the_steps():
    truth = TRUTH[["x", "z"]].to_numpy()
    errors = [np.abs(free_run(True, 0.5, dt) - truth).max() for dt in (0.1, 0.01, 0.001)]
    assert errors[0] > 8 * errors[1] > 60 * errors[2]


def test_the_switches_of_the_free_run_leave_the_sheet_of_the_source_alone():
    mended, plain = evaluate(football, along=1, first=0.5), evaluate(football)
    for column in football.sections["Reanalysis"]:
        assert mended[column.name].equals(plain[column.name])
        rules = [*column.start, column.expression]
        assert not {"along", "first"} & {str(s) for r in rules if r for s in r.free_symbols}


def test_a_missing_photo_leaves_the_forecast_each_coordinate_on_its_own():
    data = {"i": PHOTOS["i"].tolist()}
    data["i"][7] = None
    frame = evaluate(football, data)
    assert frame["x_a"][7] == frame["x_f"][7]
    assert frame["z_a"][7] != frame["z_f"][7]
    assert math.isnan(frame["d_i"][7])
    assert math.isnan(frame["x_cam"][7])
    assert frame["x_a"].notna().all()


def test_without_any_photo_the_analysis_is_the_free_run():
    frame = evaluate(football, {"i": [None] * 16, "j": [None] * 16})
    assert np.allclose(frame["x_a"], frame["x_free"])
    assert math.isnan(frame.attrs["scalars"]["mean_d_i"])


def test_the_forecast_of_the_goal_line_holds_what_a_flight_in_fine_steps_gives():
    """Oracle: the truth extrapolated by a parabola through its last five points."""
    last = TRUTH.tail(5)
    x, z = (np.polyfit(last["t"], last[axis], 2) for axis in "xz")
    moment = next(r for r in np.roots(x).real if 1.5 < r < 1.7)
    found = evaluate(football, h=0, p=2).attrs["scalars"]
    assert found["goal_wait"] == pytest.approx(moment - 1.5, abs=0.01)
    assert abs(found["goal_height"] - np.polyval(z, moment)) < 2 * found["goal_sigma"]


def test_the_spread_at_the_goal_line_is_that_of_independent_analyses():
    """First-order error propagation, against noise added to the last two analyses."""
    frame = evaluate(football, h=0, p=2)
    scalars, random = frame.attrs["scalars"], np.random.RandomState(1)
    u, w = frame["u"].iloc[-1], frame["w"].iloc[-1]
    noise = random.standard_normal((2, 2, 100_000)) * math.sqrt(scalars["p_x"])
    x, z = (frame[["x_a", "z_a"]].tail(2).to_numpy().T[..., None] + noise).transpose(0, 1, 2)
    u_next = (x[1] - x[0]) / DT - F * np.sign(u) * u**2 * DT
    w_next = (z[1] - z[0]) / DT - F * np.sign(w) * w**2 * DT - G * DT
    wait = -x[1] / u_next
    heights = z[1] + w_next * wait + G * wait * (DT - wait) / 2
    assert np.std(heights) == pytest.approx(scalars["goal_sigma"], rel=0.05)


def test_over_many_kicks_the_spread_at_the_goal_line_is_on_the_safe_side():
    """New noise in all photos, filtered anew: the claim is larger than the spread, not by half."""
    random = np.random.RandomState(7)
    seen = np.stack([A * TRUTH["x"], J_0 - A * TRUTH["z"]], axis=1)
    heights, waits = [], []
    for _ in range(400):
        i, j = (seen + 3 * random.standard_normal(seen.shape)).T
        found = evaluate(football, {"i": i, "j": j}, h=0, p=2).attrs["scalars"]
        heights.append(found["goal_height"])
        waits.append(found["goal_wait"])
    claimed = evaluate(football, h=0, p=2).attrs["scalars"]
    assert 1 < claimed["goal_sigma"] / np.std(heights) < 1.5
    assert 1 < claimed["goal_wait_sigma"] / np.std(waits) < 1.5


def test_the_exercise_asks_for_the_filter_and_draws_what_it_needs():
    assert {q.name for q in exercise.questions} >= {"K_x", "K_z", "x_f", "z_f", "x_a", "z_a"}
    assert len(exercise.charts) >= 3


BAD_TABLES = {
    "photo,t,i\n0,0,1\n": "lacks column 'j'",
    "photo,t,i,j,k\n0,0,1,1,1\n": "has an extra column 'k'",
    "photo,t,i,j,j\n0,0,1,1,1\n": "repeats column 'j'",
    "photo,t,i,j\n0,0,1,x\n": "line 2, column j is 'x'; it must be a number",
    "photo,t,i,j\n0,0,inf,1\n": "line 2, column i is inf; it must be a finite number",
    "photo,t,i,j\n0,0,1,1\n1,0,1,1\n": "line 3, column t: 0 repeats 0",
    "photo,t,i,j\n0,1,1,1\n1,0,1,1\n": "line 3, column t: 0 goes back from 1",
    "photo,t,i,j\n0,,1,1\n": "column t is ''; it must be a number",
    "photo,t,i,j\n0,0,1\n": "line 2 has 3 fields, the header 4",
    "photo,t,i,j\n": "no rows",
    "": "lacks column",
    "photo,t,i,j\n0,0,1,1\n1,0.15,1,1\n": "row 1 is photo 1 at 0.15 s; it must be photo 1 at 0.1 s",
    "photo,t,i,j\n0,0,1,1\n2,0.2,1,1\n": "row 1 is photo 2 at 0.2 s",
}


@pytest.mark.parametrize("text", BAD_TABLES)
def test_a_bad_photo_table_is_refused_with_file_line_and_column(tmp_path, text):
    path = tmp_path / "photos.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=f"photos.csv.*{BAD_TABLES[text]}"):
        build_model(camera=path)


def test_a_photo_table_that_is_no_text_or_not_there_is_refused(tmp_path):
    path = tmp_path / "photos.csv"
    with pytest.raises(DataError, match="cannot be read"):
        build_model(camera=path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataError, match="cannot be read"):
        build_model(camera=path)


def test_an_empty_field_is_a_missing_photo_also_in_a_file(tmp_path):
    path = tmp_path / "photos.csv"
    text = Path(DATA / "football_camera.csv").read_text()
    path.write_text(text.replace("623.1", ""))
    frame = evaluate(build_model(camera=path))
    assert frame["x_a"][5] == frame["x_f"][5]
