"""Sums, means and counts over cells that meet criteria, such as ">2" or "a*"."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Sequence
from functools import lru_cache

from kfsheet.parsing.calculator.averages import Number, Statistic, extreme, mean, numbers, total
from kfsheet.parsing.calculator.broadcasting import (
    MANY,
    Entry,
    area_of,
    broadcast,
    scalar,
    whole,
)
from kfsheet.parsing.calculator.values import (
    EMPTY,
    Area,
    Context,
    Error,
    FailedError,
    Scalar,
    UnsupportedError,
    Value,
    is_number,
    numeral,
    read,
    used,
)

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

        def count(one: Scalar) -> Number:
            return c.arithmetic.from_float(float(len(_met(c, [(area, one)]))))

        return _over_criteria(c, wanted, count)
    part = used(c, area)  # cells beyond those in use are empty and meet it, too
    beyond = area.height * area.width - part.height * part.width
    return c.arithmetic.from_float(float(len(_met(c, [(part, wanted)])) + beyond))


FUNCTIONS: dict[str, Entry] = {
    "SUMIF": whole(2, 3, _one_criterion(total), single=1),
    "AVERAGEIF": whole(2, 3, _one_criterion(mean), single=1),
    "SUMIFS": whole(3, MANY, _many_criteria(total)),
    "AVERAGEIFS": whole(3, MANY, _many_criteria(mean)),
    "MAXIFS": whole(3, MANY, _many_criteria(extreme(max))),
    "MINIFS": whole(3, MANY, _many_criteria(extreme(min))),
    "COUNTIF": whole(2, 2, _count_if, single=1),
    "COUNTIFS": whole(2, MANY, _count_ifs),
}
