"""excel_code and python_code: what they print, what they refuse, and that others agree."""

import math

import pytest
import sympy as sp
from expressions import KINDS, VARIABLES, calculate, samples
from sympy import And, Eq, Float, Integer, Not, Or, Piecewise, Rational, Symbol

from kfsheet import python_code
from kfsheet.errors import PrintError
from kfsheet.evaluation import numerics
from kfsheet.model.expressions import (
    RMS,
    Last,
    Mean,
    Missing,
    Observed,
    SumProduct,
    t,
    when_observed,
)
from kfsheet.printing.excel import excel_code

x, y, z = VARIABLES
u = sp.IndexedBase("u", real=True)
CELLS = {u[t]: "E5", u[t - 1]: "E4", u: "$E$4:$E$19", Last(u): "E19"}


@pytest.mark.parametrize(
    ("expression", "formula"),
    [
        # numbers and constants
        (Integer(-3), "-3"),
        (Rational(1, 3), "1/3"),
        (Float("0.1"), "0.1"),
        (Float("-1.5e-7"), "-1.5E-07"),
        (sp.pi, "PI()"),
        (sp.E, "EXP(1)"),
        # sums: positive before negative, short before long
        (x + y, "x+y"),
        (x - y, "x-y"),
        (-x - y, "-x-y"),
        (1 - x**2, "1-x^2"),
        (u[t - 1] - x * u[t], "E4-x*E5"),
        (x - (y - z), "x+z-y"),
        (sp.Add(x, sp.Mul(-1, y + z, evaluate=False), evaluate=False), "x-(y+z)"),
        # products
        (2 * x / 3, "2*x/3"),
        (-x / (2 * y), "-x/(2*y)"),
        (x * (y + z), "x*(y+z)"),
        (x / (y * z), "x/(y*z)"),
        (1 / x, "1/x"),
        (1 / (x + y), "1/(x+y)"),
        (sp.Pow(1 / x, -1, evaluate=False), "1/(1/x)"),
        (x * u[t] * sp.sin(y), "x*SIN(y)*E5"),
        # powers, and the minus that Excel binds tighter
        (x**2, "x^2"),
        (-(x**2), "-(x^2)"),
        (-(x**2) * y, "-(x^2)*y"),
        (-x * y**2, "-x*y^2"),
        ((-x) ** 3, "-(x^3)"),
        (sp.Pow(-x, 3, evaluate=False), "(-x)^3"),
        (x**-2, "1/x^2"),
        (x ** (-y), "x^(-y)"),
        (sp.Pow(x**y, z, evaluate=False), "(x^y)^z"),
        (x ** (y**z), "x^(y^z)"),
        (x ** Rational(1, 3), "x^(1/3)"),
        (sp.sqrt(x), "SQRT(x)"),
        (1 / sp.sqrt(x), "1/SQRT(x)"),
        (Rational(1, 2) ** x, "(1/2)^x"),
        # functions
        (sp.exp(-x), "EXP(-x)"),
        (sp.log(x), "LN(x)"),
        (sp.log(x, 10), "LN(x)/LN(10)"),
        (sp.sin(x) + sp.cos(x) + sp.tan(x), "SIN(x)+COS(x)+TAN(x)"),
        (sp.asin(x), "ASIN(x)"),
        (sp.acos(x), "ACOS(x)"),
        (sp.atan(x), "ATAN(x)"),
        (sp.sinh(x), "SINH(x)"),
        (sp.cosh(x), "COSH(x)"),
        (sp.tanh(x), "TANH(x)"),
        (sp.asinh(x), "ASINH(x)"),
        (sp.acosh(x), "ACOSH(x)"),
        (sp.atanh(x), "ATANH(x)"),
        (sp.cot(x), "(1/TAN(x))"),
        (-sp.sec(x), "-1/COS(x)"),
        (sp.acot(x), "(IF(x=0,PI()/2,ATAN(1/x)))"),
        (sp.acsch(x), "(ASINH(1/x))"),
        (sp.atan2(y, x), "ATAN2(x,y)"),
        (sp.sign(x), "SIGN(x)"),
        (sp.Abs(x), "ABS(x)"),
        (sp.Min(x, y), "MIN(x,y)"),
        (sp.Max(x, 1), "MAX(1,x)"),
        (sp.floor(x), "INT(x)"),
        (sp.ceiling(x), "(-INT(-x))"),
        (sp.Mod(x, y), "MOD(x,y)"),
        # conditions
        (Piecewise((x, x > 0), (0, True)), "IF(x>0,x,0)"),
        (Piecewise((1, x < y), (2, Eq(x, y)), (3, True)), "IF(x<y,1,IF(x=y,2,3))"),
        (Piecewise((1, And(x > 0, y >= 1)), (0, True)), "IF(AND(y>=1,x>0),1,0)"),
        (Piecewise((1, Or(x > 0, sp.Ne(y, 1))), (0, True)), "IF(OR(x>0,y<>1),1,0)"),
        (Piecewise((1, Not(And(x > 0, y > 0))), (0, True)), "IF(NOT(AND(x>0,y>0)),1,0)"),
        # kfsheet's own words
        (Missing, '""'),
        (when_observed(u[t], 2 * u[t]), 'IF(ISNUMBER(E5),2*E5,"")'),
        (Mean(u), "AVERAGE($E$4:$E$19)"),
        (RMS(u), "SQRT(SUMSQ($E$4:$E$19)/COUNT($E$4:$E$19))"),
        (SumProduct(u, u), "SUMPRODUCT($E$4:$E$19,$E$4:$E$19)"),
        (Last(u), "E19"),
    ],
)
def test_each_kind_of_node_prints_as_a_person_would_write_it(expression, formula):
    assert excel_code(expression, CELLS.get) == formula


@pytest.mark.parametrize(
    ("expression", "culprit"),
    [
        (sp.gamma(x), "gamma"),
        (sp.Function("g")(x), "g"),
        (sp.oo, "oo"),
        (sp.I * x, "ImaginaryUnit"),
        (sp.EulerGamma, "EulerGamma"),
        (sp.Integral(sp.sin(sp.sin(x)), x), "Integral"),
        (sp.Derivative(sp.sin(x), x, evaluate=False), "Derivative"),
        (sp.Matrix([[x]]), "Matrix"),
        (Piecewise((x, x > 0)), "otherwise"),
        (Float(1 / 3), "15 digits"),
        (u[t - 3], r"u\[t - 3\] has no cell"),
        (Symbol("x1"), "reads x1 as a cell"),
        (Symbol("R"), "row or a column"),
        (Symbol("rho squared"), "letters"),
        (sum(Symbol(f"long_name_{n}") for n in range(30)), "too long to audit"),
    ],
)
def test_what_excel_lacks_is_refused_by_name(expression, culprit):
    with pytest.raises(PrintError, match=culprit):
        excel_code(expression, CELLS.get)


def test_names_may_be_a_mapping_and_symbols_keep_their_own_name():
    assert excel_code(x + y, {x: "Parameters!$B$2"}) == "Parameters!$B$2+y"


def test_a_quoted_sheet_name_does_not_hide_a_power():
    assert excel_code(-(x**2), {x: "'a*b'!A1"}) == "-('a*b'!A1^2)"


def test_canaries_the_engines_read_a_minus_and_powers_as_excel_does(engine, tmp_path):
    canaries = {
        "=-2^2": 4,
        "=-F1^2": 9,
        "=2*-F1^2": 18,
        "=0-F1^2": -9,
        "=-(F1^2)": -9,
        "=-(F1^2)*2": -18,
        "=2^3^2": 64,
        "=ATAN2(1,0)": 0,
        "=MOD(-5,3)": 1,
        "=INT(-2.5)": -3,
    }
    assert calculate(canaries, engine, tmp_path / "c.xlsx") == list(canaries.values())


@pytest.fixture(scope="module")
def drawn():
    """Random expressions with values and worth; those too long for a cell left out."""
    found, used = samples(2600, seed=20_260_101)
    printed, refused = [], []
    for expression, values, worth in found:
        row = len(printed) + 1
        cells = dict(zip(VARIABLES, (f"A{row}", f"B{row}", f"C{row}"), strict=True))
        try:
            printed.append((f"={excel_code(expression, cells)}", expression, values, worth))
        except PrintError as error:
            refused.append(str(error))
    assert all("too long" in reason for reason in refused)
    assert len(printed) >= 2500
    assert min(used[kind] for kind in KINDS) >= 50, used
    return printed


def test_2500_random_expressions_are_worth_the_same_in_a_sheet_and_in_mpmath(
    engine, drawn, tmp_path
):
    formulas, expressions, inputs, worths = zip(*drawn, strict=True)
    found = calculate(formulas, engine, tmp_path / "random.xlsx", inputs)
    wrong = [
        (str(e), f, v, w)
        for e, f, v, w in zip(expressions, formulas, found, worths, strict=True)
        if not isinstance(v, int | float) or not math.isclose(v, w, rel_tol=1e-9, abs_tol=1e-15)
    ]
    assert wrong == []


def test_2500_random_expressions_are_worth_the_same_in_python(drawn):
    names = {**vars(math), **vars(numerics)}
    wrong = [
        (str(e), python_code(e), w)
        for _, e, values, w in drawn
        if not math.isclose(
            eval(python_code(e), names | dict(zip("xyz", values, strict=True))),
            w,
            rel_tol=1e-9,
            abs_tol=1e-15,
        )
    ]
    assert wrong == []


def test_an_observed_cell_is_asked_for_and_never_assumed():
    assert Observed(Missing) == False  # noqa: E712 - SymPy's false
    assert python_code(when_observed(u[t], u[t], 0)) == "u[t] if observed(u[t]) else 0.0"
