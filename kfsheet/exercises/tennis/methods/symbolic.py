"""The report's derivations in SymPy: (3.2) from (3.1), the claim of (3.5), and the scale gauge."""

from __future__ import annotations

from dataclasses import dataclass

from sympy import Expr, Matrix, Symbol, exp, simplify, solve, sqrt, symbols, tan

from kfsheet.errors import DataError

m, c_D, c_L, g, t = symbols("m c_D c_L g t", positive=True)
X = Matrix(symbols("X_1:4", real=True))
V = Matrix(symbols("V_1:4", real=True))
Omega = Matrix(symbols("Omega_1:4", real=True))


def diamond_from_lines(theta: Symbol, eps: Symbol, half: Symbol) -> tuple[Expr, Expr]:
    """Section 3.2: the left corner of the error diamond, and its diagonal along the base.

        y = tan(theta) x,   y = -tan(theta - eps) x + 2 m tan(theta - eps)

    Returns
    -------
    corner, diagonal : Expr
        x where the two lines meet, and 2 (m - x), m being ``half`` the distance of the cameras.
    """
    x = Symbol("x")
    one = tan(theta) * x
    other = -tan(theta - eps) * x + 2 * half * tan(theta - eps)
    (corner,) = solve(one - other, x)
    return corner, 2 * (half - corner)


def length(v: Matrix) -> Expr:
    """|v| of a vector."""
    return sqrt(v.dot(v))


def acceleration(v: Matrix) -> Matrix:
    """Right-hand side of (3.1) over m: -c_D/m |v| v + c_L/m Omega x v - g k."""
    return (-c_D * length(v) * v + c_L * Omega.cross(v)) / m - g * Matrix([0, 0, 1])


def small_time_expansion(order: int = 2) -> Matrix:
    """Position as a power series in t, derived from (3.1), up to t^order.

    The derivatives of x at t = 0 follow one from the other: x' = V, x'' = a(v),
    x''' = (da/dv) a(v), ...

    Raises
    ------
    DataError
        If the order is not 1, 2, 3 or 4.
    """
    if order not in (1, 2, 3, 4):
        raise DataError(f"order is {order!r}; it must be 1, 2, 3 or 4")
    a = acceleration(V)
    series, derivative, factor = X, V, t
    for n in range(1, order + 1):
        series = series + derivative * factor
        derivative = a if n == 1 else derivative.jacobian(V) * a
        factor = factor * t / (n + 1)
    return series


def printed_velocity() -> Matrix:
    """The velocity line of (3.2) as printed, with |V| in the spin term."""
    printed = -c_D * length(V) * V + c_L * length(V) * Omega.cross(V)
    return V + (printed / m - g * Matrix([0, 0, 1])) * t


@dataclass(frozen=True)
class PrintedSolution:
    """Equation (3.5), and the equation that it should solve, in one letter for the matrix A.

    All matrices in (3.5) are functions of A alone, so they commute, and what holds for a number in
    the place of A holds for the matrix. ``A``, ``X``, ``V`` and ``g`` are its symbols.
    """

    A: Symbol
    X: Symbol
    V: Symbol
    g: Symbol
    x: Expr

    @property
    def residual(self) -> Expr:
        """X'' - A x'/m + g: 0 if (3.5) solves the equation."""
        velocity = self.x.diff(t)
        return simplify(velocity.diff(t) - self.A * velocity / m + self.g)

    @property
    def start(self) -> tuple[Expr, Expr]:
        """x(0) and x'(0)."""
        return simplify(self.x.subs(t, 0)), simplify(self.x.diff(t).subs(t, 0))


def printed_solution() -> PrintedSolution:
    """Equation (3.5): X + m A^-1 g t - (e^(At/m) - I)(m^2 A^-2 g - m A^-1 V)."""
    A, at, speed, down = symbols("A X V g", real=True)
    x = at + m / A * down * t - (exp(A * t / m) - 1) * (m**2 / A**2 * down - m / A * speed)
    return PrintedSolution(A, at, speed, down, x)


def gauge(s: Symbol) -> tuple[Matrix, Matrix]:
    """What a camera at the origin cannot see: every length s times as long.

    With V -> s V, g -> s g and c_D -> c_D/s the acceleration of (3.1) becomes s times as large,
    and so does the whole path; the direction in which the camera sees the ball stays.

    Returns
    -------
    before, after : Matrix
        s times the acceleration, and the acceleration of the scaled problem.
    """
    scaled = {g: s * g, c_D: c_D / s}
    moved = acceleration(s * V).subs(scaled, simultaneous=True)
    return s * acceleration(V), moved


def gauge_residual() -> Matrix:
    """The difference of both, simplified: 0."""
    s = Symbol("s", positive=True)
    before, after = gauge(s)
    return (after - before).applyfunc(lambda e: simplify(e.expand()))
