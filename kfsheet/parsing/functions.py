"""Excel's functions as SymPy has them: a table, and the few rules for truth values and gaps.

A range is a list of rows of expressions, or one :class:`IndexedBase` for a whole column. Cells in
it that hold no number are left out, as Excel leaves them out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import inf, isfinite

from sympy import (
    Abs,
    Add,
    And,
    Basic,
    Eq,
    Expr,
    Float,
    Ge,
    Gt,
    IndexedBase,
    Integer,
    Le,
    Lt,
    Max,
    Min,
    Mod,
    Mul,
    Ne,
    Not,
    Or,
    Piecewise,
    Pow,
    Rational,
    S,
    floor,
    log,
    pi,
    sign,
    sqrt,
)
from sympy import functions as sf
from sympy.core.relational import Relational
from sympy.logic.boolalg import Boolean

from kfsheet.errors import FormulaError
from kfsheet.model.expressions import (
    Count,
    Largest,
    Mean,
    Observed,
    Smallest,
    Std,
    Sum,
    SumProduct,
)

Range = list[list[Basic]]
MOST_DIGITS = 300  # of an exact power of numbers; beyond it a float has to do

RELATIONS: dict[str, type[Relational]] = {
    "=": Eq,
    "<>": Ne,
    "<": Lt,
    "<=": Le,
    ">": Gt,
    ">=": Ge,
}


def is_truth(value: Basic) -> bool:
    """Whether a value is TRUE or FALSE; SymPy's symbols could be either, ours are numbers."""
    return isinstance(value, Boolean) and not isinstance(value, Expr)


def as_number(value: Basic) -> Expr:
    """A value in arithmetic: TRUE counts 1."""
    if isinstance(value, IndexedBase | list):
        raise FormulaError("a range stands where one cell belongs")
    if value in (S.true, S.false):
        return S.One if value == S.true else S.Zero
    if is_truth(value):
        return Piecewise((S.One, value), (S.Zero, True), evaluate=False)
    return value


def as_condition(value: Basic) -> Boolean:
    """A value as the test of an IF: a number other than 0 holds."""
    if isinstance(value, IndexedBase | list):
        raise FormulaError("a range stands where one cell belongs")
    return value if is_truth(value) else Ne(value, 0, evaluate=False)


def compare(operator: str, left: Basic | str, right: Basic | str) -> Boolean:
    """A comparison; with "" it asks whether a cell holds a number."""
    if isinstance(left, str):
        left, right = right, left
    if isinstance(right, str):
        if right or isinstance(left, str) or operator not in ("=", "<>"):
            raise FormulaError("a formula compares text")
        return is_number(left) if operator == "<>" else Not(is_number(left))
    return RELATIONS[operator](as_number(left), as_number(right), evaluate=False)


def is_number(value: Basic) -> Boolean:
    """ISNUMBER of a cell or an expression."""
    if isinstance(value, list):
        (value,) = (cell for row in value for cell in row)
    if is_truth(value):
        return S.false
    return S.true if getattr(value, "is_number", False) else Observed(value)


def power(base: Expr, exponent: Expr) -> Expr:
    """A power; one of numbers alone stays small, whatever was typed."""
    if base.is_Number and exponent.is_Number:
        if base == 0 and exponent <= 0:
            raise FormulaError("the formula divides by zero")
        digits = max(len(str(getattr(base, part, 1))) for part in "pq")
        if digits * abs(exponent) > MOST_DIGITS:
            return _rounded_power(float(base), float(exponent))
    return Pow(base, exponent)


def _rounded_power(base: float, exponent: float) -> Expr:
    try:
        worth = base**exponent
    except OverflowError:
        worth = inf
    if isinstance(worth, complex) or not isfinite(worth):
        raise FormulaError("the formula holds a number beyond 1e308")
    return Float(worth)


# -- ranges --------------------------------------------------------------------------------------


def _cells(ranges: Iterable[Basic | Range]) -> list[Basic]:
    cells: list[Basic] = []
    for item in ranges:
        if isinstance(item, IndexedBase):
            raise FormulaError("a whole column stands beside other arguments")
        cells += [c for row in item for c in row] if isinstance(item, list) else [as_number(item)]
    return cells


def _present(cell: Basic, value: Expr, otherwise: Expr = S.Zero) -> Expr:
    """``value`` if the cell holds a number."""
    seen = is_number(cell)
    if seen in (S.true, S.false):
        return value if seen == S.true else otherwise
    return Piecewise((value, seen), (otherwise, True), evaluate=False)


def _aggregate(
    whole: Callable[[IndexedBase], Expr], cells: Callable[[list[Basic]], Expr]
) -> Callable[..., Expr]:
    def apply(*ranges: Basic | Range) -> Expr:
        if len(ranges) == 1 and isinstance(ranges[0], IndexedBase):
            return whole(ranges[0])
        return cells(_cells(ranges))

    return apply


def _total(cells: list[Basic]) -> Expr:
    return Add(*(_present(c, c) for c in cells))


def _count(cells: list[Basic]) -> Expr:
    return Add(*(_present(c, S.One) for c in cells))


def _squares(cells: list[Basic]) -> Expr:
    return Add(*(_present(c, c**2) for c in cells))


def _product(cells: list[Basic]) -> Expr:
    return Mul(*(_present(c, c, S.One) for c in cells))


def _mean(cells: list[Basic]) -> Expr:
    return _total(cells) * power(_count(cells), S.NegativeOne)


def _deviation(cells: list[Basic]) -> Expr:
    mean, count = _mean(cells), _count(cells)
    return sqrt(Add(*(_present(c, (c - mean) ** 2) for c in cells)) / (count - 1))


def _sumproduct(*ranges: Basic | Range) -> Expr:
    if all(isinstance(r, IndexedBase) for r in ranges) and len(ranges) in (1, 2):
        return Sum(*ranges) if len(ranges) == 1 else SumProduct(*ranges)
    lists = [_cells([r]) for r in ranges]
    if len({(len(r), len(r[0])) if isinstance(r, list) else (1, 1) for r in ranges}) > 1:
        raise FormulaError("the ranges of SUMPRODUCT have different shapes")
    return Add(*(Mul(*(_present(c, c) for c in row)) for row in zip(*lists, strict=True)))


def _distance(first: Range, second: Range) -> Expr:
    return Add(*((a - b) ** 2 for a, b in zip(_cells([first]), _cells([second]), strict=True)))


# -- single values -------------------------------------------------------------------------------


def _elementary(function: Callable[[Expr], Expr]) -> Callable[[Basic], Expr]:
    return lambda value: function(as_number(_one(value)))


def _one(value: Basic | Range) -> Basic:
    if isinstance(value, list):
        if len(value) == len(value[0]) == 1:
            return value[0][0]
        raise FormulaError("a range stands where one cell belongs")
    return value


def _log(x: Basic, base: Basic | None = None) -> Expr:
    base = Integer(10) if base is None else as_number(_one(base))
    return log(as_number(_one(x))) / log(base)


def _atan2(x: Basic, y: Basic) -> Expr:
    return sf.atan2(as_number(_one(y)), as_number(_one(x)), evaluate=False)


def _round(x: Basic, digits: Basic = S.Zero) -> Expr:
    x, digits = as_number(_one(x)), as_number(_one(digits))
    if not digits.is_Integer or abs(digits) > 20:
        raise FormulaError("ROUND has a number of digits that is not a small whole number")
    scale = Integer(10) ** digits
    return sign(x) * floor(Abs(x) * scale + Rational(1, 2), evaluate=False) / scale


def _truncate(x: Basic) -> Expr:
    x = as_number(_one(x))
    return sign(x) * floor(Abs(x), evaluate=False)


def _both(kind: type[Boolean]) -> Callable[..., Boolean]:
    return lambda *tests: kind(*(as_condition(_one(test)) for test in tests), evaluate=False)


def _extreme(kind: type, whole: type) -> Callable[..., Expr]:
    return _aggregate(whole, lambda cells: kind(*cells, evaluate=False))


FUNCTIONS: dict[str, Callable[..., Basic]] = {
    name.upper(): _elementary(getattr(sf, name))
    for name in (
        "exp sqrt sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh sign".split()
    )
} | {
    "PI": lambda: pi,
    "TRUE": lambda: S.true,
    "FALSE": lambda: S.false,
    "LN": _elementary(log),
    "LOG": _log,
    "LOG10": _elementary(_log),
    "ABS": _elementary(Abs),
    "INT": _elementary(lambda x: floor(x, evaluate=False)),
    "TRUNC": _truncate,
    "ROUND": _round,
    "DEGREES": _elementary(lambda x: x * 180 / pi),
    "RADIANS": _elementary(lambda x: x * pi / 180),
    "POWER": lambda a, b: power(as_number(_one(a)), as_number(_one(b))),
    "ATAN2": _atan2,
    "MOD": lambda a, b: Mod(as_number(_one(a)), as_number(_one(b)), evaluate=False),
    "AND": _both(And),
    "OR": _both(Or),
    "NOT": lambda test: Not(as_condition(_one(test))),
    "ISNUMBER": is_number,
    "SUM": _aggregate(Sum, _total),
    "COUNT": _aggregate(Count, _count),
    "AVERAGE": _aggregate(Mean, _mean),
    "SUMSQ": _aggregate(lambda c: SumProduct(c, c), _squares),
    "PRODUCT": lambda *ranges: _product(_cells(ranges)),
    "STDEV": _aggregate(Std, _deviation),
    "STDEV.S": _aggregate(Std, _deviation),
    "MIN": _extreme(Min, Smallest),
    "MAX": _extreme(Max, Largest),
    "SUMPRODUCT": _sumproduct,
    "SUMXMY2": _distance,
}
