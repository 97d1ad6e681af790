"""Functions that look things up, say where they are, and arrange arrays."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from functools import cmp_to_key, partial
from typing import Any

from openpyxl.utils import get_column_letter

from kfsheet.parsing.calculator.broadcasting import (
    MANY,
    Entry,
    area_of,
    argument,
    broadcast,
    scalar,
    whole,
)
from kfsheet.parsing.calculator.criteria import wildcard
from kfsheet.parsing.calculator.values import (
    EMPTY,
    Area,
    Areas,
    Array,
    Context,
    Error,
    FailedError,
    Scalar,
    UnsupportedError,
    Value,
    areas_of,
    compare,
    is_reference,
    number,
    rows_of,
    size_of,
    truth,
)
from kfsheet.printing.excel_names import LAST_COLUMN, LAST_ROW


def _whole(c: Context, n: int) -> Any:
    return c.arithmetic.from_float(float(n))


# -- where things are ------------------------------------------------------------------------------


def _place(axis: int) -> Callable[..., Value]:
    """ROW (axis 1) and COLUMN (axis 2): of the formula's own cell, or of those of a range."""

    def apply(c: Context, value: Value = EMPTY) -> Value:
        if value is EMPTY:
            return _whole(c, c.host[axis])
        area = area_of(value)
        first, size = area[axis], (area.height, area.width)[axis - 1]
        if size == 1:
            return _whole(c, first)
        c.spend(size)
        line = tuple(_whole(c, first + i) for i in range(size))
        return tuple((x,) for x in line) if axis == 1 else (line,)

    return apply


def _size(axis: int) -> Callable[..., Any]:
    def apply(c: Context, value: Value) -> Any:
        if type(value) is Error:
            raise FailedError(value)
        return _whole(c, size_of(c, value)[axis])

    return apply


def _count_areas(c: Context, value: Value) -> Any:
    if not is_reference(value):
        raise FailedError(value if type(value) is Error else Error.VALUE)
    return _whole(c, len(areas_of(value)))


def _address(c: Context, *values: Value) -> str:
    defaults = (0, 0, 1, True, "")
    given = [argument(kind, c, v, d) for kind, v, d in zip("iiibt", values, defaults, strict=False)]
    row, column, fixed, letters, sheet = *given, *defaults[len(given) :]
    if not (1 <= row <= LAST_ROW and 1 <= column <= LAST_COLUMN and 1 <= fixed <= 4):
        raise FailedError(Error.VALUE)
    if not letters:
        raise UnsupportedError("ADDRESS in R1C1 notation")
    dollars = ("$" if fixed in (1, 3) else "", "$" if fixed in (1, 2) else "")
    before = f"{sheet}!" if sheet.isalnum() else f"'{sheet}'!" if sheet else ""
    return f"{before}{dollars[0]}{get_column_letter(column)}{dollars[1]}{row}"


def _offset(c: Context, value: Value, *shifts: Value) -> Area:
    area = area_of(value)
    down, right = (argument("i", c, shift) for shift in shifts[:2])
    sizes = [area.height, area.width]
    for i, size in enumerate(shifts[2:]):
        sizes[i] = argument("i", c, size, sizes[i])
    if 0 in sizes:
        raise FailedError(Error.REF)
    top, left = area.top + down, area.left + right
    ends = [sorted((start, start + size - (1 if size > 0 else -1)))
            for start, size in zip((top, left), sizes, strict=True)]  # fmt: skip
    if ends[0][0] < 1 or ends[1][0] < 1 or ends[0][1] > LAST_ROW or ends[1][1] > LAST_COLUMN:
        raise FailedError(Error.REF)
    return Area(area.sheet, ends[0][0], ends[1][0], ends[0][1], ends[1][1])


# -- INDEX -----------------------------------------------------------------------------------------


def _index(c: Context, value: Value, row: Value = EMPTY, column: Value = None, which: Value = 1.0):
    if type(value) is Error:
        raise FailedError(value)
    if type(value) is Areas:
        n = argument("i", c, which)
        if not 1 <= n <= len(value.areas):
            raise FailedError(Error.REF)
        value = value.areas[n - 1]
    if type(row) is tuple or type(column) is tuple:
        pick = lambda c, *places: _cell_at(c, value, *places)  # noqa: E731
        return broadcast(c, pick, row, 0.0 if column is EMPTY else column)
    y = argument("i", c, row)
    x = argument("i", c, column) if column is not EMPTY else None
    return part(c, value, *_places(c, value, y, x))


def _places(c: Context, value: Value, y: int, x: int | None) -> tuple[int, int]:
    """In one row, a single number counts columns."""
    if x is None:
        return (1, y) if size_of(c, value)[0] == 1 else (y, 0)
    return y, x


def _cell_at(c: Context, value: Value, row: Scalar, column: Scalar) -> Scalar:
    places = [argument("i", c, place) for place in (row, column)]
    if 0 in places:
        places = _places(c, value, places[0], None)
    found = rows_of(c, part(c, value, *places))
    return found[0][0]


def part(c: Context, value: Value, row: int, column: int) -> Value:
    """A cell of an area or array, or all of a row or column where the other is 0."""
    height, width = size_of(c, value)
    if row < 0 or column < 0:
        raise FailedError(Error.VALUE)
    if row > height or column > width:
        raise FailedError(Error.REF)
    y, x = (row or 1) - 1, (column or 1) - 1
    bottom, right = (y if row else height - 1), (x if column else width - 1)
    if type(value) is Area:
        top, left = value.top + y, value.left + x
        return Area(value.sheet, top, left, value.top + bottom, value.left + right)
    rows = rows_of(c, value)
    if row and column:
        return rows[y][x]
    return tuple(line[x : right + 1] for line in rows[y : bottom + 1])


# -- looking up ------------------------------------------------------------------------------------


def _line(c: Context, value: Value) -> list[Scalar]:
    """A row or a column as a list."""
    rows = rows_of(c, value)
    if len(rows) > 1 < len(rows[0]):
        raise FailedError(Error.NA)
    return [cell for row in rows for cell in row]


def _alike(c: Context, wanted: Scalar, items: Sequence[Scalar]) -> list[int]:
    kind = type(wanted)
    c.spend(len(items))
    return [i for i, item in enumerate(items) if type(item) is kind]


def _wanted(c: Context, value: Scalar) -> Scalar:
    if type(value) is Error:
        raise FailedError(value)
    return number(c, value) if value is EMPTY else value


def exact(c: Context, wanted: Scalar, items: Sequence[Scalar], wild: bool = True) -> int:
    """The first item that equals what is wanted; a text may hold * and ?."""
    if wild and type(wanted) is str and any(sign in wanted for sign in "*?~"):
        match = wildcard(wanted.lower()).fullmatch
        c.spend(len(items) * 4)
        for i, item in enumerate(items):
            if type(item) is str and match(item.lower()):
                return i
    else:
        for i in _alike(c, wanted, items):
            if compare(c, items[i], wanted) == 0:
                return i
    raise FailedError(Error.NA)


def nearest(c: Context, wanted: Scalar, items: Sequence[Scalar], rising: bool = True) -> int:
    """The last item up to what is wanted, of sorted ones, by halving as spreadsheets search.

    Items of other kinds are passed over: ``LOOKUP(2, 1/(A1:A9>0), ...)`` finds the last number.
    """
    order = cmp_to_key(partial(compare, c) if rising else lambda a, b: -compare(c, a, b))
    places = _alike(c, wanted, items)
    after = bisect_right(places, order(wanted), key=lambda i: order(items[i]))
    if not after:
        raise FailedError(Error.NA)
    return places[after - 1]


def _match(c: Context, wanted: Value, array: Value, kind: Value = 1.0) -> Value:
    items, how = _line(c, array), argument("n", c, kind)

    def at(c: Context, one: Scalar) -> Any:
        one = _wanted(c, one)
        if how == 0:
            return _whole(c, exact(c, one, items) + 1)
        if how > 0:
            return _whole(c, nearest(c, one, items) + 1)
        return _whole(c, _falling(c, one, items) + 1)

    return _each_of(c, wanted, at)


def _falling(c: Context, wanted: Scalar, items: Sequence[Scalar]) -> int:
    """The first item equal, or else the last one above, of items that fall."""
    order = cmp_to_key(lambda a, b: -compare(c, a, b))
    places = _alike(c, wanted, items)
    before = bisect_left(places, order(wanted), key=lambda i: order(items[i]))
    if before < len(places) and compare(c, items[places[before]], wanted) == 0:
        return places[before]
    if not before:
        raise FailedError(Error.NA)
    return places[before - 1]


def _each_of(c: Context, wanted: Value, at: Callable[[Context, Scalar], Scalar]) -> Value:
    """A look-up of one thing, or of each cell of an array."""
    if type(wanted) is not tuple:
        return at(c, scalar(c, wanted))

    def caught(c: Context, one: Scalar) -> Scalar:
        try:
            return at(c, one)
        except FailedError as failed:
            return failed.error

    return broadcast(c, caught, wanted)


def _lookup(c: Context, wanted: Value, array: Value, results: Value = EMPTY) -> Value:
    rows = rows_of(c, array)
    if results is EMPTY:  # the longer side is looked through, the last line is the result
        wide = len(rows[0]) > len(rows)
        items = list(rows[0]) if wide else [row[0] for row in rows]
        found = list(rows[-1]) if wide else [row[-1] for row in rows]
    else:
        items, found = _line(c, array), _line(c, results)

    def at(c: Context, one: Scalar) -> Scalar:
        place = nearest(c, _wanted(c, one), items)
        if place >= len(found):
            raise FailedError(Error.REF)
        return found[place]

    return _each_of(c, wanted, at)


def _table(vertical: bool) -> Callable[..., Value]:
    """VLOOKUP and HLOOKUP."""

    def apply(c: Context, wanted: Value, table: Value, place: Value, near: Value = True) -> Value:
        size = size_of(c, table)[1 if vertical else 0]
        line, roughly = argument("i", c, place), argument("b", c, near)
        if line < 1:
            raise FailedError(Error.VALUE)
        if line > size:
            raise FailedError(Error.REF)
        at_line = (lambda n: (0, n)) if vertical else (lambda n: (n, 0))
        items = _line(c, part(c, table, *at_line(1)))
        results = _line(c, part(c, table, *at_line(line)))
        search = nearest if roughly else exact
        return _each_of(c, wanted, lambda c, one: results[search(c, _wanted(c, one), items)])

    return apply


def _found(c: Context, wanted: Scalar, items: Sequence[Scalar], mode: int, search: int) -> int:
    """XMATCH: 0 exact, -1 or the next smaller, 1 or the next larger, 2 with * and ?."""
    wanted = _wanted(c, wanted)
    if mode not in (-1, 0, 1, 2) or search not in (-2, -1, 1, 2):
        raise FailedError(Error.VALUE)
    order = range(len(items)) if search in (1, 2) else range(len(items) - 1, -1, -1)
    looked = [items[i] for i in order]
    try:
        return order[exact(c, wanted, looked, mode == 2)]
    except FailedError:
        if mode in (0, 2):
            raise
    best = None
    for i in _alike(c, wanted, looked):
        beyond = compare(c, looked[i], wanted) == mode
        if beyond and (best is None or compare(c, looked[i], looked[best]) == -mode):
            best = i
    if best is None:
        raise FailedError(Error.NA)
    return order[best]


def _modes(c: Context, mode: Value, search: Value) -> tuple[int, int]:
    return argument("i", c, mode, 0), argument("i", c, search, 1)


def _xmatch(c: Context, wanted: Value, array: Value, mode: Value = 0.0, search: Value = 1.0):
    items, how = _line(c, array), _modes(c, mode, search)
    return _each_of(c, wanted, lambda c, one: _whole(c, _found(c, one, items, *how) + 1))


def _xlookup(
    c: Context,
    wanted: Value,
    array: Value,
    results: Value,
    otherwise: Value = EMPTY,
    mode: Value = EMPTY,
    search: Value = EMPTY,
) -> Value:
    items, how = _line(c, array), _modes(c, mode, search)
    upright = size_of(c, array)[1] == 1

    def at(c: Context, one: Scalar) -> Value:
        try:
            place = _found(c, one, items, *how) + 1
        except FailedError as failed:
            if failed.error is not Error.NA or otherwise is EMPTY:
                raise
            return otherwise
        return part(c, results, *((place, 0) if upright else (0, place)))

    if type(wanted) is tuple:
        return _each_of(c, wanted, lambda c, one: rows_of(c, at(c, one))[0][0])
    return at(c, scalar(c, wanted))


# -- arrays ----------------------------------------------------------------------------------------


def transposed(rows: Array) -> Array:
    """Rows as columns."""
    return tuple(zip(*rows, strict=True))


def _sequence(c: Context, *values: Value) -> Array:
    given = [argument("n", c, v, d) for v, d in zip(values, (1.0, 1.0, 1.0, 1.0), strict=False)]
    height, width, start, step = *given, *(1.0, 1.0, 1.0, 1.0)[len(given) :]
    height, width = int(height), int(width)
    if height < 1 or width < 1:
        raise FailedError(Error.VALUE)
    c.spend(height * width)
    first = c.arithmetic.from_float(0.0) + start
    return tuple(tuple(first + (y * width + x) * step for x in range(width)) for y in range(height))


def _filter(c: Context, array: Value, include: Value, otherwise: Value = EMPTY) -> Value:
    rows, tests = rows_of(c, array), rows_of(c, include)
    upright = len(tests) == len(rows) and len(tests[0]) == 1
    if not upright and not (len(tests) == 1 and len(tests[0]) == len(rows[0])):
        raise FailedError(Error.VALUE)
    kept = [truth(c, cell) for row in tests for cell in row]
    for holds in kept:
        if type(holds) is Error:
            raise FailedError(holds)
    lines = rows if upright else transposed(rows)
    found = tuple(line for line, holds in zip(lines, kept, strict=True) if holds)
    if not found:
        return Error.CALC if otherwise is EMPTY else otherwise
    return found if upright else transposed(found)


def _sorted(
    c: Context, array: Value, index: Value = EMPTY, order: Value = EMPTY, across: Value = False
) -> Array:
    flat = argument("b", c, across)
    rows = transposed(rows_of(c, array)) if flat else rows_of(c, array)
    place, sign = argument("i", c, index, 1), argument("i", c, order, 1)
    if not 1 <= place <= len(rows[0]) or sign not in (1, -1):
        raise FailedError(Error.VALUE)

    def by(a: Array, b: Array) -> int:
        first, second = a[place - 1], b[place - 1]
        if first is EMPTY or second is EMPTY:  # gaps come last in either order
            return (first is EMPTY) - (second is EMPTY)
        return sign * compare(c, first, second)

    found = tuple(sorted(rows, key=cmp_to_key(by)))
    return transposed(found) if flat else found


def _unique(c: Context, array: Value, across: Value = False, once: Value = False) -> Value:
    flat, single = argument("b", c, across), argument("b", c, once)
    rows = transposed(rows_of(c, array)) if flat else rows_of(c, array)
    counts: dict[tuple, int] = {}
    keys = [tuple((type(x), x.lower() if type(x) is str else x) for x in row) for row in rows]
    for key in keys:
        counts[key] = counts.get(key, 0) + 1
    firsts = dict(zip(reversed(keys), reversed(rows), strict=True))
    found = tuple(firsts[key] for key in counts if not single or counts[key] == 1)
    if not found:
        return Error.CALC
    return transposed(found) if flat else found


def _stack(c: Context, *values: Value) -> Array:
    """VSTACK; what is narrower than the widest is filled up with #N/A."""
    rows = [row for value in values for row in rows_of(c, value)]
    width = max(map(len, rows))
    return tuple(row + (Error.NA,) * (width - len(row)) for row in rows)


def _stack_across(c: Context, *values: Value) -> Array:
    return transposed(_stack_columns(c, values))


def _stack_columns(c: Context, values: Sequence[Value]) -> Array:
    columns = [column for value in values for column in transposed(rows_of(c, value))]
    height = max(map(len, columns))
    return tuple(column + (Error.NA,) * (height - len(column)) for column in columns)


FUNCTIONS: dict[str, Entry] = {
    "ROW": whole(0, 1, _place(1)),
    "COLUMN": whole(0, 1, _place(2)),
    "ROWS": whole(1, 1, _size(0)),
    "COLUMNS": whole(1, 1, _size(1)),
    "AREAS": whole(1, 1, _count_areas),
    "ADDRESS": whole(2, 5, _address),
    "OFFSET": whole(3, 5, _offset),
    "INDEX": whole(2, 4, _index, arrays=True),
    "MATCH": whole(2, 3, _match, single=0),
    "XMATCH": whole(2, 4, _xmatch, single=0),
    "LOOKUP": whole(2, 3, _lookup, arrays=True, single=0),
    "VLOOKUP": whole(3, 4, _table(True), single=0),
    "HLOOKUP": whole(3, 4, _table(False), single=0),
    "XLOOKUP": whole(3, 6, _xlookup, single=0),
    "TRANSPOSE": whole(1, 1, lambda c, value: transposed(rows_of(c, value)), arrays=True),
    "SEQUENCE": whole(1, 4, _sequence),
    "FILTER": whole(2, 3, _filter, arrays=True),
    "SORT": whole(1, 4, _sorted, arrays=True),
    "UNIQUE": whole(1, 3, _unique, arrays=True),
    "VSTACK": whole(1, MANY, _stack, arrays=True),
    "HSTACK": whole(1, MANY, _stack_across, arrays=True),
}
