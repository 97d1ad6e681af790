"""The calculators of the tennis workbook: cells against the library and against the report."""

from pathlib import Path

import numpy as np
import openpyxl
import pytest

from kfsheet import evaluate
from kfsheet.exercises.tennis import tennis
from kfsheet.exercises.tennis.methods.cameras import error_diamond, rms_error
from kfsheet.exercises.tennis.methods.centroid import centroid, lambert_shift

WORKBOOKS = Path(__file__).parents[3] / "workbooks"


def test_the_cameras_sheet_is_the_library():
    frame = evaluate(tennis)
    H, V = error_diamond(frame["theta"])
    np.testing.assert_allclose(frame["H"], H)
    np.testing.assert_allclose(frame["V"], V)
    np.testing.assert_allclose(frame["rms_cross"], rms_error(frame["theta"]))
    scalars = frame.attrs["scalars"]
    assert scalars["d_max"] == pytest.approx(10.4167, abs=5e-5)
    assert np.degrees(scalars["theta_best"]) == pytest.approx(45.024, abs=5e-4)
    assert np.degrees(scalars["apex_best"]) == pytest.approx(109.47, abs=0.01)


@pytest.mark.parametrize(
    "light", [{}, {"phi": 30}, {"ambient": 0.4, "wall": 0.3, "threshold": 0.1}]
)
def test_the_centroid_sheet_is_the_library(light):
    """The cells sample each pixel once; the library's centroid gets the same image."""
    frame = evaluate(tennis, **light)
    image = frame["light"].iloc[:100].to_numpy().reshape(10, 10)
    found = centroid(image, light.get("wall", 0.0), light.get("threshold", 0.0))
    scalars = frame.attrs["scalars"]
    assert [scalars["i_centroid"], scalars["j_centroid"]] == pytest.approx(found)


@pytest.mark.parametrize(
    ("values", "fits"),
    [
        ({}, True),
        ({"window": 11}, True),  # 9 whole lines; the ball ends on the ninth
        ({"window": 14}, False),
        ({"j_ball": 6.2}, False),
        ({"i_ball": 7}, False),
        ({"j_ball": 2}, False),
        ({"window": 10, "pitch": 0.5}, False),
    ],
)
def test_a_ball_that_the_rows_do_not_hold_is_noticed(values, fits):
    """Against the centre of intensity of the same ball on an image that is large enough."""
    p = {"window": 10, "i_ball": 4.5, "j_ball": 4.5, "pitch": 1.0} | values
    j, i = np.mgrid[-20:40, -20:40] * p["pitch"]
    a, b = (i - p["i_ball"]) / 4, (j - p["j_ball"]) / 4
    image = np.where(a**2 + b**2 < 1, np.maximum(a, 0), 0)  # light from the right
    scalars = evaluate(tennis, **values).attrs["scalars"]
    whole = [(image * n).sum() / image.sum() for n in (i, j)]
    found = [scalars["i_centroid"], scalars["j_centroid"]]
    assert scalars["ball_fits"] == fits == (found == pytest.approx(whole))


@pytest.mark.parametrize("name", ["tennis", "tennis_toss"])
def test_every_result_that_warns_turns_red_in_the_workbook(name):
    """Summaries whose words begin with "1: ... 0:" say whether the others mean anything."""
    warnings = {n for n, s in tennis.summaries.items() if s.description.startswith("1: ")}
    assert {"ball_fits", "landed"} <= warnings
    sheet = openpyxl.load_workbook(WORKBOOKS / f"{name}.xlsx")["Parameters"]
    rules = {
        r.formula[0]: str(area.sqref) for area in sheet.conditional_formatting for r in area.rules
    }
    rows = {sheet.cell(row, 6).value: row for row in range(5, sheet.max_row + 1)}
    assert rules == {f"$G${rows[n]}=0": f"F{rows[n]}:I{rows[n]}" for n in warnings}


def test_the_centroid_sheet_shows_the_shift():
    for phi in (30, 60, 90):
        scalars = evaluate(tennis, phi=phi).attrs["scalars"]
        assert scalars["shift_theory"] == pytest.approx(lambert_shift(np.radians(phi)))
        assert scalars["shift_i"] == pytest.approx(scalars["shift_theory"], abs=0.03)
