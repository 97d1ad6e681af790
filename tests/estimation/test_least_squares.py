"""Least squares, Newton's method and linear drag against NumPy, SciPy and SymPy's solvers."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import lambertw
from sympy import (
    Function,
    LambertW,
    Matrix,
    Rational,
    dsolve,
    exp,
    lambdify,
    simplify,
    solve,
    symbols,
)

from kfsheet.errors import ModelError
from kfsheet.estimation.drag import distorted, fall_argument, fall_asymptote, flight, lambert_step
from kfsheet.estimation.least_squares import least_squares, newton_step, normal_equations

a, b, c, X, y = symbols("a b c X y", real=True)
n, S_X, S_XX, S_XXX, S_XXXX, S_y, S_Xy, S_XXy = symbols("n S_X S_XX S_XXX S_XXXX S_y S_Xy S_XXy")
SUMS = {1: n, X: S_X, X**2: S_XX, y: S_y, X * y: S_Xy}
k, g, tau = symbols("k g tau", positive=True)
p, v = symbols("p v", real=True)
RNG = np.random.RandomState(4)


def test_a_straight_line_is_numpys():
    xs, ys = RNG.standard_normal((2, 30))
    found = least_squares(a + b * X, [a, b], y, SUMS)
    at = {n: 30, S_X: xs.sum(), S_XX: (xs**2).sum(), S_y: ys.sum(), S_Xy: (xs * ys).sum()}
    slope, constant = np.polyfit(xs, ys, 1)
    assert float(found[a].subs(at)) == pytest.approx(constant)
    assert float(found[b].subs(at)) == pytest.approx(slope)


def test_a_parabola_is_numpys():
    xs, ys = RNG.standard_normal((2, 30))
    sums = {**SUMS, X**3: S_XXX, X**4: S_XXXX, X**2 * y: S_XXy}
    found = least_squares(a + b * X + c * X**2, [a, b, c], y, sums)
    at = {s: float(lambdify((X, y), m)(xs, ys).sum()) for m, s in sums.items() if m != 1}
    values = [float(found[letter].subs({**at, n: 30})) for letter in (c, b, a)]
    np.testing.assert_allclose(values, np.polyfit(xs, ys, 2))


def test_the_normal_equations_are_those_of_the_source():
    """Equation (8): the sum of (y - a x - b) x and the sum of (y - a x - b) are 0."""
    xs, ys = (RNG.randint(-9, 9, 7) for _ in range(2))
    at = {n: 7, S_X: xs.sum(), S_XX: (xs**2).sum(), S_y: ys.sum(), S_Xy: (xs * ys).sum()}
    first, second = normal_equations(a * X + b, [a, b], y, SUMS)
    assert (
        first.lhs.subs(at) - sum((j - a * i - b) * i for i, j in zip(xs, ys, strict=True))
    ).expand() == 0
    assert (
        second.lhs.subs(at) - sum(j - a * i - b for i, j in zip(xs, ys, strict=True))
    ).expand() == 0


def test_newtons_step_is_a_tangents():
    x = symbols("x")
    root = Rational(1)
    for _ in range(8):
        root = newton_step(x**3 - 7, x).subs(x, root).n(30)
    assert abs(root**3 - 7) < 1e-20


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: normal_equations(a * exp(b * X), [a, b], y, SUMS), "not linear in a"),
        (lambda: normal_equations(a * X, [a, b], y, SUMS), "not linear in b"),
        (lambda: normal_equations(a + b * X**2, [a, b], y, SUMS), r"the sum of X\*\*4"),
        (lambda: least_squares(a + b, [a, b], y, SUMS), "do not determine"),
        (lambda: newton_step(a, b), "does not depend on b"),
        (lambda: distorted(0, tau), "drag over mass k is 0"),
        (lambda: flight(0, g, tau, X), "drag over mass k is 0"),
        (lambda: fall_asymptote(k, 0, p, v), "gravity g is 0"),
        (lambda: fall_argument(k, 0, v, c), "gravity g is 0"),
    ],
)
def test_what_cannot_be_solved_is_refused(call, message):
    with pytest.raises(ModelError, match=message):
        call()


def test_the_flight_solves_the_differential_equation():
    """Laplace's way, which flight() goes, against SymPy's dsolve."""
    z = Function("z")
    position, velocity = flight(k, g, tau, distorted(k, tau)) * Matrix([p, v, 1])
    equation = z(tau).diff(tau, 2) + k * z(tau).diff(tau) + g
    start = {z(0): p, z(tau).diff(tau).subs(tau, 0): v}
    assert simplify(dsolve(equation, z(tau), ics=start).rhs - position) == 0
    assert simplify(position.diff(tau) - velocity) == 0


def test_two_steps_of_a_flight_are_one():
    first, second = symbols("first second", positive=True)

    def stage(time):
        return flight(k, g, time, distorted(k, time)).col_join(Matrix([[0, 0, 1]]))

    assert simplify(stage(second) * stage(first) - stage(first + second)).is_zero_matrix


def test_the_end_of_a_flight_is_what_sympy_finds():
    c = fall_asymptote(k, g, p, v)
    end = (c + LambertW(fall_argument(k, g, v, c))) / k
    height = (flight(k, g, tau, distorted(k, tau)) * Matrix([p, v, 1]))[0]
    (found,) = solve(height, tau)
    numbers = {k: Rational(7, 10), g: 10, p: Rational(1, 2), v: 3}
    assert abs((found - end).subs(numbers).n(30)) < 1e-20
    assert abs(height.subs(tau, end).subs(numbers).n(30)) < 1e-20


@given(k=st.floats(0.05, 5), drop=st.floats(0.01, 3), v=st.floats(-9, 9), steps=st.just(12))
def test_newtons_steps_reach_the_ground_and_do_not_overshoot(k, drop, v, steps):
    """Against an integrator and a bracketing root finder that know neither X nor W."""
    c = fall_asymptote(k, 10.0, drop, v)
    w = float(fall_argument(k, 10.0, v, c))
    step = lambdify(symbols("W w"), lambert_step(*symbols("W w")))
    path = [0.0]
    for _ in range(steps):
        path.append(step(path[-1], w))
    assert path[-1] == pytest.approx(lambertw(w).real, abs=1e-7)
    moves = np.diff(path)
    assert (moves <= 1e-9).all() or (moves >= -1e-9).all()

    def height(t):
        return drop + (v + 10 / k) * -np.expm1(-k * t) / k - 10 * t / k

    top = max(0.0, np.log1p(k * v / 10) / k) if k * v > -10 else 0.0
    ground = brentq(height, top, float(c) / k + 10)
    assert (c + path[-1]) / k == pytest.approx(ground, abs=1e-6)


def test_the_flight_is_what_small_steps_add_up_to():
    solution = solve_ivp(
        lambda _, s: [s[1], -0.8 * s[1] - 9.8], (0, 0.9), [0.5, 4], rtol=1e-10, atol=1e-12
    )
    at = (0.8, 9.8, 0.9, (1 - np.exp(-0.72)) / 0.8)
    np.testing.assert_allclose(
        np.array(flight(*at) * Matrix([0.5, 4, 1]), float).ravel(), solution.y[:, -1], rtol=1e-8
    )
