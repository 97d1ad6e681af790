"""The shipped photos: what they show, how they were chosen, and whether they are typical."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import chi2

from kfsheet import evaluate
from kfsheet.exercises.football import DATA, football
from kfsheet.exercises.football.kick import flight, model_error, tilted
from kfsheet.exercises.football.typical import (
    SEED,
    SUMMARIES,
    is_typical,
    photos_of,
    typical_ranges,
)

sys.path.insert(0, str(Path(__file__).parents[3] / "tools"))
from draw_kick import tables

P = football.defaults()


def test_the_flight_is_that_of_drag_along_the_path():
    """Oracle: SciPy's integrator with a tolerance of 1e-11."""

    def rate(_, s):
        speed = np.hypot(s[2], s[3])
        return [s[2], s[3], -0.03 * speed * s[2], -0.03 * speed * s[3] - 9.80665]

    times = np.arange(16) * 0.1
    solved = solve_ivp(
        rate, (0, 1.5), [23.4, 0.11, -22, 10.5], t_eval=times, rtol=1e-11, atol=1e-11
    )
    assert np.allclose(flight(P), solved.y[:2], rtol=0, atol=1e-6)


def test_the_data_files_hold_the_draw_of_the_seed():
    for name, text in tables(SEED).items():
        assert (DATA / name).read_text() == text


@pytest.fixture(scope="module")
def ranges():
    return typical_ranges()


def test_the_shipped_draw_is_the_first_that_is_typical(ranges):
    assert [is_typical(seed, ranges) for seed in range(SEED + 1)] == [False] * SEED + [True]


def test_every_summary_of_the_shipped_photos_is_within_the_middle_three_fifths(ranges):
    found = evaluate(football, h=0, p=2).attrs["scalars"]
    for name in SUMMARIES:
        low, high = ranges[name]
        assert low <= found[name] <= high, name


def test_a_test_of_the_consistent_model_finds_nothing_wrong_with_the_shipped_photos():
    """Sums of squares over their theory are chi-squared; no tail is nearer than a fifth."""
    found = evaluate(football, h=0, p=2).attrs["scalars"]
    for pixel, axis in ("ix", "jz"):
        spread = 14 * (found[f"std_d_{pixel}"] / found[f"sigma_d_{pixel}"]) ** 2
        assert 0.2 < chi2.cdf(spread, 14) < 0.8
        camera = 16 * (found[f"rms_{axis}_cam"] * P["a"]) ** 2 / P[f"r_{pixel}"]
        assert 0.2 < chi2.cdf(camera, 16) < 0.8


def test_the_draws_of_two_seeds_differ():
    assert photos_of(1)["i"] != photos_of(2)["i"]


def test_the_model_itself_errs_by_millimetres_and_a_tilted_camera_by_a_metre():
    """From the table of the truth alone: three positions in a row, one step of the equations."""
    truth = np.loadtxt(DATA / "football_truth.csv", delimiter=",", skiprows=1)[:, 2:]
    v = np.diff(truth, axis=0) / 0.1
    step = truth[1:-1] + (v[:-1] - 0.003 * np.abs(v[:-1]) * v[:-1] - [0, 0.980665]) * 0.1
    errors = np.sqrt(((step - truth[2:]) ** 2).mean(axis=0))
    assert errors == pytest.approx([0.0019, 0.0150], abs=5e-5)
    assert [np.sqrt((e**2).mean()) for e in model_error(P)] == pytest.approx(errors, rel=1e-3)
    x, z = truth.T
    for distance, most in ((np.inf, 0.089), (40.0, 1.22)):
        # A pinhole at (0, -distance): the ball's ray meets the picture plane, depth 0.
        depth, way = x * np.sin(np.radians(5)), x * np.cos(np.radians(5))
        meets = way * (1 if distance == np.inf else distance / (distance + depth))
        seen, height = tilted(x, z, 5, distance)
        assert np.allclose(seen, meets)
        assert np.allclose(height * way, z * meets)
        assert np.abs(seen - x).max() == pytest.approx(most, abs=0.005)
