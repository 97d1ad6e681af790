"""Least squares and Newton's method, derived symbolically until they fit into a cell.

    0 = sum over the data of (y - f(x; a)) df/da_i,   one equation for each parameter a_i
    x <- x - f(x)/f'(x)

A fit to all data so far needs no data but their running sums, so it is a recurrence like a filter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from sympy import Eq, Expr, Poly, Symbol, simplify, solve

from kfsheet.errors import ModelError


def normal_equations(
    model: Expr, parameters: Sequence[Symbol], y: Symbol, sums: Mapping[Expr, Expr]
) -> list[Eq]:
    """The equations that the least-squares parameters of a linear model solve.

    Parameters
    ----------
    model : Expr
        What y should be, linear in the parameters: ``a_0*X + a_1``.
    parameters : sequence of Symbol
        The parameters.
    y : Symbol
        What was measured.
    sums : mapping of Expr to Expr
        The sum of each monomial of the data: ``{1: n, X: S_X, X**2: S_XX, y: S_y, X*y: S_Xy}``.

    Returns
    -------
    list of Eq
        One for each parameter: its sum of ``(y - model) * d model/d parameter``, equal to 0.

    Raises
    ------
    ModelError
        If the model is not linear in the parameters, or the sum of a monomial is not given.

    Examples
    --------
    The mean is the constant that fits best:

    >>> from sympy import symbols
    >>> a, y, n, S_y = symbols("a y n S_y")
    >>> normal_equations(a, [a], y, {1: n, y: S_y})
    [Eq(S_y - a*n, 0)]
    """
    slopes = [model.diff(a) for a in parameters]
    for a, slope in zip(parameters, slopes, strict=True):
        if slope == 0 or slope.has(*parameters):
            raise ModelError(f"{model} is not linear in {a}; least squares here needs a_0*X + ...")
    return [Eq(_summed((y - model) * slope, parameters, sums), 0) for slope in slopes]


def _summed(term: Expr, parameters: Sequence[Symbol], sums: Mapping[Expr, Expr]) -> Expr:
    data = sorted(term.free_symbols - set(parameters), key=str)
    total = 0
    # A sum over the data is linear in the monomials of the data, so each may be summed alone.
    for powers, coefficient in Poly(term, *data).terms():
        monomial = Poly({powers: 1}, *data).as_expr()
        if monomial not in sums:
            raise ModelError(
                f"the sum of {monomial} is not given; sums holds {', '.join(map(str, sums))}"
            )
        total += coefficient * sums[monomial]
    return total


def least_squares(
    model: Expr, parameters: Sequence[Symbol], y: Symbol, sums: Mapping[Expr, Expr]
) -> dict[Symbol, Expr]:
    """The parameters that solve the normal equations; see :func:`normal_equations`.

    Raises
    ------
    ModelError
        Also if the equations do not determine every parameter.

    Examples
    --------
    >>> from sympy import symbols
    >>> a, y, n, S_y = symbols("a y n S_y")
    >>> least_squares(a, [a], y, {1: n, y: S_y})
    {a: S_y/n}
    """
    solution = solve(normal_equations(model, parameters, y, sums), list(parameters), dict=True)
    if len(solution) != 1 or set(solution[0]) != set(parameters):
        raise ModelError(f"the normal equations of {model} do not determine every parameter")
    return {a: simplify(solution[0][a]) for a in parameters}


def newton_step(f: Expr, x: Symbol) -> Expr:
    """Where the tangent of f at x is 0: a better root of f than x.

    Raises
    ------
    ModelError
        If f does not depend on x.

    Examples
    --------
    >>> from sympy import Symbol
    >>> x = Symbol("x")
    >>> newton_step(x**2 - 2, x)
    x/2 + 1/x
    """
    if f.diff(x) == 0:
        raise ModelError(f"{f} does not depend on {x}, so it has no tangent that meets 0")
    return simplify(x - f / f.diff(x))
