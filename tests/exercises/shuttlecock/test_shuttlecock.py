"""The shuttlecock: filters, fits and fall points, and what its source claims of them."""

import sys
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.polynomial import polynomial
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.stats import binom
from sympy import Matrix, Symbol, diff, series, symbols

from kfsheet import ModelError, Recurrence, add_filter, evaluate, t
from kfsheet.estimation.drag import distorted, flight
from kfsheet.exercises.shuttlecock import DATA, build_model, shuttlecock
from kfsheet.exercises.shuttlecock.filters import joint_model
from kfsheet.exercises.shuttlecock.forecasts import add_fit, add_latest, track_fit
from kfsheet.workbook.reading.open_workbook import open_workbook
from tests.estimation.test_kalman import assert_close, assert_same_filter, joint_filter

sys.path.insert(0, str(Path(__file__).parents[3] / "benchmarks"))
from shuttlecock_three_by_three import (
    compiled_steps,
    counted,
    disagreement,
    flown,
    operations,
    problems,
    step,
)

T, K, G, N = 1 / 30, 1.0, 9.80665, 27
P_0, V_0 = np.array([0, 0, 0.5]), np.array([1.5, 0.8, 4.0])
TIME = T * np.arange(N)
DOWN = np.array([0, 0, 1.0])
NAMES = [f"{letter}{axis}" for axis, letter in product("xyz", ("", "v", "a"))]
OBSERVED = ["x_obs", "y_obs", "z_obs"]


@pytest.fixture(scope="module")
def frame():
    return evaluate(shuttlecock)


def track(time, p=P_0, v=V_0, k=K):
    """Equation (6), with v_z0 where it prints v_0."""
    fading = np.exp(-k * np.asarray(time))[..., None]
    still = p + v / k + DOWN * (G / k**2 - G * np.asarray(time)[..., None] / k)
    return still - (v / k + DOWN * G / k**2) * fading


def integrated(time, k_2=0.0):
    """The flight by small steps, linear and quadratic drag; where and when it comes down."""

    def rate(_, state):
        v = state[3:]
        return [*v, *(-(K + k_2 * np.linalg.norm(v)) * v - G * DOWN)]

    def ground(_, state):
        return state[2]

    ground.direction = -1
    start, exact = [*P_0, *V_0], {"rtol": 1e-10, "atol": 1e-12}
    path = solve_ivp(rate, (0, 2), start, t_eval=time, events=ground, **exact)
    return path.y[:3].T, path.t_events[0][0], path.y_events[0][0][:2]


def rms(values, axis=None):
    return np.sqrt(np.mean(np.square(values), axis=axis))


# -- the model -----------------------------------------------------------------------------------


def test_the_draws_are_what_their_seed_makes():
    table = pd.read_csv(DATA / "shuttlecock_draws.csv")
    made = np.random.RandomState(20091219).standard_normal((N, 3)).round(6)
    assert (table[["n_x", "n_y", "n_z"]].to_numpy() == made).all()


def test_units_agree():
    assert shuttlecock.check_units() == []


def test_the_truth_is_equation_6(frame):
    np.testing.assert_allclose(frame[["x_true", "y_true", "z_true"]], track(TIME), atol=1e-14)


@pytest.mark.parametrize("k_2", [0, 0.1, 0.4])
def test_the_truth_is_what_small_steps_add_up_to(k_2):
    """Quadratic drag, stepped as linear drag of the same force, is right within 4 mm."""
    f = evaluate(shuttlecock, k_2=k_2)
    path, moment, place = integrated(TIME, k_2)
    tolerance = 0.004 if k_2 else 1e-8
    np.testing.assert_allclose(f[["x_true", "y_true", "z_true"]], path, atol=tolerance)
    found = [f.attrs["scalars"][name] for name in ("x_fall", "y_fall", "t_fall")]
    np.testing.assert_allclose(found, [*place, moment], atol=tolerance)


def test_snr_25_and_r_004_are_one_statement(frame):
    """A noise of 1/25 of the signal's power is 0.04 if that power is 1; here it is not."""
    for axis in "xyz":
        power = np.mean(frame[f"{axis}_true"] ** 2)
        noise = frame[f"{axis}_obs"] - frame[f"{axis}_true"]
        variance = frame.attrs["scalars"][f"var_{axis}"]
        assert variance == pytest.approx(power / 25)
        np.testing.assert_allclose(noise, np.sqrt(power / 25) * frame_draws(axis), atol=1e-14)
        assert variance / power == pytest.approx(shuttlecock.parameters["r_obs"].value)
        assert variance < 0.04


def test_the_band_of_the_cameras_holds_19_of_20_frames(frame):
    seen, truth = frame[OBSERVED].to_numpy(), track(TIME)
    half = 2 * rms(truth, axis=0) / 5
    np.testing.assert_allclose(frame[["x_low", "y_low", "z_low"]], truth - half, atol=1e-13)
    np.testing.assert_allclose(frame[["x_high", "y_high", "z_high"]], truth + half, atol=1e-13)
    outside = (np.abs(seen - truth) > half).sum()
    assert binom.ppf(0.001, 81, 0.0455) <= outside <= binom.ppf(0.999, 81, 0.0455)


def frame_draws(axis):
    return pd.read_csv(DATA / "shuttlecock_draws.csv")[f"n_{axis}"]


# -- the filter ----------------------------------------------------------------------------------


def nine_by_nine(frame, k=K):
    """Equations (10) to (14) of all three axes at once, with a matrix inverse."""
    A = np.kron(np.eye(3), [[1, T, T**2 / 2], [0, 1, T], [0, -k, -k * T]])
    fall = np.array([0] * 8 + [-G])
    H = np.kron(np.eye(3), [1.0, 0, 0])
    ys = frame[OBSERVED].to_numpy()
    return joint_filter(
        lambda x: A @ x + fall,
        lambda x: A,
        lambda x: H @ x,
        lambda x: H,
        0.04 * np.eye(9),
        0.04 * np.eye(3),
        np.kron(ys[0], [1.0, 0, 0]),
        np.kron(np.eye(3), np.diag([0.04, 25, 25])),
        ys[1:],
    )


def test_three_small_filters_equal_the_joint_one(frame):
    assert_same_filter(frame, NAMES, *nine_by_nine(frame))


def test_the_joint_filter_falls_apart_by_itself(frame):
    """Nine states have 45 covariances; 27 of them relate two axes, stay 0 and get no column."""
    kept = [c for c in shuttlecock.table if c.startswith("P_") and c.endswith("_f")]
    assert len(kept) == 3 * 6
    _, P, _ = nine_by_nine(frame)
    assert not P[:, :3, 3:].any()
    alone = build_model()
    add_filter(alone, joint_model(alone, "z"), section="Alone", suffix="_alone")
    found = evaluate(alone)
    for column in ("z_a", "vz_a", "az_a", "P_zvz_a", "K_az_z", "d_z"):
        assert (found[f"{column}_alone"][1:] == frame[column][1:]).all()


def test_a_first_position_that_counts_twice_is_a_start_with_half_the_variance():
    """f_start = 1/2 against a filter that starts at the first position and then assimilates it."""
    f = evaluate(shuttlecock, f_start=0.5)
    ys = f[OBSERVED].to_numpy()
    x, P = np.array([ys[0, 2], 0, 0]), np.diag([0.04, 25, 25])
    A, fall = np.array([[1, T, T**2 / 2], [0, 1, T], [0, -K, -K * T]]), np.array([0, 0, -G])
    H, R = np.array([[1.0, 0, 0]]), np.array([[0.04]])
    S = H @ P @ H.T + R
    P = P - P @ H.T @ H @ P / S
    found = joint_filter(
        lambda x: A @ x + fall,
        lambda x: A,
        lambda x: H @ x,
        lambda x: H,
        0.04 * np.eye(3),
        R,
        x,
        P,
        ys[1:, 2:],
    )
    for i, name in enumerate(["z_a", "vz_a", "az_a"]):
        assert_close(f[name], found[0][:, i])
    assert_close(f["P_zz_a"], found[1][:, 0, 0])


@pytest.mark.parametrize("axes", ["", "w", "xyw"])
def test_an_axis_that_does_not_exist_is_refused(axes):
    with pytest.raises(ModelError, match="give some of x, y, z"):
        joint_model(shuttlecock, axes)


def test_operations_are_counted_as_by_hand():
    """n = m = 1 on the fingers of both hands; the covariance of n = 3 by the textbook's formula."""
    assert list(operations(1, 1).values()) == [2, 3, 5, 4, 3]
    product = 3 * 3 * (3 + 2)
    assert operations(3, 1)["its covariance, (11)"] == 2 * product + 9


def test_nine_by_nine_costs_nine_times_as_much():
    assert counted().loc["one step", "ratio"] == pytest.approx(9, abs=0.5)


def test_three_filters_and_the_joint_one_fly_the_same_flight(frame):
    """The benchmark's two programs, with inverses, against each other and against the sheet."""
    positions = frame[OBSERVED].to_numpy()
    assert disagreement(positions) < 1e-12
    for states, P in flown(positions):
        assert_same_filter(frame, NAMES, states, P, nine_by_nine(frame)[2])


def test_compiled_loops_compute_what_they_are_timed_for():
    pytest.importorskip("numba")
    seen = np.array([[0.3], [-0.2], [0.9]])
    _, (x, P, *model) = problems(np.array([0.1, 0, 0.5]))
    found = compiled_steps()(x, P, *model, seen, 4)
    for _ in range(4):
        x, P = step(x, P, *model, seen)
    np.testing.assert_allclose(found[0], x, atol=1e-13)
    np.testing.assert_allclose(found[1], P, atol=1e-13)


def test_the_third_row_makes_the_acceleration_a_function_of_the_velocity(frame):
    after = frame[1:]
    np.testing.assert_allclose(after["az_f"], -K * after["vz_f"] - G)
    np.testing.assert_allclose(after["ax_f"], -K * after["vx_f"], atol=1e-14)


def test_A_errs_by_T_cubed_in_position_and_T_squared_in_velocity():
    """On a state that obeys the drag law, against the exact transition."""
    step, k, v, p = symbols("T k v p", positive=True)
    A = Matrix([[1, step, step**2 / 2], [0, 1, step], [0, -k, -k * step]])
    exact = flight(k, 0, step, distorted(k, step)) * Matrix([p, v, 1])
    error = A * Matrix([p, v, -k * v]) - Matrix([*exact, -k * exact[1]])
    orders = [series(e, step, 0, 5).removeO().as_poly(step).monoms()[-1][0] for e in error]
    assert orders == [3, 2, 2]
    assert A.rank() == 2


def test_gravity_enters_through_the_acceleration_alone():
    """B is never printed; (0, 0, 1) follows from the model, (T^2/2, T, 1) counts gravity twice."""
    model = joint_model(shuttlecock, "z")
    g = shuttlecock["g"]
    B = Matrix([diff(e, g) / -1 for e in model.transition])
    assert Matrix([0, 0, 1]) == B
    at = {Symbol("z", real=True): 0.5, Symbol("vz", real=True): 4, Symbol("az", real=True): -4 - G}
    scalars = evaluate(shuttlecock).attrs
    values = {**scalars["parameters"], **scalars["scalars"]}
    position, velocity, _ = (
        float(e.subs({shuttlecock["dt"]: values["dt"], shuttlecock["k_fit"]: 1, g: G}).subs(at))
        for e in model.transition
    )
    exact = track([T, T + 1e-6])[:, 2]
    assert position == pytest.approx(exact[0], abs=1e-4)
    true_velocity = (exact[1] - exact[0]) / 1e-6
    assert velocity == pytest.approx(true_velocity, abs=0.01)
    assert abs(velocity - T * G - true_velocity) > 0.3


def test_the_printed_position_lacks_a_factor_T():
    """Equation (9): x(i-1) + x'(i-1) adds metres and metres per second."""
    m = Recurrence("printed", title="As printed", rows=3)
    dt = m.parameter("dt", 1 / 30, "s", "time between two frames")
    x, v = m.columns("x", "v", section="Printed")
    v_0 = m.parameter("v_0", 1, "m/s", "velocity at the start")
    m.define(v[t], v[t - 1], "m/s", "velocity", start=[v_0])
    m.define(x[t], x[t - 1] + v[t - 1] + v[t] * dt, "m", "position", start=[0])
    (problem,) = m.check_units()
    assert problem.name == "x"
    assert "m/s" in problem.reason


def test_the_printed_height_starts_with_another_velocity():
    """Equation (6) prints v_0, the speed, in the height; only v_z0 starts as it should."""
    f = evaluate(shuttlecock)
    printed = track(TIME, v=np.array([*V_0[:2], np.linalg.norm(V_0)]))[:, 2]
    started = (f["z_true"][1] - f["z_true"][0]) / T
    assert started == pytest.approx(4 - (4 + G) * T / 2, abs=0.01)
    assert (printed[1] - printed[0]) / T > started + 0.3


# -- fits and fall points ------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "seen"), [("raw", "obs"), ("kf", "a")])
def test_running_sums_are_a_fit_to_all_frames_so_far(frame, name, seen):
    X = (1 - np.exp(-K * TIME)) / K
    y = frame[[f"{axis}_{seen}" for axis in "xyz"]].to_numpy() - np.outer(G * (X - TIME) / K, DOWN)
    for last in range(1, N):
        p, v = polynomial.polyfit(X[: last + 1], y[: last + 1], 1)
        assert_close(frame.loc[last, [f"p_{axis}_{name}" for axis in "xyz"]], p, 1e-8)
        assert_close(frame.loc[last, [f"v_{axis}_{name}" for axis in "xyz"]], v, 1e-8)


def test_a_forecast_from_what_is_not_there_is_refused():
    m = build_model()
    with pytest.raises(ModelError, match="x_smoothed"):
        add_fit(m, "Fit", "s", "fit to nothing", "smoothed")
    with pytest.raises(ModelError, match="x_a_s"):
        add_latest(m, "Latest", "s", "no filter", "_s")


def test_without_noise_every_fit_is_the_truth():
    f = evaluate(shuttlecock, {name: np.zeros(N) for name in ("n_x", "n_y", "n_z")})
    np.testing.assert_allclose(f[["p_x_raw", "p_y_raw", "p_z_raw"]][1:], [P_0] * 26, atol=1e-12)
    np.testing.assert_allclose(f[["v_x_raw", "v_y_raw", "v_z_raw"]][1:], [V_0] * 26, atol=1e-11)
    assert f["e_fall_raw"].max() < 1e-11


@pytest.mark.parametrize(
    "parameters", [{}, {"k_m": 0.2}, {"f_k": 2}, {"z_fall": -2}, {"k_2": 0.4}], ids=str
)
def test_newton_in_cells_finds_the_fall_that_a_bracketing_root_finder_finds(parameters):
    f = evaluate(shuttlecock, **parameters)
    k, ground = f.attrs["scalars"]["k_fit"], f.attrs["parameters"]["z_fall"]
    for name, row in product(("raw", "kf"), range(3, N)):
        p, v = (f.loc[row, [f"{s}_{a}_{name}" for a in "xyz"]].to_numpy() for s in "pv")
        top = max(0.0, np.log1p(k * v[2] / G) / k)
        above = partial(lambda s, p, v: track(s, p, v, k)[2] - ground, p=p, v=v)
        fall = brentq(above, top, 20, xtol=1e-14)
        assert f.loc[row, f"t_fall_{name}"] == pytest.approx(fall, abs=1e-9)
        place = f.loc[row, [f"x_fall_{name}", f"y_fall_{name}"]]
        np.testing.assert_allclose(place, track(fall, p, v, k)[:2], atol=1e-8)


def test_where_a_flight_stays_below_there_is_no_forecast():
    f = evaluate(shuttlecock, z_fall=3)
    top = track(np.log1p(4 / G))[2]
    assert top < 3
    assert f["t_fall_raw"][5:].isna().all()
    assert f["e_fall_kf"][5:].isna().all()
    assert f["t_fall_true"].notna().all()


def test_an_exact_filter_without_prior_knowledge_is_the_fit():
    """Recursive least squares: the same numbers by two roads, frame by frame."""
    f = evaluate(shuttlecock, var_v=1e9)
    both = f[["x_fall_ex", "x_fall_raw", "y_fall_ex", "y_fall_raw", "t_fall_ex", "t_fall_raw"]][2:]
    np.testing.assert_allclose(both.to_numpy()[:, ::2], both.to_numpy()[:, 1::2], atol=1e-5)


def exact_filter(frame, Phi_s, var_v, ys):
    X = (1 - np.exp(-K * T)) / K
    F = np.kron(np.eye(3), [[1, X], [0, 1 - K * X]])
    fall = np.array([0, 0, 0, 0, G * (X - T) / K, -G * X])
    Q = Phi_s * np.kron(np.eye(3), [[T**3 / 3, T**2 / 2], [T**2 / 2, T]])
    H = np.kron(np.eye(3), [1.0, 0])
    variance = [frame.attrs["scalars"][f"var_{axis}"] for axis in "xyz"]
    start = np.diag(np.ravel([(r, var_v) for r in variance]))
    return joint_filter(
        lambda x: F @ x + fall,
        lambda x: F,
        lambda x: H @ x,
        lambda x: H,
        Q,
        np.diag(variance),
        np.kron(ys[0], [1.0, 0]),
        start,
        ys[1:],
    )


def test_the_exact_filter_equals_the_joint_update():
    f = evaluate(shuttlecock, Phi_s=0.7, var_v=9)
    found = exact_filter(f, 0.7, 9, f[OBSERVED].to_numpy())
    assert_same_filter(f, ["x", "vx", "y", "vy", "z", "vz"], *found, suffix="_ex")


def test_the_gate_treats_an_outlier_as_a_missing_frame():
    wild = {name: frame_draws(name[-1]).to_numpy(copy=True) for name in ("n_x", "n_y", "n_z")}
    wild["n_x"][12] = 15
    f = evaluate(shuttlecock, wild, gate=4)
    ys = f[OBSERVED].to_numpy(copy=True)
    ys[12, 0] = np.nan
    x, P, _ = exact_filter(f, 0, 25, ys)
    for i, name in enumerate(["x", "vx", "y", "vy", "z", "vz"]):
        assert_close(f[f"{name}_a_ex"], x[:, i])
    assert_close(f["P_xx_a_ex"], P[:, 0, 0])
    assert (f.loc[f["K_x_x_ex"] == 0].index == [12]).all()


def test_the_sums_of_the_fit_are_those_of_the_normal_equations():
    solution, sums = track_fit()
    X, y = np.array([0.0, 1, 2, 4]), np.array([1.0, 3, 4, 9])
    at = dict(zip(sums.values(), (4, X.sum(), X @ X, y.sum(), X @ y), strict=True))
    found = [float(solution[letter].subs(at)) for letter in "pv"]
    np.testing.assert_allclose(found, np.linalg.lstsq(np.vander(X, 2)[:, ::-1], y)[0])


def test_a_wide_sheet_prints_on_several_pages_each_with_frame_and_time():
    """On one page, 72 columns would be some 4 mm wide each."""
    book = open_workbook(Path(__file__).parents[3] / "workbooks" / "shuttlecock.xlsx")
    wide, narrow = book["Kalman"], book["Camera"]
    assert wide.max_column / wide.page_setup.fitToWidth <= 16
    assert wide.print_title_cols == "$A:$B"
    assert narrow.page_setup.fitToWidth in (None, 1)
