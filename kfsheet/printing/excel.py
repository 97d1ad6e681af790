"""SymPy expression -> text of an Excel formula.

Excel's grammar differs from mathematics in one place that matters: its unary minus binds
*tighter* than ``^``. With 3 in A1, ``=-A1^2`` is 9 and ``=2*-A1^2`` is 18. It also reads
``2^3^2`` from the left, as 64. Hence: a minus before a power prints as ``-(...)``, and a power in
a power is parenthesised.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from openpyxl.utils import FORMULAE
from sympy import Basic, Expr, Indexed, Symbol

from kfsheet.errors import PrintError
from kfsheet.printing.excel_names import excel_name_problem
from kfsheet.printing.formula_printer import FormulaPrinter

Names = Mapping[Basic, str] | Callable[[Basic], str | None]

SAME_NAME = "exp sqrt sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh sign"
FUNCTIONS = {name: name.upper() for name in SAME_NAME.split()} | {
    "log": "LN",
    "Abs": "ABS",
    "Min": "MIN",
    "Max": "MAX",
    "floor": "INT",
    "Mod": "MOD",
    "Observed": "ISNUMBER",
}
AGGREGATES = {
    "Mean": "AVERAGE({0})",
    "RMS": "SQRT(SUMSQ({0})/COUNT({0}))",
    "Std": "STDEV({0})",
    "Sum": "SUM({0})",
    "Count": "COUNT({0})",
    "Largest": 'IF(COUNT({0})>0,MAX({0}),"")',
    "Smallest": 'IF(COUNT({0})>0,MIN({0}),"")',
    "SumProduct": "SUMPRODUCT({0},{1})",
}
HARD_LIMIT = 255
EXCEL_DIGITS = 15

assert {*FUNCTIONS.values(), "ATAN2", "PI", "IF", "AND", "OR", "NOT"} <= set(FORMULAE)


class ExcelPrinter(FormulaPrinter):
    """Printer of one formula, without the leading ``=``; see :func:`excel_code`."""

    language = "Excel"
    power = "^"
    plus = {"+": "+", "-": "-"}
    comma = ","
    relations = {"==": "=", "!=": "<>", "<": "<", "<=": "<=", ">": ">", ">=": ">="}
    constants = {"Pi": "PI()", "Exp1": "EXP(1)"}
    functions = FUNCTIONS

    def __init__(self, names: Names | None = None) -> None:
        super().__init__()
        self._names = names if callable(names) else (names or {}).get

    def _print_Symbol(self, expr: Symbol) -> str:
        name = self._names(expr)
        if name is None and (problem := excel_name_problem(expr.name)):
            raise PrintError(f"symbol {expr}: {problem}; give it a cell or a name in names=")
        return name or expr.name

    def _print_Indexed(self, expr: Indexed) -> str:
        name = self._names(expr)
        if name is None:
            raise PrintError(f"{expr} has no cell; give it one in names=")
        return name

    _print_IndexedBase = _print_Indexed

    def _print_Float(self, expr: Expr) -> str:
        text = repr(float(expr)).replace("e", "E")
        # Zeros at either end are not counted by Excel either.
        digits = text.split("E")[0].lstrip("-").replace(".", "").strip("0")
        if len(digits) > EXCEL_DIGITS:
            raise PrintError(
                f"Excel keeps {EXCEL_DIGITS} digits of a number in a formula and {text} has "
                f"{len(digits)}; make it a parameter (a cell keeps all) or a Rational"
            )
        return text.removesuffix(".0")

    def _print__Missing(self, expr: Expr) -> str:
        return '""'

    def _minus(self, text: str) -> str:
        """Minus a product; a power that comes first is put into parentheses of its own.

        ``-(a^2)*b``, not ``-(a^2*b)``: IronCalc 0.9.1 drops the latter's when it loads a file.
        """
        end, power = _first_factor(text)
        return f"-({text[:end]}){text[end:]}" if power else f"-{text}"

    def _print_Min(self, expr: Expr) -> str:
        return self._call(self.functions[type(expr).__name__], *expr.args)

    _print_Max = _print_Mod = _print_Observed = _print_Min

    def _print_atan2(self, expr: Expr) -> str:
        # Excel's order of the arguments is the other way round.
        y, x = expr.args
        return self._call("ATAN2", x, y)

    def _print_ceiling(self, expr: Expr) -> str:
        # Excel's CEILING takes a second argument, and programs differ for negative numbers.
        return f"(-INT({self._print(-expr.args[0])}))"

    def _print_Piecewise(self, expr: Basic) -> str:
        *branches, (last, condition) = expr.args
        if condition != True:  # noqa: E712 - a SymPy condition, not a Python one
            raise PrintError(f"Piecewise without an otherwise branch: {expr}; IF would be FALSE")
        text = self._print(last)
        for value, test in reversed(branches):
            text = f"IF({self._print(test)},{self._print(value)},{text})"
        return text

    def _print_ITE(self, expr: Basic) -> str:
        return self._call("IF", *expr.args)

    def _print_And(self, expr: Basic) -> str:
        return self._call("AND", *expr.args)

    def _print_Or(self, expr: Basic) -> str:
        return self._call("OR", *expr.args)

    def _print_Not(self, expr: Basic) -> str:
        return self._call("NOT", *expr.args)

    def _print_BooleanAtom(self, expr: Basic) -> str:
        return "TRUE" if expr else "FALSE"

    def _print_Aggregate(self, expr: Expr) -> str:
        name = type(expr).__name__
        if name == "Last":
            return self._print_Indexed(expr)
        return AGGREGATES[name].format(*map(self._print, expr.args))


def _first_factor(text: str) -> tuple[int, bool]:
    """Where the first factor of a product ends, and whether it is a power."""
    depth, quoted, power = 0, False, False
    for place, character in enumerate(text):
        quoted ^= character == "'"
        depth += (character == "(") - (character == ")")
        if depth == 0 and not quoted:
            if character in "*/":
                return place, power
            power |= character == "^"
    return len(text), power


def excel_code(expr: Expr, names: Names | None = None) -> str:
    """Text of the Excel formula, without ``=``, that computes ``expr``.

    Parameters
    ----------
    expr : Expr
        Real arithmetic: Add, Mul, Pow, Rational, Float (at most 15 digits), pi, E, sqrt, exp, log,
        trigonometric and hyperbolic functions and their inverses, atan2, sign, Abs, Min, Max,
        floor, ceiling, Mod, Piecewise with relations, And, Or, Not; and kfsheet's Observed,
        Missing and aggregates.
    names : mapping or callable, optional
        Cell reference or defined name for each symbol, ``x[t - 1]`` or column; a symbol that
        ``names`` does not know prints as its own name.

    Raises
    ------
    PrintError
        For a node that has no equivalent in Excel 2010, naming it, and for a formula of more than
        255 characters.

    Examples
    --------
    >>> from sympy import symbols
    >>> a, b_x, r_i = symbols("a b_x r_i")
    >>> excel_code(a*b_x/(r_i + a**2*b_x))
    'a*b_x/(r_i+a^2*b_x)'
    >>> excel_code(-a**2)
    '-(a^2)'
    """
    text = ExcelPrinter(names).doprint(expr)
    if len(text) > HARD_LIMIT:
        raise PrintError(
            f"the formula of {len(text)} characters is too long to audit (limit {HARD_LIMIT}): "
            f"{text[:60]}...; give a part of it a column of its own"
        )
    return text
