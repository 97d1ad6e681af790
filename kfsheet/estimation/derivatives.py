"""Derivatives of what engineers write into a filter: also of Max, Min, Mod, floor, sign and Abs.

SymPy differentiates a kink into Dirac's delta, Heaviside's step or a Derivative that nobody can
print. A filter linearises at one point, where the kink almost surely is not: there Max has the
slope of the branch that holds, floor and sign have none, and Mod has that of its dividend.
"""

from __future__ import annotations

from collections.abc import Sequence

from sympy import (
    Abs,
    Add,
    Basic,
    Dummy,
    Expr,
    Matrix,
    Max,
    Min,
    Mod,
    Piecewise,
    S,
    Symbol,
    ceiling,
    floor,
    preorder_traversal,
    sign,
)

KINKS = (Abs, Max, Min, Mod, ceiling, floor, sign)


def derivative(expression: Expr, x: Symbol) -> Expr:
    """The derivative of ``expression`` with respect to ``x``, away from its kinks.

    Examples
    --------
    >>> from sympy import Max, Mod, Symbol, sign
    >>> x = Symbol("x", real=True)
    >>> derivative(x - sign(x) * x**2 / 4, x)
    -x*sign(x)/2 + 1
    >>> derivative(Max(x - 1, 0), x)
    Piecewise((0, x <= 1), (1, True))
    >>> derivative(Mod(3 * x, 2), x)
    3
    """
    kinks = {node: Dummy(real=True) for node in _outermost_kinks(expression, x)}
    if not kinks:
        return expression.diff(x)
    # The chain rule: first as if the kinks were variables, then through each of them.
    smooth = expression.xreplace(kinks)
    terms = [smooth.diff(x)]
    terms += [smooth.diff(dummy) * _through(kink, x) for kink, dummy in kinks.items()]
    return Add(*terms).xreplace({dummy: kink for kink, dummy in kinks.items()})


def jacobian(values: Sequence[Expr], symbols: Sequence[Symbol]) -> Matrix:
    """Derivatives of values (rows) with respect to symbols (columns)."""
    return Matrix(len(values), len(symbols), lambda i, j: derivative(values[i], symbols[j]))


def _outermost_kinks(expression: Basic, x: Symbol) -> list[Expr]:
    """Kinks that depend on x and stand in no other kink, conditions of a Piecewise left alone."""
    found = []
    walk = preorder_traversal(expression)
    for node in walk:
        if isinstance(node, KINKS) and node.has(x):
            found.append(node)
            walk.skip()
        elif node.is_Boolean or not node.has(x):
            walk.skip()
    return found


def _through(kink: Expr, x: Symbol) -> Expr:
    """The derivative of a kink where it has one."""
    if isinstance(kink, Max | Min):
        return _of_the_extreme(kink, x)
    if isinstance(kink, Mod):
        dividend, divisor = kink.args
        return derivative(dividend, x) - floor(dividend / divisor) * derivative(divisor, x)
    if isinstance(kink, Abs):
        return sign(kink.args[0]) * derivative(kink.args[0], x)
    return S.Zero  # floor, ceiling, sign: steps


def _of_the_extreme(kink: Max | Min, x: Symbol) -> Expr:
    """The derivative of the argument that is the largest, or the smallest."""
    *first, last = kink.args
    branches = []
    for n, argument in enumerate(first):
        # a >= max(b, c), else b >= c, else c: where two are equal, either slope is right.
        rest = kink.func(*kink.args[n + 1 :])
        holds = argument >= rest if isinstance(kink, Max) else argument <= rest
        branches.append((derivative(argument, x), holds))
    return Piecewise(*branches, (derivative(last, x), True))
