"""Sums, means, deviations, the n-th of many, and what SUBTOTAL makes of them.

In a range only numbers count; texts, truth values and empty cells in it are left out. What is
written as an argument itself counts as in arithmetic: SUM(TRUE, "2") is 3.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

from kfsheet.parsing.calculator.broadcasting import (
    MANY,
    Entry,
    area_of,
    argument,
    broadcast,
    scalar,
    whole,
)
from kfsheet.parsing.calculator.mathematics import nearly_floor, ratio
from kfsheet.parsing.calculator.values import (
    EMPTY,
    Context,
    Error,
    FailedError,
    Scalar,
    Value,
    cells_of,
    is_reference,
    number,
)

Number = Any
"""A number of the context's arithmetic."""
Statistic = Callable[[Context, list[Number]], Number]


def numbers(c: Context, values: Sequence[Value]) -> list[Number]:
    """The numbers that an aggregate counts; the first error among the values fails it."""
    found, kind = [], c.arithmetic.kind
    for value in values:
        if is_reference(value) or type(value) is tuple:
            for cell in cells_of(c, value):
                if type(cell) is kind:
                    found.append(cell)
                elif type(cell) is Error:
                    raise FailedError(cell)
        else:
            found.append(_direct(c, value))
    return found


def _direct(c: Context, value: Scalar) -> Number:
    x = number(c, value)
    if type(x) is Error:
        raise FailedError(x)
    return x


def _numbers_of_all(c: Context, values: Sequence[Value]) -> list[Number]:
    """For AVERAGEA and its like: in ranges TRUE is 1, a text 0; gaps are left out."""
    found = []
    for value in values:
        ranged = is_reference(value) or type(value) is tuple
        for cell in cells_of(c, value):
            if type(cell) is Error:
                raise FailedError(cell)
            if not ranged or cell is not EMPTY:
                found.append(c.arithmetic.from_float(0.0) if ranged and type(cell) is str
                             else _direct(c, cell))  # fmt: skip
    return found


def aggregate(statistic: Statistic, gather: Callable = numbers) -> Entry:
    """An entry for a function of all numbers in its arguments."""
    return whole(1, MANY, lambda c, *values: statistic(c, gather(c, values)))


# -- statistics of a list of numbers ---------------------------------------------------------------


def total(c: Context, found: Sequence[Number]) -> Number:
    """The sum, from the first to the last, as spreadsheets add."""
    return reduce(operator.add, found, c.arithmetic.from_float(0.0))


def product(c: Context, found: Sequence[Number]) -> Number:
    """The product; 0 of nothing, as in Excel."""
    return reduce(operator.mul, found) if found else c.arithmetic.from_float(0.0)


def mean(c: Context, found: Sequence[Number]) -> Number:
    """The mean; #DIV/0! of nothing."""
    return ratio(total(c, found), len(found))


def squares(c: Context, found: Sequence[Number]) -> Number:
    """The sum of squares of what deviates from the mean."""
    middle = mean(c, found)
    return total(c, [(x - middle) * (x - middle) for x in found])


def _sum_of_squares(c: Context, found: Sequence[Number]) -> Number:
    return total(c, [x * x for x in found])


def _deviation_squares(c: Context, found: Sequence[Number]) -> Number:
    if not found:
        raise ValueError
    return squares(c, found)


def _variance(fewer: int) -> Statistic:
    def statistic(c: Context, found: list[Number]) -> Number:
        return ratio(squares(c, found), len(found) - fewer) if found else ratio(0, 0)

    return statistic


def _root(statistic: Statistic) -> Statistic:
    return lambda c, found: c.arithmetic.functions["sqrt"](statistic(c, found))


def extreme(choose: Callable) -> Statistic:
    """The largest or the smallest; 0 of none."""
    return lambda c, found: choose(found) if found else c.arithmetic.from_float(0.0)


def _median(c: Context, found: list[Number]) -> Number:
    return _quantile(c, found, c.arithmetic.from_float(0.5))


def _quantile(c: Context, found: list[Number], share: Number) -> Number:
    """PERCENTILE and QUARTILE: between the two nearest of the sorted numbers."""
    if not found or not 0 <= share <= 1:
        raise ValueError
    place = share * (len(found) - 1)
    below = int(nearly_floor(c, place))
    ordered = sorted(found)
    above = ordered[min(below + 1, len(found) - 1)]
    # a fraction that is nothing but the rounding of a share is none
    fraction = max(place - below, place * 0)
    return ordered[below] + fraction * (above - ordered[below])


def _mode(c: Context, found: list[Number]) -> Number:
    counts: dict[Number, int] = {}
    for x in found:
        counts[x] = counts.get(x, 0) + 1
    best = max(counts, key=counts.__getitem__, default=None)
    if best is None or counts[best] < 2:
        raise FailedError(Error.NA)
    return best


def _mean_deviation(c: Context, found: list[Number]) -> Number:
    if not found:
        raise ValueError
    middle = mean(c, found)
    return mean(c, [abs(x - middle) for x in found])


def _geometric_mean(c: Context, found: list[Number]) -> Number:
    """By logarithms: the product of many numbers would be beyond 1E308."""
    if not found or min(found) <= 0:
        raise ValueError
    f = c.arithmetic.functions
    return f["exp"](mean(c, [f["log"](x) for x in found]))


def _harmonic_mean(c: Context, found: list[Number]) -> Number:
    if not found or min(found) <= 0:
        raise ValueError
    return len(found) / total(c, [1 / x for x in found])


def _skewness(c: Context, found: list[Number]) -> Number:
    n, middle = len(found), mean(c, found)
    spread = _root(_variance(1))(c, found)
    cubes = total(c, [ratio(x - middle, spread) ** 3 for x in found])
    return ratio(cubes * n, (n - 1) * (n - 2))


STATISTICS: dict[str, Statistic] = {
    "SUM": total,
    "SUMSQ": _sum_of_squares,
    "PRODUCT": product,
    "MIN": extreme(min),
    "MAX": extreme(max),
    "AVERAGE": mean,
    "MEDIAN": _median,
    "MODE": _mode,
    "MODE.SNGL": _mode,
    "DEVSQ": _deviation_squares,
    "AVEDEV": _mean_deviation,
    "GEOMEAN": _geometric_mean,
    "HARMEAN": _harmonic_mean,
    "SKEW": _skewness,
} | {
    name: statistic
    for fewer, ends in ((1, ("", ".S")), (0, ("P", ".P")))
    for end in ends
    for name, statistic in (
        (f"VAR{end}", _variance(fewer)),
        (f"STDEV{end}", _root(_variance(fewer))),
    )
}
OF_ALL: dict[str, Statistic] = {
    "MINA": extreme(min),
    "MAXA": extreme(max),
    "AVERAGEA": mean,
    "VARA": _variance(1),
    "VARPA": _variance(0),
    "STDEVA": _root(_variance(1)),
    "STDEVPA": _root(_variance(0)),
}

# -- counting --------------------------------------------------------------------------------------


def _counted(c: Context, value: Value) -> int:
    if is_reference(value) or type(value) is tuple:
        return sum(type(cell) is c.arithmetic.kind for cell in cells_of(c, value))
    return type(value) is not Error and type(number(c, value)) is not Error


def _count(c: Context, *values: Value) -> Number:
    return c.arithmetic.from_float(float(sum(_counted(c, value) for value in values)))


def _count_all(c: Context, *values: Value) -> Number:
    found = (
        cell is not EMPTY or not is_reference(value)
        for value in values
        for cell in cells_of(c, value)
    )
    return c.arithmetic.from_float(float(sum(found)))


def _count_blank(c: Context, value: Value) -> Number:
    area = area_of(value)
    full = sum(cell not in (EMPTY, "") for cell in cells_of(c, area))
    return c.arithmetic.from_float(float(area.height * area.width - full))


# -- the n-th of many ------------------------------------------------------------------------------


def _nth(largest: bool) -> Callable[..., Value]:
    def apply(c: Context, values: Value, places: Value) -> Value:
        ordered = sorted(numbers(c, [values]), reverse=largest)

        def at(c: Context, place: Scalar) -> Scalar:
            n = number(c, place)
            if type(n) is Error:
                return n
            n = int(n)
            return ordered[n - 1] if 1 <= n <= len(ordered) else Error.NUM

        return _at_each(c, places, at)

    return apply


def _at_each(c: Context, places: Value, at: Callable[[Context, Scalar], Scalar]) -> Value:
    """A function at a scalar, or at each cell of an array: LARGE(A1:A9, {1,2,3})."""
    return broadcast(c, at, places) if type(places) is tuple else at(c, scalar(c, places))


def _percentile(parts: int) -> Callable[..., Value]:
    def apply(c: Context, values: Value, share: Value) -> Number:
        part = argument("n", c, share)
        if parts > 1:
            part = c.arithmetic.floor(part)
        return _quantile(c, numbers(c, [values]), part / parts)

    return apply


def _rank(middle: bool) -> Callable[..., Number]:
    def apply(c: Context, x: Value, values: Value, order: Value = 0.0) -> Number:
        x, found = argument("n", c, x), numbers(c, [values])
        rising = argument("n", c, order) != 0
        ties = sum(c.arithmetic.compare(y, x) == 0 for y in found)
        if not ties:
            raise FailedError(Error.NA)
        before = sum(c.arithmetic.compare(y, x) == (-1 if rising else 1) for y in found)
        place = float(before + 1)
        return c.arithmetic.from_float(place + (ties - 1) / 2 if middle else place)

    return apply


# -- SUBTOTAL and AGGREGATE ------------------------------------------------------------------------

NUMBERED = "AVERAGE COUNT COUNTA MAX MIN PRODUCT STDEV STDEVP SUM VAR VARP MEDIAN MODE".split()
NTH = {14: _nth(True), 15: _nth(False), 16: _percentile(1), 17: _percentile(4)}


def _numbered(c: Context, which: int, values: Sequence[Value], careful: bool) -> Number:
    """The function of a number in Excel's list; without care, errors are left out."""
    if not 1 <= which <= len(NUMBERED):
        raise FailedError(Error.VALUE)
    if not careful:
        values = [(tuple(x for x in cells_of(c, v) if type(x) is not Error) or (EMPTY,),)
                  for v in values]  # fmt: skip
    name = NUMBERED[which - 1]
    if name in ("COUNT", "COUNTA"):
        count = _count if name == "COUNT" else _count_all
        return count(c, *[_without_gaps(v) for v in values])
    return STATISTICS[name](c, numbers(c, values))


def _without_gaps(value: Value) -> Value:
    if type(value) is not tuple:
        return value
    return (tuple(x for row in value for x in row if x is not EMPTY),)


def _subtotal(c: Context, which: Value, *values: Value) -> Number:
    """Other subtotals among the cells, and rows that are hidden, are not known here."""
    return _numbered(c, argument("i", c, which) % 100, values, True)


def _aggregate(c: Context, which: Value, option: Value, *values: Value) -> Value:
    number_of, how = argument("i", c, which), argument("i", c, option)
    if not 0 <= how <= 7:
        raise FailedError(Error.VALUE)
    careful = how not in (2, 3, 6, 7)
    if number_of in NTH and len(values) == 2:
        cells = tuple(x for x in cells_of(c, values[0]) if careful or type(x) is not Error)
        return NTH[number_of](c, (cells,), values[1])
    return _numbered(c, number_of, values, careful)


FUNCTIONS: dict[str, Entry] = (
    {name: aggregate(statistic) for name, statistic in STATISTICS.items()}
    | {name: aggregate(statistic, _numbers_of_all) for name, statistic in OF_ALL.items()}
    | {
        "COUNT": whole(1, MANY, _count),
        "COUNTA": whole(1, MANY, _count_all),
        "COUNTBLANK": whole(1, 1, _count_blank),
        "LARGE": whole(2, 2, _nth(True), single=1),
        "SMALL": whole(2, 2, _nth(False), single=1),
        "SUBTOTAL": whole(2, MANY, _subtotal),
        "AGGREGATE": whole(3, MANY, _aggregate, arrays=True),
    }
    | dict.fromkeys(("RANK", "RANK.EQ"), whole(2, 3, _rank(False), single=0))
    | {"RANK.AVG": whole(2, 3, _rank(True), single=0)}
    | dict.fromkeys(("PERCENTILE", "PERCENTILE.INC"), whole(2, 2, _percentile(1), single=1))
    | dict.fromkeys(("QUARTILE", "QUARTILE.INC"), whole(2, 2, _percentile(4), single=1))
)
