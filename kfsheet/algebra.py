"""The analysis equation, specialised symbolically until it fits into a cell.

    x_a = x_f + B H' (R + H B H')^-1 (y - H[x_f])

Nothing here states a gain: :func:`analysis` forms the matrices for whatever B, R and H it is
given, keeps every intermediate one for display, and simplifies. For diagonal matrices the result
is the scalar gain that a spreadsheet needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sympy import Expr, Matrix, Symbol, diag, factor, limit, oo, simplify, sqrt, symbols

from kfsheet.errors import ModelError


@dataclass(frozen=True)
class Analysis:
    """Every matrix on the way from B, H, R to the analysis, in the order of the derivation.

    Attributes
    ----------
    x_f : Matrix
        Forecast, n x 1.
    B : Matrix
        Covariance of the errors of the forecast, n x n.
    R : Matrix
        Covariance of the errors of the observations, m x m.
    H : Matrix
        Linear part of the observation operator, m x n.
    c : Matrix
        Constant part of the observation operator, m x 1.
    y : Matrix
        Observations, m x 1.
    """

    x_f: Matrix
    B: Matrix
    R: Matrix
    H: Matrix
    c: Matrix
    y: Matrix

    @property
    def BHt(self) -> Matrix:
        """B H', n x m: how an error of the state shows in what is observed."""
        return self.B * self.H.T

    @property
    def HBHt(self) -> Matrix:
        """H B H', m x m: covariance of the forecast, seen by the observer."""
        return self.H * self.BHt

    @property
    def S(self) -> Matrix:
        """R + H B H', m x m: covariance of the innovation."""
        return self.R + self.HBHt

    @property
    def S_inverse(self) -> Matrix:
        """S^-1, m x m."""
        if self.S.det().equals(0):
            raise ModelError(f"S = R + H B H' has no inverse: {self.S}; is an error variance 0?")
        return _tidy(self.S.inv())

    @property
    def K(self) -> Matrix:
        """The gain B H' S^-1, n x m."""
        return _tidy(self.BHt * self.S_inverse)

    @property
    def innovation(self) -> Matrix:
        """Y - H[x_f], m x 1, with the whole of an affine H."""
        return self.y - self.c - self.H * self.x_f

    @property
    def x_a(self) -> Matrix:
        """The analysis x_f + K (y - H[x_f]), n x 1."""
        return self.x_f + self.K * self.innovation

    @property
    def P_a(self) -> Matrix:
        """Covariance of the errors of the analysis, (I - K H) B, n x n."""
        return _tidy(self.B - self.K * self.H * self.B)


def _tidy(matrix: Matrix) -> Matrix:
    return matrix.applyfunc(lambda e: factor(simplify(e)))


def analysis(
    x_f: Sequence[Symbol],
    operator: Sequence[Expr],
    y: Sequence[Symbol],
    B: Matrix,
    R: Matrix,
) -> Analysis:
    """Specialise the analysis equation to a state, an observation operator and covariances.

    Parameters
    ----------
    x_f : sequence of Symbol
        The n elements of the forecast.
    operator : sequence of Expr
        The m observed quantities as affine functions of the forecast, ``[a*x, j_0 - a*z]``.
    y : sequence of Symbol
        The m observations.
    B, R : Matrix
        n x n and m x m, symmetric.

    Raises
    ------
    ModelError
        If a shape does not fit, B or R is not symmetric, or the operator is not affine.

    Examples
    --------
    >>> from sympy import diag, symbols
    >>> x, y, a, b, r = symbols("x y a b r", positive=True)
    >>> analysis([x], [a*x], [y], diag(b), diag(r)).K
    Matrix([[a*b/(a**2*b + r)]])
    """
    state, observed = Matrix(list(x_f)), Matrix(list(operator))
    n, m = len(state), len(observed)
    for name, matrix, size in (("B", Matrix(B), n), ("R", Matrix(R), m)):
        if matrix.shape != (size, size) or not matrix.is_symmetric():
            raise ModelError(f"{name} must be symmetric and {size} x {size}; it is {matrix}")
    if len(y) != m:
        raise ModelError(f"there are {m} observed quantities but {len(y)} observations")
    H = observed.jacobian(state)
    constant = simplify(observed - H * state)
    if H.has(*state) or constant.has(*state):
        raise ModelError(f"the operator {list(operator)} is not affine in {list(x_f)}")
    return Analysis(state, Matrix(B), Matrix(R), H, constant, Matrix(list(y)))


def diagonal_analysis(n: int) -> Analysis:
    """N quantities, each observed by itself: B = diag(b), R = diag(r), H = diag(a).

    Its gain is diag(K) with K_i = b_i a_i / (r_i + a_i^2 b_i): the scalar gain.
    """
    if not isinstance(n, int) or n < 1:
        raise ModelError(f"the number of quantities is {n!r}; give a whole number from 1 up")
    x, y, a = (_family(letter, n, real=True) for letter in ("x_f", "y", "a"))
    b, r = (_family(letter, n, positive=True) for letter in "br")
    operator = [a_n * x_n for a_n, x_n in zip(a, x, strict=True)]
    return analysis(x, operator, y, diag(*b), diag(*r))


def _family(letter: str, n: int, **assumptions: bool) -> tuple[Symbol, ...]:
    return symbols(f"{letter}_1:{n + 1}", **assumptions)


def correlated_covariance(b_x: Expr, b_z: Expr, rho: Expr) -> Matrix:
    """B of two errors with variances b_x, b_z and correlation rho, 2 x 2."""
    covariance = rho * sqrt(b_x) * sqrt(b_z)
    return Matrix([[b_x, covariance], [covariance, b_z]])


def gain_limits(gain: Expr, r: Symbol, b: Symbol) -> dict[str, Expr]:
    """Limits of a scalar gain: a perfect observation, a useless one, a useless forecast.

    Returns
    -------
    dict
        Keys ``"r -> 0"``, ``"r -> oo"`` and ``"b -> oo"``.
    """
    cases = {"r -> 0": (r, 0), "r -> oo": (r, oo), "b -> oo": (b, oo)}
    return {name: limit(gain, symbol, end) for name, (symbol, end) in cases.items()}


def sequential_gain(B: Matrix, h: Matrix, r: Any) -> tuple[Matrix, Matrix]:
    """Gain and covariance after one scalar observation: division, no inverse.

        S = h B h' + r,   K = B h' / S,   P = B - K h B

    Parameters
    ----------
    B : Matrix
        n x n covariance before the observation.
    h : Matrix
        1 x n row of the observation operator.
    r : Expr
        Variance of the error of the observation.

    Returns
    -------
    K, P : Matrix
        n x 1 gain and n x n covariance.
    """
    if h.shape != (1, B.rows):
        raise ModelError(f"h must be 1 x {B.rows}; it is {h.rows} x {h.cols}")
    S = (h * B * h.T)[0] + r
    K = B * h.T / S
    return K, B - K * h * B
