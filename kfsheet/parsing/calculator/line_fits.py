"""Functions of pairs of numbers: lines through points, correlations, sums of products."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator
from functools import reduce

from kfsheet.parsing.calculator.averages import Number, mean, total
from kfsheet.parsing.calculator.broadcasting import (
    MANY,
    Entry,
    argument,
    broadcast,
    whole,
)
from kfsheet.parsing.calculator.mathematics import ratio
from kfsheet.parsing.calculator.values import (
    EMPTY,
    Context,
    Error,
    FailedError,
    Scalar,
    UnsupportedError,
    Value,
    is_number,
    number,
    rows_of,
    size_of,
)


def pairs(c: Context, first: Value, second: Value) -> list[tuple[Number, Number]]:
    """The pairs of which both are numbers; #N/A for arrays of unequal size."""
    sides = [list(_cells(c, first)), list(_cells(c, second))]
    if len(sides[0]) != len(sides[1]):
        raise FailedError(Error.NA)
    for cell in (cell for side in sides for cell in side):
        if type(cell) is Error:
            raise FailedError(cell)
    both = zip(*sides, strict=True)
    return [(a, b) for a, b in both if is_number(c, a) and is_number(c, b)]


def _cells(c: Context, value: Value) -> Iterator[Scalar]:
    return (cell for row in rows_of(c, value) for cell in row)


def _moments(c: Context, xs: Value, ys: Value) -> tuple[Number, ...]:
    """Number of pairs, means of x and y, and the sums of squares xx, xy and yy about them."""
    found = pairs(c, xs, ys)
    mx, my = (mean(c, [pair[i] for pair in found]) for i in (0, 1))
    near = [(x - mx, y - my) for x, y in found]
    xx, xy, yy = (total(c, [a[i] * a[j] for a in near]) for i, j in ((0, 0), (0, 1), (1, 1)))
    return len(found), mx, my, xx, xy, yy


def _slope(c: Context, ys: Value, xs: Value) -> Number:
    _, _, _, xx, xy, _ = _moments(c, xs, ys)
    return ratio(xy, xx)


def _intercept(c: Context, ys: Value, xs: Value) -> Number:
    _, mx, my, xx, xy, _ = _moments(c, xs, ys)
    return my - ratio(xy, xx) * mx


def _forecast(c: Context, x: Value, ys: Value, xs: Value) -> Number:
    x = argument("n", c, x)
    _, mx, my, xx, xy, _ = _moments(c, xs, ys)
    return my + ratio(xy, xx) * (x - mx)


def _correlation(c: Context, xs: Value, ys: Value) -> Number:
    _, _, _, xx, xy, yy = _moments(c, xs, ys)
    root = c.arithmetic.functions["sqrt"]
    return ratio(xy, root(xx) * root(yy))


def _covariance(fewer: int) -> Callable[..., Number]:
    def apply(c: Context, xs: Value, ys: Value) -> Number:
        n, _, _, _, xy, _ = _moments(c, xs, ys)
        return ratio(xy, n - fewer)

    return apply


def _standard_error(c: Context, ys: Value, xs: Value) -> Number:
    n, _, _, xx, xy, yy = _moments(c, xs, ys)
    if n < 3:
        raise ZeroDivisionError
    return c.arithmetic.functions["sqrt"](max(yy - ratio(xy * xy, xx), xx * 0) / (n - 2))


def _trend(c: Context, ys: Value, xs: Value = None, new: Value = None, constant: Value = True):
    """TREND of one variable; without ``xs`` it is 1, 2, 3, ..."""
    if xs is EMPTY:
        rows, columns = size_of(c, ys)
        places = iter(range(1, rows * columns + 1))
        xs = tuple(
            tuple(c.arithmetic.from_float(float(next(places))) for _ in range(columns))
            for _ in range(rows)
        )
    if size_of(c, xs) != size_of(c, ys):
        raise UnsupportedError("TREND of several variables")
    _, mx, my, xx, xy, _ = _moments(c, xs, ys)
    if not argument("b", c, constant):
        raise UnsupportedError("TREND through the origin")
    slope = ratio(xy, xx)

    def at(c: Context, x: Scalar) -> Scalar:
        x = number(c, x)
        return x if type(x) is Error else my + slope * (x - mx)

    return broadcast(c, at, rows_of(c, xs if new is EMPTY else new))


def _paired(term: Callable[[Number, Number], Number]) -> Callable[..., Number]:
    """SUMX2MY2 and its like."""
    return lambda c, xs, ys: total(c, [term(x, y) for x, y in pairs(c, xs, ys)])


def _sum_of_products(c: Context, *values: Value) -> Number:
    """What is no number counts as 0; all arrays must have one shape."""
    arrays = [rows_of(c, value) for value in values]
    if len({(len(a), len(a[0])) for a in arrays}) > 1:
        raise FailedError(Error.VALUE)
    flat = [[cell for row in array for cell in row] for array in arrays]
    for cell in (cell for side in flat for cell in side):
        if type(cell) is Error:
            raise FailedError(cell)
    zero, kind = c.arithmetic.from_float(0.0), c.arithmetic.kind
    terms = zip(*([x if type(x) is kind else zero for x in side] for side in flat), strict=True)
    return total(c, [reduce(operator.mul, term) for term in terms])


FUNCTIONS: dict[str, Entry] = (
    {
        "SLOPE": whole(2, 2, _slope),
        "INTERCEPT": whole(2, 2, _intercept),
        "STEYX": whole(2, 2, _standard_error),
        "RSQ": whole(2, 2, lambda c, *sides: _correlation(c, *sides) ** 2),
        "COVARIANCE.S": whole(2, 2, _covariance(1)),
        "TREND": whole(1, 4, _trend),
        "SUMX2MY2": whole(2, 2, _paired(lambda x, y: x * x - y * y), arrays=True),
        "SUMX2PY2": whole(2, 2, _paired(lambda x, y: x * x + y * y), arrays=True),
        "SUMXMY2": whole(2, 2, _paired(lambda x, y: (x - y) * (x - y)), arrays=True),
        "SUMPRODUCT": whole(1, MANY, _sum_of_products, arrays=True),
    }
    | dict.fromkeys(("FORECAST", "FORECAST.LINEAR"), whole(3, 3, _forecast, single=0))
    | dict.fromkeys(("CORREL", "PEARSON"), whole(2, 2, _correlation))
    | dict.fromkeys(("COVAR", "COVARIANCE.P"), whole(2, 2, _covariance(0)))
)
