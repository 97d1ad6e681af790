"""Every formula that fits into a cell is calculated or given up, soon and in little memory."""

import time
import tracemalloc

import pytest

from kfsheet.errors import FormulaError, TooMuchWorkError
from kfsheet.parsing.calculator import Error, Formula, SheetCalculator
from kfsheet.parsing.syntax import LONGEST, parse_formula

FULL = {
    "parentheses": "(" * 4000 + "1" + ")" * 4000,
    "a sum of cells": "A1+" * 2700 + "A1",
    "powers": "1^" * 4000 + "1",
    "comparisons": "1=" * 4000 + "1",
    "texts": '"a"&' * 2000 + '"a"',
    "signs": "-" * 8000 + "1",
    "percents": "1" + "%" * 8000,
    "IFs": "IF(A1>0,1," * 700 + "1" + ")" * 700,
    "to the right": "1+(" * 2000 + "1" + ")" * 2000,
    "2,700 arguments": "SUM(" + ",".join(["A1"] * 2700) + ")",
    "unions": "(" + "A1," * 2700 + "A1)",
    "an array": "{" + "1;" * 4000 + "1}",
    "ranges": "A1:" * 2700 + "A1",
    "intersections": "A1 " * 2700 + "A1",
    "spills": "A1" + "#" * 8000,
    "open calls": "SUM(" * 2000,
    "open braces": "{" * 8000,
    "open brackets": "T" + "[" * 8000,
    "quotes": "'" * 8001,
    "exclamation marks": "A!" * 4000,
    "digits": "9" * 8000,
    "names": "a." * 4000,
    "spaces": " " * 8000 + "1",
    "LETs": "LET(a,1," + ",".join(f"a{n},a{n}+a{n}" for n in range(400)) + ",a)",
    "prefixes": "_xlfn." * 1300 + "SUM(1)",
}
HUGE = [
    "SUM(ROW(1:1048576)*COLUMN(A:XFD))",
    'REPT("x",1E9)',
    'REPT(REPT("x",32767),32767)',
    "SUMPRODUCT((D:D=1)*(E:E=2)*(F:F))",
    "SUM(MMULT(ROW(1:1000)*COLUMN(A:ALL),ROW(1:1000)*COLUMN(A:ALL)))",
    "MDETERM(SEQUENCE(900,900))",
    "FACT(1E9)",
    "10^10^10",
    "COMBIN(1E9,5E8)",
    "SUM(SEQUENCE(1E6,1E4))",
    "SUM(SMALL(ROW(1:1048576),ROW(1:1048576)))",
    "SUMPRODUCT(MATCH(ROW(1:100000),ROW(1:100000),0))",
    "REDUCE(0,SEQUENCE(1000000),LAMBDA(a,b,a+b))",
    'LET(d,LAMBDA(f,x,f(f,x&x)),d(d,"ab"))',
    'LET(a,"xxxxxxxxxxxxxxxx",b,a&a,c1_,b&b,d,c1_&c1_,e,d&d,f,e&e,g,f&f,h,g&g,i,h&h,j,i&i,'
    "k,j&j,l,k&k,m,l&l,n,m&m,o,n&n,p,o&o,q,p&p,LEN(q))",
    'SUBSTITUTE(REPT("a",32767),"a",REPT("b",32767))',
    'SEARCH("' + "*a" * 100 + 'b",REPT("a",32767))',
    'SUM(LEN(REPT("ab",ROW(1:32767))))',
    "SUM(" + ",".join(["B:XFD"] * 200) + ")",
    "SUM(SUM(" * 25 + "1:1048576" + ",1),1)" * 25,
    'LOOKUP(2,1/(D:D<>""),E:E)',
]


def limited(formula, array=False):
    """The value in a workbook, or the error, with seconds and megabytes that it took."""
    area = (1, 1, 1, 1) if array else None
    cells = {(r, c): float(r + c) for r in range(5, 20) for c in range(3, 13)}
    cells[1, 1] = Formula(f"={formula}", (1, 1), area)
    tracemalloc.start()
    began = time.process_time()
    try:
        value = SheetCalculator({"S": cells}, work=200_000).value(("S", 1, 1))
    except FormulaError as error:
        value = error
    seconds, (_, peak) = time.process_time() - began, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return value, seconds, peak / 2**20


@pytest.mark.parametrize("kind", FULL)
def test_a_cell_full_of_anything_ends_soon(kind):
    assert len(FULL[kind]) <= LONGEST
    _, seconds, megabytes = limited(FULL[kind])
    assert seconds < 2
    assert megabytes < 200


@pytest.mark.parametrize("array", [False, True])
@pytest.mark.parametrize("formula", HUGE, ids=lambda formula: formula[:40])
def test_a_formula_of_much_work_ends_soon(formula, array):
    value, seconds, megabytes = limited(formula, array)
    assert seconds < 4  # tracing memory takes its time
    assert megabytes < 200
    assert isinstance(value, float | str | Error | FormulaError)


def test_what_is_too_deep_is_given_up_and_no_riddle_for_engines():
    for kind in ("parentheses", "IFs", "a sum of cells"):
        with pytest.raises(TooMuchWorkError, match="deeper"):
            parse_formula(FULL[kind])


def test_a_formula_that_fills_its_cell_is_read():
    text = "SUM(" + ",".join(f"A{n}*2" for n in range(1000, 1255)) + ")"
    text += "+0" * 200 + " " * (LONGEST - len(text) - 400)
    assert len(text) == LONGEST
    assert parse_formula(text)
    with pytest.raises(FormulaError, match="8193 characters; 8192"):
        parse_formula(text + " ")


def test_a_number_beyond_all_numbers_is_no_number():
    with pytest.raises(FormulaError):
        parse_formula("1E999")


@pytest.mark.parametrize(
    ("formula", "original"),
    [
        ('IFERROR(__xludf.DUMMYFUNCTION("A1*2"),12)', "A1*2"),
        ('IFERROR(__xludf.DUMMYFUNCTION("IF(A1="""",""a"",A1)"),"""")', 'IF(A1="","a",A1)'),
        ('1+IFERROR(__XLUDF.DUMMYFUNCTION("=SUM(A1:A3)"),#N/A)', "1+SUM(A1:A3)"),
    ],
)
def test_the_formula_that_google_hides_is_read(formula, original):
    assert parse_formula(formula) == parse_formula(original)


@pytest.mark.parametrize("text", ['"""COMPUTED_VALUE"""', '""', '"A1*("', "A1"])
def test_where_google_hides_no_formula_none_is_guessed(text):
    with pytest.raises(FormulaError):
        parse_formula(f"IFERROR(__xludf.DUMMYFUNCTION({text}),12)")
