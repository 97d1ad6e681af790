"""Linear drag as the shuttlecock's source prints it, and the fall in its sheet."""

import numpy as np
import pytest
from scipy.special import lambertw
from sympy import Eq, Function, LambertW, Matrix, dsolve, exp, solve, symbols

from kfsheet import evaluate
from kfsheet.drag import distorted, fall_argument, fall_asymptote, flight
from kfsheet.exercises.shuttlecock import shuttlecock

k, g, tau = symbols("k g tau", positive=True)
p, v = symbols("p v", real=True)
G = 9.80665


def solution(gravity):
    """Equation (5), solved."""
    s = Function("s")
    law = Eq(s(tau).diff(tau, 2), -k * s(tau).diff(tau) - gravity)
    return dsolve(law, s(tau), ics={s(0): p, s(tau).diff(tau).subs(tau, 0): v}).rhs


def printed(gravity):
    """Equation (6), with m/k = 1/k and its v_0 in the height read as v_z0."""
    if not gravity:
        return -v / k * exp(-k * tau) + v / k + p
    still = (gravity + v * k) / k**2 - gravity * tau / k + p
    return still - (gravity / k**2 + v / k) * exp(-k * tau)


@pytest.mark.parametrize("gravity", [0, g], ids=["level", "height"])
def test_dsolve_of_equation_5_is_equation_6_and_the_flight(gravity):
    solved = solution(gravity)
    assert (solved - printed(gravity)).expand() == 0
    place, speed = flight(k, gravity, tau, distorted(k, tau)) * Matrix([p, v, 1])
    assert (place - solved).expand() == 0
    assert (speed - solved.diff(tau)).expand() == 0


def test_the_moment_that_sympy_finds_is_the_one_of_asymptote_and_argument():
    (moment,) = solve(solution(g), tau)
    c = fall_asymptote(k, g, p, v)
    assert (moment - (c + LambertW(fall_argument(k, g, v, c))) / k).simplify() == 0


@pytest.mark.parametrize("parameters", [{}, {"k_m": 0.5}, {"e_k": 1}, {"z_fall": -1}], ids=str)
@pytest.mark.parametrize("run", ["raw", "kf"])
def test_the_sheet_falls_when_scipy_says(parameters, run):
    f = evaluate(shuttlecock, **parameters)
    rate = f.attrs["scalars"]["k_fit"]
    speed = f[f"v_z_{run}"][2:]
    drop = f[f"p_z_{run}"][2:] - f.attrs["parameters"]["z_fall"]
    c = 1 + rate * speed / G + rate**2 * drop / G
    w = -(1 + rate * speed / G) * np.exp(-c)
    moment = (c + lambertw(w.to_numpy()).real) / rate
    np.testing.assert_allclose(f[f"t_fall_{run}"][2:], moment, rtol=1e-9)
