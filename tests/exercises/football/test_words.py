"""What the Read me, the README and the charts say about the football is so."""

import re
from pathlib import Path

import numpy as np
import pytest

from kfsheet import evaluate, study
from kfsheet.exercises.football import exercise, football
from kfsheet.exercises.football.typical import other_kicks

ABOUT = " ".join(exercise.about)
README = (Path(__file__).parents[3] / "README.md").read_text(encoding="utf-8")
NOTEBOOK = (Path(__file__).parents[3] / "notebooks" / "01_football.py").read_text(encoding="utf-8")


def outside(run):
    """How many of the innovations lie outside two standard deviations, in i and in j."""
    scalars = run.attrs["scalars"]
    return [int((run[d].abs() > 2 * scalars[f"sigma_{d}"]).sum()) for d in ("d_i", "d_j")]


def test_the_innovations_lie_outside_or_inside_as_the_read_me_counts_them():
    said = re.search(r"(\d+) of the 15 d_i lie outside.*all 15 d_i and (\d+) of", ABOUT)
    printed, mended = outside(evaluate(football)), outside(evaluate(football, h=0, p=2))
    assert (printed[0], 15 - mended[1]) == tuple(map(int, said.groups()))
    assert mended[0] == 0


def test_other_beliefs_leave_the_photos_and_bring_the_gains_closer_to_0():
    believed, told = evaluate(football), evaluate(football, r_i=900, r_j=900)
    assert told["i"].equals(believed["i"])
    for gain in ("K_x", "K_z"):
        assert abs(told.attrs["scalars"][gain]) < abs(believed.attrs["scalars"][gain]) / 20
    for axis in "xz":
        ways = [(r[f"{axis}_a"] - r[f"{axis}_f"]).abs().sum() for r in (told, believed)]
        assert ways[0] < ways[1]


@pytest.mark.parametrize("text", [ABOUT, README, NOTEBOOK], ids=["Read me", "README", "notebook"])
def test_no_words_say_that_a_variance_makes_the_camera_worse(text):
    assert not re.search(r"camera (that|which) errs by 30|instead of 3|camera error \{", text)


def test_the_errors_over_400_kicks_are_those_that_the_read_me_names():
    said = re.search(r"camera errs by ([\d.]+) m, .* by ([\d.]+) m, .* by ([\d.]+) m", ABOUT)
    runs = ("cam", "a", "ekf")
    columns = [f"e_{axis}_{run}" for axis in "xz" for run in runs]
    found = study(football, 400, other_kicks(400), columns=columns, h=0, p=2)
    for run, value in zip(runs, said.groups(), strict=True):
        squares = [found.rows[f"e_{axis}_{run}"]["rms"][1:] ** 2 for axis in "xz"]
        assert np.sqrt(np.mean(squares)) == pytest.approx(float(value), abs=6e-4)


def test_the_band_of_the_four_states_settles():
    found = evaluate(football)
    late = found["x_high"][6:]
    assert late.max() - late.min() < 0.1 * late.mean()
    assert found["x_high"][0] > 1.5 * late.mean()
