"""Expressions as LaTeX, in the human order of :mod:`kfsheet.printing`."""

from __future__ import annotations

import re

from sympy import Add, Basic, Expr, Indexed, Symbol
from sympy.printing.latex import LatexPrinter, tex_greek_dictionary, translate

from kfsheet.printing import human_terms

SPECIAL = {"dt": r"\Delta t"}


class HumanLatexPrinter(LatexPrinter):
    """LaTeX in the human order, with ``x_a[t - 1]`` as x_{a, t-1}."""

    def _print_Indexed(self, expr: Indexed) -> str:
        return latex_name(str(expr.base.label), self._print(expr.indices[0]).replace(" ", ""))

    def _print_IndexedBase(self, expr: Basic) -> str:
        return latex_name(str(expr.label))

    def _print_Symbol(self, expr: Symbol, style: str = "plain") -> str:
        return latex_name(expr.name)

    def _as_ordered_terms(self, expr: Add, order: str | None = None) -> list[Expr]:
        return human_terms(expr)


def latex_name(name: str, *indices: str) -> str:
    r"""``e_x_a`` as e_{x,a}, Greek names as Greek letters.

    >>> latex_name("sigma_theta", "t")
    '\\sigma_{\\theta,t}'
    """
    head, *rest = (_greek(part) for part in re.split("_+", name))
    subscript = ",".join([*filter(None, rest), *indices])
    return f"{head}_{{{subscript}}}" if subscript else head


def _greek(part: str) -> str:
    if part in SPECIAL:
        return SPECIAL[part]
    known = part in tex_greek_dictionary or translate(part) != part
    return translate(part) if known else part if len(part) < 2 else rf"\mathrm{{{part}}}"


def latex_code(expression: Expr) -> str:
    """LaTeX of an expression, for a notebook or a handout."""
    return HumanLatexPrinter().doprint(expression)
