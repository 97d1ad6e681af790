"""Text of an Excel formula -> SymPy expression: the way back from :mod:`kfsheet.printing.excel`.

:mod:`kfsheet.parsing.syntax` reads the text by Excel's own precedence; here each node of its tree
becomes mathematics. What is not arithmetic of numbers (arrays, look-ups, text, names that are made
from text) is refused, never guessed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sympy import ITE, Basic, Expr, Float, Integer, Piecewise, Rational, S, Symbol

from kfsheet.errors import FormulaError
from kfsheet.model.expressions import Missing
from kfsheet.parsing.functions import FUNCTIONS, as_condition, as_number, compare, is_truth, power
from kfsheet.parsing.references import Reference, read_reference
from kfsheet.parsing.syntax import Tree, parse_formula

Meaning = Basic | list[list[Basic]]
"""What a reference stands for: an expression, a whole column, or the cells of a range by row."""
LookUp = Callable[[Reference], Meaning]


def references(tree: Tree) -> list[Reference]:
    """Every reference in a tree, in the order in which they stand."""
    if tree[0] == "reference":
        return [tree[1]]
    return [r for part in tree[1:] if isinstance(part, tuple) for r in references(part)]


def relative_tree(tree: Tree, host: tuple[int, int]) -> Tree:
    """The tree with each reference seen from the cell that holds the formula."""
    if tree[0] == "reference":
        return ("reference", tree[1].seen_from(host))
    return tuple(relative_tree(p, host) if isinstance(p, tuple) else p for p in tree)


def tree_to_sympy(tree: Tree, look_up: LookUp) -> Basic:
    """The expression of a syntax tree; ``look_up`` says what each reference stands for."""
    value = _Reader(look_up).read(tree)
    if isinstance(value, list):
        raise FormulaError("the formula gives a range, not a number")
    return value


def read_formula(text: str, names: Mapping[str, Meaning] | None = None) -> Basic:
    """The SymPy expression that a formula computes.

    Parameters
    ----------
    text : str
        The formula, with or without ``=``.
    names : mapping, optional
        What references mean, by their text: ``{"E4": x[t - 1], "dt": dt}``; without it, names
        become symbols.

    Raises
    ------
    FormulaError
        If it is no formula, holds what is not arithmetic of numbers, or a cell has no meaning.

    Examples
    --------
    >>> from sympy import Symbol
    >>> read_formula("=-A1^2", {"A1": Symbol("x")})
    x**2
    """
    known = {read_reference(key): meaning for key, meaning in (names or {}).items()}

    def look_up(reference: Reference) -> Meaning:
        if reference in known:
            return known[reference]
        if reference.name and not reference.sheet:
            return Symbol(reference.name)
        raise FormulaError("a reference has no meaning; give it one in names=")

    return tree_to_sympy(parse_formula(text), look_up)


class _Reader:
    """Reads a tree bottom up."""

    def __init__(self, look_up: LookUp) -> None:
        self._look_up = look_up

    def read(self, tree: Tree) -> Meaning:
        return getattr(self, f"_{tree[0]}")(*tree[1:])

    def _number(self, value: float) -> Expr:
        return number(value)

    def _truth(self, value: bool) -> Basic:
        return S.true if value else S.false

    def _text(self, value: str) -> Basic:
        return Missing

    def _omitted(self) -> Expr:
        return S.Zero

    def _error(self, value: str) -> Basic:
        raise FormulaError(f"the formula holds the error {value}")

    def _array(self, *rows: Tree) -> Basic:
        raise FormulaError("a formula holds arrays, which are not read")

    def _foreign(self, text: str) -> Basic:
        raise FormulaError(f"{text} is no cell, range or name of this workbook")

    def _reference(self, reference: Reference) -> Meaning:
        return self._look_up(reference)

    def _scalar(self, tree: Tree) -> Basic:
        value = self.read(tree)
        if isinstance(value, list):
            if len(value) == len(value[0]) == 1:
                return value[0][0]
            raise FormulaError("a range stands where one cell belongs")
        return value

    def _unary(self, operator: str, operand: Tree) -> Basic:
        if operator not in ("+", "-", "%"):
            raise FormulaError(f"the operator {operator} is not read")
        value = self._scalar(operand)
        if operator == "+":
            return value
        return -as_number(value) if operator == "-" else as_number(value) / 100

    def _binary(self, operator: str, left: Tree, right: Tree) -> Basic:
        if operator in ("=", "<>", "<", "<=", ">", ">="):
            return compare(operator, self._side(left), self._side(right))
        if operator not in ("+", "-", "*", "/", "^"):
            raise FormulaError(f"the operator {operator!r} is not read")
        a, b = as_number(self._scalar(left)), as_number(self._scalar(right))
        if operator == "^":
            return power(a, b)
        if operator == "/":
            return a * power(b, S.NegativeOne)
        return {"+": a + b, "-": a - b}[operator] if operator in "+-" else a * b

    def _side(self, tree: Tree) -> Basic | str:
        """One side of a comparison; a text stays one, since x = "" asks whether x is empty."""
        return tree[1] if tree[0] == "text" else self._scalar(tree)

    def _call(self, name: str, *arguments: Tree) -> Basic:
        if name == "IF":
            return self._if(*arguments)
        if name not in FUNCTIONS:
            raise FormulaError(f"the function {name} is not read as mathematics")
        try:
            return FUNCTIONS[name](*(self.read(a) for a in arguments))
        except TypeError:
            raise FormulaError(
                f"{name} has {len(arguments)} arguments, or a wrong kind of them"
            ) from None

    def _if(self, test: Tree, yes: Tree, no: Tree = ("text", "")) -> Basic:
        condition = as_condition(self._scalar(test))
        values = [self._scalar(yes), self._scalar(no)]
        if condition in (S.true, S.false):
            return values[0] if condition == S.true else values[1]
        if all(map(is_truth, values)):
            return ITE(condition, *values)
        first, second = (as_number(v) for v in values)
        return Piecewise((first, condition), (second, True), evaluate=False)


def number(value: float) -> Expr:
    """A number typed in a formula, as the decimal that was typed."""
    if value.is_integer() and abs(value) < 1e15:
        return Integer(int(value))
    return Rational(repr(value)) if 1e-12 < abs(value) < 1e15 else Float(value, 17)
