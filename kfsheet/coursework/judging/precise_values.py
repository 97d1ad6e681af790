"""The value of an expression at one point, to 30 figures, by a spreadsheet's rules.

An expression is worth a number, or :data:`MISSING` where it has no value on purpose (an empty
text); what a spreadsheet would show as an error raises :class:`NoValueError`. MPFR does the
numbers, by way of gmpy2. An expression is asked for at dozens of points, so it is first made into
functions that call each other, one for each of its nodes.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from functools import lru_cache, reduce
from typing import Any

import gmpy2
from gmpy2 import mpfr
from sympy import And, Basic, Indexed, Not, Or, Piecewise, Rational, S
from sympy.core.relational import Relational
from sympy.logic.boolalg import ITE

from kfsheet.model.expressions import Missing, Observed, lag, t

DIGITS = 30
BITS = 110  # a few more than 30 digits need
LARGEST = mpfr("1e300")
ZERO = mpfr(0)
FARTHEST_ANGLE = mpfr("1e15")  # spreadsheets refuse to take the sine of more


class NoValueError(ArithmeticError):
    """A spreadsheet would show an error here."""


class _Missing:
    def __repr__(self) -> str:
        return "MISSING"


MISSING = _Missing()
Value = Any
"""An mpfr or MISSING."""
LookUp = Callable[[str, int], Value]
"""Value of a scalar (row 0), or of a column in a row; None for an empty cell, which counts as 0
in arithmetic."""
Program = Callable[[LookUp, int], Value]
"""Value of an expression where a look-up and a row are given."""
Test = Callable[[LookUp, int], bool]

_context = gmpy2.context(precision=BITS)


def exact(value: float) -> mpfr:
    """A number of a spreadsheet, to calculate with."""
    return mpfr(value, BITS)


def is_real(value: Value | str) -> bool:
    """Whether a value is a number."""
    return isinstance(value, mpfr)


def value_of(expression: Basic, look_up: LookUp, row: int) -> Value:
    """The value of an expression in a row; ``look_up`` gives that of scalars and cells."""
    return _program(expression)(look_up, row)


@lru_cache(maxsize=10_000)
def cell_of(node: Indexed) -> tuple[str, bool, int]:
    """Column of a cell reference, whether its row is fixed, and the row or the lag."""
    index = node.indices[0]
    fixed = bool(index.is_Integer)
    return str(node.base.label), fixed, int(index if fixed else lag(node))


# -- expressions as functions --------------------------------------------------------------


@lru_cache(maxsize=20_000)
def _program(e: Basic) -> Program:
    if e is Missing:
        return lambda look_up, row: MISSING
    if e == t:
        return lambda look_up, row: exact(row)
    if reference := _reference(e):
        return lambda look_up, row: ZERO if (v := reference(look_up, row)) is None else v
    if isinstance(e, Piecewise):
        return _choice(e)
    if e.is_Number or e.is_NumberSymbol:
        return _literal(e)
    return _computed(e)


def _reference(e: Basic) -> Program | None:
    """How to find what a symbol or a cell holds; None for anything else."""
    if e.is_Symbol and e != t:
        scalar = e.name
        return lambda look_up, row: look_up(scalar, 0)
    if not isinstance(e, Indexed):
        return None
    name, fixed, place = cell_of(e)
    if fixed:
        return lambda look_up, row: look_up(name, place)
    return lambda look_up, row: look_up(name, row - place)


def _choice(e: Piecewise) -> Program:
    branches = [(_program(value), _test(condition)) for value, condition in e.args]

    def value(look_up: LookUp, row: int) -> Value:
        for branch, holds in branches:
            if holds(look_up, row):
                return branch(look_up, row)
        return MISSING

    return value


def _literal(e: Basic) -> Program:
    if not e.is_finite:
        return _refusal("the result is no real number")
    number = Rational(e.evalf(DIGITS + 10)) if e.is_NumberSymbol else Rational(e)
    quotient = _context.div(number.p, number.q)
    return lambda look_up, row: quotient


def _refusal(reason: str) -> Program:
    def value(look_up: LookUp, row: int) -> Value:
        raise NoValueError(reason)

    return value


def _computed(e: Basic) -> Program:
    function = FUNCTIONS.get(type(e).__name__)
    if function is None:
        return _refusal(f"{type(e).__name__} has no value")
    arguments = [_program(a) for a in e.args]

    def value(look_up: LookUp, row: int) -> mpfr:
        numbers = [argument(look_up, row) for argument in arguments]
        if MISSING in numbers:
            raise NoValueError("arithmetic with a text")
        try:
            result = function(*numbers)
        except (ArithmeticError, ValueError, TypeError) as error:
            raise NoValueError(str(error)) from None
        if not -LARGEST < result < LARGEST:  # as with what is not a number at all
            raise NoValueError("the result is no real number")
        return result

    return value


@lru_cache(maxsize=20_000)
def _test(e: Basic) -> Test:
    if e in (S.true, S.false):
        holds = e == S.true
        return lambda look_up, row: holds
    if isinstance(e, Observed):
        return _observed(e.args[0])
    if isinstance(e, And | Or | Not | ITE):
        return _connected(e)
    if not isinstance(e, Relational):
        return _refusal(f"{type(e).__name__} is no condition")
    compare, left, right = RELATIONS[e.rel_op], _program(e.lhs), _program(e.rhs)

    def relation(look_up: LookUp, row: int) -> bool:
        numbers = left(look_up, row), right(look_up, row)
        if MISSING in numbers:
            raise NoValueError("a comparison with a text")
        return compare(*numbers)

    return relation


def _connected(e: Basic) -> Test:
    tests = [_test(a) for a in e.args]
    if isinstance(e, Not):
        return lambda look_up, row: not tests[0](look_up, row)
    if isinstance(e, ITE):
        return lambda look_up, row: tests[1 if tests[0](look_up, row) else 2](look_up, row)
    combine = all if isinstance(e, And) else any
    # Every one of them: an error in one is an error of the whole.
    return lambda look_up, row: combine([test(look_up, row) for test in tests])


def _observed(e: Basic) -> Test:
    program = _reference(e) or _program(e)

    def there(look_up: LookUp, row: int) -> bool:
        try:
            return program(look_up, row) not in (None, MISSING)
        except NoValueError:
            return False

    return there


# -- a spreadsheet's functions -------------------------------------------------------------


def _angle(function: Callable[[mpfr], mpfr]) -> Callable[[mpfr], mpfr]:
    """A function of an angle, which no spreadsheet takes of a very large one."""

    def apply(x: mpfr) -> mpfr:
        if not -FARTHEST_ANGLE <= x <= FARTHEST_ANGLE:
            raise NoValueError("an angle beyond all numbers")
        return function(x)

    return apply


def _power(base: mpfr, exponent: mpfr) -> mpfr:
    if base == 0 and exponent <= 0:
        raise NoValueError("a power of zero")
    return _context.pow(base, exponent)


def _modulo(a: mpfr, b: mpfr) -> mpfr:
    return difference(a, _context.mul(b, _context.floor(_context.div(a, b))))


# The operators of Python would round to the precision of a double.
difference: Callable[[mpfr, mpfr], mpfr] = _context.sub
size: Callable[[mpfr], mpfr] = _context.abs
FUNCTIONS: dict[str, Callable[..., mpfr]] = {
    name: getattr(_context, name)
    for name in "exp log sqrt asin acos atan atan2 sinh cosh tanh asinh acosh atanh floor".split()
} | {
    "sin": _angle(_context.sin),
    "cos": _angle(_context.cos),
    "tan": _angle(_context.tan),
    "ceiling": _context.ceil,
    "sign": lambda x: exact(gmpy2.sign(x)),
    "Add": lambda *terms: reduce(_context.add, terms),
    "Mul": lambda *factors: reduce(_context.mul, factors),
    "Pow": _power,
    "Abs": size,
    "Min": min,
    "Max": max,
    "Mod": _modulo,
}  # fmt: skip
RELATIONS: dict[str, Callable[[mpfr, mpfr], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
