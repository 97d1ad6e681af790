"""The text of formulas in kernels, and of the tests that find what is not finite."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Protocol

from sympy import Add, Expr, Indexed, Mul, Piecewise, Pow, S, Symbol

from kfsheet.model.expressions import Missing, lag, t
from kfsheet.printing.python import PythonPrinter

CHEAP = ("**", "fabs", "observed", "sign")
"""Calls, and the power of a whole number, that are plain arithmetic to a processor."""


class Source(Protocol):
    """Who writes a kernel: it knows where cells are, and is told of calls and divisions."""

    def cell(self, name: str, back: int) -> str:
        """A column in this row or in one before."""
        ...

    def whole(self, name: str) -> str:
        """A column as an array, for an aggregate."""
        ...

    def call(self, name: str, arguments: Sequence[Expr], text: str, in_branch: bool) -> str:
        """What is written for a call that would read ``text``."""
        ...

    def divide(self, factors: Sequence[Expr], text: str, in_branch: bool) -> None:
        """Told of every division: by which factors, as which text."""
        ...


class KernelPrinter(PythonPrinter):
    """A cell of this row is a local variable, one of a row before is another."""

    def __init__(self, source: Source) -> None:
        super().__init__()
        self._source = source
        self._branches = 0
        self._hiding = 0  # depth inside what may turn an infinite value into a finite one

    @contextmanager
    def _inside(self) -> Iterator[None]:
        """Prints what may turn an infinite value into a finite one."""
        self._hiding += 1
        try:
            yield
        finally:
            self._hiding -= 1

    def rule(self, expr: Expr) -> str:
        """The value of a cell.

        Of a cell that may be empty, every power is tested: inf - inf would pass for a gap.
        """
        if not expr.has(Missing):
            return self.doprint(expr)
        with self._inside():
            return self.doprint(expr)

    def _print_Symbol(self, expr: Symbol) -> str:
        # To a compiler the row is an integer of 64 bits, and its powers would wrap around.
        return "float(t)" if expr == t else super()._print_Symbol(expr)

    def _print_Mod(self, expr: Expr) -> str:
        with self._inside():
            text = super()._print_Mod(expr)
        return self._source.call("%", expr.args, text, bool(self._branches))

    def _print_Indexed(self, expr: Indexed) -> str:
        return self._source.cell(str(expr.base.label), int(lag(expr)))

    def _print_IndexedBase(self, expr: Expr) -> str:
        return self._source.whole(str(expr.label))

    def _print_Piecewise(self, expr: Expr) -> str:
        self._branches += 1
        try:
            with self._inside():
                return super()._print_Piecewise(expr)
        finally:
            self._branches -= 1

    def _denominator(self, factors: list[Expr]) -> str:
        with self._inside():
            text = super()._denominator(factors)
        self._source.divide(factors, text, bool(self._branches))
        return text

    def _call(self, name: str, *arguments: Expr) -> str:
        with self._inside():
            text = super()._call(name, *arguments)
        return self._source.call(name, arguments, text, bool(self._branches))

    def _print_Pow(self, expr: Expr) -> str:
        exponent = expr.exp
        if exponent.is_Number and exponent < 0:
            return super()._print_Pow(expr)  # a division
        if not exponent.is_Integer and exponent != S.Half:
            return self._call("power", expr.base, exponent)
        name, text = "sqrt" if exponent == S.Half else "**", super()._print_Pow(expr)
        if self._hiding:
            # Python refuses a power that overflows; in a sum it is seen at the end of the row.
            name, text = "bounded", f"bounded({text})"
        return self._source.call(name, (expr,), text, bool(self._branches))


def unless_missing(name: str) -> str:
    """0, or NaN for what is infinite; missing values are fine."""
    return f"(0.0 if isnan({name}) else {name} - {name})"


@lru_cache(maxsize=4096)
def carried(rule: Expr) -> frozenset[str]:
    """Columns whose infinite or undefined value makes that of ``rule`` so too, in any case.

    Those of this row or of the one before: so what is carried on is seen in the last row.
    """
    if isinstance(rule, Indexed):
        return frozenset({str(rule.base.label)} if lag(rule) <= 1 else ())
    if isinstance(rule, Piecewise):
        return frozenset.intersection(*(carried(value) for value, _ in rule.args))
    if isinstance(rule, Add | Mul) or (isinstance(rule, Pow) and rule.exp.is_positive):
        terms = rule.args[:1] if isinstance(rule, Pow) else rule.args
        return frozenset().union(*map(carried, terms))
    return frozenset()


def balanced(terms: list[str]) -> str:
    """A sum in pairs, so that no addition waits for all of those before."""
    while len(terms) > 1:
        terms = [f"({' + '.join(terms[n : n + 2])})" for n in range(0, len(terms), 2)]
    return terms[0]


PRELUDE = '''"""Generated by kfsheet; this file may be deleted at any time."""

from math import asinh, atan, atan2, cos, fabs, isnan, nan, pi, sin, tan, tanh

from numpy import empty

from kfsheet.evaluation.fastmath import (
    acos, acosh, asin, atanh, bounded, ceil, cosh, count, exp, floor, largest, last, log, mean,
    observed, power, rms, sign, sinh, smallest, sqrt, std, sumproduct, total
)

'''
