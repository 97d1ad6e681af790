"""What notebook 5 says of the filter's honesty, against theory and an algebra of its own."""

import math
from itertools import product

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal, norm

from kfsheet import NEES, Draws, evaluate, study
from kfsheet.exercises.cannonball import cannonball
from tests.exercises.cannonball.test_cannonball import DT, NAMES, P_0, F, G, N, radar_slope

B = np.array([304.8, -30.48, -304.8, 30.48])
R = np.diag([0.01**2, 30.48**2])
DRAWS = Draws("n_theta", "n_r", seed=5)
FLIGHTS = 4000
EARLY, LATE = slice(1, 67), slice(200, None)
COLUMNS = [f"e_{n}_a" for n in NAMES] + [f"P_{n}{n}_a" for n in NAMES] + ["NIS"]


def fly(members, draws=DRAWS, **parameters):
    """Per sweep: real/claimed error of each element, NIS and NEES."""
    nees = {"NEES": NEES(tuple(NAMES))}
    options = {"columns": COLUMNS, "scalars": ["rms_x_a", "rms_y_a"], "nees": nees}
    ensemble = study(cannonball, members, draws, **options, **parameters)
    rows = ensemble.rows
    found = {n: rows[f"e_{n}_a"]["rms"] / rows[f"P_{n}{n}_a"]["mean"] ** 0.5 for n in NAMES}
    found |= {name: rows[name]["mean"] for name in ("NIS", "NEES")}
    return pd.DataFrame(found), ensemble


def starts(factor, error=B):
    """Parameters of a start: its error (one, or one for each flight) and what is claimed of it."""
    sizes = factor * np.sqrt(np.diag(P_0))
    claimed = {f"s_{n}": float(size) for n, size in zip(NAMES, sizes, strict=True)}
    return claimed | {f"e_{n}": factor * e for n, e in zip(NAMES, error, strict=True)}


def drawn(members, seed=17):
    sizes = np.sqrt(np.diag(P_0))[:, None]
    return sizes * np.random.RandomState(seed).standard_normal((4, members))


def deviations(found, members):
    """How many sampling deviations each figure is away from that of an honest filter."""
    expected = pd.Series({**dict.fromkeys(NAMES, 1), "NIS": 2, "NEES": 4})
    spread = pd.Series({**dict.fromkeys(NAMES, 0.5), "NIS": 4, "NEES": 8})
    return (found - expected) / np.sqrt(spread / members)


@pytest.fixture(scope="module")
def common():
    return fly(FLIGHTS)


def passed_on():
    """P_a and what is left of a start, A, per sweep: a filter along the true path, in matrices."""
    P, A, lines = P_0.copy(), np.eye(4), []
    for row in range(1, N):
        time, v = row * DT, 915 / math.sqrt(2)
        P = F @ P @ F.T
        H = radar_slope([v * time, v, v * time - G * time**2 / 2, v - G * time])
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        P, A = (np.eye(4) - K @ H) @ P, (np.eye(4) - K @ H) @ F @ A
        lines.append((P, A))
    return (np.array(part) for part in zip(*lines, strict=True))


def test_what_a_common_start_does_is_linear_algebra(common):
    """Errors are (A b, P_a - A P_0 A'): their size, the NEES and the coverage follow."""
    found, ensemble = common
    P, A = passed_on()
    C = P + A @ (np.outer(B, B) - P_0) @ A.swapaxes(1, 2)
    for k, name in enumerate(NAMES):
        expected = np.sqrt(C[:, k, k] / P[:, k, k])
        assert np.abs(found[name][1:] - expected).max() < 4 * math.sqrt(0.5 / FLIGHTS), name
        mean, error = ensemble.rows[f"e_{name}_a"]["mean"][1:], np.sqrt(P[:, k, k] / FLIGHTS)
        assert (np.abs(mean - (A @ B)[:, k]) / error)[5:].max() < 4.5, name
    expected = np.trace(np.linalg.solve(P, C), axis1=1, axis2=2)
    assert np.abs(found["NEES"][1:] - expected).max() < 4 * math.sqrt(8 / FLIGHTS)


def test_a_common_start_is_dishonest_in_the_first_seconds_and_only_there(common):
    """y errs less than claimed, vy more, all four together more; the NIS notices nothing."""
    far = deviations(common[0], FLIGHTS)
    assert far["y"][EARLY].min() < -5
    assert far["vy"][EARLY].max() > 6
    assert far["NEES"][EARLY].mean() > 2
    assert far["x"][EARLY].min() < -2
    assert np.abs(far[LATE]).max().max() < 4
    assert np.abs(far["NIS"][1:]).max() < 4


def test_the_coverage_is_that_of_a_common_start():
    """Errors are normal about A b, and narrower than P: at first, all are within 2 sigma of vy."""
    flights, columns, inside = 1000, ["e_vy_a", "P_vyvy_a"], 0
    for k in range(flights):
        draws = dict(zip(DRAWS.columns, DRAWS.of(k, N), strict=True))
        error, variance = evaluate(cannonball, draws, columns=columns).to_numpy()[1:].T
        inside = inside + (error**2 < 4 * variance)
    P, A = passed_on()
    mean, claimed = (A @ B)[:, 3], np.sqrt(P[:, 3, 3])
    spread = np.sqrt((P - A @ P_0 @ A.swapaxes(1, 2))[:, 3, 3])
    share = norm.cdf((2 * claimed - mean) / spread) - norm.cdf((-2 * claimed - mean) / spread)
    assert np.abs(inside / flights - share).max() < 4.5 * math.sqrt(0.95 * 0.05 / flights)
    assert inside[:10].min() == flights
    assert share[:10].min() > 0.9999


def test_drawn_starts_make_it_honest():
    found, _ = fly(FLIGHTS, **starts(1, drawn(FLIGHTS)))
    far = deviations(found[1:], FLIGHTS)
    assert np.abs(far).max().max() < 4.5
    assert np.abs(far["NEES"][:66].mean()) < 2  # where a common start gives more


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_only_a_common_start_has_an_early_block_whatever_the_seed(seed):
    """Outsiders clump, so their number scatters; but a hundred times its mean is rare (Markov)."""
    draws, share = Draws("n_theta", "n_r", seed=seed), {}
    for kind, start in {"common": {}, "drawn": starts(1, drawn(FLIGHTS, seed))}.items():
        far = deviations(fly(FLIGHTS, draws, **start)[0][1:], FLIGHTS)
        share[kind] = (np.abs(far.loc[:125]) > 3.3).mean().mean()
    assert share["drawn"] < 100 * 2 * norm.sf(3.3) < share["common"]


def test_a_smaller_common_start_is_worse_so_it_is_not_the_curvature(common):
    """A tenth of the error has a hundredth of the curvature."""
    members = 1500
    tenth, _ = fly(members, **starts(0.1))
    far = deviations(tenth, members)
    assert tenth["NEES"].max() > common[0]["NEES"].max() + 0.1
    assert tenth["y"].min() < 0.75 < common[0]["y"].min()
    assert far["NEES"][100:200].mean() > 3  # and for longer


def test_the_curvature_shows_from_three_times_the_start():
    """The sagitta is then a sizeable part of the error of the range; at ten times, five of it."""
    members, highest = 1000, {}
    for factor in (1, 3, 10):
        found, _ = fly(members, **starts(factor, drawn(members)))
        highest[factor] = deviations(found[1:], members).max()
    assert highest[1]["NEES"] < 4 < highest[3]["NEES"] < 20
    assert highest[10]["NEES"] > 500
    assert highest[1]["NIS"] < 4.5
    assert highest[10]["NIS"] > 100


def test_what_the_filter_is_told_of_the_start_matters_to_its_honesty_not_to_its_errors():
    members = 200

    def figures(**changed):
        found, ensemble = fly(members, **changed)
        errors = ensemble.scalars["mean"]
        return np.array([errors["rms_x_a"], errors["rms_y_a"], found["NEES"][EARLY].mean()])

    basis = figures()
    for name in ("s_x", "s_vx", "s_y", "s_vy"):
        change = figures(**{name: 1.1 * cannonball.parameters[name].value}) / basis - 1
        assert np.abs(change[:2]).max() < 0.005, name
    assert change[2] < -0.02  # s_vy
    assert (figures(Phi_s=0.1)[:2] > 1.1 * basis[:2]).all()
    assert 1.03 < figures(e_vy=1.1 * 30.48)[2] / basis[2] < 1.05


# -- q and r by likelihood -----------------------------------------------------------------

PARTS = ["d_theta", "S_theta", "d_r_left", "S_r", "NIS"]


def run(echoes, q, theta, r):
    """Log-likelihood and mean NIS of echoes, for a filter that assumes q and r."""
    draws = {"n_theta": echoes[0] * 0.01 / theta, "n_r": echoes[1] * 30.48 / r}
    assumed = {"Phi_s": q, "sigma_theta": theta, "sigma_r": r}
    frame = evaluate(cannonball, draws, columns=PARTS, **assumed)[1:]
    angle = norm.logpdf(frame["d_theta"], 0, np.sqrt(frame["S_theta"]))
    distance = norm.logpdf(frame["d_r_left"], 0, np.sqrt(frame["S_r"]))
    return float(angle.sum() + distance.sum()), float(frame["NIS"].mean())


def fitted(echoes):
    bounds = np.log([(1e-6, 1e3), (1e-4, 1), (1, 1e4)])
    first = np.log([0.1, 0.05, 100])
    found = minimize(lambda x: -run(echoes, *np.exp(x))[0], first, method="L-BFGS-B", bounds=bounds)
    assert found.success
    return np.exp(found.x)


def test_the_likelihood_in_two_factors_is_that_of_both_innovations_together():
    pairs = {f"P_{a}{b}_f" for a, b in product(NAMES, repeat=2)}
    known = [c.name for c in cannonball.all_columns()]
    wanted = [c for c in known if c in pairs | {f"{n}_f" for n in NAMES} | {"d_theta", "d_r"}]
    frame = evaluate(cannonball, columns=wanted)  # all of them would be compiled first
    total = 0
    for row in range(1, N):
        now = frame.loc[row]
        P = np.array(
            [[now.get(f"P_{a}{b}_f", now.get(f"P_{b}{a}_f")) for b in NAMES] for a in NAMES]
        )
        H = radar_slope(now[["x_f", "vx_f", "y_f", "vy_f"]].to_numpy())
        total += multivariate_normal.logpdf(now[["d_theta", "d_r"]], cov=H @ P @ H.T + R)
    echoes = [cannonball.table[name].values for name in ("n_theta", "n_r")]
    assert run(np.array(echoes), 0, 0.01, 30.48)[0] == pytest.approx(total, abs=1e-6)


def gusty(member, density):
    """Draws that hold the echoes of a ball pushed about by white noise of the acceleration."""
    state = np.random.RandomState((9, member))
    echoes, time = DRAWS.of(member, N), DT * np.arange(N)
    place = 915 / math.sqrt(2) * time * (1 + 1j) - 1j * G * time**2 / 2 - 30480
    steps = 20  # within a sweep: Euler's method, which knows no formula for Q
    pushes = state.standard_normal((2, N * steps)) * math.sqrt(density * DT / steps)
    path = np.cumsum(np.cumsum(pushes, axis=1), axis=1)[:, ::steps] * DT / steps
    moved = place + path[0] + 1j * path[1]
    return echoes + np.array([np.angle(moved / place) / 0.01, (abs(moved) - abs(place)) / 30.48])


@pytest.mark.parametrize("density", [0, 1])
def test_the_maximum_of_the_likelihood_finds_q_and_r(density):
    """Deviations to 1/sqrt(2 N) a flight; q to a third, and no noise where there is none."""
    flights = 10
    found = np.array([fitted(gusty(k, density)) for k in range(flights)])
    error = np.log(found[:, 1:] / [0.01, 30.48])
    spread = 1 / math.sqrt(2 * (N - 1))
    assert np.abs(error.mean(axis=0)).max() < 3.5 * spread / math.sqrt(flights)
    assert (0.5 * spread < error.std(axis=0, ddof=1)).all()
    assert (error.std(axis=0, ddof=1) < 1.7 * spread).all()
    if density:
        assert np.median(found[:, 0]) == pytest.approx(density, rel=0.4)
        assert 0.2 < found[:, 0].min() < found[:, 0].max() < 4
    else:
        assert np.median(found[:, 0]) < 0.002
        assert found[:, 0].max() < 0.02


def test_the_likelihood_tells_what_the_nis_of_a_flight_cannot():
    flights = [DRAWS.of(k, N) for k in range(60)]
    calm, wary = (np.array([run(e, q, 0.01, 30.48) for e in flights]) for q in (0, 0.1))
    assert (wary[:, 0] < calm[:, 0]).mean() > 0.9
    assert abs(wary[:, 1].mean() - calm[:, 1].mean()) < 0.3 * calm[:, 1].std()
