"""The value of an expression at one point, to 30 figures, by a spreadsheet's rules.

An expression is worth a number, or :data:`MISSING` where it has no value on purpose (an empty
text); what a spreadsheet would show as an error raises :class:`NoValueError`. mpmath does the
numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
from mpmath import mpf
from sympy import And, Basic, Indexed, Not, Or, Piecewise, S
from sympy.core.relational import Relational
from sympy.logic.boolalg import ITE

from kfsheet.expressions import Missing, Observed, t

DIGITS = 30
LARGEST = mpf(10) ** 300


class NoValueError(ArithmeticError):
    """A spreadsheet would show an error here."""


class _Missing:
    def __repr__(self) -> str:
        return "MISSING"


MISSING = _Missing()
Value = Any
"""An mpf or MISSING."""
LookUp = Callable[[Basic, int], Value]
"""Value of a symbol or ``column[row]``; None for an empty cell, which counts as 0 in arithmetic."""


def value_of(expression: Basic, look_up: LookUp, row: int) -> Value:
    """The value of an expression in a row; ``look_up`` gives that of symbols and cells."""
    with mpmath.workdps(DIGITS):
        return _Evaluator(look_up, row).value(expression)


class _Evaluator:
    def __init__(self, look_up: LookUp, row: int) -> None:
        self._look_up, self._row = look_up, row

    def value(self, e: Basic) -> Value:
        if e is Missing:
            return MISSING
        if e == t:
            return mpf(self._row)
        if e.is_Symbol or isinstance(e, Indexed):
            found = self._look_up(e, self._row)
            return mpf(0) if found is None else found
        if isinstance(e, Piecewise):
            return self._choice(e)
        if e.is_Number or e.is_NumberSymbol:
            return _literal(e)
        return self._computed(e)

    def number(self, e: Basic) -> mpf:
        value = self.value(e)
        if value is MISSING:
            raise NoValueError("arithmetic with a text")
        return value

    def _choice(self, e: Piecewise) -> Value:
        for value, condition in e.args:
            if self.truth(condition):
                return self.value(value)
        return MISSING

    def _computed(self, e: Basic) -> mpf:
        function = FUNCTIONS.get(type(e).__name__)
        if function is None:
            raise NoValueError(f"{type(e).__name__} has no value")
        try:
            result = function(*(self.number(a) for a in e.args))
        except (ArithmeticError, ValueError, TypeError, MemoryError) as error:
            raise NoValueError(str(error)) from None
        if not isinstance(result, mpf) or not abs(result) < LARGEST:
            raise NoValueError("the result is no real number")
        return result

    def truth(self, e: Basic) -> bool:
        if e in (S.true, S.false):
            return e == S.true
        if isinstance(e, Observed):
            return self._observed(e.args[0])
        if isinstance(e, And | Or):
            return (all if isinstance(e, And) else any)([self.truth(a) for a in e.args])
        if isinstance(e, Not):
            return not self.truth(e.args[0])
        if isinstance(e, ITE):
            return self.truth(e.args[1] if self.truth(e.args[0]) else e.args[2])
        if not isinstance(e, Relational):
            raise NoValueError(f"{type(e).__name__} is no condition")
        return RELATIONS[e.rel_op](*(self.number(a) for a in e.args))

    def _observed(self, e: Basic) -> bool:
        try:
            if e.is_Symbol or isinstance(e, Indexed):
                return e == t or self._look_up(e, self._row) not in (None, MISSING)
            return self.value(e) is not MISSING
        except NoValueError:
            return False


def _literal(e: Basic) -> mpf:
    if not e.is_finite:
        raise NoValueError("the result is no real number")
    if e.is_Rational:
        return mpf(e.p) / e.q
    return mpf(e._to_mpmath(mpmath.mp.prec))


def _power(base: mpf, exponent: mpf) -> mpf:
    if base == 0 and exponent <= 0:
        raise NoValueError("a power of zero")
    if base and abs(exponent * mpmath.log(abs(base))) > 1_000:
        raise NoValueError("a power beyond all numbers")
    return mpmath.power(base, exponent)


def _bounded(function: Callable[[mpf], mpf]) -> Callable[[mpf], mpf]:
    """A function that grows, or costs, without bounds for large arguments."""

    def apply(x: mpf) -> mpf:
        if abs(x) > LIMITS.get(function.__name__, 1_000):
            raise NoValueError("an argument beyond all numbers")
        return mpf(function(x))

    return apply


LIMITS = dict.fromkeys(("sin", "cos", "tan"), 1e15)
FUNCTIONS: dict[str, Callable[..., mpf]] = {
    name: _bounded(getattr(mpmath, name))
    for name in "exp sin cos tan sinh cosh tanh".split()
} | {
    name: getattr(mpmath, name)
    for name in "sqrt log asin acos atan atan2 asinh acosh atanh sign floor ceil".split()
} | {
    "Add": lambda *terms: mpmath.fsum(terms),
    "Mul": lambda *factors: mpmath.fprod(factors),
    "Pow": _power,
    "Abs": abs,
    "Min": min,
    "Max": max,
    "Mod": lambda a, b: a - b * mpmath.floor(a / b),
}  # fmt: skip
FUNCTIONS["ceiling"] = FUNCTIONS.pop("ceil")
RELATIONS: dict[str, Callable[[mpf, mpf], bool]] = {
    "==": lambda a, b: a == b,
    "!=": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}
