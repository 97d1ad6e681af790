"""The filter builder against filters that are written otherwise: joint, batch, exact, filterpy."""

import math
import re
from fractions import Fraction
from itertools import islice

import numpy as np
import pytest
from filterpy.kalman import ExtendedKalmanFilter
from hypothesis import given
from hypothesis import strategies as st
from sympy import Matrix, Rational, Symbol, atan2, diag, eye, pi, sqrt, symbols, zeros

from kfsheet import (
    Intermediate,
    ModelError,
    Observation,
    Recurrence,
    State,
    StateSpace,
    add_filter,
    evaluate,
    python_source,
    t,
    when_observed,
)
from kfsheet.estimation.filter_columns import wrapped

RNG = np.random.RandomState(7)


def joint_filter(f, F, h, H, Q, R, x, P, observations, wrap=()):
    """The textbook's filter with a matrix inverse; a missing observation leaves its row out."""
    history = [(x, P, np.nan)]
    for y in observations:
        A = F(x)
        x, P = f(x), A @ P @ A.T + Q
        seen = ~np.isnan(y)
        d, C = y - h(x), H(x)[seen]
        for k in wrap:
            d[k] = math.remainder(d[k], 2 * math.pi)
        d = d[seen]
        S = C @ P @ C.T + R[np.ix_(seen, seen)]
        K = P @ C.T @ np.linalg.inv(S)
        nis = d @ np.linalg.solve(S, d) if seen.any() else np.nan
        x, P = x + K @ d, (np.eye(len(x)) - K @ C) @ P
        history.append((x, P, nis))
    return [np.array(part) for part in zip(*history, strict=True)]


def assert_close(ours, theirs, tolerance=1e-9):
    """Relative to the largest value of a column."""
    theirs = np.asarray(theirs, float)
    scale = np.nanmax(np.abs(theirs))
    np.testing.assert_allclose(ours, theirs, rtol=tolerance, atol=tolerance * scale)


def assert_same_filter(frame, names, x, P, nis, suffix=""):
    for i, a in enumerate(names):
        assert_close(frame[f"{a}_a{suffix}"], x[:, i])
        for j, b in enumerate(names[i:], i):
            column = f"P_{a}{b}_a{suffix}"
            if column in frame:
                assert_close(frame[column], P[:, i, j])
            else:
                assert not P[:, i, j].any()
    assert_close(frame[f"NIS{suffix}"][1:], nis[1:])


def dense(n, m, rows, missing=(), gate=None):
    """A linear model without a single zero, as a recurrence and as arrays."""
    F, H = np.eye(n) + 0.1 * RNG.standard_normal((n, n)), RNG.standard_normal((m, n))
    Q, R = 0.1 * np.eye(n) + 0.01, np.diag(0.5 + RNG.random_sample(m))
    ys = RNG.standard_normal((rows, m))
    for place in missing:
        ys[place] = np.nan
    r = Recurrence("dense", title="A dense model")
    value = {}

    def number(name, x):
        value[name] = float(x)
        return r.parameter(name, float(x), "", name)

    state = {
        Symbol(f"s{i}_", real=True): State("", f"element {i}", Rational(i), Rational(1 + i))
        for i in range(n)
    }
    x = Matrix(list(state))
    A = Matrix(n, n, lambda i, j: number(f"F_{i}_{j}", F[i, j]))
    C = Matrix(m, n, lambda i, j: number(f"H_{i}_{j}", H[i, j]))
    N = Matrix(n, n, lambda i, j: number(f"Q_{i}_{j}", Q[i, j]) if i <= j else 0)
    N = Matrix(n, n, lambda i, j: N[min(i, j), max(i, j)])
    seen = []
    for k in range(m):
        cell = r.data(
            f"y_{k}", ys[:, k], "", "observed", section="Data", may_be_missing=bool(missing)
        )
        r_k = number(f"r_{k}", R[k, k])
        seen.append(Observation(f"y{k}", cell[t], (C * x)[k], r_k, "", gate=gate))
    add_filter(r, StateSpace(state, list(A * x), N, seen), section="Filter")
    arrays = {"F": F, "H": H, "Q": Q, "R": R, "ys": ys}
    return r, [s.name for s in state], arrays


@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 1), (3, 2), (4, 3)])
@pytest.mark.parametrize("missing", [(), ((2, 0), (3, slice(None)), (5, -1))], ids=["all", "gaps"])
def test_one_observation_after_the_other_equals_the_joint_update(n, m, missing):
    r, names, a = dense(n, m, rows=12, missing=missing)
    x, P, nis = joint_filter(
        lambda x: a["F"] @ x,
        lambda x: a["F"],
        lambda x: a["H"] @ x,
        lambda x: a["H"],
        a["Q"],
        a["R"],
        np.arange(n, dtype=float),
        np.diag(1.0 + np.arange(n)),
        a["ys"][1:],
    )
    assert_same_filter(evaluate(r), names, x, P, nis)


@pytest.mark.parametrize("missing", [(), ((5, 1),)], ids=["all", "gap"])
def test_a_gate_treats_outliers_as_missing_and_keeps_what_else_was_seen(missing):
    r, names, a = dense(3, 2, rows=12, missing=missing, gate=8)
    seen, kept = a["ys"].copy(), a["ys"].copy()
    for place in ((4, 0), (7, 1), (9, 0), (9, 1)):
        seen[place], kept[place] = 1000, np.nan
    x, P, _ = joint_filter(
        lambda x: a["F"] @ x,
        lambda x: a["F"],
        lambda x: a["H"] @ x,
        lambda x: a["H"],
        a["Q"],
        a["R"],
        np.arange(3.0),
        np.diag(1.0 + np.arange(3)),
        kept[1:],
    )
    frame = evaluate(r, {"y_0": seen[:, 0], "y_1": seen[:, 1]})
    assert (frame["NIS"][[4, 7, 9]] > 8**2).all()  # the innovation itself stays to be seen
    for i, name in enumerate(names):
        assert_close(frame[f"{name}_a"], x[:, i])
        assert_close(frame[f"P_{name}{name}_a"], P[:, i, i])


def test_long_products_get_columns_of_their_own():
    """F P F' of a dense 4-state model has 16 terms; none of its formulas may be long."""
    r, _, _ = dense(4, 3, rows=5)
    assert {"FP_s0__s1_", "PH_s0__y0"} <= set(r.table)
    assert max(len(str(c.expression)) for c in r.table.values() if not c.is_data) < 200


def radar(rows=60, **options):
    """A ball that flies past a radar, with drag: nonlinear in motion and in observation."""
    r = Recurrence("radar", title="A ball with drag past a radar")
    dt = r.parameter("dt", 0.1, "s", "time step", sign="positive")
    c = r.parameter("c_d", 0.01, "1/m", "drag")
    g = r.parameter("g", 9.8, "m/s2", "gravity")
    x_0 = r.parameter("x_0", 24, "m", "start")
    noise = np.random.RandomState(3).standard_normal((rows, 2))
    time = 0.1 * np.arange(rows)
    angle = np.arctan2(1 + 20 * time - 4.9 * time**2, 25 - 20 * time) + 0.02 * noise[:, 0]
    reach = np.hypot(1 + 20 * time - 4.9 * time**2, 25 - 20 * time) + 0.5 * noise[:, 1]
    ys = np.column_stack([angle, reach])
    ys[5, 0] = ys[9, 1] = np.nan
    ys[20] = np.nan
    theta = r.data("theta_obs", ys[:, 0], "rad", "angle", section="Radar", may_be_missing=True)
    reach = r.data("r_obs", ys[:, 1], "m", "range", section="Radar", may_be_missing=True)
    x, vx, y, vy = symbols("x vx y vy", real=True)
    speed = sqrt(vx**2 + vy**2)
    state = {
        x: State("m", "distance", x_0, 4),
        vx: State("m/s", "velocity", -12, 9),
        y: State("m", "height", 2, 4),
        vy: State("m/s", "velocity upwards", 12, 9),
    }
    step = [
        x + vx * dt,
        vx - c * speed * vx * dt,
        y + vy * dt - g * dt**2 / 2,
        vy - (g + c * speed * vy) * dt,
    ]
    model = StateSpace(
        state,
        step,
        diag(0, Rational(1, 16), 0, Rational(1, 16)),
        [
            Observation("theta", theta[t], atan2(y, x), Rational(1, 16), "rad", angle=True),
            Observation("r", reach[t], sqrt(x**2 + y**2), Rational(1, 4), "m"),
        ],
    )
    add_filter(r, model, section="Filter", **options)
    return r, ys


def fly(x, dt=0.1, c=0.01, g=9.8):
    speed = np.hypot(x[1], x[3])
    return np.array(
        [
            x[0] + x[1] * dt,
            x[1] - c * speed * x[1] * dt,
            x[2] + x[3] * dt - g * dt**2 / 2,
            x[3] - (g + c * speed * x[3]) * dt,
        ]
    )


def look(x):
    return np.array([np.arctan2(x[2], x[0]), np.hypot(x[0], x[2])])


def slope(function):
    """Jacobian by central differences, to about 1e-10: shares nothing with SymPy."""

    def jacobian(x, h=1e-4):
        steps = np.eye(len(x)) * h
        far = [(function(x + 2 * s), function(x - 2 * s)) for s in steps]
        near = [(function(x + s), function(x - s)) for s in steps]
        return np.column_stack(
            [(8 * (b[0] - b[1]) - (a[0] - a[1])) / (12 * h) for a, b in zip(far, near, strict=True)]
        )

    return jacobian


def test_a_nonlinear_model_equals_a_filter_with_numerical_jacobians():
    r, ys = radar()
    x, P, nis = joint_filter(
        fly,
        slope(fly),
        look,
        slope(look),
        np.diag([0, 1 / 16, 0, 1 / 16]),
        np.diag([1 / 16, 1 / 4]),
        np.array([24.0, -12, 2, 12]),
        np.diag([4.0, 9, 4, 9]),
        ys[1:],
        wrap=(0,),
    )
    frame = evaluate(r)
    for i, a in enumerate(("x", "vx", "y", "vy")):
        np.testing.assert_allclose(frame[f"{a}_a"], x[:, i], rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(frame["P_xvy_a"], P[:, 0, 3], rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(frame["NIS"][1:], nis[1:], rtol=1e-6)


def test_filterpy_computes_the_same():
    """Its update takes both observations at once, with numpy's inverse."""
    r, ys = radar()
    ys = np.nan_to_num(ys, nan=1.0)
    frame = evaluate(r, {"theta_obs": ys[:, 0], "r_obs": ys[:, 1]})
    ekf = ExtendedKalmanFilter(dim_x=4, dim_z=2)
    ekf.x, ekf.P = np.array([24.0, -12, 2, 12]), np.diag([4.0, 9, 4, 9])
    ekf.Q, ekf.R = np.diag([0, 1 / 16, 0, 1 / 16]), np.diag([1 / 16, 1 / 4])

    def residual(a, b):
        return np.array([math.remainder(a[0] - b[0], 2 * math.pi), a[1] - b[1]])

    for row in range(1, 60):
        ekf.F = slope(fly)(ekf.x)
        ekf.P = ekf.F @ ekf.P @ ekf.F.T + ekf.Q
        ekf.x = fly(ekf.x)
        ekf.update(ys[row], slope(look), look, residual=residual)
        found = frame.loc[row, ["x_a", "vx_a", "y_a", "vy_a"]]
        np.testing.assert_allclose(found, ekf.x, rtol=1e-6, atol=1e-6)


def test_without_noise_of_the_model_the_filter_is_weighted_least_squares():
    """All observations in one batch, with the start as one more of them."""
    rows, dt, r, s = 30, Fraction(1, 4), 2.0, (9.0, 4.0)
    y = RNG.standard_normal(rows) + 5
    m = Recurrence("line", title="Constant velocity")
    cell = m.data("y", y, "m", "observed", section="Data")
    x, v = symbols("x v", real=True)
    state = {
        x: State("m", "position", 1, Rational(9)),
        v: State("m/s", "velocity", 0, Rational(4)),
    }
    step = [x + v * Rational(1, 4), v]
    model = StateSpace(state, step, zeros(2, 2), [Observation("y", cell[t], x, Rational(2), "m")])
    add_filter(m, model, section="Filter")
    frame = evaluate(m)

    times = float(dt) * np.arange(1, rows)
    A = np.vstack([np.eye(2), np.column_stack([np.ones(rows - 1), times])])
    b = np.concatenate([[1.0, 0.0], y[1:]])
    W = np.diag([1 / s[0], 1 / s[1], *[1 / r] * (rows - 1)])
    covariance = np.linalg.inv(A.T @ W @ A)
    x_0, v_0 = covariance @ A.T @ W @ b
    forward = np.array([[1, times[-1]], [0, 1]])
    end = forward @ covariance @ forward.T
    assert_close(frame[["x_a", "v_a"]].iloc[-1], [x_0 + v_0 * times[-1], v_0])
    assert_close(frame[["P_xx_a", "P_xv_a", "P_vv_a"]].iloc[-1], [end[0, 0], end[0, 1], end[1, 1]])


def test_a_small_case_in_exact_rationals():
    """The generated source computes with fractions as well; so no rounding excuses a difference."""
    m = Recurrence("exact", title="Exact", rows=3)
    q, r_1, r_2 = (m.parameter(n, 1, "", n) for n in ("q", "r_1", "r_2"))
    a = m.data("a", [0, 1, 2], "", "observed", section="Data")
    b = m.data("b", [0, 3, 1], "", "observed", section="Data")
    x, v = symbols("x v", real=True)
    starts = (m.parameter(name, 1, "", name) for name in ("x_0", "s_x", "v_0", "s_v"))
    state = {x: State("", "position", *islice(starts, 2)), v: State("", "velocity", *starts)}
    seen = [Observation("a", a[t], x + v, r_1, ""), Observation("b", b[t], x - 2 * v, r_2, "")]
    add_filter(m, StateSpace(state, [x + v, v], diag(0, q), seen), section="Filter")
    namespace = {}
    exec(python_source(m).replace("= 0.0", "= 0"), namespace)
    numbers = {"q": Fraction(1, 3), "r_1": Fraction(2, 7), "r_2": Fraction(5, 11)}
    numbers |= {"x_0": Fraction(1), "s_x": Fraction(2), "v_0": Fraction(0), "s_v": Fraction(3)}
    columns, _ = namespace["exact"](
        a=list(map(Fraction, (0, 1, 2))), b=list(map(Fraction, (0, 3, 1))), **numbers
    )

    F, H = Matrix([[1, 1], [0, 1]]), Matrix([[1, 1], [1, -2]])
    Q, R = diag(0, Rational(1, 3)), diag(Rational(2, 7), Rational(5, 11))
    X, P = Matrix([1, 0]), diag(2, 3)
    for row in (1, 2):
        X, P = F * X, F * P * F.T + Q
        d, S = Matrix([[0, 1, 2][row], [0, 3, 1][row]]) - H * X, H * P * H.T + R
        K = P * H.T * S.inv()
        nis = (d.T * S.inv() * d)[0]
        X, P = X + K * d, (eye(2) - K * H) * P
        found = [columns[c][row] for c in ("x_a", "v_a", "P_xx_a", "P_xv_a", "P_vv_a", "NIS")]
        assert all(isinstance(value, Fraction) for value in found)
        assert found == [Fraction(int(e.p), int(e.q)) for e in (*X, P[0, 0], P[0, 1], P[1, 1], nis)]


def test_the_covariance_stays_positive_definite():
    frame = evaluate(radar()[0])
    names = ["x", "vx", "y", "vy"]
    P = np.array(
        [[frame[f"P_{a}{b}_a" if i <= j else f"P_{b}{a}_a"] for j, b in enumerate(names)]
         for i, a in enumerate(names)]
    )  # fmt: skip
    assert np.linalg.eigvalsh(P.transpose(2, 0, 1)).min() > 0


def test_parts_that_never_meet_are_filters_of_their_own():
    """Two axes in one model: the same numbers as alone, and no column for what stays 0."""

    def build(axes, suffix=""):
        m = Recurrence("axes", title="Axes")
        state, step, seen = {}, [], []
        for n, axis in enumerate(axes):
            values = np.random.RandomState(ord(axis)).standard_normal(20)
            cell = m.data(f"{axis}_obs", values, "m", "observed", section="Data")
            p, v = symbols(f"{axis} v{axis}", real=True)
            state |= {p: State("m", "position", n - n, 1), v: State("m/s", "velocity", 1, 4)}
            step += [p + v, v]
            seen.append(Observation(axis, cell[t], p, Rational(1, 2), "m"))
        noise = diag(*[0, Rational(1, 9)] * len(axes))
        add_filter(m, StateSpace(state, step, noise, seen), section="Filter", suffix=suffix)
        return evaluate(m)

    both, x, y = build("xy"), build("x"), build("y")
    assert not {"P_xy_a", "K_x_y", "x_1", "d_y_left"} & set(both.columns)
    for alone in (x, y):
        for column in set(alone.columns) - {"NIS"}:
            assert both[column].equals(alone[column]), column
    assert_close(both["NIS"][1:], x["NIS"][1:] + y["NIS"][1:], 1e-15)


def test_what_is_not_observed_follows_the_forecast():
    m = Recurrence("blind", title="One of two is seen")
    cell = m.data("obs", [1.0, 2.0, 3.0], "m", "observed", section="Data")
    x, y = symbols("x y", real=True)
    state = {x: State("m", "seen", 0, 1), y: State("m", "unseen", 5, 1)}
    seen = [Observation("x", cell[t], x, 1, "m")]
    add_filter(m, StateSpace(state, [x, y], diag(0, Rational(1, 4)), seen), section="Filter")
    frame = evaluate(m)
    assert frame["y_a"].tolist() == [5, 5, 5]
    assert frame["P_yy_a"].tolist() == [1, 1.25, 1.5]
    assert frame["P_xx_a"].tolist() == pytest.approx([1, 1 / 2, 1 / 3])


def test_a_variance_may_be_a_column_that_is_missing_with_its_observation():
    m = Recurrence("varying", title="An error that varies")
    cell = m.data("obs", [1, 2, np.nan, 3], "m", "seen", section="Data", may_be_missing=True)
    (r,) = m.columns("r_obs", section="Data")
    m.define(r[t], when_observed(cell[t], cell[t] ** 2), "m2", "grows with what is seen")
    x = Symbol("x", real=True)
    model = StateSpace(
        {x: State("m", "seen", 0, 1)}, [x], zeros(1, 1), [Observation("x", cell[t], x, r[t], "m")]
    )
    add_filter(m, model, section="Filter")
    frame = evaluate(m)
    assert frame["S_x"].tolist()[1] == 5
    assert np.isnan(frame["S_x"][2])
    assert frame["K_x_x"].tolist()[1:] == pytest.approx([0.2, 0, 0.8 / 9.8])
    assert frame["x_a"].tolist()[1:3] == pytest.approx([0.4, 0.4])


@given(st.floats(-50, 50))
def test_a_wrapped_angle_is_the_same_direction_within_half_a_turn(angle):
    a = Symbol("a", real=True)
    found = float(wrapped(a).subs(a, angle))
    assert -math.pi <= found <= math.pi
    difference = found - math.remainder(angle, 2 * math.pi)
    assert min(abs(difference), abs(abs(difference) - 2 * math.pi)) < 1e-12


def test_half_a_turn_to_either_side_is_plus_pi():
    """The end of (-pi, pi] that belongs to it, in symbols and in floating-point numbers."""
    m = Recurrence("half_turns", title="Half a turn, and one and a half")
    angle = m.data("angle", [math.pi, -math.pi], "rad", "half a turn", section="Turns")
    (same,) = m.columns("same", section="Turns")
    m.define(same[t], wrapped(angle[t]), "rad", "wrapped")
    assert evaluate(m)["same"].tolist() == [math.pi, math.pi]
    assert {wrapped(n * pi) for n in (-3, -1, 1, 3)} == {pi}


X = Symbol("x", real=True)
ONE = {X: State("m", "position", 0, 1)}
SEEN = Observation("x", X, X, 1, "m")


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ((ONE, [X, X], zeros(1, 1), [SEEN]), "the state has 1 elements but the transition has 2: "),
        ((ONE, [X], zeros(2, 2), [SEEN]), "Q must be symmetric and 1 x 1"),
        ((ONE, [X], zeros(1, 1), []), "give one or more observations"),
        ((ONE, [X], zeros(1, 1), [SEEN, SEEN]), "of different names"),
        (({}, [], zeros(0, 0), [SEEN]), "no elements"),
        ((ONE, [X], zeros(1, 1), [Observation("x", X, 1, 1, "m")]), "depends on no element"),
    ],
)
def test_a_model_whose_parts_do_not_fit_is_refused(parts, message):
    with pytest.raises(ModelError, match=message):
        StateSpace(*parts)


@pytest.mark.parametrize("gate", [0, -3])
def test_a_gate_that_lets_nothing_in_is_refused(gate):
    with pytest.raises(ModelError, match="the gate of x is"):
        Observation("x", X, X, 1, "m", gate=gate)


def test_names_that_are_taken_are_refused_and_nothing_is_added():
    m = Recurrence("twice", title="Twice")
    cell = m.data("x_a", [1.0, 2.0], "m", "in the way", section="Data")
    model = StateSpace(ONE, [X], zeros(1, 1), [Observation("x", cell[t], X, 1, "m")])
    with pytest.raises(ModelError, match=r"x_a.*taken"):
        add_filter(m, model, section="Filter")
    assert set(m.table) == {"x_a"}


def test_a_transition_through_intermediates_is_the_same_filter():
    """A midpoint step of x' = -k x^2 in one formula, and in three, with its derivative."""
    frames = []
    for through in (False, True):
        m = Recurrence("decay", title="Decay", step="row")
        k, dt = m.parameter("k", 0.3, "", "rate"), m.parameter("dt", 0.1, "", "step")
        y = m.data("y", [2, 1.9, math.nan, 1.8, 1.7], "", "seen", section="D", may_be_missing=True)
        x, slope, half = (Symbol(name, real=True) for name in ("x", "slope", "half"))
        formulas = {slope: -k * x**2, half: x + slope * dt / 2}
        rule = x - k * half**2 * dt
        plain = rule.subs(half, formulas[half]).subs(slope, formulas[slope])
        model = StateSpace(
            {x: State("", "x", 2, 1)},
            [rule if through else plain],
            Matrix([[Rational(1, 8)]]),
            [Observation("y", y[t], x, Rational(1, 4), "")],
            {w: Intermediate("", str(w), f) for w, f in formulas.items()} if through else {},
        )
        add_filter(m, model, section="F")
        frames.append(evaluate(m))
    one, three = frames
    assert {"slope", "half", "D_slope_x", "D_half_x"} <= set(three.columns) - set(one.columns)
    for column in one.columns:
        assert_close(three[column], one[column], 1e-14)


def test_an_intermediate_reads_only_those_before_it():
    x, a, b = symbols("x a b", real=True)
    with pytest.raises(ModelError, match="after it"):
        StateSpace(
            {x: State("", "x", 0, 1)},
            [a],
            Matrix([[0]]),
            [Observation("y", x, x, 1, "")],
            {a: Intermediate("", "a", b * x), b: Intermediate("", "b", x)},
        )


def test_no_name_holds_what_libreoffice_reads_as_the_code_of_a_character():
    """It shows K_x1_u as Ku, for _x1_ is the character 1; a state may be called x1 all the same."""
    m = Recurrence("code", title="Code", step="row")
    y = m.data("y", [1, 2, 3], "", "seen", section="D")
    x1, x2 = symbols("x1 x2", real=True)
    state = {x1: State("", "a", 0, 1), x2: State("", "b", 0, 1)}
    seen = [Observation("y", y[t], x1 * x2 + x1, 1, "")]
    model = StateSpace(state, [x1 + x2, x1 * x2], eye(2), seen)
    for suffix in ("", "_lin"):
        add_filter(m, model, section=f"F{suffix}", suffix=suffix)
    names = [*m.table, *m.parameters]
    assert {"Kx1_y", "x1_f_lin", "Fx2x1_lin"} <= set(names)
    assert not [name for name in names if re.search("_x[0-9A-Fa-f]{1,4}_", name)]
    with pytest.raises(ModelError, match="LibreOffice"):
        m.parameter("K_x1_u", 1, "", "refused")
