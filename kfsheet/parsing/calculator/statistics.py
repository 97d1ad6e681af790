"""Sums, means, deviations, fits of a line, and the same over cells that meet criteria.

In a range only numbers count; texts, truth values and empty cells in it are left out. What is
written as an argument itself counts as in arithmetic: SUM(TRUE, "2") is 3.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache, reduce
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
    Area,
    Context,
    Error,
    FailedError,
    Scalar,
    UnsupportedError,
    Value,
    cells_of,
    is_number,
    is_reference,
    number,
    numeral,
    read,
    rows_of,
    size_of,
    used,
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


def _extreme(choose: Callable) -> Statistic:
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
    "MIN": _extreme(min),
    "MAX": _extreme(max),
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
    "MINA": _extreme(min),
    "MAXA": _extreme(max),
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


# -- pairs of numbers ------------------------------------------------------------------------------


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


# -- cells that meet criteria ----------------------------------------------------------------------

CRITERION = re.compile(r"(<>|<=|>=|<|>|=)?(.*)", re.DOTALL)
ORDERS = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "=": operator.eq,
    "<>": operator.ne,
}


def criterion(c: Context, wanted: Scalar) -> Callable[[Scalar], bool]:
    """The test that COUNTIF makes of its criterion: 5, ">5", "<>", "a*"."""
    if type(wanted) is not str:
        if wanted is EMPTY:
            wanted = c.arithmetic.from_float(0.0)
        return _equality(c, wanted)
    sign, rest = CRITERION.fullmatch(wanted).groups()
    order = sign or "="
    if rest == "":
        gap = {"=": lambda cell: cell is EMPTY, "<>": lambda cell: cell is not EMPTY}
        return gap.get(order, lambda cell: False) if sign else lambda cell: cell in (EMPTY, "")
    thing = _meant(c, rest)
    if type(thing) is str:
        return _text_test(order, thing)
    if order in ("=", "<>"):
        equal = _equality(c, thing)
        return equal if order == "=" else lambda cell: not equal(cell)
    return lambda cell: type(cell) is type(thing) and _order(c, order, cell, thing)


def _equality(c: Context, thing: Scalar) -> Callable[[Scalar], bool]:
    """Equal in kind and value; but a text that holds a number equals that number here."""
    of_number = is_number(c, thing)

    def holds(cell: Scalar) -> bool:
        if of_number and type(cell) is str:
            cell = numeral(c, cell) if any(map(str.isdigit, cell)) else cell
        return type(cell) is type(thing) and _order(c, "=", cell, thing)

    return holds


def _order(c: Context, sign: str, cell: Scalar, thing: Scalar) -> bool:
    if type(thing) is c.arithmetic.kind:
        return ORDERS[sign](c.arithmetic.compare(cell, thing), 0)
    return cell is thing if type(thing) is Error else ORDERS[sign](cell, thing)


def _meant(c: Context, words: str) -> Scalar:
    """A criterion's text as the number, truth value or error that it names."""
    if words.upper() in ("TRUE", "FALSE"):
        return words.upper() == "TRUE"
    if words.startswith("#") and words.upper() in [e.value for e in Error]:
        return Error(words.upper())
    x = numeral(c, words)
    return words if type(x) is Error else x


def _text_test(order: str, words: str) -> Callable[[Scalar], bool]:
    if order in ("=", "<>"):
        match = wildcard(words.lower()).fullmatch
        return lambda cell: (type(cell) is str and match(cell.lower())) == (order == "=")
    low = words.lower()
    return lambda cell: type(cell) is str and ORDERS[order](cell.lower(), low)


class Wildcard:
    """A text with ``*`` and ``?``, which a tilde makes ordinary characters.

    The pieces between the stars are found one after the other, each as far left as it goes: a
    regular expression of many stars could try for hours.
    """

    def __init__(self, words: str) -> None:
        pieces = [""]
        for part in re.findall(r"~[*?~]|\*|.", words, re.DOTALL):
            if part == "*":
                pieces.append("")
            else:
                pieces[-1] += "." if part == "?" else re.escape(part[-1])
        self._pieces = [re.compile(piece, re.DOTALL) for piece in pieces]

    def fullmatch(self, text: str) -> bool:
        """Whether it is the whole text."""
        first, *middle = self._pieces
        if not middle:
            return first.fullmatch(text) is not None
        start = first.match(text)
        *middle, last = middle
        place = self._after(text, start.end(), middle) if start else None
        if place is None:
            return False
        tail = re.compile(f"(?:{last.pattern})\\Z", re.DOTALL)
        return tail.search(text, place) is not None

    def find(self, text: str, start: int) -> int:
        """Where it begins in a text, from ``start`` on; -1 if nowhere."""
        first = self._pieces[0].search(text, start)
        if not first or self._after(text, first.end(), self._pieces[1:]) is None:
            return -1
        return first.start()

    @staticmethod
    def _after(text: str, place: int, pieces: Sequence[re.Pattern[str]]) -> int | None:
        for piece in pieces:
            found = piece.search(text, place)
            if not found:
                return None
            place = found.end()
        return place


@lru_cache(maxsize=500)
def wildcard(words: str) -> Wildcard:
    """The pattern of a text, made once."""
    return Wildcard(words)


def _aligned(c: Context, area: Area, shape: Area) -> Area:
    """SUMIF's range of sums: only where it begins counts."""
    bottom, right = area.top + shape.height - 1, area.left + shape.width - 1
    return area._replace(bottom=bottom, right=right)


def _met(c: Context, conditions: Sequence[tuple[Area, Scalar]]) -> list[tuple[int, int]]:
    """Offsets of the cells at which all criteria hold; all ranges have one shape."""
    first = conditions[0][0]
    if any((a.height, a.width) != (first.height, first.width) for a, _ in conditions):
        raise FailedError(Error.VALUE)
    parts = [used(c, area) for area, _ in conditions]
    height, width = max(p.height for p in parts), max(p.width for p in parts)
    tests = [criterion(c, wanted) for _, wanted in conditions]
    blocks = [read(c, a._replace(bottom=a.top + height - 1, right=a.left + width - 1))
              for a, _ in conditions]  # fmt: skip
    together = list(zip(blocks, tests, strict=True))
    return [
        (y, x)
        for y in range(height)
        for x in range(width)
        if all(test(block[y][x]) for block, test in together)
    ]


def _conditional(c: Context, area: Area, conditions: list, statistic: Statistic) -> Number:
    cells = [c.cell(area.sheet, area.top + y, area.left + x) for y, x in _met(c, conditions)]
    return statistic(c, numbers(c, [(tuple(cells),)] if cells else []))


def _over_criteria(c: Context, value: Value, apply: Callable[[Scalar], Scalar]) -> Value:
    """A criterion that is an array gives an array of results."""
    if type(value) is tuple:
        return broadcast(c, lambda c, wanted: apply(wanted), value)
    return apply(value if type(value) is Error else scalar(c, value))


def _one_criterion(statistic: Statistic) -> Callable[..., Value]:
    """SUMIF, AVERAGEIF: the range of the criterion first, that of the numbers last."""

    def apply(c: Context, where: Value, wanted: Value, what: Value = EMPTY) -> Value:
        tested = area_of(where)
        area = _aligned(c, tested if what is EMPTY else area_of(what), tested)
        result = lambda one: _conditional(c, area, [(tested, one)], statistic)  # noqa: E731
        return _over_criteria(c, wanted, result)

    return apply


def _conditions(c: Context, parts: Sequence[Value]) -> list[tuple[Area, Scalar]]:
    if len(parts) % 2:
        raise UnsupportedError("a range of criteria without a criterion")
    both = zip(parts[::2], parts[1::2], strict=True)
    return [(area_of(a), w if type(w) is Error else scalar(c, w)) for a, w in both]


def _many_criteria(statistic: Statistic) -> Callable[..., Value]:
    """SUMIFS and its like: the range of the numbers first."""

    def apply(c: Context, what: Value, *parts: Value) -> Number:
        area, conditions = area_of(what), _conditions(c, parts)
        if (area.height, area.width) != (conditions[0][0].height, conditions[0][0].width):
            raise FailedError(Error.VALUE)
        return _conditional(c, area, conditions, statistic)

    return apply


def _count_ifs(c: Context, *parts: Value) -> Number:
    return c.arithmetic.from_float(float(len(_met(c, _conditions(c, parts)))))


def _count_if(c: Context, where: Value, wanted: Value) -> Value:
    area = area_of(where)
    if type(wanted) is not str or not criterion(c, wanted)(EMPTY):
        count = lambda one: c.arithmetic.from_float(float(len(_met(c, [(area, one)]))))  # noqa: E731
        return _over_criteria(c, wanted, count)
    part = used(c, area)  # cells beyond those in use are empty and meet it, too
    beyond = area.height * area.width - part.height * part.width
    return c.arithmetic.from_float(float(len(_met(c, [(part, wanted)])) + beyond))


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
        "SUMIF": whole(2, 3, _one_criterion(total), single=1),
        "AVERAGEIF": whole(2, 3, _one_criterion(mean), single=1),
        "SUMIFS": whole(3, MANY, _many_criteria(total)),
        "AVERAGEIFS": whole(3, MANY, _many_criteria(mean)),
        "MAXIFS": whole(3, MANY, _many_criteria(_extreme(max))),
        "MINIFS": whole(3, MANY, _many_criteria(_extreme(min))),
        "COUNTIF": whole(2, 2, _count_if, single=1),
        "COUNTIFS": whole(2, MANY, _count_ifs),
        "SUBTOTAL": whole(2, MANY, _subtotal),
        "AGGREGATE": whole(3, MANY, _aggregate, arrays=True),
    }
    | dict.fromkeys(("FORECAST", "FORECAST.LINEAR"), whole(3, 3, _forecast, single=0))
    | dict.fromkeys(("CORREL", "PEARSON"), whole(2, 2, _correlation))
    | dict.fromkeys(("COVAR", "COVARIANCE.P"), whole(2, 2, _covariance(0)))
    | dict.fromkeys(("RANK", "RANK.EQ"), whole(2, 3, _rank(False), single=0))
    | {"RANK.AVG": whole(2, 3, _rank(True), single=0)}
    | dict.fromkeys(("PERCENTILE", "PERCENTILE.INC"), whole(2, 2, _percentile(1), single=1))
    | dict.fromkeys(("QUARTILE", "QUARTILE.INC"), whole(2, 2, _percentile(4), single=1))
)
