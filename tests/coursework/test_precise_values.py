"""The judge's arithmetic: 30 figures, beside mpmath's, and a spreadsheet's errors."""

import mpmath
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from sympy import Rational, cos, exp, log, sin, sqrt, symbols

from kfsheet.coursework.judging.precise_values import MISSING, NoValueError, exact, value_of
from kfsheet.model.expressions import Missing, Observed, t

a, b = symbols("a b", real=True)
PLAIN = [
    a + b - Rational(1, 3), a * b / 7, a**3 / b**2, sqrt(a**2 + b**2), sp.atan2(a, b), exp(a / 10),
    sin(a) * cos(b), sp.tanh(a - b), log(a**2 + 1) * sp.pi, sp.Abs(a - b) * sp.sign(a),
    sp.Min(a, b) + sp.Max(a, 2),
    sp.floor(a) - sp.ceiling(b), sp.acos(a / (sp.Abs(a) + 1)), sp.Mod(a, b),
]  # fmt: skip
SIZES = st.floats(0.01, 50) | st.floats(-50, -0.01)


def at(**values):
    return lambda name, row: exact(values[name])


@pytest.mark.parametrize("expression", PLAIN, ids=str)
@given(x=SIZES, y=SIZES)
def test_a_value_has_thirty_figures(expression, x, y):
    found = value_of(expression, at(a=x, b=y), 0)
    with mpmath.workdps(60):
        terms = expression.subs({a: Rational(x), b: Rational(y)}).evalf(60, maxn=500)
        wanted = mpmath.mpf(str(terms))
        far = abs(mpmath.mpf(f"{found:.45g}") - wanted)
        assert far <= mpmath.mpf(10) ** -29 * max(abs(wanted), abs(x), abs(y), 1)


@pytest.mark.parametrize(
    "expression",
    [1 / a, log(a), log(a - 1), sqrt(a - 1), sp.acos(a + 2), a**-2, a**a, exp(b * 1000),
     sin(b * 1e15), sp.Mod(b, a), Missing + b, sp.Symbol("a") / a],
    ids=str,
)  # fmt: skip
def test_what_a_spreadsheet_shows_as_an_error_has_no_value(expression):
    with pytest.raises(NoValueError):
        value_of(expression, at(a=0, b=3), 0)


def test_an_empty_cell_counts_as_zero_but_is_not_observed():
    empty = lambda name, row: None  # noqa: E731
    assert value_of(a + 2, empty, 0) == 2
    assert value_of(sp.Piecewise((1, Observed(a)), (Missing, True)), empty, 0) is MISSING


def test_an_error_in_one_condition_is_an_error_of_the_whole_but_not_in_a_branch_not_taken():
    both = sp.Piecewise((1, (b > 0) | (1 / a > 0)), (2, True))
    with pytest.raises(NoValueError):
        value_of(both, at(a=0, b=3), 0)
    assert value_of(sp.Piecewise((b, b > 0), (1 / a, True)), at(a=0, b=3), 0) == 3
    assert (
        value_of(sp.Piecewise((1, sp.ITE(b > 0, a < 1, 1 / a > 0)), (2, True)), at(a=0, b=3), 0)
        == 1
    )


def test_the_number_of_the_row_is_a_value():
    assert value_of(t**2, at(), 7) == 49
