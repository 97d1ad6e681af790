"""What LibreOffice and IronCalc make of formulas, for comparison with the calculator."""

import random
import re

from formula_trees import tree_of
from openpyxl import Workbook
from openpyxl.utils import FORMULAE

from kfsheet.errors import KfsheetError
from kfsheet.parsing.calculator import EMPTY, Error, Formula, SheetCalculator

DATA = {
    "A": [3.0, -4.0, 0.5, 2.0, 10.0, 0.25, 7.0, 1.0],
    "B": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0],
    "C": [2.5, "7", True, None, -1.5, "abc", 4.0, False],
    "D": ["x", "apple", "Banana", "1E2", " 3 ", "TRUE", "", "a*b"],
}
CELLS = {
    (row, column): value
    for column, values in enumerate(DATA.values(), 1)
    for row, value in enumerate(values, 1)
    if value is not None
}
NAME = re.compile(r"\b([A-Z][A-Z0-9.]*)\(")


def written(formula):
    """A formula as files hold it: functions that came after 2007 with their prefix."""
    return NAME.sub(lambda m: m[0] if m[1] in FORMULAE else f"_xlfn.{m[1]}(", formula)


REFERENCE = re.compile(
    r'"[^"]*"|(?<![\w!:$.])([A-D][1-8](?::[A-D]\d+)?|[A-D]:[A-D]|\d:\d)(?![\w(.])'
)


def of_data(formula):
    """A formula whose references are all to the sheet D."""
    return REFERENCE.sub(lambda m: f"D!{m[1]}" if m[1] else m[0], formula)


def oracle_file(formulas, path):
    """A workbook with the data in D and the formulas in F, one below the other."""
    book = Workbook()
    data = book.active
    data.title = "D"
    for (row, column), value in CELLS.items():
        data.cell(row, column).value = value
        if isinstance(value, str):
            data.cell(row, column).data_type = "s"
    sheet = book.create_sheet("F")
    for row, formula in enumerate(formulas, 1):
        sheet.cell(row, 1).value = "=" + written(formula)
    book.save(path)
    return path


def calculated(formulas, **options):
    """Our values of the formulas; an exception where there is none."""
    sheets = {"D": CELLS, "F": {(r, 1): Formula(f, (r, 1)) for r, f in enumerate(formulas, 1)}}
    book = SheetCalculator(sheets, parse=tree_of, **options)
    return [value_or_refusal(book, row) for row in range(1, len(formulas) + 1)]


def value_or_refusal(book, row):
    try:
        value = book.value(("F", row, 1))
    except KfsheetError as error:
        return error
    return value.value if isinstance(value, Error) else "" if value is EMPTY else value


def same(ours, theirs):
    """Whether two values are one: numbers to 1e-9, any error like any other."""
    if isinstance(theirs, str) and theirs.startswith("#"):
        return isinstance(ours, str) and ours.startswith("#")
    if isinstance(ours, bool) or isinstance(theirs, bool):
        return ours == theirs
    if isinstance(ours, float) and isinstance(theirs, int | float):
        return abs(ours - theirs) <= 1e-9 * max(1, abs(ours), abs(theirs))
    return (ours or "") == (theirs or "")


# -- random formulas -------------------------------------------------------------------------------

SIGNATURES = dict(
    line.split()
    for line in """
    ABS n|SIN n|COS n|TAN n|ASIN n|ACOS n|ATAN n|SINH s|COSH s|TANH s|ASINH n|ACOSH n|ATANH n
    ATAN2 nn|EXP s|LN n|LOG10 n|LOG n|LOG nn|SQRT n|SQRTPI n|POWER nn|SIGN n|INT n|DEGREES n
    RADIANS n|ROUND ni|ROUNDUP ni|ROUNDDOWN ni|TRUNC ni|MROUND nn|EVEN n|ODD n|QUOTIENT nn
    MOD nn|FACT i|COMBIN ii|GCD ii|LCM ii|CEILING nn|FLOOR nn|PI -|SEC n|CSC n|COT n
    SUM r|SUM nv|SUMSQ r|PRODUCT r|MIN r|MAX r|MIN nn|MAX nv|MINA r|MAXA r|AVERAGE r|AVERAGEA r
    COUNT r|COUNTA r|COUNT vv|COUNTBLANK r|MEDIAN r|MODE r|STDEV r|STDEVP r|VAR r|VARP r
    STDEV.S r|STDEV.P r|VAR.S r|VAR.P r|DEVSQ r|AVEDEV r|GEOMEAN r|HARMEAN r|LARGE ri|SMALL ri
    RANK nr|PERCENTILE rp|QUARTILE ri|SLOPE cc|INTERCEPT cc|FORECAST ncc|CORREL cc|PEARSON cc
    RSQ cc|COVAR cc|STEYX cc|SUMX2MY2 cc|SUMX2PY2 cc|SUMXMY2 cc|SUMPRODUCT cc|SUMPRODUCT r
    SUMIF rq|COUNTIF rq|AVERAGEIF rq|SUMIFS cdq|COUNTIFS cq|AVERAGEIFS cdq|SUBTOTAL 9r
    IF bvv|IF vnn|IFERROR vn|IFNA nn|CHOOSE jvvv|AND bb|OR bb|XOR bb|NOT b|IFS bvbv|SWITCH nvnvv
    ISNUMBER v|ISTEXT v|ISBLANK a|ISNONTEXT v|ISLOGICAL v|ISERROR v|ISERR v|ISNA v|ISEVEN n|ISODD n
    N v|T v|TYPE v|ERROR.TYPE v|VALUE t|CONCATENATE tt|CONCAT tt|TEXTJOIN tbtt|LEFT ti|RIGHT ti
    MID tji|LEN t|LOWER t|UPPER t|TRIM t|SUBSTITUTE ttt|FIND tt|SEARCH tt|EXACT tt|REPT tj
    ROW a|COLUMN a|ROWS r|COLUMNS r|INDEX rj|MATCH nc0|MATCH nB|LOOKUP nB|VLOOKUP nTj|INDEX Tjj
    ADDRESS jj|ERF s|ERFC s|NORMSDIST n|NORMDIST nnnb|NORMSINV p|EXPONDIST nnb|STANDARDIZE nnn
    DEVSQ nn|SUMSQ nn|FACTDOUBLE i|PERMUT ii|GAMMALN n|AREAS r|SKEW r|MDETERM m
    """.replace("\n", "|").split("|")
    for line in [line.strip()]
    if line
    for line in [" ".join([f"{line.split()[0]}/{line.split()[1]}", line.split()[1]])]
)
LITERALS = "0 1 2 3 -1 0.5 -2.5 10 1E-3 100 2.55 -7 1E10".split()
CRITERIA = ['">2"', '"<=1"', '"<>3"', "3", '"a*"', '"=apple"', '"<>"', "TRUE", '"7"']


class Formulas:
    """Random formulas over all functions and kinds of values."""

    def __init__(self, seed):
        self._random = random.Random(seed)
        self._pick = self._random.choice

    def formula(self, depth=3):
        if self._random.random() < 0.3 and depth > 1:
            return self.operation(depth)
        key = self._pick(list(SIGNATURES))
        kinds = SIGNATURES[key].replace("-", "")
        return f"{key.split('/')[0]}({','.join(self.argument(k, depth - 1) for k in kinds)})"

    def operation(self, depth):
        sign = self._pick("+ - * / ^ & = < >= <>".split())
        sides = [self._pick([self.value, self.formula])(depth - 1) for _ in "ab"]
        minus = self._pick(["", "", "", "-"])
        return f"{minus}({sides[0]}){sign}({sides[1]})"

    def argument(self, kind, depth):
        return getattr(self, f"arg_{kind}", lambda depth: kind)(depth)

    def value(self, depth):
        number = lambda depth: self._pick(LITERALS)  # noqa: E731
        return self._pick([number, self.cell, self.arg_t, self.arg_b])(depth)

    def cell(self, depth):
        return f"D!{self._pick('AAABBCD')}{self._random.randint(1, 8)}"

    def arg_n(self, depth):
        if depth > 0 and self._random.random() < 0.4:
            return self.formula(depth)
        return self._pick(
            [self._pick(LITERALS), f"D!{self._pick('AAABBC')}{self._pick('12345678')}"]
        )

    def arg_v(self, depth):
        return self._pick([self.arg_n, self.arg_t, self.arg_b, self.cell])(depth)

    def arg_a(self, depth):
        return self.cell(depth)

    def arg_i(self, depth):
        return self._pick(["0", "1", "2", "3", "-1", "5", "2.7"])

    def arg_j(self, depth):
        return self._pick(["1", "2", "3"])

    def arg_p(self, depth):
        return self._pick(["0", "0.25", "0.3", "0.5", "0.9", "1", "1.5"])

    def arg_s(self, depth):
        return self._pick(["0.5", "-1", "2", "D!A3", "D!B2", "D!C1", "0"])

    def arg_t(self, depth):
        return self._pick(['"a"', '"Abc"', '"12"', "D!D2", "D!D3", "D!A1", '""'])

    def arg_q(self, depth):
        return self._pick(CRITERIA)

    def arg_B(self, depth):
        return "D!B1:B8"

    def arg_T(self, depth):
        return "D!B1:C8"

    def arg_m(self, depth):
        return self._pick(["D!A1:B2", "D!A3:B4", "D!A5:B6", "D!A1:B3"])

    def arg_d(self, depth):
        return self._pick(["D!A1:A8", "D!C1:C8"])

    def arg_b(self, depth):
        sides = self._pick(LITERALS), self.cell(depth)
        return self._pick(["TRUE", "FALSE", f"{sides[1]}>{sides[0]}", "D!A1>D!B2", "D!C3"])

    def arg_c(self, depth):
        return self._pick(["D!A1:A8", "D!B1:B8", "D!C1:C8", "D!A1:A5", "D!B1:B5"])

    def arg_r(self, depth):
        return self._pick(
            ["D!A1:A8", "D!B2:B6", "D!C1:C8", "D!A1:C8", "D!D1:D8", "D!A2:B4", "D!C4"]
        )
