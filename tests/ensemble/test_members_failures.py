"""What has no value in a single run has none among many: the member is named, never left out."""

import warnings

import numpy as np
import pytest
from sympy import Eq, Piecewise, Symbol, atan, exp, log, sqrt

from kfsheet import (
    RMS,
    DataError,
    Missing,
    Recurrence,
    Sum,
    evaluate,
    study,
    t,
    when_observed,
)

STEPS = 30
HUGE = Symbol("huge", real=True)


def model_of(rule, *others, start=1):
    """Column v by a rule, and s, which reads it and stays finite or not as its own rule says."""
    m = Recurrence("fails", title="Fails", rows=STEPS)
    a = m.parameter("a", 0.5, "", "a")
    m.parameter("huge", 1e170, "", "a number whose square is too large")
    v, s = m.columns("v", "s", section="S")
    m.define(v[t], rule(v, a), "", "v", start=[start])
    m.define(s[t], others[0](v, a) if others else v[t] + 0, "", "s")
    return m


FAILURES = {
    "root": (lambda v, a: sqrt(v[t - 1] - a), lambda v, a: v[t] + 1),
    "logarithm": (lambda v, a: log(v[t - 1]) + v[t - 1] - a, lambda v, a: 2 * v[t]),
    "division": (lambda v, a: 1 / (v[t - 1] - 1), lambda v, a: v[t] + a),
    "power": (lambda v, a: (v[t - 1] + 12) ** 12, lambda v, a: 1 / v[t]),
    "product": (lambda v, a: v[t - 1] * (v[t - 1] + 9), lambda v, a: 1 / v[t]),
    "difference of infinities": (
        lambda v, a: v[t - 1] * (v[t - 1] + 9),
        lambda v, a: v[t] * (1 - 2 * a) + v[t] / (v[t] + 1),
    ),
    "hidden by a denominator": (lambda v, a: HUGE * t, lambda v, a: 1 / (1 + v[t] ** 2)),
    "hidden by an arctangent": (lambda v, a: HUGE * t, lambda v, a: atan(v[t] ** 3)),
    "exponential": (lambda v, a: v[t - 1] + 60, lambda v, a: 1 / (1 + exp(v[t]))),
    "before the gaps": (
        lambda v, a: v[t - 1] * (v[t - 1] + 9),
        lambda v, a: Piecewise((Missing, v[t] > 10), (v[t], True)),
    ),
}


@pytest.fixture(params=[True, False], ids=["compiled", "by Python"])
def compiled(request):
    """With Numba and without it."""
    if request.param:
        pytest.importorskip("numba")
    return request.param


@pytest.mark.parametrize("name", FAILURES)
def test_what_fails_alone_fails_among_many(compiled, name):
    """Also where only a column is wanted that hides the failure."""
    m = model_of(*FAILURES[name])
    for columns in (["v"], ["s"]) if "hidden" not in name and name != "exponential" else (["s"],):
        with pytest.raises(DataError, match=r"row|has no value"):
            evaluate(m, columns=columns, compiled=compiled)
        with pytest.raises(DataError, match="fails, member 0 has no value"):
            study(m, 3, columns=columns, scalars=(), compiled=compiled)


def test_a_member_that_diverges_is_named_and_never_left_out(compiled):
    m = model_of(lambda v, a: a * v[t - 1] ** 2, lambda v, a: v[t] * (1 - a) + v[t] / (v[t] + 1))
    values = np.full(10, 0.5)
    ensemble = study(m, 10, columns=["s"], a=values, compiled=compiled)
    assert ensemble.rows["s"]["count"].eq(10).all()
    values[[3, 6, 9]] = 5
    with pytest.raises(DataError, match="member 3 has no value"):
        study(m, 10, columns=["s"], a=values, compiled=compiled)
    with pytest.raises(DataError, match="v in row"):
        evaluate(m, a=5, compiled=compiled)


@pytest.mark.parametrize("aggregate", [RMS, Sum])
def test_a_summary_that_overflows_is_an_error_in_every_way_of_running(compiled, aggregate):
    m = Recurrence("heavy", title="Heavy", rows=4)
    a = m.parameter("a", 1e300, "", "a")
    (v,) = m.columns("v", section="S")
    m.define(v[t], a * (t + 1), "", "v")
    m.summary("whole", aggregate(v), "", "of v")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(DataError, match=r"whole|beyond 1e308"):
            evaluate(m, a=4e307 if aggregate is Sum else 1e300, compiled=compiled)
        with pytest.raises(DataError, match="member 0 has no value"):
            study(m, 2, a=4e307 if aggregate is Sum else 1e300, compiled=compiled)


def test_a_derived_scalar_that_overflows_is_an_error_in_every_way_of_running(compiled):
    m = Recurrence("heavy", title="Heavy", rows=4)
    a = m.parameter("a", 1e200, "", "a")
    b = m.derived("b", a * (a + 1), "", "more than there are numbers")
    (v,) = m.columns("v", section="S")
    m.define(v[t], 1 / b, "", "v")
    with pytest.raises(DataError, match="b is inf"):
        evaluate(m, compiled=compiled)
    with pytest.raises(DataError, match="member 0 has no value"):
        study(m, 2, columns=["v"], scalars=(), compiled=compiled)


def test_an_infinite_value_of_one_row_is_found_whoever_reads_it(compiled):
    """Read by what turns it into a finite one, two rows on, or only once."""
    for rule in (
        lambda v: atan(v[t - 1]),
        lambda v: 1 / (1 + v[t - 2] ** 2),
        lambda v: Piecewise((v[t - 1], t < 4), (1, True)),
        lambda v: v[t - 2] + 1,
    ):
        m = Recurrence("fails", title="Fails", rows=11)
        b = m.parameter("b", 1e200, "", "large")
        v, s = m.columns("v", "s", section="S")
        m.define(v[t], Piecewise((b * (b + 1), Eq(t, 8)), (1, True)), "", "v", start=[1, 1])
        m.define(s[t], rule(v), "", "s", start=[0, 0])
        with pytest.raises(DataError, match="v in row 8"):
            evaluate(m, columns=["s"], compiled=compiled)
        with pytest.raises(DataError, match="member 0 has no value"):
            study(m, 2, columns=["s"], compiled=compiled)


def test_a_table_of_start_rows_alone_may_lack_values(compiled):
    m = Recurrence("short", title="Short", rows=1)
    (v,) = m.columns("v", section="S")
    m.define(v[t], t + 1, "", "v", start=[Missing])
    assert study(m, 2, columns=["v"], compiled=compiled).rows["v"]["count"].tolist() == [0]


def test_what_no_row_asks_for_is_not_refused(compiled):
    """The root has no value; but it is for rows that this table does not have."""
    m = Recurrence("short", title="Short", rows=2)
    a = m.parameter("a", -1, "", "a")
    (v,) = m.columns("v", section="S")
    m.define(v[t], v[t - 1] + sqrt(a), "", "v", start=[1, 2])
    ensemble = study(m, 2, columns=["v"], compiled=compiled)
    assert ensemble.rows["v"]["mean"].tolist() == [1, 2]
    assert evaluate(m, compiled=compiled)["v"].tolist() == [1, 2]


def test_what_was_not_observed_is_no_failure(compiled):
    m = Recurrence("gaps", title="Gaps", rows=4)
    y = m.data("y", [1, None, 3, 4], "", "seen", section="S", may_be_missing=True)
    v, w = m.columns("v", "w", section="S")
    m.define(v[t], when_observed(y[t], 2 * y[t]), "", "v")
    m.define(w[t], when_observed(v[t], v[t], 7), "", "w", start=[Missing])
    ensemble = study(m, 3, columns=["v", "w"], compiled=compiled)
    assert ensemble.rows["v"]["count"].tolist() == [3, 0, 3, 3]
    assert ensemble.rows["w"]["mean"][1:].tolist() == [7, 6, 8]
    assert evaluate(m, compiled=compiled)["w"][1:].tolist() == [7, 6, 8]


def test_a_member_without_a_value_is_named(compiled):
    m = Recurrence("fails", title="Fails", rows=3)
    a = m.parameter("a", 1, "", "a")
    (v,) = m.columns("v", section="S")
    m.define(v[t], sqrt(a) * v[t - 1], "", "v", start=[1])
    values = np.ones(100)
    values[83] = -1
    with pytest.raises(DataError, match="member 83 has no value"):
        study(m, 100, columns=["v"], a=values, compiled=compiled)
