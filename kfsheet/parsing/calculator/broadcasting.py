"""Functions of single values, used on whole arrays; and how functions are put into tables.

A table's entry is ``(least, most, build)``: how many arguments a function takes, and what makes a
closure of their trees. ``each`` and ``whole`` make entries of plain Python functions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from kfsheet.errors import KfsheetError
from kfsheet.parsing.calculator.values import (
    EMPTY,
    LARGEST,
    Area,
    Array,
    Context,
    Error,
    FailedError,
    Program,
    Scalar,
    Value,
    areas_of,
    is_reference,
    number,
    text,
    truth,
)

MANY = 255
"""Arguments that a function takes at most."""


class Compiler(Protocol):
    """What a table's entry needs to make closures of its arguments."""

    arrays: bool
    of_arrays: Compiler

    def raw(self, tree: tuple) -> Program:
        """The value of a node; a reference stays one."""
        ...

    def operand(self, tree: tuple) -> Program:
        """The value of a node, never a reference."""
        ...


Entry = tuple[int, int, Callable[..., Program]]


def intersect(c: Context, value: Value) -> Scalar:
    """The one cell of a range that stands in the formula's own row or column."""
    if type(value) is tuple:
        return value[0][0]
    if not is_reference(value):
        return value
    area, *more = areas_of(value)
    _, row, column = c.host
    if more or area.height > 1 < area.width:
        return Error.VALUE
    y = area.top if area.height == 1 else row
    x = area.left if area.width == 1 else column
    inside = area.top <= y <= area.bottom and area.left <= x <= area.right
    return c.cell(area.sheet, y, x) if inside else Error.VALUE


def settled(c: Context, function: Callable[..., Value], *arguments: Any) -> Value:
    """The result of a function, with what Python raises as the error that a cell shows."""
    try:
        result = function(c, *arguments)
    except KfsheetError:
        raise
    except FailedError as failed:
        return failed.error
    except ZeroDivisionError:
        return Error.DIV0
    except (ArithmeticError, ValueError):
        return Error.NUM
    if type(result) is c.arithmetic.kind and not -LARGEST <= result <= LARGEST:
        return Error.NUM
    return result


def broadcast(c: Context, function: Callable[..., Scalar], *values: Value) -> Array:
    """A function of scalars over arrays; what is one row, column or cell serves for all.

    Where one array has a cell and another, longer than one, has none, stands #N/A.
    """
    arrays = [v if type(v) is tuple else ((v,),) for v in values]
    height, width = max(map(len, arrays)), max(len(a[0]) for a in arrays)
    c.spend(height * width)
    return tuple(
        tuple([function(c, *(_item(a, y, x) for a in arrays)) for x in range(width)])
        for y in range(height)
    )


def _item(array: Array, y: int, x: int) -> Scalar:
    y, x = (y if len(array) > 1 else 0), (x if len(array[0]) > 1 else 0)
    return array[y][x] if y < len(array) and x < len(array[0]) else Error.NA


def lifted(c: Context, function: Callable[..., Scalar], *values: Value) -> Value:
    """A function of scalars at scalars, or over arrays if one of its arguments is one."""
    if tuple in map(type, values):
        return broadcast(c, lambda c, *cells: settled(c, function, *cells), *values)
    return settled(c, function, *values)


def whole_number(c: Context, value: Scalar) -> int | Error:
    """A scalar as the whole number that is left when its fraction is cut off."""
    x = number(c, value)
    return x if type(x) is Error else int(c.arithmetic.to_float(x))


READERS: dict[str, Callable[[Context, Scalar], Any]] = {
    "n": number,
    "t": text,
    "b": truth,
    "i": whole_number,
    "v": lambda c, value: value,
}


def each(kinds: str, function: Callable[..., Scalar], least: int | None = None) -> Entry:
    """An entry for a function of scalars.

    Parameters
    ----------
    kinds : str
        For each argument a letter: n a number, t a text, b a truth value, i a whole number, v a
        scalar as it is; in capitals, an error there is none of the result.
    function : callable
        ``function(context, *arguments)``.
    least : int, optional
        How many arguments must be there; the others are left to the function's defaults.
    """
    readers = [READERS[kind.lower()] for kind in kinds]
    caught = [kind.isupper() for kind in kinds]

    def at(c: Context, *scalars: Scalar) -> Scalar:
        given = []
        for reader, catches, scalar in zip(readers, caught, scalars, strict=False):
            item = reader(c, scalar)
            if type(item) is Error and not catches:
                return item
            given.append(item)
        return function(c, *given)

    def build(compiler: Compiler, *trees: tuple) -> Program:
        if len(trees) == 1:
            return _of_one(function, at, compiler.operand(trees[0]), kinds[0] == "n")
        arguments = [compiler.operand(tree) for tree in trees]
        return lambda c: lifted(c, at, *[argument(c) for argument in arguments])

    return (len(kinds) if least is None else least), len(kinds), build


def _of_one(function: Callable, at: Callable, argument: Program, of_number: bool) -> Program:
    def value(c: Context) -> Value:
        x = argument(c)
        if of_number and type(x) is float:  # the most frequent case, without detours
            return settled(c, function, x)
        return lifted(c, at, x)

    return value


def whole(
    least: int,
    most: int,
    function: Callable[..., Value],
    *,
    arrays: bool = False,
    single: int | None = None,
) -> Entry:
    """An entry for a function of whole values: references, arrays, scalars, as they come.

    With ``arrays``, ranges in its arguments are calculated with as a whole in every formula.
    ``single`` is the place of an argument that is one value, as the criterion of COUNTIF is: in
    an array formula, a range there gives an array of results.
    """

    def build(compiler: Compiler, *trees: tuple) -> Program:
        inner = compiler.of_arrays if arrays else compiler
        arguments = [
            compiler.operand(tree) if place == single else inner.raw(tree)
            for place, tree in enumerate(trees)
        ]
        return lambda c: settled(c, function, *[argument(c) for argument in arguments])

    return least, most, build


def scalar(c: Context, value: Value) -> Scalar:
    """A value where only one will do; an error fails the function."""
    if is_reference(value) or type(value) is tuple:
        value = intersect(c, value)
    if type(value) is Error:
        raise FailedError(value)
    return value


def argument(kind: str, c: Context, value: Value, default: Any = None) -> Any:
    """A value as an argument of one of the kinds of :func:`each`."""
    if value is EMPTY and default is not None:
        return default
    found = READERS[kind](c, scalar(c, value))
    if type(found) is Error:
        raise FailedError(found)
    return found


def area_of(value: Value) -> Area:
    """A value that must be one rectangle of cells."""
    if type(value) is Error:
        raise FailedError(value)
    if type(value) is not Area:
        raise FailedError(Error.VALUE)
    return value
