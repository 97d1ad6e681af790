"""The analysis equation, specialised symbolically until it fits into a cell.

    x_a = x_f + B H' (R + H B H')^-1 (y - H[x_f])

Nothing here states a gain: :func:`analysis` forms the matrices for whatever B, R and H it is
given, keeps every intermediate one for display, and simplifies. For diagonal matrices the result
is the scalar gain that a spreadsheet needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from sympy import (
    Add,
    Expr,
    Function,
    ImmutableMatrix,
    Matrix,
    Mul,
    Symbol,
    diag,
    eye,
    factor,
    fraction,
    integrate,
    inverse_laplace_transform,
    limit,
    oo,
    simplify,
    sqrt,
    symbols,
    zeros,
)

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
    return matrix.applyfunc(lambda e: _signed(factor(simplify(e))))


def _signed(e: Expr) -> Expr:
    """The same fraction with its sign in front: SymPy may leave it in every term of a sum."""
    above, below = (Mul.make_args(part) for part in fraction(e))
    turned = [f for f in (*above, *below) if f.is_Add and f.could_extract_minus_sign()]
    if not turned:
        return e
    parts = (Mul(*(-f if f in turned else f for f in part)) for part in (above, below))
    return (-1) ** len(turned) * next(parts) / next(parts)


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
    # An affine operator is its own linearisation, H x + c; if x is left in either part, it is not.
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


def transition_matrix(F: Matrix, dt: Expr) -> Matrix:
    """Transition matrix of ``dx/dt = F x`` over a step: the series that ends.

        Phi = I + F dt + F^2 dt^2/2! + ...

    Parameters
    ----------
    F : Matrix
        n x n dynamics matrix, nilpotent: some power of it is 0.
    dt : Expr
        The step, s.

    Raises
    ------
    ModelError
        If F is not square, or no power of it is 0 so that the series does not end.

    Examples
    --------
    >>> from sympy import Matrix, Symbol
    >>> transition_matrix(Matrix([[0, 1], [0, 0]]), Symbol("dt"))
    Matrix([
    [1, dt],
    [0,  1]])
    """
    _check_square("F", F)
    term, total = eye(F.rows), zeros(F.rows, F.rows)
    # If any power of F is 0, then F^n is (Cayley and Hamilton): n terms decide.
    for k in range(1, F.rows + 1):
        total += term
        term = (term * F * dt / k).applyfunc(_simplest)
        if term.is_zero_matrix:
            return total
    raise ModelError(f"no power of F is 0, so the series does not end; F is {F}")


def transition_matrix_laplace(F: Matrix, dt: Symbol) -> Matrix:
    """The same by the inverse Laplace transform of (s I - F)^-1, for any square F."""
    _check_square("F", F)
    s = Symbol("s")
    resolvent = (s * eye(F.rows) - F).inv().applyfunc(simplify)
    # Of a step that may be negative, SymPy keeps a Heaviside function in every entry.
    step = Symbol("step", positive=True)
    transform = resolvent.applyfunc(lambda e: inverse_laplace_transform(e, s, step))
    return transform.subs(step, dt).applyfunc(simplify)


def discrete_noise(F: Matrix, Q: Matrix, dt: Expr) -> Matrix:
    """Covariance that white noise of spectral density Q adds during a step.

        Q_k = integral from 0 to dt of Phi(tau) Q Phi(tau)' dtau

    Parameters
    ----------
    F, Q : Matrix
        n x n dynamics matrix (nilpotent) and spectral density, symmetric.
    dt : Expr
        The step, s.

    Raises
    ------
    ModelError
        If a shape does not fit, or the series of the transition matrix does not end.

    Examples
    --------
    >>> from sympy import Matrix, diag, symbols
    >>> dt, q = symbols("dt q", positive=True)
    >>> discrete_noise(Matrix([[0, 1], [0, 0]]), diag(0, q), dt)
    Matrix([
    [dt**3*q/3, dt**2*q/2],
    [dt**2*q/2,      dt*q]])
    """
    _check_square("F", F)
    if Q.shape != F.shape or not Q.is_symmetric():
        raise ModelError(f"Q must be symmetric and {F.rows} x {F.rows}; it is {Q}")
    return Matrix(_discrete_noise(ImmutableMatrix(F), ImmutableMatrix(Q), dt))


@lru_cache(maxsize=32)
def _discrete_noise(F: ImmutableMatrix, Q: ImmutableMatrix, dt: Expr) -> ImmutableMatrix:
    """Found once for filters that share their motion."""
    tau = Symbol("tau", real=True)
    Phi = transition_matrix(F, tau)
    return (Phi * Q * Phi.T).applyfunc(lambda e: _simplest(integrate(e, (tau, 0, dt))))


def _simplest(e: Expr) -> Expr:
    """Simplified; a product of symbols is simple, and SymPy loads its physics to find that."""
    return simplify(e) if e.has(Add, Function) else e


def _check_square(name: str, matrix: Matrix) -> None:
    if matrix.rows != matrix.cols:
        raise ModelError(f"{name} must be square; it is {matrix.rows} x {matrix.cols}")
