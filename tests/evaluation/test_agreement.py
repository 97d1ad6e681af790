"""Python and machine code: the same numbers, and the same refusals, alone and among many."""

import numpy as np
import pytest
from sympy import Abs, Max, Mod, Rational, ceiling, floor, sign

from kfsheet import Count, DataError, Largest, Recurrence, evaluate, study, t, when_observed

ROWS = 12
GAP = 5
BIG = 1e200


def model(rule, value=1.0, rows=ROWS, start=()):
    """Column x by a rule of a parameter a, data u and y with a gap, and a column z before it."""
    m = Recurrence("odd", title="Odd", rows=rows)
    a = m.parameter("a", value, "", "a")
    pushed, seen = [0.0] * rows, [1.0] * rows
    if rows > GAP:
        pushed[GAP], seen[GAP] = BIG, None
    u = m.data("u", pushed, "", "push", section="S")
    y = m.data("y", seen, "", "seen", section="S", may_be_missing=True)
    z, x = m.columns("z", "x", section="S")
    m.define(z[t], u[t] * a, "", "z")
    m.define(x[t], rule(x, z, y, a), "", "x", start=list(start))
    return m


def by_scalar(expression):
    """A model whose derived scalar D may have no value."""
    m = Recurrence("odd", title="Odd", rows=ROWS)
    D = m.derived("D", expression(m.parameter("a", -1, "", "a")), "", "D")
    (x,) = m.columns("x", section="S")
    m.define(x[t], x[t - 1] + D, "", "x", start=[0])
    return m


def by_summary():
    m = model(lambda x, z, y, a: a * t, rows=99)
    most = m.summary("most", Count(m["u"]) ** 12 + Largest(m["y"]), "", "most")
    (v,) = m.columns("v", section="S")
    m.define(v[t], most + t, "", "v")
    return m


NUMBERS = {
    "a high power of the row": model(lambda x, z, y, a: t**10, rows=120),
    "a product of rows": model(lambda x, z, y, a: a * (t + 1) ** 4, rows=80_000),
    "an endless product": model(lambda x, z, y, a: floor(a) * floor(a + t), 1e10),
    "a large floor": model(lambda x, z, y, a: floor(a * (t + 1)) + ceiling(-a * t), 1e100),
    "a floor beside a whole number": model(lambda x, z, y, a: Max(floor(a / (t + 1)), 2), 9.5),
    "signs": model(lambda x, z, y, a: sign(t - 4) ** 3 * t**8 + Abs(t - 6) ** 5, rows=300),
    "a remainder of negative numbers": model(
        lambda x, z, y, a: Mod(t * Rational(1, 3), a) + x[t - 1], -3, start=[0]
    ),
    "a high power of a count": by_summary(),
    "start rows alone": model(lambda x, z, y, a: x[t - 1] / a, 0, rows=2, start=[1, 2]),
}
REFUSED = {
    "a divisor that overflows": model(lambda x, z, y, a: Mod(5, (a + t) ** 2), BIG),
    "a remainder by zero": model(lambda x, z, y, a: Mod(t + 1, a), 0),
    "powers that cancel beside a gap": model(
        lambda x, z, y, a: (a * t) ** 2 - (a * t + a) ** 2 + when_observed(y[t], y[t]), BIG
    ),
    "an overflow carried into a gap": model(
        lambda x, z, y, a: z[t] + when_observed(y[t], y[t]), BIG
    ),
    "the size of a complex number": model(
        lambda x, z, y, a: Abs(x[t - 1] + (a - t) ** Rational(3, 2)), 3.5, start=[0]
    ),
    "a complex scalar": by_scalar(lambda a: a ** Rational(3, 2)),
    "an endless power": model(lambda x, z, y, a: x[t - 1] + 2**t, rows=1_100, start=[0]),
    "a large floor of nothing": model(lambda x, z, y, a: floor(a * a * (t + 1)), BIG),
}


def ways(m):
    """Every way to compute the last columns, by name."""
    column = [[*m.table][-1]]
    wanted = list(dict.fromkeys([*column, "z"] if "z" in m.table else column))
    own = {"a": np.full(11, m.parameters["a"].value)}

    def single(compiled):
        return evaluate(m, columns=wanted, compiled=compiled)[wanted].to_numpy()

    def many(compiled, **parameters):
        options = {"columns": wanted, "compiled": compiled, "scalars": ()}
        ensemble = study(m, 11, **options, **parameters)
        return np.column_stack([ensemble.rows[name]["mean"] for name in wanted])

    return {
        "single": lambda: single(True),
        "many": lambda: many(True),
        "many, each with its own": lambda: many(True, **own),
        "many, by arrays": lambda: many(False, **own),
    }, lambda: single(False)


@pytest.fixture(autouse=True)
def numba():
    pytest.importorskip("numba")


@pytest.mark.parametrize("name", NUMBERS)
def test_numbers_are_those_of_python(name):
    others, python = ways(NUMBERS[name])
    expected = python()
    assert np.isfinite(expected[-1]).all()
    for way, compute in others.items():
        found = compute()
        assert (np.isnan(found) == np.isnan(expected)).all(), way
        np.testing.assert_allclose(found, expected, rtol=1e-13, err_msg=way)


@pytest.mark.parametrize("name", REFUSED)
def test_what_python_refuses_is_refused_in_every_way(name):
    others, python = ways(REFUSED[name])
    for compute in (python, *others.values()):
        with pytest.raises(DataError, match=r"^odd"):
            compute()
