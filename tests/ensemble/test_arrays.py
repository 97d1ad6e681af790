"""All members at once by NumPy: each one's numbers, gaps and refusals are those of its own run."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import (
    Abs,
    And,
    Eq,
    Max,
    Min,
    Mod,
    Not,
    Or,
    Piecewise,
    Rational,
    acos,
    acosh,
    asin,
    atan,
    atan2,
    atanh,
    ceiling,
    cos,
    cosh,
    exp,
    floor,
    log,
    sign,
    sinh,
    sqrt,
    tan,
    tanh,
)

from kfsheet import (
    RMS,
    Count,
    DataError,
    Largest,
    Last,
    Mean,
    Observed,
    Recurrence,
    Smallest,
    Std,
    Sum,
    SumProduct,
    evaluate,
    exercise_names,
    load_exercise,
    study,
    t,
    when_observed,
)
from kfsheet.ensemble import groups
from kfsheet.ensemble.groups import columns_and_scalars
from kfsheet.ensemble.study import everyone

ROWS, MEMBERS = 9, 40


def by_arrays(model, members, data=None, **parameters):
    """All columns and scalars of all members."""
    names = [c.name for c in model.all_columns()]
    group = everyone(model, members, data, names, None, {}, parameters, False)
    return columns_and_scalars(group)


def alone(model, member, data, parameters):
    """The same of one member, by Python."""
    pick = {n: v[member] if np.ndim(v) else v for n, v in parameters.items()}
    run = evaluate(model, {n: v[member] for n, v in data.items()}, compiled=False, **pick)
    return run.to_numpy().T, [*run.attrs["scalars"].values()]


def assert_equal_to_single_runs(model, members, data=None, tolerance=1e-12, **parameters):
    data = data or {}
    out, results = by_arrays(model, members, data, **parameters)
    for member in range(0, members, max(1, members // 5)):
        columns, scalars = alone(model, member, data, parameters)
        assert (np.isnan(columns) == np.isnan(out[member])).all()
        size = np.sqrt(np.nanmean(np.where(np.isnan(columns), 0, columns) ** 2, axis=1))
        far = np.nan_to_num(np.abs(columns - out[member])).max(axis=1)
        assert (far <= tolerance * np.maximum(size, 1e-300)).all()
        np.testing.assert_allclose(results[member], scalars, rtol=1e-11, equal_nan=True)


@pytest.fixture
def no_python(monkeypatch):
    """Nobody asks Python for a member."""

    def refuse(*_):
        raise AssertionError("arrays were not trusted")

    monkeypatch.setattr(groups, "_by_python", refuse)


def noisy(model, members, share=0.0):
    """Data of every member: those of the model with noise, and gaps where they may be."""
    state, data = np.random.RandomState(members), {}
    for column in (c for c in model.all_columns() if c.is_data):
        values = np.array(column.values, dtype=float)
        size = 1e-3 * np.nanmax(np.abs(values), initial=1e-6)
        data[column.name] = values + size * state.standard_normal((members, model.rows))
        if column.may_be_missing:
            data[column.name][state.random_sample(data[column.name].shape) < share] = np.nan
    return data


@pytest.mark.parametrize("name", exercise_names())
def test_every_exercise_is_computed_as_alone(no_python, name):
    model = load_exercise(name).model
    assert_equal_to_single_runs(model, 7, noisy(model, 7), 5e-12)


@pytest.mark.parametrize("name", ["football", "shuttlecock"])
def test_members_with_gaps_and_parameters_of_their_own_are_computed_as_alone(no_python, name):
    model = load_exercise(name).model
    parameter = next(p for p in model.parameters.values() if p.name.startswith(("r_", "sigma")))
    own = {parameter.name: parameter.value * np.linspace(0.5, 2, MEMBERS)}
    assert_equal_to_single_runs(model, MEMBERS, noisy(model, MEMBERS, 0.3), 5e-12, **own)


# -- one rule at a time ------------------------------------------------------------------------


def of_rule(rule, **options):
    """Column x by a rule of data u and y, which has gaps, of x itself and of parameters a and b."""
    m = Recurrence("rules", title="Rules", rows=ROWS)
    a, b = m.parameter("a", 0.7, "", "a"), m.parameter("b", -1.3, "", "b")
    u = m.data("u", [0.5] * ROWS, "", "complete", section="S")
    y = m.data("y", [0.5] * ROWS, "", "with gaps", section="S", may_be_missing=True)
    (x,) = m.columns("x", section="S")
    m.define(x[t], rule(a, b, u, y, x), "", "x", start=[Rational(1, 4)], **options)
    return m


def given_data(low=-2.0, high=2.0):
    state = np.random.RandomState(7)
    data = {name: state.uniform(low, high, (MEMBERS, ROWS)) for name in "uy"}
    data["y"][state.random_sample((MEMBERS, ROWS)) < 0.3] = np.nan
    return data


RULES = {
    "a root where it exists": lambda a, b, u, y, x: Piecewise((sqrt(u[t]), u[t] > 0), (a, True)),
    "a logarithm where it exists": lambda a, b, u, y, x: Piecewise((b, u[t] <= 0), (log(u[t]), 1)),
    "a quotient where it exists": lambda a, b, u, y, x: Piecewise(
        (0, Eq(floor(u[t]), 0)), (1 / floor(u[t]), True)
    ),
    "nested branches": lambda a, b, u, y, x: Piecewise(
        (Piecewise((log(u[t] - 1), u[t] > 1), (atanh(u[t]), u[t] < 1), (0, True)), u[t] > 0),
        (acosh(1 - u[t]) + asin(-u[t] / 2) ** 2, True),
    ),
    "an exponential that would overflow": lambda a, b, u, y, x: Piecewise(
        (exp(exp(9 * u[t])), u[t] < 0), (cosh(-u[t]) + sinh(u[t]), True)
    ),
    "a condition that is asked for only after another": lambda a, b, u, y, x: Piecewise(
        (1, And(u[t] > 0, sqrt(Max(u[t], 0)) < 1)), (2, Or(u[t] < -1, u[t] > 1)), (3, True)
    ),
    "not and or": lambda a, b, u, y, x: Piecewise(
        (u[t], Not(Or(u[t] > 1, Observed(y[t])))), (b, And(Observed(y[t]), y[t] > 0)), (a, True)
    ),
    "gaps": lambda a, b, u, y, x: when_observed((y[t], x[t - 1]), y[t] ** 2 + x[t - 1] / 9, u[t]),
    "a floor beside gaps": lambda a, b, u, y, x: when_observed(y[t], floor(5 * y[t]), 7),
    "signs": lambda a, b, u, y, x: sign(floor(u[t])) ** 3 - sign(x[t - 1]) / 3,
    "largest and smallest beside gaps": lambda a, b, u, y, x: when_observed(
        y[t], Max(y[t], u[t], a) - Min(y[t], b)
    ),
    "remainders": lambda a, b, u, y, x: Mod(7 * u[t], a) + Mod(u[t], b) + Mod(-u[t], 2 * a),
    "angles": lambda a, b, u, y, x: atan2(u[t], b) + tan(u[t] / 2) + acos(u[t] / 3) + tanh(a),
    "powers": lambda a, b, u, y, x: Abs(u[t]) ** a + (1 + u[t] ** 2) ** b + u[t] ** 5 - u[t] ** -2,
    "broken powers": lambda a, b, u, y, x: (3 + u[t]) ** Rational(-3, 2) + cos(u[t]) ** 3,
    "whole steps": lambda a, b, u, y, x: ceiling(3 * u[t]) - floor(u[t] / 7) + t**2,
    "rows": lambda a, b, u, y, x: Piecewise((x[t - 1] + t, t < 4), (u[t - 1] * x[t - 1], True)),
}


@pytest.mark.parametrize("name", RULES)
def test_a_rule_is_computed_as_alone_and_no_branch_that_is_not_taken_is_in_the_way(no_python, name):
    own = {"a": np.linspace(0.5, 1.5, MEMBERS), "b": np.linspace(-2, -1, MEMBERS)}
    for parameters in ({}, own):
        assert_equal_to_single_runs(of_rule(RULES[name]), MEMBERS, given_data(), **parameters)


AGGREGATES = [Count, Largest, Last, Mean, RMS, Smallest, Std, Sum]


@pytest.mark.parametrize("aggregate", AGGREGATES)
def test_aggregates_leave_out_what_is_missing(no_python, aggregate):
    m = of_rule(lambda a, b, u, y, x: when_observed(y[t], y[t] * a))
    m.summary("s", aggregate(m["x"]), "", "of a column")
    m.summary("of_data", aggregate(m["y"]), "", "of data")
    m.summary("p", SumProduct(m["x"], m["u"]), "", "of two")
    data = given_data()
    data["y"][3] = np.nan  # nothing is left but the start
    assert_equal_to_single_runs(m, MEMBERS, data)


# -- what has no value -------------------------------------------------------------------------

WRONG = {
    "division": (lambda a, b, u, y, x: a / u[t], 0.0),
    "remainder": (lambda a, b, u, y, x: Mod(a, u[t]), 0.0),
    "root": (lambda a, b, u, y, x: atan(sqrt(u[t])), -1.0),
    "logarithm": (lambda a, b, u, y, x: log(u[t]) ** 2, 0.0),
    "arcsine": (lambda a, b, u, y, x: asin(u[t]), 2.0),
    "broken power": (lambda a, b, u, y, x: u[t] ** Rational(1, 3), -1.0),
    "exponential": (lambda a, b, u, y, x: 1 / (1 + exp(u[t])), 1e4),
    "square": (lambda a, b, u, y, x: 1 / (1 + u[t] ** 2), 1e200),
    "product": (lambda a, b, u, y, x: u[t] * (u[t] + 1), 1e200),
    "in a branch that is taken": (
        lambda a, b, u, y, x: Piecewise((0, u[t] > 0), (sqrt(u[t]), True)),
        -1.0,
    ),
    "in a second condition": (
        lambda a, b, u, y, x: Piecewise((0, And(u[t] < 1, sqrt(u[t]) > 0)), (1, True)),
        -1.0,
    ),
    "beside gaps": (lambda a, b, u, y, x: when_observed(y[t], log(u[t])), -1.0),
}


@pytest.mark.parametrize("member", [0, 17, MEMBERS - 1])
@pytest.mark.parametrize("name", WRONG)
def test_the_one_member_without_a_value_is_named(name, member):
    rule, value = WRONG[name]
    model, data = of_rule(rule), given_data(0.25, 0.75)
    study(model, MEMBERS, data, compiled=False)
    data["u"][member, 5], data["y"][member, 5] = value, 1
    with pytest.raises(DataError, match=r"row 5"):
        alone(model, member, data, {})
    with pytest.raises(DataError, match=f"rules, member {member} has no value"):
        study(model, MEMBERS, data, columns=["x"], compiled=False)


def mean_of_gaps(rule):
    """A second pass that reads the mean of a column: NaN for a member that observed nothing."""
    m = of_rule(lambda a, b, u, y, x: when_observed(y[t], y[t] * a))
    mean = m.summary("mean_y", Mean(m["y"]), "", "mean")
    (z,) = m.columns("z", section="S")
    m.define(z[t], rule(mean, m["u"][t]), "", "z")
    data = given_data(0.25, 0.75)
    data["y"][:, 0] = 1.0
    return m, data


@pytest.mark.parametrize("rule", [lambda s, u: s + u, lambda s, u: floor(s), lambda s, u: sign(s)])
def test_what_is_missing_does_not_pass_into_what_is_complete(rule):
    model, data = mean_of_gaps(rule)
    assert study(model, MEMBERS, data, columns=["z"], compiled=False).rows["z"]["count"].min() == 40
    data["y"][12] = np.nan
    words = "member 12 has no value: (z in row 0 is nan|cannot convert float NaN)"
    try:
        columns, scalars = alone(model, 12, data, {})
    except DataError:
        with pytest.raises(DataError, match=words):
            study(model, MEMBERS, data, columns=["z"], compiled=False)
    else:  # the sign of nothing is 0
        assert_equal_to_single_runs(model, MEMBERS, data)


def test_python_has_the_last_word_where_numpy_is_too_strict():
    """A product in a branch that one member does not take overflows: that is nobody's error."""
    model = of_rule(lambda a, b, u, y, x: Piecewise((a, u[t] > 9), (u[t] * u[t - 1] * u[t], True)))
    data = given_data()
    data["u"][13, 4] = 1e200
    data["u"][13, 5] = 1e200
    assert_equal_to_single_runs(model, MEMBERS, data)


def test_arrays_give_the_same_bits_whenever_they_are_asked(monkeypatch):
    model, data = of_rule(RULES["nested branches"]), given_data()
    asked = {"columns": ["x"], "compiled": False}
    first = study(model, MEMBERS, data, **asked)
    for _ in range(3):
        assert study(model, MEMBERS, data, **asked).rows["x"].equals(first.rows["x"])


# -- random models -----------------------------------------------------------------------------

NUMBERS = st.integers(-3, 3)


def formulas(cells):
    """Formulas of any shape over some cells: a third of them have no value somewhere."""
    one = st.sampled_from([sqrt, log, exp, cos, floor, sign, Abs, atan, lambda x: 1 / x])
    two = st.sampled_from(
        [
            lambda x, y: x + y,
            lambda x, y: x - 2 * y,
            lambda x, y: x * y,
            lambda x, y: x / y,
            lambda x, y: Max(x, y),
            lambda x, y: Min(x, y / 2),
            lambda x, y: Mod(x, y),
            lambda x, y: atan2(x, y),
            lambda x, y: Piecewise((sqrt(x), x > y), (y, True)),
            lambda x, y: Piecewise((x / y, Or(y > 1, x < y)), (log(y), x > 0), (x * y, True)),
            lambda x, y: when_observed(cells[0], x, y),
        ]
    )
    return st.recursive(
        st.sampled_from(cells) | NUMBERS.map(lambda n: Rational(n, 2)),
        lambda inner: (
            st.builds(lambda f, x: f(x), one, inner)
            | st.builds(lambda f, x, y: f(x, y), two, inner, inner)
        ),
        max_leaves=6,
    )


@settings(max_examples=120, deadline=None)
@given(st.data())
def test_random_models_are_computed_or_refused_as_alone(drawn):
    m = Recurrence("random", title="Random", rows=5)
    y = m.data("y", [0.5] * 5, "", "with gaps", section="S", may_be_missing=True)
    u = m.data("u", [0.5] * 5, "", "complete", section="S")
    x, z = m.columns("x", "z", section="S")
    try:
        m.define(x[t], drawn.draw(formulas([y[t], u[t], x[t - 1], u[t - 1]])), "", "x", start=[1])
        m.define(z[t], drawn.draw(formulas([x[t], u[t], y[t]])), "", "z")
        m.validate()
        evaluate(m, compiled=False)
    except DataError:
        pass  # that of some other member may have a value
    except Exception:  # of SymPy or of the model's own checks: no model
        return
    state = np.random.RandomState(drawn.draw(st.integers(0, 99)))
    data = {name: state.uniform(-3, 3, (6, 5)).round(1) for name in "uy"}
    data["y"][state.random_sample((6, 5)) < 0.3] = np.nan
    expected, failed = [], None
    for member in range(6):
        try:
            expected.append(alone(m, member, data, {}))
        except DataError:
            failed = member
            break
    if failed is not None:
        with pytest.raises(DataError, match=f"member {failed} has no value"):
            by_arrays(m, 6, data)
        return
    out, results = by_arrays(m, 6, data)
    for member, (columns, scalars) in enumerate(expected):
        np.testing.assert_allclose(out[member], columns, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(results[member], scalars, rtol=1e-9)
