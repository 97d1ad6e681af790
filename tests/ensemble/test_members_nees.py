"""NEES is e' P^-1 e of the states that are named, in whatever order, or an error."""

from itertools import permutations

import numpy as np
import pytest
from sympy import Piecewise, sqrt

from kfsheet import NEES, DataError, Draws, ModelError, Recurrence, evaluate, study, t
from kfsheet.ensemble.nees import normalised
from kfsheet.exercises.cannonball import cannonball
from kfsheet.exercises.shuttlecock import shuttlecock

NAMES = ("x", "vx", "y", "vy")
DRAWS = Draws("n_theta", "n_r", seed=3)


def nees_of_one(run, states, row):
    """By the inverse of the matrix that stands in the columns of a run, whatever their order."""
    known = set(run.columns)

    def entry(a, b):
        name = next((n for n in (f"P_{a}{b}_a", f"P_{b}{a}_a") if n in known), None)
        return run.loc[row, name] if name else 0.0

    P = np.array([[entry(a, b) for b in states] for a in states])
    e = run.loc[row, [f"e_{a}_a" for a in states]].to_numpy(float)
    return e @ np.linalg.inv(P) @ e


def test_the_order_of_the_states_makes_no_difference():
    orders = {"".join(order): NEES(order) for order in permutations(NAMES)}
    ensemble = study(cannonball, 1, DRAWS, nees=orders)
    draws = DRAWS.of(0, cannonball.rows)
    run = evaluate(cannonball, {"n_theta": draws[0], "n_r": draws[1]})
    for row in (0, 1, 700, 1319):
        expected = nees_of_one(run, NAMES, row)
        for name in orders:
            assert ensemble.rows[name]["mean"][row] == pytest.approx(expected, rel=1e-6), name


def test_states_that_nothing_connects_are_independent():
    """The axes of the shuttlecock have no common column; each adds its own NEES."""
    states = [
        n[2:-2] for n in evaluate(shuttlecock).columns if n.startswith("e_") and n[-2:] == "_a"
    ]
    assert len(states) > 1
    spec = {"all": NEES(states), **{s: NEES([s]) for s in states}}
    rows = study(shuttlecock, 1, nees=spec).rows
    run = evaluate(shuttlecock)
    for row in (1, 10, 20):
        expected = nees_of_one(run, states, row)
        assert rows["all"]["mean"][row] == pytest.approx(expected, rel=1e-9)


def claims(*names, values=None):
    """Two errors 1 and 2, and columns of a covariance by name."""
    m = Recurrence("claims", title="Claims", rows=3)
    columns = {"e_a_a": [1, 1, 1], "e_b_a": [2, 2, 2], "e_c_a": [3, 3, 3]}
    columns |= {name: (values or {}).get(name, [4, 4, 4]) for name in names}
    for name, numbers in columns.items():
        m.data(name, numbers, "", name, section="S")
    return m


def test_a_covariance_without_a_column_is_refused_unless_it_follows_or_is_declared():
    half = {"P_ab_a": [1, 1, 1], "P_cb_a": [1, 1, 1]}
    m = claims("P_aa_a", "P_bb_a", "P_cc_a", "P_ab_a", "P_cb_a", values=half)
    with pytest.raises(
        ModelError, match=r"neither P_ac_a nor P_ca_a.*independent=\[\('a', 'c'\)\]"
    ):
        study(m, 1, nees={"N": NEES(("a", "b", "c"))})
    spec = NEES(("a", "b", "c"), independent=[("c", "a")])
    P, e = np.array([[4, 1, 0], [1, 4, 1], [0, 1, 4]]), np.array([1, 2, 3])
    found = study(m, 1, nees={"N": spec}).rows["N"]["mean"]
    np.testing.assert_allclose(found, e @ np.linalg.inv(P) @ e, rtol=1e-14)
    alone = study(claims("P_aa_a", "P_bb_a"), 1, nees={"N": NEES(("a", "b"))})
    np.testing.assert_allclose(alone.rows["N"]["mean"], 1 / 4 + 4 / 4)
    with pytest.raises(ModelError, match="needs the column P_cc_a"):
        study(claims("P_aa_a"), 1, nees={"N": NEES(("a", "c"))})


def test_elimination_agrees_with_inverses_of_random_covariances():
    state = np.random.RandomState(4)
    A = state.standard_normal((200, 7, 5, 5))
    P, e = A @ A.transpose(0, 1, 3, 2) + 0.1 * np.eye(5), state.standard_normal((200, 7, 5))
    entries = {(i, j): P[..., i, j] for i in range(5) for j in range(i, 5)}
    found, wrong = normalised([e[..., k] for k in range(5)], entries)
    expected = (e * np.linalg.solve(P, e[..., None])[..., 0]).sum(axis=-1)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert not wrong.any()


def test_a_state_that_is_known_exactly_has_no_nees_in_that_row():
    m = claims("P_aa_a", "P_bb_a", "P_ab_a", values={"P_aa_a": [0, 4, 4], "P_ab_a": [0, 1, 4]})
    found = study(m, 2, nees={"N": NEES(("a", "b"))}).rows["N"]
    assert found["count"].tolist() == [0, 2, 0]  # known; sound; both the same, a singular P
    assert np.isnan(found["mean"][[0, 2]]).all()
    P, e = np.array([[4, 1], [1, 4]]), np.array([1, 2])
    assert found["mean"][1] == pytest.approx(e @ np.linalg.inv(P) @ e)


def test_a_member_whose_covariance_is_none_is_named():
    m = Recurrence("wild", title="A covariance that is none", rows=4)
    rho = m.parameter("rho", 0.5, "", "correlation")
    names = m.columns("e_a_a", "e_b_a", "P_aa_a", "P_bb_a", "P_ab_a", section="S")
    e_a, e_b, P_aa, P_bb, P_ab = names
    for column in (e_a, e_b, P_aa, P_bb):
        m.define(column[t], t + 1, "", "any")
    m.define(P_ab[t], Piecewise((rho * sqrt(P_aa[t] * P_bb[t]), t > 1), (0, True)), "", "any")
    spec = {"N": NEES(("a", "b"))}
    assert study(m, 3, nees=spec, rho=[0, 0.5, -0.9]).rows["N"]["count"].eq(3).all()
    with pytest.raises(DataError, match="member 2: P in row 2 is no covariance"):
        study(m, 3, nees=spec, rho=[0, 0.5, -1.5])
