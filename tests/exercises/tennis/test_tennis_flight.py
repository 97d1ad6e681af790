"""Dynamics of the tennis report: expansion, closed form, flights, and the scale gauge."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from sympy import Matrix, simplify, symbols, zeros

from kfsheet.errors import DataError
from kfsheet.exercises.tennis import read_drive, read_toss
from kfsheet.exercises.tennis.methods import symbolic as sym
from kfsheet.exercises.tennis.methods.closed_form import closed_form
from kfsheet.exercises.tennis.methods.dynamics import (
    TEXTBOOK_DRAG,
    Ball,
    acceleration,
    flights,
    impact,
    nine_quantities,
)
from kfsheet.exercises.tennis.methods.shots import DRIVE, TOSS

TIMES = np.linspace(0, 1, 101)
SHOTS = {"A": read_drive(), "B": read_toss()}


@pytest.fixture(params=["A", "B"])
def name(request):
    return request.param


@pytest.fixture
def shot(name):
    return SHOTS[name]


# -- (3.1) and (3.2) -----------------------------------------------------------------------


def test_the_textbook_drag_is_the_reports():
    assert pytest.approx(0.00108, abs=5e-6) == TEXTBOOK_DRAG


def test_the_given_truth_is_a_solution_of_3_1(shot):
    assert np.abs(shot.scene.ball.fly(shot.times) - shot.truth).max() < 6e-7  # six decimals


def test_the_acceleration_is_that_of_the_component_equations():
    """The three lines of section 3.6, letter by letter, with the true speed for |V|."""
    v, kappa, (l1, l2, l3), g = np.array([20.0, 3.0, -4.0]), 0.02, (0.3, -0.4, 0.5), 9.8
    k = kappa * np.sqrt(20**2 + 3**2 + 4**2)
    lines = [
        -k * v[0] - l3 * v[1] + l2 * v[2],
        -k * v[1] + l3 * v[0] - l1 * v[2],
        -g - k * v[2] + l1 * v[1] - l2 * v[0],
    ]
    np.testing.assert_allclose(acceleration(v, kappa, (l1, l2, l3), g), lines)


def test_the_expansion_follows_from_3_1_and_its_printed_velocity_does_not():
    """The printed velocity line has |V| in the spin term, where position and (3.1) have none."""
    x = sym.small_time_expansion()
    right = x.diff(sym.t)
    assert simplify(right.diff(sym.t) - sym.acceleration(sym.V)) == zeros(3, 1)
    wrong = (sym.printed_velocity() - right).applyfunc(simplify)
    spurious = sym.c_L / sym.m * (sym.length(sym.V) - 1) * sym.Omega.cross(sym.V) * sym.t
    assert (wrong - spurious).applyfunc(simplify) == zeros(3, 1)


def test_the_second_time_scale_is_no_time():
    """Measure lengths in another unit: m/(c_D |V|) stays, m/(c_L |Omega x V|) changes."""
    s = symbols("s", positive=True)
    drag = sym.m / (sym.c_D * sym.length(sym.V))
    spin = sym.m / (sym.c_L * sym.length(sym.Omega.cross(sym.V)))
    unit = {**{v: s * v for v in sym.V}, sym.c_D: sym.c_D / s}

    def change(scale):
        return simplify(scale.subs(unit, simultaneous=True) / scale)

    assert [change(drag), change(spin)] == [1, 1 / s]
    assert change(spin * sym.length(sym.V)) == 1


def test_the_expansion_meets_the_flight_as_its_order_says(name):
    """The error of order 2 falls eightfold when the time is halved, that of order 3 sixteenfold."""
    ball = SHOTS[name].scene.ball
    values = {sym.m: 1, sym.c_D: ball.kappa, sym.c_L: 1, sym.g: ball.g}
    for vector, numbers in ((sym.X, ball.X), (sym.V, ball.V), (sym.Omega, ball.spin)):
        values |= dict(zip(vector, numbers, strict=True))
    times = np.array([0.01, 0.02])
    for order in (2, 3):
        series = sym.small_time_expansion(order).subs(values)
        errors = [
            np.linalg.norm(np.array(series.subs(sym.t, t), float).ravel() - x)
            for t, x in zip(times, ball.fly(times), strict=True)
        ]
        assert errors[1] / errors[0] == pytest.approx(2 ** (order + 1), rel=0.1)


def test_nine_quantities_come_back_from_a_quadratic():
    ball = DRIVE.ball
    push = acceleration(ball.V, ball.kappa, ball.spin, ball.g)
    t = np.linspace(0, 0.2, 9)[:, None]
    found = nine_quantities(t[:, 0], ball.X + ball.V * t + push * t**2 / 2)
    np.testing.assert_allclose(found.X, ball.X)
    np.testing.assert_allclose(found.V, ball.V)
    assert found.kappa == pytest.approx(ball.kappa)
    np.testing.assert_allclose(found.across, np.cross(ball.spin, ball.V), atol=1e-9)
    # Of the spin only the part across V: adding some along V changes nothing.
    along = found.spin + 0.3 * ball.V / np.linalg.norm(ball.V)
    np.testing.assert_allclose(np.cross(along, ball.V), found.across, atol=1e-9)
    assert found.spin @ ball.V == pytest.approx(0, abs=1e-12)


# -- (3.5) ---------------------------------------------------------------------------------


def test_3_5_solves_its_equation_and_starts_where_it_should():
    solution = sym.printed_solution()
    assert solution.residual == 0
    assert solution.start == (solution.X, solution.V)


def linear_flight(ball, times):
    """(3.4) and (3.5) through a matrix exponential, and through an ODE solver."""
    k = ball.kappa * np.linalg.norm(ball.V)
    a, b, c = ball.spin
    B = np.array([[-k, -c, b], [c, -k, -a], [-b, a, -k]])
    M = np.zeros((7, 7))
    M[:3, 3:6], M[3:6, 3:6], M[5, 6] = np.eye(3), B, -ball.g
    start = np.array([*ball.X, *ball.V, 1])
    by_matrix = np.array([expm(M * t) @ start for t in times])[:, :3]
    solved = solve_ivp(
        lambda _, y: M @ y, (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-12
    )
    return by_matrix, solved.y[:3].T


@pytest.mark.parametrize(
    "ball",
    [
        DRIVE.ball,
        TOSS.ball,
        Ball((0, 0, 0), (30, 1, 5), 0.0, (0.02, 0.05, 0.04)),
        Ball((0, 0, 0), (30, 1, 5), 0.02),
        Ball((0, 0, 0), (30, 1, 5)),
        Ball((1, 2, 3), (30, 1, 5), 0.09, (3, -2, 5), 4.9),
    ],
    ids=["A", "B", "no drag", "no spin", "neither", "wild"],
)
def test_the_closed_form_agrees_with_a_matrix_exponential_and_an_ode_solver(ball):
    ours = closed_form(TIMES, ball.X, ball.V, ball.kappa, ball.spin, ball.g)
    by_matrix, solved = linear_flight(ball, TIMES)
    assert np.abs(ours - by_matrix).max() < 1e-12
    assert np.abs(ours - solved).max() < 1e-9


def test_3_5_is_far_from_3_1_after_a_second():
    for ball, metres in ((DRIVE.ball, 0.949), (TOSS.ball, 0.101)):
        linear = closed_form([1], ball.X, ball.V, ball.kappa, ball.spin, ball.g)[0]
        assert np.linalg.norm(linear - ball.fly([1])[0]) == pytest.approx(metres, abs=5e-4)


def test_without_drag_and_spin_a_flight_is_a_parabola():
    ball = Ball((1, 2, 3), (4, 5, 6))
    parabola = ball.X + np.outer(TIMES, ball.V) - np.outer(TIMES**2, [0, 0, 4.9])
    np.testing.assert_allclose(ball.fly(TIMES), parabola, atol=1e-12)
    time, x = impact(ball, ground=0)
    assert time == pytest.approx((6 + np.sqrt(36 + 6 * 9.8)) / 9.8)
    assert x == pytest.approx([1 + 4 * time, 2 + 5 * time, 0])


def test_a_flight_backwards_undoes_a_flight():
    ball = DRIVE.ball
    back = ball.state(1.0).state(-1.0)
    np.testing.assert_allclose([*back.X, *back.V], [*ball.X, *ball.V], atol=1e-8)
    with pytest.raises(DataError, match="order"):
        flights([0.2, 0.1], ball.X[None], ball.V[None], 0, (0, 0, 0))
    with pytest.raises(DataError, match="come down"):
        impact(Ball((0, 0, 1), (0, 0, 1), g=-1), longest=5)


# -- the scale gauge ----------------------------------------------------------------------


def test_camera_1_cannot_tell_the_scale(name, shot):
    """The gauge: every length s times, with g and c_D; symbolically, and in the pixels."""
    assert sym.gauge_residual() == Matrix([0, 0, 0])
    camera, ball = shot.scene.camera_1, shot.scene.ball
    larger = ball.scaled(1.3, camera.position)
    one, other = (camera.project(b.fly(shot.times)) for b in (ball, larger))
    assert np.abs(one - other).max() < 1e-6
    assert larger.g == pytest.approx(1.3 * 9.8)
