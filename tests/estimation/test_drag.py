"""Linear drag as the shuttlecock's source prints it, and the fall in its sheet."""

from pathlib import Path

import numpy as np
import pytest
from mpmath import lambertw as mp_lambertw
from mpmath import mp, mpf
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import lambertw
from sympy import Eq, Function, LambertW, Matrix, dsolve, exp, lambdify, solve, symbols

from kfsheet import evaluate, recalculate
from kfsheet.estimation.drag import distorted, fall_argument, fall_asymptote, flight, lambert_start
from kfsheet.exercises.shuttlecock import shuttlecock
from kfsheet.workbook.write.layout import FIRST_ROW, Layout

k, g, tau = symbols("k g tau", positive=True)
p, v = symbols("p v", real=True)
G = 9.80665
WORKBOOK = Path(__file__).parents[2] / "workbooks" / "shuttlecock.xlsx"


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


def exact_fall(k_m, p_z, v_z):
    """When a flight from p_z, upwards with v_z, comes down to 0: fifty digits, of these doubles."""
    with mp.workdps(50):
        rate, speed, ground = mpf(k_m), mpf(v_z), mpf(G)
        c = 1 + rate * speed / ground + rate**2 * mpf(p_z) / ground
        return float((c + mp_lambertw(-(1 + rate * speed / ground) * mp.exp(-c)).real) / rate)


def digits_left(k_m):
    """Seconds that double precision leaves uncertain, times ten."""
    return 1e-11 + 1e-14 / k_m**2


@pytest.mark.parametrize("run", ["raw", "kf"])
@pytest.mark.parametrize("k_m", [0.001, 0.01, 0.1, 1, 5])
def test_from_weak_drag_to_strong_the_sheet_falls_when_fifty_digits_say(k_m, run):
    f = evaluate(shuttlecock, k_m=k_m)
    fitted = f[[f"p_z_{run}", f"v_z_{run}"]].to_numpy()[1:]
    moment = [exact_fall(k_m, p_z, v_z) for p_z, v_z in fitted]
    np.testing.assert_allclose(f[f"t_fall_{run}"][1:], moment, rtol=0, atol=digits_left(k_m))


@pytest.mark.parametrize("k_m", [0.001, 0.01, 0.1, 1, 5])
def test_from_weak_drag_to_strong_the_truth_falls_when_its_height_is_0(k_m):
    """Small steps and a bracket, without Lambert's function; and every frame says the same."""
    f = evaluate(shuttlecock, k_m=k_m)
    assert f.attrs["scalars"]["t_fall"] == pytest.approx(landed(k_m), abs=1e-7)
    np.testing.assert_allclose(
        f["t_fall_true"], exact_fall(k_m, 0.5, 4), rtol=0, atol=digits_left(k_m)
    )


def landed(k_m):
    def rate(_, state):
        return [state[1], -k_m * state[1] - G]

    path = solve_ivp(rate, (0, 2), [0.5, 4], dense_output=True, rtol=1e-11, atol=1e-12)
    return brentq(lambda s: path.sol(s)[0], 0.5, 2, xtol=1e-13)


@pytest.mark.parametrize("z_fall", [3, 1.25])
def test_where_the_truth_stays_below_it_ends_at_its_highest_point(z_fall):
    f = evaluate(shuttlecock, z_fall=z_fall)
    assert f.attrs["scalars"]["t_fall"] == pytest.approx(np.log1p(4 / G))


def test_in_ironcalc_too_weak_drag_falls_when_fifty_digits_say():
    sheet, row, column = Layout.standard(shuttlecock).scalars["k_m"]
    found = recalculate(WORKBOOK, changes={sheet: {(row, column): 0.01}})
    cells = {
        name: [found[page][r, at] for r in range(FIRST_ROW + 1, FIRST_ROW + 27)]
        for page in ("Truth", "Fit raw")
        for name in ("t_fall_true", "p_z_raw", "v_z_raw", "t_fall_raw")
        for (r, at), text in found[page].items()
        if r == 1 and text == name
    }
    moment = exact_fall(0.01, 0.5, 4)
    np.testing.assert_allclose(cells["t_fall_true"], moment, rtol=0, atol=digits_left(0.01))
    fitted = zip(cells["p_z_raw"], cells["v_z_raw"], strict=True)
    moments = [exact_fall(0.01, *fit) for fit in fitted]
    np.testing.assert_allclose(cells["t_fall_raw"], moments, rtol=0, atol=digits_left(0.01))


def test_the_first_guess_is_as_near_as_it_says():
    for edge, off in ((0, 0.011), (100, 0.37)):
        w = edge - (edge + np.exp(-1)) * np.logspace(-14, -1e-9, 300)
        guess = lambdify(k, lambert_start(1 + exp(1) * k))(w)
        assert np.abs(guess - lambertw(w).real).max() < off


@pytest.mark.parametrize("parameters", [{"f_k": 2}, {"z_fall": -1}], ids=str)
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
