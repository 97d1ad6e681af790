"""Conditions and choices, which calculate only what is taken, and names within a formula."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from kfsheet.parsing.calculator.broadcasting import (
    MANY,
    Compiler,
    Entry,
    broadcast,
    each,
    whole,
    whole_number,
)
from kfsheet.parsing.calculator.values import (
    EMPTY,
    Array,
    Context,
    Error,
    FailedError,
    Lambda,
    Program,
    Scalar,
    TooMuchWorkError,
    UnsupportedError,
    Value,
    cells_of,
    compare,
    is_reference,
    rows_of,
    truth,
)

Choose = Callable[[Context, Scalar], int | Error]
"""Which branch a scalar takes, counted from 0; or the error that the result is."""


def choice(test: Program, branches: Sequence[Program], choose: Choose, settle: Callable) -> Program:
    """One of several branches; only the one taken is calculated.

    With an array of conditions, the branches that are taken anywhere are calculated once.
    """

    def value(c: Context) -> Value:
        condition = test(c)
        if type(condition) is tuple:
            return _choices(c, condition, branches, choose, settle)
        taken = choose(c, condition)
        return taken if type(taken) is Error else branches[taken](c)

    return value


def _choices(
    c: Context, conditions: Array, branches: Sequence[Program], choose: Choose, settle: Callable
) -> Array:
    taken = tuple(tuple(choose(c, cell) for cell in row) for row in conditions)
    needed = sorted({i for row in taken for i in row if type(i) is int})
    found = [settle(c, branches[i](c)) for i in needed]

    def pick(c: Context, index: int | Error, *values: Scalar) -> Scalar:
        return index if type(index) is Error else values[needed.index(index)]

    return broadcast(c, pick, taken, *found)


def _settle(c: Context, value: Value) -> Value:
    return rows_of(c, value) if is_reference(value) else value


def _if(compiler: Compiler, test: tuple, yes: tuple, no: tuple = ("truth", False)) -> Program:
    def choose(c: Context, condition: Scalar) -> int | Error:
        holds = truth(c, condition)
        return holds if type(holds) is Error else 0 if holds else 1

    branches = [compiler.raw(yes), compiler.raw(no)]
    return choice(compiler.operand(test), branches, choose, _settle)


def _choose(compiler: Compiler, index: tuple, *values: tuple) -> Program:
    def choose(c: Context, scalar: Scalar) -> int | Error:
        i = whole_number(c, scalar)
        if type(i) is Error:
            return i
        return i - 1 if 1 <= i <= len(values) else Error.VALUE

    return choice(compiler.operand(index), [compiler.raw(v) for v in values], choose, _settle)


def _ifs(compiler: Compiler, *parts: tuple) -> Program:
    """IFS is an IF in the last branch of an IF; #N/A if no condition holds."""
    if len(parts) % 2:
        raise UnsupportedError("IFS has a condition without a value")
    rest: tuple = ("error", "#N/A")
    for test, value in reversed(list(zip(parts[::2], parts[1::2], strict=True))):
        rest = ("call", "IF", test, value, rest)
    return compiler.raw(rest)


def _switch(compiler: Compiler, subject: tuple, *parts: tuple) -> Program:
    run, otherwise = compiler.operand(subject), ("error", "#N/A")
    if len(parts) % 2:
        *parts, otherwise = parts
    cases = [
        (compiler.operand(case), compiler.raw(value))
        for case, value in zip(parts[::2], parts[1::2], strict=True)
    ]
    last = compiler.raw(otherwise)

    def value(c: Context) -> Value:
        found = run(c)
        if type(found) is tuple:
            raise UnsupportedError("SWITCH of an array")
        if type(found) is Error:
            return found
        for case, result in cases:
            candidate = case(c)
            if type(candidate) is Error:
                return candidate
            if compare(c, found, candidate) == 0:
                return result(c)
        return last(c)

    return value


def _catching(caught: Callable[[Error], bool]) -> Callable[..., Program]:
    """IFERROR and IFNA: the other value is calculated only where there is an error."""

    def build(compiler: Compiler, subject: tuple, otherwise: tuple) -> Program:
        run, rescue = compiler.operand(subject), compiler.operand(otherwise)

        def failed(scalar: Scalar) -> bool:
            return type(scalar) is Error and caught(scalar)

        def value(c: Context) -> Value:
            found = run(c)
            if type(found) is not tuple:
                return rescue(c) if failed(found) else found
            if not any(failed(cell) for row in found for cell in row):
                return found
            pick = lambda c, cell, other: other if failed(cell) else cell  # noqa: E731
            return broadcast(c, pick, found, rescue(c))

        return value

    return build


# -- truth values ----------------------------------------------------------------------------------


def _truths(c: Context, values: Sequence[Value]) -> list[bool]:
    """The truth values of all arguments; texts and gaps in ranges are left out."""
    found = []
    for value in values:
        ranged = is_reference(value) or type(value) is tuple
        for cell in cells_of(c, value):
            if ranged and (type(cell) is str or cell is EMPTY):
                continue
            holds = truth(c, cell)
            if type(holds) is Error:
                raise FailedError(holds)
            found.append(holds)
    if not found:
        raise FailedError(Error.VALUE)
    return found


def _combined(combine: Callable[[list[bool]], bool]) -> Callable[..., bool]:
    return lambda c, *values: combine(_truths(c, values))


# -- names within a formula ------------------------------------------------------------------------


def _identifier(tree: tuple) -> str:
    if tree[0] != "reference" or not tree[1].name or tree[1].sheet:
        raise UnsupportedError("LET and LAMBDA name what is no name")
    return tree[1].name.lower()


def _let(compiler: Compiler, *parts: tuple) -> Program:
    if len(parts) % 2 == 0:
        raise UnsupportedError("LET has a name without a value")
    names = [_identifier(part) for part in parts[:-1:2]]
    runs = [compiler.raw(part) for part in parts[1::2]]
    result = compiler.raw(parts[-1])

    def value(c: Context) -> Value:
        outside = c.variables
        try:
            for name, run in zip(names, runs, strict=True):
                c.variables = {**c.variables, name: run(c)}
            return result(c)
        finally:
            c.variables = outside

    return value


def _lambda(compiler: Compiler, *parts: tuple) -> Program:
    parameters = tuple(_identifier(part) for part in parts[:-1])
    body = compiler.raw(parts[-1])
    return lambda c: Lambda(parameters, body, c.variables)


def called(c: Context, function: Value, arguments: Sequence[Value]) -> Value:
    """What a LAMBDA gives for arguments."""
    c.spend(10)
    if type(function) is not Lambda or len(arguments) != len(function.parameters):
        return function if type(function) is Error else Error.VALUE
    outside = c.variables
    given = dict(zip(function.parameters, arguments, strict=True))
    c.variables = {**function.variables, **given}
    try:
        return function.body(c)
    except RecursionError:  # it calls itself without an end
        raise TooMuchWorkError("the formula is nested too deep") from None
    finally:
        c.variables = outside


def _single(c: Context, value: Value) -> Scalar:
    """What a LAMBDA gives for one cell of an array must be one value."""
    rows = rows_of(c, value)
    return rows[0][0] if len(rows) == len(rows[0]) == 1 else Error.CALC


def _map(c: Context, *values: Value) -> Array:
    *arrays, function = values
    at = lambda c, *cells: _single(c, called(c, function, cells))  # noqa: E731
    return broadcast(c, at, *(rows_of(c, array) for array in arrays))


def _running(c: Context, start: Value, array: Value, function: Value) -> list[list[Scalar]]:
    rows, so_far = [], start
    for row in rows_of(c, array):
        rows.append([])
        for cell in row:
            so_far = cell if so_far is EMPTY else _single(c, called(c, function, (so_far, cell)))
            rows[-1].append(so_far)
    return rows


def _by_row(c: Context, array: Value, function: Value) -> Array:
    lines = [(row,) for row in rows_of(c, array)]
    return tuple((_single(c, called(c, function, (line,))),) for line in lines)


def _by_column(c: Context, array: Value, function: Value) -> Array:
    lines = [tuple((x,) for x in column) for column in zip(*rows_of(c, array), strict=True)]
    return (tuple(_single(c, called(c, function, (line,))) for line in lines),)


def _constant(value: bool) -> Entry:
    return whole(0, 0, lambda c: value)


FUNCTIONS: dict[str, Entry] = {
    "IF": (2, 3, _if),
    "IFS": (2, MANY, _ifs),
    "CHOOSE": (2, MANY, _choose),
    "SWITCH": (3, MANY, _switch),
    "IFERROR": (2, 2, _catching(lambda error: True)),
    "IFNA": (2, 2, _catching(lambda error: error is Error.NA)),
    "AND": whole(1, MANY, _combined(all)),
    "OR": whole(1, MANY, _combined(any)),
    "XOR": whole(1, MANY, _combined(lambda found: sum(found) % 2 == 1)),
    "NOT": each("b", lambda c, holds: not holds),
    "TRUE": _constant(True),
    "FALSE": _constant(False),
    "LET": (3, MANY, _let),
    "LAMBDA": (1, MANY, _lambda),
    "MAP": whole(2, MANY, _map, arrays=True),
    "REDUCE": whole(3, 3, lambda c, *args: _running(c, *args)[-1][-1], arrays=True),
    "SCAN": whole(3, 3, lambda c, *args: tuple(map(tuple, _running(c, *args))), arrays=True),
    "BYROW": whole(2, 2, _by_row, arrays=True),
    "BYCOL": whole(2, 2, _by_column, arrays=True),
}
