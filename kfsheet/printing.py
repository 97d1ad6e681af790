"""Arithmetic as text, in one order for every language.

SymPy sorts the terms of a sum by its own canonical order, ``-a*x + i``. People write the
innovation as ``i - a*x``. The printers of kfsheet (Python, LaTeX, Excel) take
the human order from here, so that a formula looks the same wherever it is read.
"""

from __future__ import annotations

from sympy import (
    Add,
    Basic,
    Eq,
    Expr,
    Indexed,
    Integer,
    Mul,
    Number,
    Pow,
    Rational,
    S,
    Symbol,
    sympify,
)
from sympy import functions as sf
from sympy.core.function import Function, _coeff_isneg
from sympy.printing.codeprinter import CodePrinter
from sympy.printing.precedence import PRECEDENCE

from kfsheet.errors import PrintError

# Functions that neither Python's math module nor Excel 2010 has, by ones that both have.
# acot is SymPy's branch, (-pi/2, pi/2]: atan(1/x) with the point x = 0 added.
RARE_FUNCTIONS = {
    "cot": lambda x: 1 / sf.tan(x),
    "sec": lambda x: 1 / sf.cos(x),
    "csc": lambda x: 1 / sf.sin(x),
    "coth": lambda x: 1 / sf.tanh(x),
    "sech": lambda x: 1 / sf.cosh(x),
    "csch": lambda x: 1 / sf.sinh(x),
    "acot": lambda x: sf.Piecewise((S.Pi / 2, Eq(x, 0)), (sf.atan(1 / x), True)),
    "asec": lambda x: sf.acos(1 / x),
    "acsc": lambda x: sf.asin(1 / x),
    "acoth": lambda x: sf.atanh(1 / x),
    "asech": lambda x: sf.acosh(1 / x),
    "acsch": lambda x: sf.asinh(1 / x),
}


def human_terms(expression: Add) -> list[Expr]:
    """Terms of a sum as a person writes them: positive before negative, short before long."""
    return sorted(
        expression.as_ordered_terms(),
        key=lambda term: (_coeff_isneg(term), _size(term)),
    )


def _size(expression: Basic) -> int:
    """How long an expression looks: its nodes, a cell reference being one."""
    if isinstance(expression, Indexed) or not expression.args:
        return 1
    return 1 + sum(map(_size, expression.args))


def human_factors(expression: Mul) -> list[Expr]:
    """Factors of a product as a person writes them: number, scalars, functions, cells."""

    def rank(factor: Expr) -> tuple[int, str]:
        core = factor.base if isinstance(factor, Pow) else factor
        kinds = (Number, Symbol, Function, Indexed)
        place = next((n for n, kind in enumerate(kinds) if isinstance(core, kind)), len(kinds))
        return place, core.name if isinstance(core, Symbol) else ""

    return sorted(expression.as_ordered_factors(), key=rank)


class FormulaPrinter(CodePrinter):
    """Strict printer of real arithmetic; a language adds its tables and its own nodes.

    Only methods defined below this class are ever called: what CodePrinter inherits would
    print matrices, dictionaries or unknown functions as something that looks like a formula.
    """

    language = "a formula"
    power = "**"
    functions: dict[str, str] = {}
    constants: dict[str, str] = {}

    def doprint(self, expr: Expr) -> str:
        """The text of ``expr``; raises PrintError for a node the language lacks."""
        return self._print(sympify(expr))

    def _print(self, expr: Basic, **kwargs: object) -> str:
        for node in type(expr).__mro__:
            name = "_print_" + node.__name__
            if any(name in vars(cls) for cls in _ours(type(self))):
                return getattr(self, name)(expr)
        raise PrintError(
            f"{self.language} cannot express {type(expr).__name__} ({expr}); "
            "rewrite it with arithmetic, elementary functions and Piecewise"
        )

    # -- atoms ---------------------------------------------------------------------------

    def _print_Integer(self, expr: Integer) -> str:
        return str(expr.p)

    def _print_Rational(self, expr: Rational) -> str:
        return f"{expr.p}/{expr.q}"

    def _print_NumberSymbol(self, expr: Expr) -> str:
        name = type(expr).__name__
        if name not in self.constants:
            raise PrintError(f"{self.language} has no constant {expr}; make it a parameter")
        return self.constants[name]

    def _print_Infinity(self, expr: Expr) -> str:
        raise PrintError(f"{self.language} has no number {expr}; take the limit first")

    _print_NegativeInfinity = _print_ComplexInfinity = _print_NaN = _print_Infinity

    # -- arithmetic ----------------------------------------------------------------------

    def _print_Add(self, expr: Add) -> str:
        first, *rest = human_terms(expr)
        text = self.parenthesize(first, PRECEDENCE["Add"])
        if _coeff_isneg(first):
            text = self._negated(-first)
        for term in rest:
            sign, size = ("-", -term) if _coeff_isneg(term) else ("+", term)
            text += self.plus[sign] + self.parenthesize(size, PRECEDENCE["Add"])
        return text

    plus = {"+": " + ", "-": " - "}

    def _print_Mul(self, expr: Mul) -> str:
        if _coeff_isneg(expr):
            return self._negated(-expr)
        above, below = [], []
        for factor in human_factors(expr):
            if isinstance(factor, Rational):
                above += [Integer(factor.p)] if factor.p != 1 else []
                below += [Integer(factor.q)] if factor.q != 1 else []
            elif isinstance(factor, Pow) and _coeff_isneg(factor.exp):
                below.append(Pow(factor.base, -factor.exp, evaluate=factor.exp == -1))
            else:
                above.append(factor)
        return self._product(above) + (f"/{self._denominator(below)}" if below else "")

    def _product(self, factors: list[Expr]) -> str:
        return "*".join(self.parenthesize(f, PRECEDENCE["Mul"]) for f in factors) or "1"

    def _denominator(self, factors: list[Expr]) -> str:
        text = self._product(factors)
        return text if len(factors) == 1 else f"({text})"

    def _print_Pow(self, expr: Pow) -> str:
        base, exponent = expr.base, expr.exp
        if _coeff_isneg(exponent):
            return "1/" + self._denominator([Pow(base, -exponent, evaluate=exponent == -1)])
        if exponent == S.Half:
            return f"{self.functions['sqrt']}({self._print(base)})"
        level = PRECEDENCE["Pow"]
        return self.parenthesize(base, level) + self.power + self.parenthesize(exponent, level)

    def _negated(self, size: Expr) -> str:
        """Minus a term that is not itself negative."""
        return "-" + self.parenthesize(size, PRECEDENCE["Mul"], strict=isinstance(size, Mul))

    # -- functions -----------------------------------------------------------------------

    def _print_Function(self, expr: Function) -> str:
        name = type(expr).__name__
        if name in RARE_FUNCTIONS:
            return f"({self._print(RARE_FUNCTIONS[name](*expr.args))})"
        if name not in self.functions:
            raise PrintError(
                f"{self.language} has no function {name}, in {expr}; "
                "rewrite it with elementary functions"
            )
        return self._call(self.functions[name], *expr.args)

    def _call(self, function: str, *arguments: Basic) -> str:
        return f"{function}({self.comma.join(self._print(a) for a in arguments)})"

    comma = ", "

    def _print_exp(self, expr: Expr) -> str:
        return self._call(self.functions["exp"], *expr.args)

    def _print_Relational(self, expr: Basic) -> str:
        lhs, rhs = (self.parenthesize(side, PRECEDENCE["Relational"]) for side in expr.args)
        return f"{lhs}{self.relations[expr.rel_op]}{rhs}"

    relations = {op: f" {op} " for op in ("==", "!=", "<", "<=", ">", ">=")}


def _ours(cls: type) -> list[type]:
    return [c for c in cls.__mro__ if issubclass(c, FormulaPrinter)]
