"""The football with its velocity in the state, against a filter written with matrices."""

import numpy as np
import pytest
from scipy.stats import chi2

from kfsheet import evaluate, study
from kfsheet.exercises.football import football
from kfsheet.exercises.football.kick import flight, photographed
from kfsheet.exercises.football.typical import other_kicks

A, J_0, DT, G, F, Q, R = 44.2, 500.0, 0.1, 9.80665, 0.03, 0.1, 9.0
KICKS = 400
ROWS = range(1, 16)


def stepped(s):
    """Half of gravity, drag for the whole step, half of gravity; the mean velocity moves it."""
    x, z, u, w = s
    half = w - G * DT / 2
    slow = 1 / (1 + F * DT * np.hypot(u, half))
    u_new, w_new = u * slow, half * slow - G * DT / 2
    return np.array([x + (u + u_new) / 2 * DT, z + (w + w_new) / 2 * DT, u_new, w_new])


def slopes(s, step=1e-5):
    columns = [(stepped(s + d) - stepped(s - d)) / 2 / step for d in np.eye(4) * step]
    return np.array(columns).T


def matrix_filter(i, j, start):
    """The joint update of both pixels, with a matrix inverse; shares no code with kfsheet."""
    H, offset = np.array([[A, 0, 0, 0], [0, -A, 0, 0]]), np.array([0, J_0])
    noise = np.kron(Q * np.array([[DT**3 / 3, DT**2 / 2], [DT**2 / 2, DT]]), np.eye(2))
    x, P = np.array(start, float), np.diag([0.01, 0.01, 1, 1])
    states, spreads = [x], [P]
    for pixels in zip(i[1:], j[1:], strict=True):
        slope = slopes(x)
        x, P = stepped(x), slope @ P @ slope.T + noise
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R * np.eye(2))
        x, P = x + K @ (np.array(pixels) - offset - H @ x), P - K @ H @ P
        states.append(x), spreads.append(P)
    return np.array(states), np.array(spreads)


def test_every_row_equals_the_matrix_filter():
    found = evaluate(football)
    states, P = matrix_filter(found["i"], found["j"], [23.4, 0.11, -22, 10.5])
    names = ["x_a_ekf", "z_a_ekf", "u_a_ekf", "w_a_ekf"]
    assert np.allclose(found[names], states, rtol=1e-8)
    for (m, n), name in {(0, 0): "xx", (0, 2): "xu", (1, 3): "zw", (2, 3): "uw"}.items():
        assert np.allclose(found[f"P_{name}_a_ekf"], P[:, m, n], rtol=1e-6, atol=1e-9)


def test_the_model_itself_errs_by_two_millimetres_a_step():
    """A step from where the ball is, compared with the flight in fine steps."""
    p = football.defaults()
    fine = np.array(flight({**p, "dt": 0.001}, 1501))
    velocities = np.gradient(fine, 0.001, axis=1, edge_order=2)
    truth = np.concatenate([fine, velocities])[:, ::100]
    errors = [stepped(truth[:, k]) - truth[:, k + 1] for k in range(15)]
    assert np.abs(errors).max(0)[:2] == pytest.approx([0.0019, 0.0015], abs=2e-4)
    assert np.abs(errors).max(0)[2:] == pytest.approx([0, 0], abs=1e-3)


@pytest.fixture(scope="module")
def kicks():
    """rms errors over the photos 1 to 15 of 400 kicks; the start is known, as in the source."""
    columns = [f"e_{axis}_{run}" for axis in "xz" for run in ("cam", "a", "f", "ekf")]
    found = study(football, KICKS, other_kicks(KICKS), columns=columns, h=0, p=2)
    return {n: float(np.sqrt((found.rows[n]["rms"][1:] ** 2).mean())) for n in columns}, found


def test_over_400_kicks_the_four_states_err_less_than_the_scheme_and_that_less_than_the_camera(
    kicks,
):
    rms, _ = kicks
    for run, value in {"cam": 0.068, "a": 0.0555, "ekf": 0.0436}.items():
        both = [rms[f"e_{axis}_{run}"] for axis in "xz"]
        assert np.mean(both) == pytest.approx(value, abs=5e-4)
        assert max(both) - min(both) < 0.002


def test_a_start_that_is_off_as_much_as_claimed_costs_two_millimetres():
    random = np.random.RandomState(3)
    p = football.defaults()
    spreads = {"x_0": 0.1, "z_0": 0.1, "u_0": 1, "w_0": 1}
    starts = {n: p[n] + s * random.standard_normal(KICKS) for n, s in spreads.items()}
    columns = ["e_x_ekf", "e_z_ekf"]
    found = study(football, KICKS, other_kicks(KICKS), columns=columns, **starts)
    rms = [np.sqrt((found.rows[n]["rms"][1:] ** 2).mean()) for n in columns]
    assert np.mean(rms) == pytest.approx(0.045, abs=0.001)


def test_its_nis_is_below_2_because_it_claims_more_error_than_the_simulation_has(kicks):
    mean = kicks[1].scalars.loc["mean_NIS", "mean"]
    assert mean == pytest.approx(1.61, abs=0.03)
    assert chi2.cdf(mean * 15 * KICKS, 30 * KICKS) < 1e-6
    honest = study(football, 100, other_kicks(100), columns=[], q=1e-4, s_pos=1e-3, s_vel=1e-2)
    assert honest.scalars.loc["mean_NIS", "mean"] == pytest.approx(2, abs=0.12)


def test_a_photo_of_the_place_corrects_the_velocity():
    gap = evaluate(football, {"i": [None] * 16})
    seen = evaluate(football)
    assert (gap["K_u_i_ekf"][1:] == 0).all()
    assert (seen["K_u_i_ekf"][1:] > 0.01).all()


def test_it_holds_for_a_flight_of_other_numbers():
    random = np.random.RandomState(8)
    p = football.defaults() | {"u_0": -15.0, "w_0": 14.0, "f": 0.05, "a": 60.0}
    photos = photographed(*flight(p), p, random)
    changed = {n: p[n] for n in ("u_0", "w_0", "f", "a")}
    x, z = flight(p)
    found = evaluate(football, {**photos, "x_true": x, "z_true": z}, **changed).attrs["scalars"]
    assert found["rms_x_ekf"] < found["rms_x_cam"]
    assert found["rms_z_ekf"] < found["rms_z_cam"]
