"""The text of formulas over arrays, with conditions as ``where``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from sympy import Basic, Expr, Indexed, S, Symbol

from kfsheet.errors import PrintError
from kfsheet.model.expressions import lag, t
from kfsheet.printing.python import PythonPrinter

PARTIAL = {"sqrt", "exp", "log", "asin", "acos", "sinh", "cosh", "acosh", "atanh", "power"}
"""Functions that have no value somewhere, or one beyond 1e308."""


class ArrayPrinter(PythonPrinter):
    """Conditions as ``where``.

    NumPy computes all branches for all members. In a branch, what may have no value is given
    ``only(x, taken)``: x for the members that take it, a quiet NaN for the others.
    """

    def __init__(
        self,
        cell: Callable[[str, int], str],
        whole: Callable[[str], str],
        called: Callable[..., str],
        keep: Callable[[str], str],
    ) -> None:
        super().__init__()
        self._cell, self._whole, self._called, self._keep = cell, whole, called, keep
        self._taken = ""  # which members take the branch that is being printed; all without one

    def _print_Symbol(self, expr: Symbol) -> str:
        return "float64(t)" if expr == t else super()._print_Symbol(expr)

    def _print_Indexed(self, expr: Indexed) -> str:
        return self._cell(str(expr.base.label), int(lag(expr)))

    def _print_IndexedBase(self, expr: Basic) -> str:
        return self._whole(str(expr.label))

    def value(self, expr: Expr) -> str:
        """The value of a cell: NumPy's number, as Python's own overflows without an error."""
        return f"float64({self._print(expr)})" if expr.is_number else self._print(expr)

    # -- what may have no value --------------------------------------------------------------

    def _only(self, text: str) -> str:
        if not self._taken:
            return text
        return self._keep(f"only({text}, {self._keep(self._taken)})")

    def _denominator(self, factors: list[Expr]) -> str:
        text = super()._denominator(factors)
        return text if all(f.is_Number for f in factors) else self._only(text)

    def _print_Mod(self, expr: Expr) -> str:
        dividend, divisor = expr.args
        return f"({self._print(dividend)}) % ({self._only(self._print(divisor))})"

    def _call(self, function: str, *arguments: Basic) -> str:
        texts = [self._print(a) for a in arguments]
        if function in PARTIAL:
            texts = list(map(self._only, texts))
        elif function in ("floor", "ceil") and self._taken:
            texts.append(self._keep(self._taken))
        text = f"{function}({', '.join(texts)})"
        return self._called(function, arguments, text, bool(self._taken))

    def _print_Pow(self, expr: Expr) -> str:
        base, exponent = expr.args
        if exponent == S.Half:
            return self._call("sqrt", base)
        if exponent.is_Integer or (exponent.is_Number and exponent < 0):
            return super()._print_Pow(expr)
        # Python's ** would make a complex number of a negative one.
        return self._call("power", base, exponent)

    # -- conditions --------------------------------------------------------------------------

    def _print_Piecewise(self, expr: Basic) -> str:
        *branches, (last, condition) = expr.args
        if condition != True:  # noqa: E712 - a SymPy condition, not a Python one
            raise PrintError(f"Piecewise without an otherwise branch: {expr}")
        return self._branch([(test, value) for value, test in branches], last, self.value)

    def _print_ITE(self, expr: Basic) -> str:
        test, yes, no = expr.args
        return self._branch([(test, yes)], no, self._print)

    def _branch(self, branches: list, last: Basic, printed: Callable[[Any], str]) -> str:
        if not branches:
            return printed(last)
        (condition, value), *others = branches
        test = self._test(condition)
        yes = self._where(test, lambda: printed(value))
        no = self._where(f"logical_not({test})", lambda: self._branch(others, last, printed))
        if condition.free_symbols <= {t}:  # the same for all members
            return f"({yes} if {test} else {no})"
        return f"where({test}, {yes}, {no})"

    def _test(self, condition: Basic) -> str:
        """The name of a condition, which is evaluated before the formula that asks for it."""
        return self._keep(self._print(condition))

    def _where(self, test: str, printed: Callable[[], str]) -> str:
        """Print what only those members compute for whom a condition holds."""
        before = self._taken
        self._taken = f"{before} & {test}" if before else test
        try:
            return printed()
        finally:
            self._taken = before

    def _print_And(self, expr: Basic) -> str:
        return self._in_turn(expr.args, "&", "{}")

    def _print_Or(self, expr: Basic) -> str:
        return self._in_turn(expr.args, "|", "logical_not({})")

    def _in_turn(self, conditions: Sequence[Basic], sign: str, goes_on: str) -> str:
        """Conditions of which Python asks for the next one only if that before leaves it open."""
        first, *others = conditions
        test = self._test(first)
        if not others:
            return test
        rest = self._where(goes_on.format(test), lambda: self._in_turn(others, sign, goes_on))
        return f"({test} {sign} {rest})"

    def _print_Not(self, expr: Basic) -> str:
        return f"logical_not({self._print(expr.args[0])})"
