"""The cannon-ball: truth, both filters, and misprints that one flight shows."""

import math

import numpy as np
import pandas as pd
import pytest
from scipy.stats import chi2
from sympy import Matrix, Symbol, diag, eye, symbols

from kfsheet import (
    Missing,
    discrete_noise,
    evaluate,
    t,
    transition_matrix,
    transition_matrix_laplace,
    when_observed,
)
from kfsheet.exercises.cannonball import (
    DATA,
    DYNAMICS,
    build_model,
    cannonball,
    extended_model,
    linear_model,
)
from tests.estimation.test_kalman import assert_close, assert_same_filter, joint_filter

DT, G, X_R, N = 0.1, 9.80665, 30480.0, 1320
NAMES = ["x", "vx", "y", "vy"]
F = np.array([[1, DT, 0, 0], [0, 1, 0, 0], [0, 0, 1, DT], [0, 0, 0, 1]])
FALL = np.array([0, 0, -G * DT**2 / 2, -G * DT])
START = np.array([304.8, 915 / math.sqrt(2) - 30.48, -304.8, 915 / math.sqrt(2) + 30.48])
P_0 = np.diag([304.8, 30.48, 304.8, 30.48]) ** 2


@pytest.fixture(scope="module")
def frame():
    return evaluate(cannonball)


def radar(x):
    return np.array([math.atan2(x[2], x[0] - X_R), math.hypot(x[0] - X_R, x[2])])


def radar_slope(x):
    a, b = x[0] - X_R, x[2]
    r = math.hypot(a, b)
    return np.array([[-b / r**2, 0, a / r**2, 0], [a / r, 0, b / r, 0]])


def rms(values):
    return math.sqrt(np.nanmean(np.square(values)))


def test_the_draws_are_what_their_seed_makes():
    table = pd.read_csv(DATA / "cannonball_draws.csv")
    draws = np.random.RandomState(20250215).standard_normal((N, 2)).round(6)
    assert (table[["n_theta", "n_r"]].to_numpy() == draws).all()


def test_the_truth_is_the_closed_solution_and_lands_when_the_table_ends(frame):
    """The trapezium is exact for a constant acceleration."""
    time = frame["time"].to_numpy()
    v = 915 / math.sqrt(2)
    assert len(frame) == N
    np.testing.assert_allclose(frame["x_true"], v * time, rtol=1e-12)
    np.testing.assert_allclose(frame["y_true"], v * time - G * time**2 / 2, atol=1e-7)
    assert frame["in_flight"].all()
    assert 2 * v / G - DT < time[-1] < 2 * v / G


def test_the_extended_filter_equals_the_joint_update(frame):
    ys = frame[["theta_obs", "r_obs"]].to_numpy()[1:]
    x, P, nis = joint_filter(
        lambda x: F @ x + FALL,
        lambda x: F,
        radar,
        radar_slope,
        np.zeros((4, 4)),
        np.diag([0.01**2, 30.48**2]),
        START,
        P_0,
        ys,
        wrap=(0,),
    )
    assert_same_filter(frame, NAMES, x, P, nis)


def test_the_linear_filter_equals_the_joint_update(frame):
    H = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0]])
    x, P = START, P_0
    for row in range(1, N):
        theta, r = frame.loc[row, ["theta_obs", "r_obs"]]
        y = np.array([X_R + r * math.cos(theta), r * math.sin(theta)])
        turn = np.array(
            [[-r * math.sin(theta), math.cos(theta)], [r * math.cos(theta), math.sin(theta)]]
        )
        R = np.diag(np.diag(turn @ np.diag([0.01**2, 30.48**2]) @ turn.T))
        x, P = F @ x + FALL, F @ P @ F.T
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        x, P = x + K @ (y - H @ x), (np.eye(4) - K @ H) @ P
    assert_close(frame.loc[N - 1, [f"{n}_a_lin" for n in NAMES]], x)
    assert_close(frame.loc[N - 1, ["P_xx_a_lin", "P_yy_a_lin"]], [P[0, 0], P[2, 2]])
    assert "P_xy_a_lin" not in frame


def test_jacobians_are_the_right_ones_not_the_printed_ones():
    """The source lacks a minus in H's first entry and mislabels one derivative."""
    model = extended_model(cannonball)
    x, vx, y, vy = model.state
    X, Y = x - Symbol("x_R", real=True), y - Symbol("y_R", real=True)
    r = (X**2 + Y**2) ** (1 / 2 * 1)
    H = model.H
    assert (H[0, 0] - (-Y / (X**2 + Y**2))).simplify() == 0
    assert (H[0, 2] - X / (X**2 + Y**2)).simplify() == 0
    assert H[0, 1] == H[0, 3] == H[1, 1] == H[1, 3] == 0
    for place in ({x: 1000, y: 2000}, {x: -3000, y: 500}):
        place = {**place, Symbol("x_R", real=True): 7, Symbol("y_R", real=True): 3}
        assert float(H[1, 0].subs(place)) == pytest.approx(float((X / r).subs(place)))
        assert float(H[0, 0].subs(place)) != pytest.approx(float((Y / r**2).subs(place)))
    assert Matrix([[1, 0, 0, 0], [0, 0, 1, 0]]) == linear_model(cannonball).H


def test_the_transition_from_the_series_and_from_laplace_are_equal():
    dt = Symbol("dt", positive=True)
    assert Matrix.zeros(4, 4) == DYNAMICS**2
    series = transition_matrix(DYNAMICS, dt)
    assert series == eye(4) + DYNAMICS * dt
    assert transition_matrix_laplace(DYNAMICS, dt) == series
    assert (np.array(series.subs(dt, DT), float) == F).all()


def test_the_printed_dynamics_matrix_is_not_nilpotent():
    """Its third row maps y to y: the series would not end, and y would grow like exp(t)."""
    printed = Matrix([[0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0]])
    assert printed**2 != Matrix.zeros(4, 4)
    with pytest.raises(ValueError, match="does not end"):
        transition_matrix(printed, Symbol("dt", positive=True))


def test_two_steps_are_one_long_step_but_not_in_the_printed_series():
    """Its second term lacks the time: I + F + F^2 t^2/2! + ..."""
    a, b = symbols("a b", positive=True)

    def printed(dt):
        return eye(4) + DYNAMICS + DYNAMICS**2 * dt**2 / 2

    for series, holds in ((lambda dt: transition_matrix(DYNAMICS, dt), True), (printed, False)):
        assert ((series(a) * series(b)).expand() == series(a + b)) == holds


def test_the_printed_update_mixes_units_and_is_named_for_it():
    """A gain in m/rad, for an angle, times a residual of position."""
    m = build_model()
    x_f, K, x_obs = m["x_f", "K_x_theta", "x_obs"]
    (x_printed,) = m.columns("x_printed", section="EKF")
    step = when_observed(x_obs[t], K[t] * (x_obs[t] - x_f[t]), 0)
    m.define(x_printed[t], x_f[t] + step, "m", "as printed", start=[Missing])
    (problem,) = m.check_units()
    assert "x_printed" in str(problem)
    assert "m²" in str(problem)


def test_the_discrete_noise_is_what_small_steps_of_white_noise_add_up_to():
    dt, Phi = symbols("dt Phi_s", positive=True)
    Q = discrete_noise(DYNAMICS, diag(0, Phi, 0, Phi), dt)
    block = Matrix([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]]) * Phi
    assert diag(block, block) == Q
    n = 2000
    step = np.array([[1, DT / n], [0, 1]])
    total = np.zeros((2, 2))
    for _ in range(n):
        total = step @ total @ step.T + np.diag([0, 2.0 * DT / n])
    np.testing.assert_allclose(total, np.array(block.subs({dt: DT, Phi: 2}), float), rtol=2e-3)


def test_sine_and_cosine_were_exchanged_and_only_45_degrees_hides_it():
    """INIT_ANGLE with sin for vx: at 30 degrees the source's ball would fly at 60."""
    frame = evaluate(cannonball, angle=30)
    assert frame["vx_true"][0] == pytest.approx(915 * math.cos(math.pi / 6))
    assert frame["vx_true"][0] != pytest.approx(915 * math.sin(math.pi / 6))
    assert frame["vy_true"][0] == pytest.approx(915 * 0.5)


def test_the_printed_sine_and_cosine_fly_a_ball_at_30_degrees_as_one_at_60():
    """It lands as far away, but after 162 s instead of 93 s and from three times the height."""
    vx, vy, x, y, path = 915 * math.sin(math.pi / 6), 915 * math.cos(math.pi / 6), 0, 0, []
    dt = 0.13
    while y >= 0:
        path.append((x, y))
        x, y, vy = x + vx * dt, y + (2 * vy - G * dt) / 2 * dt, vy - G * dt
    steep, flat = (evaluate(cannonball, angle=angle, dt=dt) for angle in (60, 30))
    flown = steep.attrs["scalars"]["flight"]
    assert flown == len(path)
    np.testing.assert_allclose(steep.loc[: flown - 1, ["x_true", "y_true"]], path, atol=1e-6)
    right = flat[flat["in_flight"] == 1]
    assert len(path) / len(right) == pytest.approx(math.sqrt(3), rel=2e-3)
    assert max(y for _, y in path) / right["y_true"].max() == pytest.approx(3, rel=1e-5)
    assert path[-1][0] == pytest.approx(right["x_true"].max(), rel=2e-3)


@pytest.mark.parametrize("place", [(1000, 2000), (40_000, 9000), (30_000, -500)])
def test_no_angle_depends_on_a_velocity_and_none_on_a_ball_at_the_radars_height(place):
    """Two labels of the source: d(theta)/d(vx) stands twice, and y_T is the radar's height.

    What the first label names is 0 and cannot be -(y - y_R)/r^2, as printed beside it; with the
    second the radar would see every ball on the horizon.
    """
    x, vx, y, _ = extended_model(cannonball).state
    theta = extended_model(cannonball).observations[0].predicted
    right, up = place[0] - X_R, place[1]
    assert theta.diff(vx) == 0 != -up / (right**2 + up**2)
    known = {x: place[0], Symbol("x_R", real=True): X_R, Symbol("y_R", real=True): 0}
    step = float(theta.subs({**known, x: place[0] + 1e-3, y: up}) - theta.subs({**known, y: up}))
    assert step / 1e-3 == pytest.approx(-up / (right**2 + up**2), rel=1e-5)
    level = float(theta.subs(y, Symbol("y_R", real=True)).subs(known))
    assert level == (math.pi if right < 0 else 0)


def test_rows_after_the_landing_leave_the_statistics():
    frame = evaluate(cannonball, angle=30)
    flying = frame["in_flight"] == 1
    assert flying.sum() == math.floor(915 / G / DT) + 1 == frame.attrs["scalars"]["flight"]
    for column in ("theta_obs", "x_obs", "d_theta", "e_x_a", "NIS", "e_y_a_high"):
        assert frame.loc[~flying, column].isna().all(), column
    assert rms(frame["e_x_a"]) == pytest.approx(frame.attrs["scalars"]["rms_x_a"])
    # Without observations the state follows the motion and the gain is 0.
    assert (frame.loc[~flying, "K_x_theta"] == 0).all()
    assert np.diff(frame.loc[~flying, "vy_a"]) == pytest.approx(-G * DT)


@pytest.mark.parametrize(("angle", "lands"), [(30, True), (45, True), (60, False), (90, False)])
def test_a_ball_that_is_still_in_the_air_is_noticed(angle, lands):
    """The closed solution says where the ball is, and whether it lands before the next row."""
    frame = evaluate(cannonball, angle=angle)
    scalars, time = frame.attrs["scalars"], frame["time"].to_numpy()
    up = 915 * math.sin(math.radians(angle))
    y = up * time - G * time**2 / 2
    assert scalars["landed"] == lands == (2 * up / G < DT * N)
    np.testing.assert_allclose(frame["x_true"], 915 * math.cos(math.radians(angle)) * time)
    np.testing.assert_allclose(frame["y_true"], y, atol=1e-7)
    assert (frame["in_flight"] == (y >= 0)).all()
    assert scalars["flight"] == (y >= 0).sum()
    assert (frame["theta_obs"].notna() == (y >= 0))[1:].all()
    assert frame.loc[0, ["theta_obs", "r_obs", "x_obs", "e_x_obs"]].isna().all()
    error = (frame["x_a"] - frame["x_true"])[y >= 0][1:]
    assert scalars["rms_x_a"] == pytest.approx(rms(error))
    assert 1.8 < scalars["mean_NIS"] < 2.2
    assert (error.abs() < frame["e_x_a_high"][y >= 0][1:]).mean() > 0.8


def test_near_the_cannon_the_tangents_mislead_and_the_linear_filter_is_the_honest_one():
    """The start is wrong by three times the range: exercise 5 of the notebook."""
    frame = evaluate(cannonball, x_R=100)
    low, high = (bound / 2 / (N - 1) for bound in chi2.interval(0.999, 2 * (N - 1)))
    scalars = frame.attrs["scalars"]
    assert low < scalars["mean_NIS_lin"] / 2 < high
    assert scalars["mean_NIS"] / 2 > 2 * high
    assert scalars["rms_y_a"] > 10 * scalars["rms_y_lin"]


def test_the_error_of_a_flight_does_not_count_the_start(frame):
    """It is given, one claimed sigma in every direction, and no filter's doing."""
    assert frame.loc[0, ["e_x_a", "e_vy_a", "e_y_lin", "e_x_obs"]].isna().all()
    for name in ("x", "y"):
        error = (frame[f"{name}_a"] - frame[f"{name}_true"])[1:]
        assert frame.attrs["scalars"][f"rms_{name}_a"] == pytest.approx(rms(error))


@pytest.mark.parametrize("belief", [0.5, 1, 3])
def test_what_a_filter_is_told_of_the_radar_leaves_the_echoes_as_they_are(frame, belief):
    """Truth and claim are two knobs: sigma is what the radar does, s what the filters hear."""
    told = evaluate(cannonball, belief_theta=belief, belief_r=belief)
    for name in ("theta_obs", "r_obs", "x_obs", "y_obs", "e_x_obs"):
        pd.testing.assert_series_equal(told[name], frame[name])
    np.testing.assert_allclose(told["r_x"], belief**2 * frame["r_x"])
    # The same echoes, from a radar whose true errors are as claimed: draws scaled the other way.
    draws = pd.read_csv(DATA / "cannonball_draws.csv")
    data = {n: draws[n].to_numpy() / belief for n in ("n_theta", "n_r")}
    radar = {"sigma_theta": 0.01 * belief, "sigma_r": 30.48 * belief}
    heard = evaluate(cannonball, data, **radar)
    for name in ("x_a", "vy_a", "P_xx_a", "K_y_r", "x_a_lin", "NIS", "NIS_lin"):
        np.testing.assert_allclose(told[name], heard[name], rtol=1e-6, atol=1e-9)


def test_a_filter_that_is_told_too_little_or_too_much_is_found_out_by_its_nis(frame):
    """Mostly an innovation is the radar's error, so the mean NIS is 2 over belief squared."""
    for belief in (0.5, 2):
        told = evaluate(cannonball, belief_theta=belief, belief_r=belief).attrs["scalars"]
        assert told["mean_NIS"] * belief**2 == pytest.approx(2, abs=0.2)


def test_units_agree():
    assert cannonball.check_units() == []


def test_the_covariance_stays_positive_definite(frame):
    P = np.array(
        [[frame[f"P_{NAMES[min(i, j)]}{NAMES[max(i, j)]}_a"] for j in range(4)] for i in range(4)]
    )
    scale = np.sqrt(np.einsum("iit->it", P))
    correlation = P / scale[:, None] / scale[None]
    assert np.linalg.eigvalsh(correlation.transpose(2, 0, 1)).min() > 0


def test_process_noise_keeps_the_filter_awake():
    """With Phi_s the claimed variance no longer falls to nothing."""
    asleep, awake = evaluate(cannonball), evaluate(cannonball, Phi_s=10)
    assert awake["P_xx_a"].iloc[-1] > 10 * asleep["P_xx_a"].iloc[-1]
    assert rms(awake["e_x_a"][600:]) > rms(asleep["e_x_a"][600:])
