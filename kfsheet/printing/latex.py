"""Expressions as LaTeX, in the human order of :mod:`kfsheet.printing.formula_printer`."""

from __future__ import annotations

import re
from collections.abc import Container

from sympy import Add, Basic, Expr, Indexed, Symbol
from sympy.printing.latex import LatexPrinter, tex_greek_dictionary, translate

from kfsheet.printing.formula_printer import human_terms

SPECIAL = {"dt": r"\Delta t"}


class HumanLatexPrinter(LatexPrinter):
    """LaTeX in the human order, with ``x_a[t - 1]`` as x_{a, t-1}."""

    verbatim: Container[str] = ()

    def _print_Indexed(self, expr: Indexed) -> str:
        return latex_name(str(expr.base.label), self._print(expr.indices[0]).replace(" ", ""))

    def _print_IndexedBase(self, expr: Basic) -> str:
        return latex_name(str(expr.label))

    def _print_Symbol(self, expr: Symbol, style: str = "plain") -> str:
        return verbatim_name(expr.name) if expr.name in self.verbatim else latex_name(expr.name)

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


def verbatim_name(name: str) -> str:
    r"""A name as it is written in a program: u_0, where it is not row 0 of u.

    >>> verbatim_name("u_0")
    '\\mathtt{u\\_0}'
    """
    words = name.replace("_", r"\_")
    return rf"\mathtt{{{words}}}"


def latex_code(expression: Expr, verbatim: Container[str] = ()) -> str:
    """LaTeX of an expression, for a notebook or a handout.

    Symbols whose names are in ``verbatim`` stay as they are written in a program.
    """
    printer = HumanLatexPrinter()
    printer.verbatim = verbatim
    return printer.doprint(expression)
