"""Expressions as Python source, in names that a student would write."""

from __future__ import annotations

from sympy import Basic, Expr, Indexed, Piecewise, Symbol
from sympy.printing.precedence import PRECEDENCE

from kfsheet.errors import PrintError
from kfsheet.printing.formula_printer import FormulaPrinter


class PythonPrinter(FormulaPrinter):
    """Python source over the names of the math module and of :mod:`kfsheet.evaluation.numerics`."""

    language = "Python"
    constants = {"Pi": "pi", "Exp1": "exp(1)"}
    functions = {
        name: name
        for name in (
            "sqrt exp log sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh "
            "sign floor"
        ).split()
    } | {"Abs": "fabs", "Min": "min", "Max": "max", "ceiling": "ceil"}

    def _print_Symbol(self, expr: Symbol) -> str:
        return expr.name

    def _print_Indexed(self, expr: Indexed) -> str:
        return f"{expr.base.label}[{self._print(expr.indices[0])}]"

    def _print_IndexedBase(self, expr: Basic) -> str:
        return str(expr.label)

    def _print_Float(self, expr: Expr) -> str:
        return repr(float(expr))

    def _print__Missing(self, expr: Expr) -> str:
        return "nan"

    def _print_Mod(self, expr: Expr) -> str:
        dividend, divisor = (self.parenthesize(x, PRECEDENCE["Pow"]) for x in expr.args)
        return f"{dividend} % {divisor}"

    def _print_Min(self, expr: Expr) -> str:
        return self._call(self.functions[type(expr).__name__], *expr.args)

    _print_Max = _print_Min

    def _print_Observed(self, expr: Basic) -> str:
        return self._call("observed", *expr.args)

    def _print_Aggregate(self, expr: Expr) -> str:
        name = type(expr).__name__.lower()
        return self._call("total" if name == "sum" else name, *expr.args)

    def _print_Piecewise(self, expr: Basic) -> str:
        *branches, (last, condition) = expr.args
        if condition != True:  # noqa: E712 - a SymPy condition, not a Python one
            raise PrintError(f"Piecewise without an otherwise branch: {expr}")
        pieces = [f"{self.value(value)} if {self._print(test)} else " for value, test in branches]
        return f"({''.join(pieces)}{self.value(last)})"

    def value(self, expr: Expr) -> str:
        """A whole value of a cell: 0.0, not 0, lest a recurrence computes in long integers."""
        return f"{expr}.0" if expr.is_Integer else self._print(expr)

    def _print_ITE(self, expr: Basic) -> str:
        test, yes, no = (self._print(a) for a in expr.args)
        return f"({yes} if {test} else {no})"

    def _print_And(self, expr: Basic) -> str:
        return f"({' and '.join(self._print(a) for a in expr.args)})"

    def _print_Or(self, expr: Basic) -> str:
        return f"({' or '.join(self._print(a) for a in expr.args)})"

    def _print_Not(self, expr: Basic) -> str:
        return f"(not {self._print(expr.args[0])})"

    def _print_BooleanAtom(self, expr: Basic) -> str:
        return str(bool(expr))


def python_code(expression: Expr) -> str:
    """Python source of an expression.

    >>> from sympy import symbols
    >>> a, b, r = symbols("a b r")
    >>> python_code(a*b/(r + a**2*b))
    'a*b/(r + a**2*b)'
    """
    text = PythonPrinter().doprint(expression)
    return text[1:-1] if isinstance(expression, Piecewise) else text


def python_value(expression: Expr) -> str:
    """Python source of the value of a cell: as :func:`python_code`, but a whole number is 0.0."""
    return f"{expression}.0" if expression.is_Integer else python_code(expression)
