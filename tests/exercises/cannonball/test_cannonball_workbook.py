"""The cannon-ball's workbook: charts, limits, and what independent engines compute of it."""

import html
import math
import re
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import need
from matplotlib.figure import Figure

from kfsheet import DataError, ModelError, draw, evaluate, recalculate
from kfsheet.exercises.cannonball import cannonball, exercise
from kfsheet.workbook.write.exercise_sheets import chart_range
from kfsheet.workbook.write.layout import Layout
from tests.estimation.test_kalman import assert_close
from tests.exercises.cannonball.test_cannonball import NAMES, N

WORKBOOK = Path(__file__).parents[3] / "workbooks" / "cannonball.xlsx"
FORMULA = re.compile("<f[^>]*>([^<]+)</f>")


@pytest.fixture(scope="module")
def frame():
    return evaluate(cannonball)


def column_of(found, place):
    """A column of a recalculated sheet; text, such as an error, is a gap."""
    sheet, at = place
    cells = [found[sheet].get((row, at)) for row in range(4, 4 + N)]
    return np.array([math.nan if cell is None or isinstance(cell, str) else cell for cell in cells])


@pytest.mark.parametrize(
    ("engine", "name", "value"),
    [("libreoffice", "angle", 30), ("ironcalc", "angle", 60), ("ironcalc", "x_R", 0)],
)
def test_the_workbook_follows_in_independent_engines(engine, name, value):
    """A shorter flight, a longer one, and a radar at the cannon, recalculated from nothing."""
    need(engine)
    layout = Layout.standard(cannonball)
    sheet, *place = layout.scalars[name]
    found = recalculate(WORKBOOK, engine, {sheet: {tuple(place): value}})
    assert "#DIV/0!" not in {cell for page in found.values() for cell in page.values()}
    frame = evaluate(cannonball, **{name: value})
    for name, value in frame.attrs["scalars"].items():
        sheet, row, column = layout.scalars[name]
        assert found[sheet][row, column] == pytest.approx(value, rel=1e-11), name
    for column in cannonball.sections["Errors"]:
        assert_close(column_of(found, layout.home(column.name)), frame[column.name], 1e-11)
    (flight,) = (chart for chart in exercise.charts if chart.title == "The flight")
    for series in flight.series[1:]:
        for axis in (series.x, series.y):
            drawn = column_of(found, chart_range(exercise, layout, axis, flight.where))
            assert_close(drawn, frame[axis].where(frame["in_flight"] == 1), 1e-11)


def test_a_low_shot_is_not_drawn_underground():
    """At 30 degrees the ball lands after 935 of 1,320 sweeps, 74 km away; no line goes on."""
    frame = evaluate(cannonball, angle=30)
    assert frame["y_true"].min() < -20_000
    (flight,) = (chart for chart in exercise.charts if chart.title == "The flight")
    lines = draw(flight, frame, Figure().subplots()).lines
    for line in lines[1:]:
        x, y = line.get_data()
        assert (~np.isnan(y)).sum() == frame["in_flight"].sum() == 934
        assert np.nanmin(y) >= -304.8
        assert np.nanmax(x) < 75_000
    with pytest.raises(ModelError, match="no column 'in_the_air'"):
        replace(exercise, charts=(replace(flight, where="in_the_air"),))
    with pytest.raises(DataError, match="needs column in_flight"):
        draw(flight, frame.drop(columns="in_flight"))


def test_the_radars_dots_lie_below_the_lines_in_every_program():
    """Excel draws the last by order on top, LibreOffice what comes first in the file."""
    clouds = [n for n, c in enumerate(exercise.charts, 1) if c.series[0].role == "cloud"]
    assert len(clouds) == 4
    with zipfile.ZipFile(WORKBOOK) as book:
        for n in clouds:
            text = book.read(f"xl/charts/chart{n}.xml").decode()
            series = re.findall("<ser>.*?</ser>", text)
            assert "E69F00" in series[-1]
            assert all("E69F00" not in other for other in series[:-1])
            order = [int(re.search(r'<order val="(\d+)"', one)[1]) for one in series]
            assert order == sorted(order, reverse=True)
            assert "legendEntry" not in text  # which of them it means differs, too


def test_no_formula_is_longer_than_120_characters():
    with zipfile.ZipFile(WORKBOOK) as book:
        pages = [n for n in book.namelist() if n.startswith("xl/worksheets/sheet")]
        texts = [html.unescape(f) for n in pages for f in FORMULA.findall(book.read(n).decode())]
    # A formula that is filled down stands in the file once, for its first row.
    growth = len(str(N + 3)) - 1
    lengths = [len(text) + growth * len(re.findall(r"[A-Z]\d\b", text)) for text in texts]
    assert len(lengths) > 150
    assert max(lengths) <= 120


def test_results_that_cover_a_part_of_the_flight_turn_red():
    _, row, _ = Layout.standard(cannonball).scalars["landed"]
    with zipfile.ZipFile(WORKBOOK) as book:
        (rules,) = re.findall(
            f'<conditionalFormatting sqref="F{row}:I{row}">.*?</conditionalFormatting>',
            book.read("xl/worksheets/sheet2.xml").decode(),
        )
    assert f"<formula>$G${row}=0</formula>" in rules
    with pytest.raises(ModelError, match="alarm names e_x_a, which is no summary"):
        replace(exercise, alarm=("landed", "e_x_a"))
    with pytest.raises(ModelError, match="with a comma even after a single one"):
        replace(exercise, alarm="landed")


def test_every_error_on_a_chart_has_the_band_that_its_filter_claims(frame):
    """Two standard deviations hold 19 of 20 errors of many flights; here are their variances."""
    for state in NAMES:
        np.testing.assert_allclose(
            frame[f"e_{state}_a_high"] ** 2 / 4, frame[f"P_{state}{state}_a"], rtol=1e-12
        )
    for state in ("x", "y"):
        np.testing.assert_allclose(
            frame[f"e_{state}_lin_high"] ** 2 / 4, frame[f"P_{state}{state}_a_lin"], rtol=1e-12
        )
    shown = {series.y for chart in exercise.charts for series in chart.series}
    bands = [c for c in frame if c.endswith(("_low", "_high"))]
    assert len(bands) == 16
    assert set(bands) <= shown
    for high in (c for c in bands if c.endswith("high")):
        assert (frame[high.replace("high", "low")].dropna() == -frame[high].dropna()).all()
