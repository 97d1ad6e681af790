"""A recurrence says in plain words what it will not take, at the moment it is written."""

import math

import pytest
from sympy import Float, Or, Piecewise, Rational, Symbol, exp, gamma, pi, sign, sin, sqrt

from kfsheet import (
    RMS,
    Chart,
    DataError,
    Exercise,
    Mean,
    ModelError,
    Observed,
    Question,
    Recurrence,
    SumProduct,
    evaluate,
    t,
    when_observed,
)
from kfsheet.exercises.football import football
from kfsheet.model.expressions import Missing


@pytest.fixture
def m():
    """A recurrence with one of everything."""
    m = Recurrence("demo", title="A demonstration", rows=4)
    m.parameter("dt", 0.5, "s", "time step", sign="positive")
    m.parameter("g", 9.8, "m/s2", "gravity")
    m.data("obs", [1.0, math.nan, 3.0, 4.0], "m", "seen", section="Fall", may_be_missing=True)
    m.columns("v", "z", section="Fall")
    return m


def parts(m):
    return [
        *(m.parameters[n].symbol for n in ("dt", "g")),
        *(m.table[n].base for n in ("obs", "v", "z")),
    ]


@pytest.mark.parametrize(
    ("definition", "message"),
    [
        (lambda dt, g, obs, v, z: v[t - 1] + Symbol("q"), "reads q, which is not defined"),
        (lambda dt, g, obs, v, z: v[t] + 1, "circular definition within a row: v -> v"),
        (lambda dt, g, obs, v, z: v[t + 1], "a later row"),
        (lambda dt, g, obs, v, z: v[0], "a row is t, t - 1"),
        (lambda dt, g, obs, v, z: v[t - 2], "give 2 start values"),
        (lambda dt, g, obs, v, z: v[t - 1] + obs[t], "obs.*may be missing; write when_observed"),
        (lambda dt, g, obs, v, z: v[t - 1] - Float(9.81) * dt, "make it a parameter"),
        (lambda dt, g, obs, v, z: v[t - 1] * 86_400, "make it a parameter"),
        (lambda dt, g, obs, v, z: v[t - 1] - Float(3.7), r"holds the number -3\.7; make"),
        (lambda dt, g, obs, v, z: v[t - 1] - 44, "make it a parameter"),
        (lambda dt, g, obs, v, z: 2 * z, r"a whole column; write z\[t\]"),
        (lambda dt, g, obs, v, z: z[t] - Mean(z), r"make it a summary\(\)"),
        (lambda dt, g, obs, v, z: z[t] - Mean(2 * z), "an aggregate takes columns"),
        (lambda dt, g, obs, v, z: gamma(dt), "no function gamma"),
        (lambda dt, g, obs, v, z: Piecewise((1, z[t] > 0)), "otherwise"),
        (lambda dt, g, obs, v, z: v[t - 1] * Symbol("dt"), "use the symbol that parameter"),
        (lambda dt, g, obs, v, z: v[t - 1] > 0, "no number in a row"),
        (lambda dt, g, obs, v, z: "v[t-1]", "give a SymPy expression"),
    ],
)
def test_a_bad_definition_is_refused_and_changes_nothing(m, definition, message):
    v = m.table["v"].base
    with pytest.raises(ModelError, match=message):
        m.define(v[t], definition(*parts(m)), "m/s", "velocity", start=[0])
    assert m.table["v"].expression is None
    m.define(v[t], v[t - 1], "m/s", "velocity", start=[0])


def test_two_columns_that_need_each_other_in_the_same_row_are_named(m):
    v, z = m.table["v"].base, m.table["z"].base
    m.define(v[t], z[t] / 2, "m/s", "velocity")
    with pytest.raises(ModelError, match="within a row: v -> z -> v"):
        m.define(z[t], v[t] + 1, "m", "height")


def test_a_circle_is_named_without_the_columns_that_only_lead_to_it(m):
    a, b, c, d = m.columns("a_first", "b_done", "c_one", "d_two", section="Fall")
    m.define(b[t], t, "", "needs nobody")
    m.define(a[t], b[t] + c[t], "", "leads into the circle")
    m.define(c[t], d[t] + b[t], "", "in the circle")
    with pytest.raises(ModelError, match="within a row: c_one -> d_two -> c_one"):
        m.define(d[t], c[t] + b[t], "", "closes the circle")


def test_a_circle_through_a_summary_is_refused(m):
    v, z = m.table["v"].base, m.table["z"].base
    m.define(v[t], z[t] / 2, "m/s", "velocity")
    mean_v = m.summary("mean_v", Mean(v), "m/s", "mean velocity")
    with pytest.raises(ModelError, match="circular definition through a summary"):
        m.define(z[t], mean_v + 1, "m", "height")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("R", "row or a column"),
        ("C", "row or a column"),
        ("rc", "row or a column"),
        ("x1", "reads x1 as a cell; write x_1"),
        ("dt1", "reads dt1 as a cell"),
        ("XFD9", "as a cell"),
        ("true", "truth value"),
        ("lambda", "Python"),
        ("sqrt", "uses this name itself"),
        ("t", "uses this name itself"),
        ("time", "taken"),
        ("dt", "taken"),
        ("obs", "taken"),
        ("DT", "does not tell it from dt"),
        ("a b", "letters, digits"),
        ("", "letters, digits"),
        ("ü", "letters, digits"),
    ],
)
def test_a_name_that_excel_python_or_kfsheet_cannot_take_is_refused(m, name, message):
    with pytest.raises(ModelError, match=message):
        m.parameter(name, 1, "", "a parameter")


def test_names_that_only_look_like_cells_are_taken(m):
    for name in ("x_0", "P_xx", "XFE1", "K_x", "rho"):
        m.parameter(name, 1, "", "a parameter")


@pytest.mark.parametrize("unit", ["furlong/foo", "3 m", "m s-"])
def test_a_unit_that_does_not_parse_is_refused(m, unit):
    with pytest.raises(ModelError, match="unit"):
        m.parameter("k", 1, unit, "a parameter")


@pytest.mark.parametrize(
    ("value", "sign", "message"),
    [
        (math.inf, "", "finite"),
        (math.nan, "", "finite"),
        ("9", "", "must be a number"),
        (True, "", "must be a number"),
        (None, "", "must be a number"),
        (-1, "nonnegative", "0 or greater"),
        (0, "positive", "greater than 0"),
    ],
)
def test_a_value_that_a_parameter_cannot_have_is_refused(m, value, sign, message):
    with pytest.raises(DataError, match=message):
        m.parameter("k", value, "", "a parameter", sign=sign)
    assert "k" not in m.parameters


def test_data_must_be_finite_complete_and_as_long_as_the_table(m):
    for values, message in [
        ([1, 2, math.inf, 4], "q, row 2 is inf"),
        ([1, 2, math.nan, 4], "q, row 2 is nan"),
        ([1, "2", 3, 4], "q, row 1 is '2'"),
        ([1, 2], "2 values, the table 4 rows"),
        ([], "0 values, the table"),
    ]:
        with pytest.raises(DataError, match=message):
            m.data("q", values, "m", "data", section="Fall")
    m.data("q", [1, 2, 3, 4], "m", "data", section="Fall")


def test_a_column_that_was_announced_must_be_defined(m):
    with pytest.raises(ModelError, match="v is announced but never defined"):
        evaluate(m)


def test_sheets_must_have_names_that_excel_takes(m):
    for name, message in [
        ("a/b", "cannot contain /"),
        ("x" * 32, "1 to 31"),
        ("check", "another sheet"),
        ("fall", "another sheet"),
    ]:
        with pytest.raises(ModelError, match=message):
            m.columns("q", section=name)


def test_a_guard_covers_exactly_the_cells_it_asks_for(m):
    dt, g, obs, v, z = parts(m)
    with pytest.raises(ModelError, match="obs"):
        m.define(v[t], when_observed(z[t], obs[t], 0), "m", "wrong guard")
    m.define(z[t], when_observed(obs[t], obs[t] / 2), "m", "half")
    m.define(v[t], Piecewise((0, ~Observed(z[t])), (z[t], True)), "m", "negative guard")
    assert evaluate(m)["v"].tolist() == [0.5, 0, 1.5, 2]


def test_a_guard_may_ask_for_two_cells_in_either_way(m):
    dt, g, obs, v, z = parts(m)
    m.define(z[t], when_observed(obs[t], obs[t]), "m", "copy")
    neither = Or(~Observed(obs[t]), ~Observed(z[t]))
    m.define(v[t], Piecewise((0, neither), (obs[t] + z[t], True)), "m", "sum")
    assert evaluate(m)["v"].tolist() == [2, 0, 6, 8]


def test_columns_of_data_and_a_summary_need_no_pass_of_their_own():
    m = Recurrence("centred", title="Data without their mean")
    x = m.data("x", [1.0, 2.0, 6.0], "m", "data", section="S")
    (y,) = m.columns("y", section="S")
    mean_x = m.summary("mean_x", Mean(x), "m", "mean")
    m.define(y[t], x[t] - mean_x, "m", "centred")
    assert evaluate(m)["y"].tolist() == [-2, -1, 3]


def test_what_is_added_after_a_run_is_in_the_next_run():
    m = Recurrence("grows", title="A model that grows", rows=2)
    (y,) = m.columns("y", section="S")
    m.define(y[t], t, "", "ramp")
    evaluate(m)
    q = m.parameter("q", 2, "", "late")
    m.derived("q_twice", 2 * q, "", "later")
    assert evaluate(m, q=3).attrs["scalars"]["q_twice"] == 6


@pytest.mark.parametrize("words", ["", "=1+1", "two\nlines", 'a """ b', "@mention"])
def test_words_that_would_break_source_or_become_a_formula_are_refused(m, words):
    with pytest.raises(ModelError, match="the words"):
        m.parameter("k", 1, "", words)


def test_halves_may_be_written_as_decimals(m):
    dt, g, obs, v, z = parts(m)
    m.define(v[t], v[t - 1] - 0.5 * g * dt, "m/s", "velocity", start=[0])
    assert m.table["v"].expression == v[t - 1] - Rational(1, 2) * g * dt


def test_a_column_may_read_a_summary_of_another(m):
    dt, g, obs, v, z = parts(m)
    m.define(v[t], t * dt, "s", "ramp")
    power = m.summary("power", SumProduct(v, v), "s2", "sum of squares")
    m.define(z[t], v[t] / sqrt(power), "", "normalised")
    assert math.isclose(sum(evaluate(m)["z"] ** 2), 1)


def test_units_that_do_not_agree_are_named_with_both_terms(m):
    dt, g, obs, v, z = parts(m)
    m.define(v[t], v[t - 1] - g, "m/s", "velocity, dt forgotten", start=[0])
    (problem,) = m.check_units()
    assert problem.name == "v"
    assert "v[t - 1] is in m/s but -g is in m/s²" in str(problem)


def test_the_unit_check_walks_every_kind_of_node(m):
    dt, g, obs, v, z = parts(m)
    k = m.parameter("k", 2, "1/s", "rate")
    d = m.parameter("d", 45, "deg", "an angle")
    for name, expression, unit in [
        ("q1", exp(-k * dt), ""),
        ("q2", sqrt(g * g) * dt, "m/s"),
        ("q3", Piecewise((g * dt, k * dt > 1), (0, True)), "m/s"),
        ("q4", sin(pi * k * dt), ""),
        ("q5", (k * dt) ** 2 + 1, ""),
    ]:
        (q,) = m.columns(name, section="Fall")
        m.define(q[t], expression, unit, "sound")
    assert m.check_units() == []
    for name, expression, reason in [
        ("w1", exp(k), "argument of exp, k, is in 1/s"),
        ("w2", g ** (k * dt) + g, "is in m/s², not in no unit"),
        ("w5", sign(g + k), "g is in m/s² but k is in 1/s"),
        ("w6", g**t, "its exponent differs from row to row"),
        ("w3", Piecewise((1, g > k), (0, True)), "g is in m/s² but k is in 1/s"),
        ("w4", sin(d), "argument of sin, d, is in deg"),
    ]:
        (q,) = m.columns(name, section="Fall")
        m.define(q[t], expression, "", "unsound")
        assert reason in str(next(p for p in m.check_units() if p.name == name))


def test_a_table_need_not_be_a_time_series():
    m = Recurrence("pixels", title="A row per pixel", step="pixel")
    w = m.data("w", [0.0, 1.0, 3.0], "", "brightness", section="Picture")
    place, share = m.columns("place", "share", section="Picture")
    m.define(place[t], t, "", "where the pixel is")
    light = m.summary("light", SumProduct(w, w), "", "sum of squares")
    m.define(share[t], w[t] ** 2 / light, "", "share of the light")
    assert evaluate(m)["share"].tolist() == [0, 0.1, 0.9]


def test_missing_is_one_object_and_prints_its_name():
    assert str(Missing) == "Missing"
    assert Missing == type(Missing)()
    assert RMS(Recurrence("a_b", title="x").columns("v", section="S")[0]).args


def test_a_column_is_not_a_list_of_cells(m):
    """The builtin sum would otherwise never end."""
    with pytest.raises(TypeError, match="not iterable"):
        sum(m["v"])
    with pytest.raises(TypeError, match="not iterable"):
        list(m)


def test_what_is_defined_can_be_had_by_name(m):
    assert m["v"] is m.table["v"].base
    assert m["dt", "v"] == (m.parameters["dt"].symbol, m.table["v"].base)
    with pytest.raises(ModelError, match="no column 'q'"):
        m["q"]


def test_a_unit_of_something_that_does_not_exist_is_refused(m):
    with pytest.raises(ModelError, match="a unit is given for dq, which"):
        m.check_units(units={"dq": "s"})
    with pytest.raises(ModelError, match="a value is given for dq"):
        m.check_units(values={"dq": 1})


def test_start_values_come_in_a_list(m):
    (w,) = m.columns("w_1", section="Fall")
    with pytest.raises(ModelError, match="give a list, as in start="):
        m.define(w[t], w[t - 1], "m", "what falls", start=0)


@pytest.mark.parametrize(
    ("bundle", "message"),
    [
        ({"about": "text"}, "give a tuple of str"),
        ({"charts": [1]}, "give a tuple of Chart"),
        ({"questions": (Question("x_f", 0, "?"),)}, "has 0 points"),
        ({"charts": (Chart("c", "x", "y", ()),)}, "at least one Series"),
    ],
)
def test_an_exercise_refuses_what_its_workbook_could_not_hold(bundle, message):
    with pytest.raises(ModelError, match=message):
        Exercise(**{"model": football, "about": ("a",), "source": "s", **bundle})


def test_messages_are_worded_for_what_there_is(m):
    empty = Recurrence("empty", title="Nothing yet")
    with pytest.raises(ModelError, match="'nope'; it has none yet"):
        empty["nope"]
    z = m.table["z"].base
    with pytest.raises(ModelError, match="from row 0 on; give a start value"):
        m.define(z[t], z[t - 1], "m", "height")
