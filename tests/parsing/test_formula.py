"""read_formula: what it makes of a formula, what it refuses, and that engines agree."""

import math

import mpmath
import pytest
import sympy as sp
from expressions import VARIABLES, calculate, samples, value
from sympy import Piecewise, Rational

from kfsheet.errors import FormulaError, PrintError
from kfsheet.model.expressions import Count, Mean, Missing, Observed, SumProduct, t
from kfsheet.parsing.formula import read_formula
from kfsheet.parsing.references import read_reference, relative_key
from kfsheet.parsing.syntax import parse_formula
from kfsheet.printing.excel import excel_code

x, y, z = VARIABLES
u = sp.IndexedBase("u", real=True)
NAMES = {"x": x, "y": y, "z": z, "A1": x, "B1": y, "C1": z, "$A$1": x, "$E$4:$E$19": u}
NAMES |= {"E5": u[t], "E4": u[t - 1], "'Free run'!$A1": z, "A1:C1": [[x, y, z]]}
NAMES |= {"B1:C1": [[y, z]], "A1:B1": [[x, y]]}


@pytest.mark.parametrize(
    ("formula", "expression"),
    [
        # Excel's precedence
        ("=-A1^2", x**2),
        ("=2*-A1^2", 2 * x**2),
        ("=0-A1^2", -(x**2)),
        ("=2^3^2", 64),
        ("=-(A1^2)", -(x**2)),
        ("=2^-A1", 2 ** (-x)),
        ("=-5%^2", Rational(25, 10_000)),
        ("=50%*A1", x / 2),
        ("=--A1", x),
        ("=A1-B1-C1", x - y - z),
        ("=A1/B1/C1", x / y / z),
        ("=A1/B1*C1", x / y * z),
        # references
        ("=$A$1+'Free run'!$A1", x + z),
        ("=x*y", x * y),
        ("=E5-E4", u[t] - u[t - 1]),
        # functions
        ("=POWER(A1,3)", x**3),
        ("=ATAN2(A1,B1)", sp.atan2(y, x)),
        ("=LN(A1)", sp.log(x)),
        ("=LOG(A1)", sp.log(x) / sp.log(10)),
        ("=LOG(A1,2)", sp.log(x) / sp.log(2)),
        ("=LOG10(A1)", sp.log(x) / sp.log(10)),
        ("=DEGREES(A1)", x * 180 / sp.pi),
        ("=RADIANS(A1)", x * sp.pi / 180),
        ("=SUM(A1:C1)", x + y + z),
        ("=SUMPRODUCT(A1:B1,B1:C1)", x * y + y * z),
        ("=SUMSQ(A1:C1)", x**2 + y**2 + z**2),
        ("=SUMXMY2(A1:B1,B1:C1)", (x - y) ** 2 + (y - z) ** 2),
        ("=AVERAGE(A1,B1)", (x + y) / 2),
        ("=PRODUCT(A1:C1)", x * y * z),
        ("=COUNT(A1:C1)", 3),
        ("=1E-3*A1", x / 1000),
        ("=.1*A1", x / 10),
        ("=(A1>0)*B1", Piecewise((y, x > 0), (0, True))),
        ("=ROUND(A1,1)", sp.sign(x) * sp.floor(abs(x) * 10 + Rational(1, 2)) / 10),
    ],
)
def test_a_formula_is_read_as_excel_reads_it(formula, expression):
    found = read_formula(formula, NAMES)
    for numbers in ((0.7, 1.3, 0.4), (1.9, 0.6, 2.2)):
        present = {Observed(v): sp.true for v in VARIABLES}
        values = dict(zip(VARIABLES, map(sp.Float, numbers), strict=True))
        values |= {u[t]: sp.Float(0.31), u[t - 1]: sp.Float(0.11)}
        wanted = sp.sympify(expression).xreplace(values)
        assert float(found.xreplace(present).xreplace(values)) == pytest.approx(
            float(wanted), rel=1e-12
        )


@pytest.mark.parametrize(
    ("formula", "expression"),
    [
        ('=IF(ISNUMBER(E5),E5,"")', Piecewise((u[t], Observed(u[t])), (Missing, True))),
        ('=IF(E5="",0,E5)', Piecewise((0, ~Observed(u[t])), (u[t], True))),
        ('=IF(E5<>"",E5,0)', Piecewise((u[t], Observed(u[t])), (0, True))),
        ("=AVERAGE($E$4:$E$19)", Mean(u)),
        (
            "=SQRT(SUMSQ($E$4:$E$19)/COUNT($E$4:$E$19))",
            sp.sqrt(SumProduct(u, u) / Count(u)),
        ),
    ],
)
def test_gaps_and_whole_columns_are_read_as_kfsheets_own_words(formula, expression):
    assert read_formula(formula, NAMES) == expression


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        ("={1,2;3,4}", "arrays"),
        ("=LET(q,1,q)", "LET"),
        ("=VLOOKUP(A1,B1:C1,2)", "VLOOKUP"),
        ('=INDIRECT("A1")', "INDIRECT"),
        ('=WEBSERVICE("http://x")', "WEBSERVICE"),
        ("=[1]Sheet1!A1", "no cell"),
        ("=A:A", "no cell"),
        ("=Table1[x]", "no cell"),
        ('="a"&"b"', "'&'"),
        ('=A1="a"', "compares text"),
        ("=#REF!+1", "error #REF!"),
        ("=A1+", "cannot be read"),
        ("=A1:C1", "range"),
        ("=A1:C1+1", "range"),
        ("=9^999^9", "beyond 1e308"),
        ("=0^-1", "divides by zero"),
        ("=SIN(1,2,3)", "SIN has 3"),
        ("=" + "(" * 70 + "1" + ")" * 70, "deeper"),
        ("=" + "-" * 70 + "1", "deeper"),
        ("=" + "1+" * 4500 + "1", "characters"),
        ("=Z99", "no meaning"),
    ],
)
def test_what_is_not_arithmetic_is_refused_by_name(formula, words):
    with pytest.raises(FormulaError, match=words.replace("[", r"\[")):
        read_formula(formula, NAMES)


def test_1000_random_expressions_survive_the_way_through_a_formula():
    """The printer writes, the reader reads, mpmath judges: it knows neither of them."""
    found, _ = samples(1050, seed=77)
    wrong, read = [], 0
    for expression, values, worth in found:
        try:
            text = excel_code(expression)
        except PrintError:
            continue  # too long for a cell
        back, read = read_formula(text, NAMES), read + 1
        with mpmath.workdps(40):
            numbers = dict(zip(VARIABLES, map(mpmath.mpf, values), strict=True))
            again = float(value(sp.sympify(back), numbers))
        if not math.isclose(again, worth, rel_tol=1e-9, abs_tol=1e-15):
            wrong.append((text, values, worth, again))
    assert wrong == []
    assert read >= 1000


def test_the_reader_and_the_engines_agree_where_a_sheet_is_peculiar(engine, tmp_path):
    formulas = ["=-A{0}^2", "=2*-B{0}^2", "=A{0}^B{0}^2", "=-A{0}%^2", "=+-A{0}", "=5-A{0}%"]
    formulas += ["=MOD(-A{0},3)", "=INT(-A{0})", "=TRUNC(-A{0})", "=ROUND(-A{0}*3,1)", "=LOG(A{0})"]
    formulas += ["=(A{0}>B{0})+1", "=IF(A{0}-B{0},1,2)", "=ATAN2(-A{0},-B{0})", "=A{0}--B{0}"]
    formulas += ["=SUMPRODUCT(A{0}:B{0},B{0}:C{0})", "=NOT(A{0}>1)+AND(A{0}>0,B{0}>0)"]
    rows = [f.format(n) for n, f in enumerate(formulas, 1)]
    inputs = [(1.5 + 0.1 * n, 1.25, 0.5) for n in range(len(rows))]
    sheet = calculate(rows, engine, tmp_path / "p.xlsx", inputs)
    for n, (text, (a, b, c), worth) in enumerate(zip(rows, inputs, sheet, strict=True), 1):
        names = {f"A{n}": sp.Float(a), f"B{n}": sp.Float(b), f"C{n}": sp.Float(c)}
        names |= {f"A{n}:B{n}": [[names[f"A{n}"], names[f"B{n}"]]]}
        names |= {f"B{n}:C{n}": [[names[f"B{n}"], names[f"C{n}"]]]}
        assert float(read_formula(text, names).doit()) == pytest.approx(worth, rel=1e-12), text


def test_a_formula_that_is_filled_down_keeps_its_key_and_no_other_does():
    assert relative_key("=K8+$B$2*LOG10(K7)", (9, 7)) == relative_key("=K9+$B$2*LOG10(K8)", (10, 7))
    assert relative_key("=K8", (9, 7)) != relative_key("=K8", (10, 7))
    assert relative_key("=LOG10(A1)", (2, 1)) != relative_key("=LOG11(A2)", (3, 1))
    assert relative_key("='A 1'!B2", (2, 2)) == relative_key("='A 1'!B3", (3, 2))
    assert relative_key('="A1"', (2, 2)) == relative_key('="A1"', (3, 2))
    assert relative_key("=x_A1+B$2", (2, 2)) == relative_key("=x_A1+B$2", (9, 2))


def test_a_reference_is_taken_apart_and_seen_from_its_host():
    seen = read_reference("'it''s'!$B5:C$7").seen_from((4, 2))
    assert seen.sheet == "it's"
    assert (
        seen.cells((10, 2), 10)
        == [
            [(11, 2), (11, 3)],
            [(10, 2), (10, 3)],
            [(9, 2), (9, 3)],
            [(8, 2), (8, 3)],
            [(7, 2), (7, 3)],
        ][::-1]
    )
    with pytest.raises(FormulaError, match="outside"):
        read_reference("A1").seen_from((4, 2)).cells((1, 1), 10)
    with pytest.raises(FormulaError, match="more than 3"):
        seen.cells((10, 2), 3)


def test_numbers_stay_exact():
    assert parse_formula("=0.1") == ("number", 0.1)
    assert read_formula("=0.1") == Rational(1, 10)
