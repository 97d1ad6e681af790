"""A flight with linear drag, solved: where, how fast, and when it ends.

    dp/dt = v,   dv/dt = -k v - g

Positions are linear in the *distorted* time X = (1 - exp(-k tau))/k, which makes a fit to a track a
straight line; the end of a flight is a value of Lambert's W.
"""

from __future__ import annotations

from functools import cache

from sympy import Expr, Matrix, Symbol, exp, log, sqrt, symbols

from kfsheet.errors import ModelError
from kfsheet.estimation.algebra import transition_matrix_laplace
from kfsheet.estimation.least_squares import newton_step


def distorted(k: Expr, tau: Expr) -> Expr:
    """X = (1 - exp(-k tau))/k, s: the time in which a flight without drag would come as far.

    Parameters
    ----------
    k, tau : Expr
        Drag over mass, 1/s, and the time, s.

    Raises
    ------
    ModelError
        If k is 0: without drag, X is the time itself.
    """
    _check_nonzero("drag over mass k", k)
    return (1 - exp(-k * tau)) / k


def flight(k: Expr, g: Expr, tau: Expr, X: Expr) -> Matrix:
    """What a time of flight does to position and velocity, exactly.

        p <- p + v X + g (X - tau)/k
        v <- v (1 - k X) - g X

    Parameters
    ----------
    k, g, tau, X : Expr
        Drag over mass in 1/s, gravity in m/s2 (0 for a horizontal axis), the time in s, and
        :func:`distorted` of it.

    Returns
    -------
    Matrix
        2 x 3; times (p, v, 1) it is the new position and velocity. Derived by Laplace transform.

    Raises
    ------
    ModelError
        If k is 0.

    Examples
    --------
    >>> from sympy import symbols
    >>> flight(*symbols("k g tau X"))
    Matrix([
    [1,        X, g*(X - tau)/k],
    [0, -X*k + 1,          -X*g]])
    """
    _check_nonzero("drag over mass k", k)
    solved, given = _flight()
    return solved.xreplace(dict(zip(given, (k, g, tau, X), strict=True)))


@cache
def _flight() -> tuple[Matrix, tuple[Symbol, ...]]:
    k, g, tau, X = symbols("k g tau X", positive=True)
    # Gravity is made part of a homogeneous system by a third element that is 1 for ever.
    dynamics = Matrix([[0, 1, 0], [0, -k, -g], [0, 0, 0]])  # of (p, v, 1)
    solved = transition_matrix_laplace(dynamics, tau)[:2, :].subs(exp(-k * tau), 1 - k * X)
    return solved.applyfunc(lambda e: e.expand().factor()), (k, g, tau, X)


def fall_asymptote(k: Expr, g: Expr, drop: Expr, v: Expr) -> Expr:
    """The number c = 1 + k v/g + k^2 drop/g: at the time c/k the asymptote of a flight ends.

    The asymptote is the fall at terminal velocity g/k that the flight approaches.

    Parameters
    ----------
    k, g, drop, v : Expr
        Drag over mass in 1/s, gravity in m/s2, height above the end in m, upward velocity in m/s.

    Raises
    ------
    ModelError
        If g is 0: then nothing falls.
    """
    _check_nonzero("gravity g", g)
    return 1 + k * v / g + k**2 * drop / g


def fall_argument(k: Expr, g: Expr, v: Expr, c: Expr) -> Expr:
    """The number w = -(1 + k v/g) exp(-c): the flight itself ends at the time (c + W(w))/k.

    W is the principal branch of Lambert's function, W exp(W) = w: of the two moments at that
    height, the one on the way down. Where w < -1/e the flight stays below, and there is none.
    The arguments and errors are those of :func:`fall_asymptote`, whose result is c.
    """
    _check_nonzero("gravity g", g)
    return -(1 + k * v / g) * exp(-c)


def lambert_start(reach: Expr) -> Expr:
    """A first guess of W(w) from reach = 1 + e w: log(1 + sqrt(2 reach) + reach/3) - 1.

    Around w = -1/e, where the branches of W meet, W = -1 + p - p^2/3 + ... with
    p = sqrt(2 reach), and Newton's method from elsewhere halves its error a step at best. Weak drag
    leads there: p is about k times the time of flight. The guess has the same first three terms,
    and grows like a logarithm, as W does. It is at most 0.011 off for w < 0, 0.37 for w < 100.

    Parameters
    ----------
    reach : Expr
        1 + e w, at least 0.

    Examples
    --------
    >>> from sympy import Symbol, series
    >>> p = Symbol("p", positive=True)
    >>> series(lambert_start(p**2 / 2), p, n=3)
    -1 + p - p**2/3 + O(p**3)
    """
    return log(1 + sqrt(2 * reach) + reach / 3) - 1


def lambert_step(W: Expr, w: Expr) -> Expr:
    """A step of Newton's method towards W(w): that for the height of the flight, in other units.

    From :func:`lambert_start`, three steps give all digits that 1 + e w has for w < 0, and four for
    w < 100. Larger ones belong to flights that begin by falling at several times the terminal
    velocity. The 1e-16 to which 1 + e w is known leave the fall time uncertain by some 1e-15/k^2
    seconds (k in 1/s): 1e-9 s for k = 0.001/s. The flight itself, computed by the same numbers, is
    no more certain.

    Examples
    --------
    >>> from sympy import symbols
    >>> W, w = symbols("W w")
    >>> lambert_step(W, w), lambert_step(0, w)
    (w*(W + 1)/(w + exp(W)), w/(w + 1))
    """
    solved, given = _lambert()
    return solved.subs(dict(zip(given, (W, w), strict=True)), simultaneous=True)


@cache
def _lambert() -> tuple[Expr, tuple[Symbol, Symbol]]:
    W, w = symbols("W w", real=True)
    # Height over time is concave, and so is this; W exp(W) - w would overshoot.
    return newton_step(w * exp(-W) - W, W), (W, w)


def _check_nonzero(name: str, value: Expr) -> None:
    if value == 0:
        raise ModelError(f"{name} is 0, but it divides; give a value above 0")
