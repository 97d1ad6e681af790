"""A recurrence as Python source that reads like the loop a student would write."""

from __future__ import annotations

import inspect
import math
import re
import textwrap
from typing import TYPE_CHECKING

from sympy import Basic, Expr, Indexed, Piecewise, Symbol
from sympy.printing.precedence import PRECEDENCE

from kfsheet import numerics
from kfsheet.errors import PrintError
from kfsheet.expressions import Aggregate
from kfsheet.printing import FormulaPrinter

if TYPE_CHECKING:
    from kfsheet.parts import Column, Scalar
    from kfsheet.recurrence import Recurrence
    from kfsheet.schedule import Pass


class PythonPrinter(FormulaPrinter):
    """Python source over the names of the math module and of :mod:`kfsheet.numerics`."""

    language = "Python"
    constants = {"Pi": "pi", "Exp1": "exp(1)"}
    functions = {
        name: name
        for name in (
            "sqrt exp log sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh "
            "sign floor"
        ).split()
    } | {"Abs": "abs", "Min": "min", "Max": "max", "ceiling": "ceil"}

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

    def _print_Aggregate(self, expr: Aggregate) -> str:
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


def python_source(model: Recurrence) -> str:
    """A module with one function that computes every column and scalar of ``model``.

    The function takes the data columns as lists and the parameters by keyword; it returns two
    dictionaries, columns by name and scalars by name. The module needs the standard library only.
    """
    body = [*_head(model), *_scalar_lines(model.derived_scalars.values())]
    body += _table_lines(model)
    for step in model.passes():
        body += [*_row_lines(model, step), *_scalar_lines(step.summaries)]
    body += _return_lines(model)
    text = "\n".join(body)
    return f"{_prelude(text)}\n\n\n{text}\n"


def _head(model: Recurrence) -> list[str]:
    data = [c.name for c in model.all_columns() if c.is_data]
    lines = [f"def {model.name}(", f"    {', '.join(data)}," if data else ""]
    lines += ["    *,"] if model.parameters else []
    for p in model.parameters.values():
        lines.append(
            f"    {p.name}={p.value!r},  # {p.unit + ': ' if p.unit else ''}{p.description}"
        )
    return [*filter(None, lines), "):", f'    """{model.title}."""']


def _scalar_lines(scalars: list[Scalar]) -> list[str]:
    return [f"    {s.name} = {python_code(s.expression)}" for s in scalars]


def _table_lines(model: Recurrence) -> list[str]:
    data = next((c.name for c in model.all_columns() if c.is_data), None)
    formulas = [c.name for c in model.all_columns() if not c.is_data]
    return [
        "",
        f"    rows = {f'len({data})' if data else model.rows}",
        *_wrapped(", ".join(formulas) + ","),
        f"    ) = ([nan] * rows for _ in range({len(formulas)}))",
    ]


def _wrapped(text: str) -> list[str]:
    return ["    (", *textwrap.wrap(text, 88, initial_indent=" " * 8, subsequent_indent=" " * 8)]


def _row_lines(model: Recurrence, step: Pass) -> list[str]:
    """The start rows one by one, then the loop; a start row that fits into the loop goes there."""
    general = step.rows[-1]
    if not general:
        return []
    alone = len(step.rows) - 1
    while alone > 1 and _fits(general, step.rows[alone - 1], alone - 1):
        alone -= 1
    lines = []
    for row in range(alone):
        lines += ["", f"    t = {row}"]
        lines += [f"    {c.name}[t] = {python_value(c.definition(row))}" for c in step.rows[row]]
    lines += ["", f"    for t in range({f'{alone}, ' if alone else ''}rows):"]
    return lines + [line for c in general for line in _loop_lines(c, alone)]


def _loop_lines(column: Column, first: int) -> list[str]:
    """A column inside the loop, which begins with row ``first``."""
    lines, word = [], "if"
    for row in range(first, len(column.start)):
        lines.append(f"        {word} t == {row}:")
        lines.append(f"            {column.name}[t] = {python_value(column.start[row])}")
        word = "elif"
    general = f"{column.name}[t] = {python_value(column.expression)}"
    return [*lines, "        else:", f"    {' ' * 8}{general}"] if lines else [f"        {general}"]


def _fits(general: tuple[Column, ...], columns: tuple[Column, ...], row: int) -> bool:
    """Whether the order of the loop is good for a start row too."""
    from kfsheet.schedule import same_row

    seen = {c.name for c in general} - {c.name for c in columns}
    for column in general:
        if same_row(column.definition(row)) & {c.name for c in general} - seen:
            return False
        seen.add(column.name)
    return True


def _return_lines(model: Recurrence) -> list[str]:
    """Every column and scalar by name."""
    scalars = [*model.derived_scalars, *model.summaries]
    lines = [""]
    for name, keys in (("columns", [c.name for c in model.all_columns()]), ("scalars", scalars)):
        _, *rest = _wrapped(", ".join(f"{key}={key}" for key in keys))
        lines += [f"    {name} = dict(", *rest, "    )"]
    return [*lines, "    return columns, scalars"]


def _prelude(text: str) -> str:
    """Imports and copies of the helpers that ``text`` uses, and that those use in turn."""
    helpers = {n: f for n, f in vars(numerics).items() if inspect.isfunction(f)}
    own = {n: inspect.getsource(f).strip() for n, f in helpers.items()}
    used: list[str] = []
    while fresh := [n for n in own if n not in used and _calls(n, text + _join(own, used))]:
        used += fresh
    source = text + _join(own, used)
    constants = [n for n in ("nan", "pi") if re.search(rf"\b{n}\b", source)]
    names = [n for n, f in vars(math).items() if callable(f) and _calls(n, source)] + constants
    imports = f"from math import {', '.join(sorted(names))}" if names else ""
    return "\n\n\n".join(filter(None, [imports, _join(own, [n for n in own if n in used])]))


def _join(sources: dict[str, str], names: list[str]) -> str:
    return "\n\n\n".join(sources[n] for n in names)


def _calls(name: str, text: str) -> bool:
    return re.search(rf"(?<!def )\b{name}\(", text) is not None
