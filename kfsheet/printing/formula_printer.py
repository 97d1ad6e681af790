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


def _one_over(x: Expr) -> Expr:
    return Pow(x, -1, evaluate=False)


def _acot(x: Expr) -> Expr:
    """SymPy's branch, (-pi/2, pi/2]: atan(1/x) with the point x = 0 added."""
    rest = (sf.atan(_one_over(x), evaluate=False), True)
    return sf.Piecewise((S.Pi / 2, Eq(x, 0, evaluate=False)), rest, evaluate=False)


# Functions that neither Python's math module nor Excel 2010 has, by ones that both have.
RARE_FUNCTIONS = {
    "cot": lambda x: _one_over(sf.tan(x, evaluate=False)),
    "sec": lambda x: _one_over(sf.cos(x, evaluate=False)),
    "csc": lambda x: _one_over(sf.sin(x, evaluate=False)),
    "coth": lambda x: _one_over(sf.tanh(x, evaluate=False)),
    "sech": lambda x: _one_over(sf.cosh(x, evaluate=False)),
    "csch": lambda x: _one_over(sf.sinh(x, evaluate=False)),
    "acot": _acot,
    "asec": lambda x: sf.acos(_one_over(x), evaluate=False),
    "acsc": lambda x: sf.asin(_one_over(x), evaluate=False),
    "acoth": lambda x: sf.atanh(_one_over(x), evaluate=False),
    "asech": lambda x: sf.acosh(_one_over(x), evaluate=False),
    "acsch": lambda x: sf.asinh(_one_over(x), evaluate=False),
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


def human_factors(factors: list[Expr]) -> list[Expr]:
    """Factors of a product as a person writes them: number, scalars, functions, cells."""

    def rank(factor: Expr) -> tuple[int, str]:
        core = factor.base if isinstance(factor, Pow) else factor
        kinds = (Number, Symbol, Function, Indexed)
        place = next((n for n, kind in enumerate(kinds) if isinstance(core, kind)), len(kinds))
        return place, core.name if isinstance(core, Symbol) else ""

    return sorted(factors, key=rank)


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
        # Only methods of ours: CodePrinter would print a matrix or an unknown function as text that
        # looks like a formula.
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
        text = self._print(first)
        for term in rest:
            size, minus = _unsigned(term)
            text += self.plus["-" if minus else "+"]
            text += self.parenthesize(size, PRECEDENCE["Add"], strict=not minus)
        return text

    plus = {"+": " + ", "-": " - "}

    def _print_Mul(self, expr: Mul) -> str:
        above, below, negative = [], [], False
        # A person writes a*b/(c*d) with one minus in front, where SymPy keeps -1 and powers of -1.
        for factor in human_factors(_factors(expr)):
            divides = _is_division(factor)
            size, minus = _unsigned(_divisor(factor) if divides else factor)
            negative ^= minus
            if isinstance(size, Rational) and not divides:
                above += [Integer(size.p)] if size.p != 1 else []
                below += [Integer(size.q)] if size.q != 1 else []
            else:
                (below if divides else above).append(size)
        text = self._product(above) + (f"/{self._denominator(below)}" if below else "")
        return self._minus(text) if negative else text

    def _product(self, factors: list[Expr]) -> str:
        return "*".join(map(self._factor, factors)) or "1"

    def _factor(self, factor: Expr) -> str:
        text = self.parenthesize(factor, PRECEDENCE["Mul"])
        return f"({text})" if _is_division(factor) else text  # 1/x, one level below a power

    def _denominator(self, factors: list[Expr]) -> str:
        text = self._product(factors)
        return text if len(factors) == 1 else f"({text})"

    def _print_Pow(self, expr: Pow) -> str:
        base, exponent = expr.base, expr.exp
        if _is_division(expr):
            return self._print_Mul(Mul(1, expr, evaluate=False))
        if exponent == S.Half:
            return f"{self.functions['sqrt']}({self._print(base)})"
        level = PRECEDENCE["Pow"]
        return self.parenthesize(base, level) + self.power + self.parenthesize(exponent, level)

    def _minus(self, text: str) -> str:
        """Minus a product; a language in which minus binds tighter than a power overrides it."""
        return "-" + text

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


def _unsigned(expr: Expr) -> tuple[Expr, bool]:
    """Size of a term, and whether a minus stands before it, also where SymPy was kept from it."""
    minus = False
    while _coeff_isneg(expr):
        expr, minus = -expr, not minus
    return expr, minus


def _factors(product: Expr) -> list[Expr]:
    """Factors of a product in canonical order, products within it and 1/tan for cot spelled out."""
    found = []
    for factor in product.as_ordered_factors() if isinstance(product, Mul) else [product]:
        if type(factor).__name__ in RARE_FUNCTIONS:
            factor = RARE_FUNCTIONS[type(factor).__name__](*factor.args)
        found += _factors(factor) if isinstance(factor, Mul) else [factor]
    return found


def _is_division(expr: Expr) -> bool:
    """Whether a power prints as ``1/...``; x**(-y) does not, since 0**(-y) may be 0."""
    return isinstance(expr, Pow) and expr.exp.is_Number and bool(expr.exp < 0)


def _divisor(power: Pow) -> Expr:
    return power.base if power.exp == -1 else Pow(power.base, -power.exp, evaluate=False)


def _ours(cls: type) -> list[type]:
    return [c for c in cls.__mro__ if issubclass(c, FormulaPrinter)]
