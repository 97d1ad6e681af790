"""Numbers: generated source, refusals at run time, missing observations."""

import math
import subprocess
import sys

import pytest
from sympy import Rational, exp, log, sqrt

from kfsheet import DataError, Recurrence, evaluate, python_source, t
from kfsheet.cli.show import as_python
from kfsheet.exercises.football import football


def test_a_run_is_a_frame_with_names_and_units():
    frame = evaluate(football)
    assert frame.index.name == "photo"
    assert list(frame.columns)[:6] == ["time", "i", "j", "u", "w", "x_f"]
    assert frame.attrs["units"]["x_f"] == "m"
    assert frame.attrs["units"]["K_x"] == "m/px"
    assert frame.attrs["parameters"]["r_i"] == 9
    assert {str(kind) for kind in frame.dtypes} == {"float64"}


def test_the_source_that_is_shown_stands_alone_and_gives_the_same_numbers(tmp_path):
    """Written to a file and run by a Python that cannot see kfsheet."""
    frame = evaluate(football)
    data = {c.name: list(c.values) for c in football.table.values() if c.is_data}
    script = tmp_path / "kick.py"
    call = f"columns, scalars = football(**{data!r})\nprint(columns['x_a'][-1], scalars['K_x'])\n"
    script.write_text(f"{as_python(football)}\n\n{call}")
    done = subprocess.run(
        [sys.executable, "-I", "-S", str(script)], capture_output=True, text=True, check=True
    )
    x_a, K_x = map(float, done.stdout.split())
    assert (x_a, K_x) == (frame["x_a"].iloc[-1], frame.attrs["scalars"]["K_x"])


def test_the_generated_source_reads_like_the_printed_equations():
    source = python_source(football)
    for line in (
        "x_a[t] = x_f[t] + K_x*d_i[t] if observed(d_i[t]) else x_f[t]",
        "d_i[t] = i[t] - a*x_f[t] if observed(i[t]) else nan",
        "u[t] = (x_a[t - 1] - x_a[t - 2])/dt - dt*f*sign(u[t - 1])*u[t - 1]**2",
        "K_x = a*b_x/(r_i + a**2*b_x)",
    ):
        assert line in source


@pytest.mark.parametrize(
    ("data", "parameters", "message"),
    [
        (None, {"q": 1}, "no parameter q; it has dt, g"),
        (None, {"r_i": -1}, "r_i is -1, but variance of the camera in i must be 0 or greater"),
        (None, {"dt": 0}, "dt is 0, but time between two photos must be greater than 0"),
        (None, {"dt": math.inf}, "finite"),
        (None, {"dt": "0.1"}, "must be a number"),
        ({"q": [1]}, {}, "no data column q"),
        ({"i": [1.0]}, {}, "i has 1 values; the table has 16 rows"),
        ({"i": [math.inf] * 16}, {}, "i, row 0 is inf"),
        ({"x_true": [None] * 16}, {}, "x_true, row 0"),
        (None, {"b_x": 0, "r_i": 0}, "K_x has no value: float division by zero"),
    ],
)
def test_what_cannot_be_computed_is_refused_by_name(data, parameters, message):
    with pytest.raises(DataError, match=message):
        evaluate(football, data, **parameters)


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (lambda k: (k - 9) ** Rational(1, 3), "q in row 0 is .*no finite number"),
        (lambda k: k * (k + 1) * (k + 2) * (k + 3), "no finite number"),
        (lambda k: exp(k), "grows beyond 1e308"),
    ],
)
def test_values_that_are_not_finite_and_real_are_refused(rule, message):
    m = Recurrence("wild", title="Values beyond doubles", rows=2)
    k = m.parameter("k", 1, "", "factor")
    (q,) = m.columns("q", section="S")
    m.define(q[t], rule(k), "", "wild")
    with pytest.raises(DataError, match=message):
        evaluate(m, k=1e100 if message != "q in row 0 is .*no finite number" else 1)


def test_a_formula_without_a_value_is_named_with_its_row():
    m = Recurrence("fall_off", title="A root that leaves its domain", rows=9)
    k = m.parameter("k", 3, "", "where the root ends")
    (q,) = m.columns("q", section="S")
    m.define(q[t], sqrt(k - t) + log(k + 1), "", "root")
    with pytest.raises(DataError, match=r"q in row 4 \(step 4\) has no value: .* in log"):
        evaluate(m)


def test_start_rows_of_different_depth_run_in_an_order_that_works_for_each():
    m = Recurrence("depths", title="Start rows of different depth", rows=5)
    p, q = m.columns("p", "q", section="S")
    m.define(p[t], q[t] + 1, "", "needs q in its row, but not at the start", start=[7, q[t - 1]])
    m.define(q[t], p[t - 1] + 1, "", "needs p of the row before", start=[p[t]])
    assert evaluate(m)["p"].tolist() == [7, 7, 9, 11, 13]
    assert evaluate(m)["q"].tolist() == [7, 8, 8, 10, 12]


def test_whole_numbers_do_not_grow_without_end():
    """Python's integers have no bounds; a recurrence that starts with 1 computes in floats."""
    m = Recurrence("grows", title="Grows", rows=40)
    (v, w) = m.columns("v", "w", section="S")
    m.define(v[t], (v[t - 1] + 12) ** 12, "", "v", start=[1])
    m.define(w[t], v[t], "", "w")
    with pytest.raises(DataError, match=r"v in row .* beyond 1e308"):
        evaluate(m)
