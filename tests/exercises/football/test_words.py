"""What the Read me, the README and the charts say about the football is so."""

import re
from pathlib import Path

import numpy as np
import pytest

from kfsheet import evaluate, study
from kfsheet.cli.commands import main
from kfsheet.exercises.football import exercise, football
from kfsheet.exercises.football.typical import other_kicks, rms_over_kicks

ABOUT = " ".join(exercise.about)
README = (Path(__file__).parents[3] / "README.md").read_text(encoding="utf-8")
NOTEBOOK = (Path(__file__).parents[3] / "notebooks" / "01_football.py").read_text(encoding="utf-8")
PROSE = " ".join(NOTEBOOK.replace("\n#", "\n").split())


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
    found = rms_over_kicks(*runs)
    for run, value in zip(runs, said.groups(), strict=True):
        assert f"{found[run]:.3f}" == value


def test_the_notebook_says_how_to_get_a_sheet_to_fill_in(tmp_path, monkeypatch):
    """As it stands there: the file of one student, and the command."""
    *lines, command = re.search(r"lines `(.*?)` and `(.*?)`, then `kfsheet (.*?)`", PROSE).groups()
    monkeypatch.chdir(tmp_path)
    Path("me.csv").write_text("\n".join(lines) + "\n")
    assert main(command.split()) == 0
    assert Path("own/students/1/football.xlsx").exists()
    assert len(exercise.questions) == 10


def test_the_band_of_the_four_states_settles():
    found = evaluate(football)
    late = found["x_high"][6:]
    assert late.max() - late.min() < 0.1 * late.mean()
    assert found["x_high"][0] > 1.5 * late.mean()


def test_the_answers_of_the_notebook_are_right():
    gain = [evaluate(football, r_i=r).attrs["scalars"]["K_x"] for r in (9, 18, 44.2**2 * 0.01)]
    assert f"from {1000 * gain[0]:.1f} to {1000 * gain[1]:.1f} mm/px" in NOTEBOOK
    assert f"to {gain[1] / gain[0]:.2f} of what" in NOTEBOOK
    assert gain[2] == pytest.approx(1 / 88.4)
    assert f"= {44.2**2 * 0.01:.1f}$ px²" in NOTEBOOK
    wrong = evaluate(football, h=0, p=2, b_x=1e-4, b_z=1e-4).attrs["scalars"]
    said = re.search(r"should scatter by ([\d.]+) px and do so by ([\d.]+)", NOTEBOOK).groups()
    assert said == (f"{wrong['sigma_d_j']:.1f}", f"{wrong['std_d_j']:.1f}")


def test_the_background_variance_that_reproduces_itself_is_near_that_of_the_source():
    """Oracle: the covariances of the extrapolation followed from step to step."""

    def background(b):
        keep, noise = 9 / (9 + 44.2**2 * b), 9 / 44.2**2
        P = np.zeros((2, 2))  # of this analysis and the one before
        F = np.array([[2 * keep, -keep], [1, 0]])
        for _ in range(200):
            P = F @ P @ F.T + np.diag([(1 - keep) ** 2 * noise, 0])
        return np.array([2, -1]) @ P @ np.array([2, -1])

    b = 0.01
    first = background(b)
    for _ in range(100):
        b = background(b)
    said = re.search(r"makes a \$b\$ of ([\d.]+) m², and the fixed point lies at (\d\.\d+)", PROSE)
    assert said.groups() == (f"{first:.4f}", f"{b:.4f}")


def test_four_states_that_claim_fifty_times_the_noise_are_no_better_than_the_scheme():
    scheme, q = rms_over_kicks("a")["a"], 5
    assert rms_over_kicks("ekf", q=q)["ekf"] == pytest.approx(scheme, rel=0.01)
    nis = study(football, 400, other_kicks(400), columns=[], q=q).scalars.loc["mean_NIS", "mean"]
    assert nis == pytest.approx(1.2, abs=0.05)
