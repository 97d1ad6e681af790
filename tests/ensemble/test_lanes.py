"""Members side by side: their numbers are those of single runs, and what fails is named."""

import numpy as np
import pytest
from sympy import Piecewise, Rational, cos, sign, sqrt

from kfsheet import (
    RMS,
    DataError,
    Mean,
    Recurrence,
    Sum,
    evaluate,
    study,
    t,
    when_observed,
)
from kfsheet.ensemble.side_by_side import WIDTH, kernel_for_many
from kfsheet.evaluation.compiling import compiled_function
from kfsheet.evaluation.kernel import kernel_of
from kfsheet.exercises.cannonball import cannonball
from kfsheet.exercises.football import football

pytest.importorskip("numba")
ROWS = 12


def filtered(rule=None):
    """A filter of constant gain: lags of everything, gaps, start rows, scalars of two kinds."""
    m = Recurrence("filtered", title="A filter of constant gain")
    q = m.parameter("q", 0.4, "", "noise of the model")
    var = m.parameter("var", 2, "", "noise of a measurement")
    late = m.parameter("late", 0, "", "how much a measurement of the row before counts")
    K = m.derived("K", q / (q + var), "", "gain")
    y = m.data("y", [float(n) for n in range(ROWS)], "", "seen", section="S", may_be_missing=True)
    u = m.data("u", [float(n % 3) for n in range(ROWS)], "", "known push", section="S")
    x_f, d, x, flag = m.columns("x_f", "d", "x", "flag", section="S")
    two = 2 * x[t - 1] - x[t - 2] + (u[t] + late * u[t - 1]) * q**2 / var
    m.define(
        x_f[t],
        two - sign(x[t - 1]) * x[t - 1] ** 2 / (8 + var) + t * sqrt(q),
        "",
        "forecast",
        start=[0, var],
    )
    m.define(d[t], when_observed(y[t], y[t] - x_f[t]), "", "innovation")
    analysis = rule(x_f, d, K) if rule else when_observed(d[t], x_f[t] + K * d[t], x_f[t])
    m.define(x[t], analysis, "", "analysis")
    since = Piecewise((flag[t - 1] + 1, (x[t] > 0) | (u[t] > 1)), (0, True))
    m.define(flag[t], since, "", "rows since", start=[0])
    m.summary("rms_d", RMS(d), "", "rms innovation")
    m.summary("both", Mean(y) + Sum(x) / var, "", "of data and of a column")
    return m


def everything(model):
    return tuple(c.name for c in model.all_columns()), None


def numbers(kernel, model, members, data):
    """All that a kernel stores, for all members."""
    shared = {c.name: np.array([c.values]) for c in model.all_columns() if c.is_data}
    series = [{**shared, **data}[name] for name in kernel.data]
    out = np.full((members, len(kernel.columns), model.rows), -1.0)
    results = np.full((members, len(kernel.scalars)), -1.0)
    parameters = np.array([[*model.defaults().values()]], dtype=float)
    compiled_function(kernel.source)(0, members, parameters, *series, out, results)
    return out, results


@pytest.mark.parametrize("members", [1, WIDTH - 1, WIDTH, 2 * WIDTH + 3])
def test_side_by_side_and_one_by_one_are_the_same_to_the_last_bit(members):
    model, state = filtered(), np.random.RandomState(members)
    seen = 3 * state.standard_normal((members, ROWS))
    seen[state.random_sample(seen.shape) < 0.2] = np.nan
    wanted = model.version, *everything(model)
    lanes, single = kernel_for_many(model, *wanted), kernel_of(model, *wanted)
    assert lanes.source != single.source
    found, expected = (numbers(k, model, members, {"y": seen}) for k in (lanes, single))
    for ours, theirs in zip(found, expected, strict=True):
        assert np.array_equal(ours, theirs, equal_nan=True)


def test_side_by_side_agrees_with_python():
    model = filtered()
    seen = np.random.RandomState(4).standard_normal((11, ROWS))
    kernel = kernel_for_many(model, model.version, *everything(model))
    out, results = numbers(kernel, model, len(seen), {"y": seen})
    for k, row in enumerate(seen):
        run = evaluate(model, {"y": row}, compiled=False)
        assert np.allclose(out[k], run.to_numpy().T, rtol=1e-13, atol=1e-13, equal_nan=True)
        scalars = [run.attrs["scalars"][name] for name in kernel.scalars]
        assert np.allclose(results[k], scalars, rtol=1e-13)


def is_vector(model, wanted=()):
    wanted = model.version, *(wanted or everything(model))
    return kernel_for_many(model, *wanted).source != kernel_of(model, *wanted).source


@pytest.mark.parametrize(
    ("rule", "plain"),
    [
        (lambda x_f, d, K: x_f[t] + K * abs(x_f[t]), True),
        (lambda x_f, d, K: x_f[t] + cos(K), True),  # the same in every row
        (lambda x_f, d, K: x_f[t] / K, True),
        (lambda x_f, d, K: cos(x_f[t]), False),
        (lambda x_f, d, K: K / x_f[t], False),
        (lambda x_f, d, K: abs(x_f[t]) ** K, False),
        # Neither may be computed before it is asked for: without a value, it would be refused.
        (lambda x_f, d, K: Piecewise((x_f[t] / K, K > 0), (x_f[t], True)), False),
        (lambda x_f, d, K: Piecewise((sqrt(K), K > 0), (x_f[t], True)), False),
    ],
)
def test_blocks_are_for_rows_of_plain_arithmetic(rule, plain):
    assert is_vector(filtered(rule)) is plain


def test_blocks_are_for_models_of_one_pass():
    model = filtered()
    assert is_vector(model)
    model.define(*second_pass(model))
    assert not is_vector(model)


def second_pass(model):
    (far,) = model.columns("far", section="S")
    return far[t], model["x"][t] - model["rms_d"], "", "far"


def test_football_is_for_blocks_and_cannonball_is_not():
    wanted = ("x_a", "z_a"), ()
    assert is_vector(football, wanted)
    assert not is_vector(cannonball, (("x_a",), ()))


@pytest.mark.parametrize("number", [0, WIDTH - 1, WIDTH, 2 * WIDTH + 2])
def test_the_member_that_diverges_is_named_whichever_its_lane(number):
    seen = np.zeros((2 * WIDTH + 3, ROWS))
    seen[number, 1] = 1e200
    with pytest.raises(DataError, match=f"member {number} has no value: it grows beyond 1e308"):
        study(filtered(), len(seen), {"y": seen}, columns=["x"], compiled=True)


def test_a_division_by_a_parameter_that_is_zero_is_refused_and_explained():
    m = Recurrence("divided", title="Divided", rows=ROWS)
    a = m.parameter("a", 1, "", "a")
    (x,) = m.columns("x", section="S")
    m.define(x[t], x[t - 1] / a, "", "x", start=[1])
    assert is_vector(m)
    assert study(m, 9, columns=["x"], compiled=True).rows["x"]["mean"][ROWS - 1] == 1
    with pytest.raises(DataError, match="member 0 has no value: division by zero"):
        study(m, 9, columns=["x"], compiled=True, a=0)


@pytest.mark.parametrize("compiled", [False, True])
@pytest.mark.parametrize("power", [Rational(3, 2), Rational(-3, 2), Rational(1, 3)])
def test_a_broken_power_of_a_negative_number_is_refused_where_values_may_be_missing(
    power, compiled
):
    """Not taken for a missing value."""
    m = Recurrence("broken", title="Broken power", rows=ROWS)
    a = m.parameter("a", 3.5, "", "a")
    y = m.data("y", [1.0] * ROWS, "", "seen", section="S", may_be_missing=True)
    (x,) = m.columns("x", section="S")
    m.define(x[t], when_observed(y[t], (a - t) ** power), "", "x")
    with pytest.raises(DataError, match="x in row 4"):
        evaluate(m, compiled=compiled)
