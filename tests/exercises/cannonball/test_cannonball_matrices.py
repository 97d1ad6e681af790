"""The article's Riccati equations in matrices, and what its misprints do over many flights."""

import numpy as np
import pytest

from kfsheet import Draws, consistency, evaluate
from kfsheet.exercises.cannonball import cannonball
from kfsheet.exercises.cannonball.matrices import NAMES, echoes_of, fly

FLIGHTS = 100


@pytest.fixture(scope="module")
def frame():
    return evaluate(cannonball)


@pytest.fixture(scope="module")
def truth(frame):
    return frame[[f"{name}_true" for name in NAMES]].to_numpy()


def own_echo(frame):
    return frame[["theta_obs", "r_obs"]].to_numpy()[None, 1:]


@pytest.mark.parametrize("changed", [{}, {"Phi_s": 1.0}, {"belief_theta": 0.5, "belief_r": 2.0}])
def test_matrices_and_scalar_columns_are_one_filter(truth, changed):
    frame = evaluate(cannonball, **changed)
    found = fly(own_echo(frame), truth, **changed)
    for k, name in enumerate(NAMES):
        np.testing.assert_allclose(found.error[0, :, k], frame[f"e_{name}_a"][1:], atol=1e-6)
        variance = frame[f"P_{name}{name}_a"][1:]
        np.testing.assert_allclose(found.claimed[0, :, k], variance, rtol=1e-6)
    np.testing.assert_allclose(found.NIS[0], frame["NIS"][1:], rtol=1e-6)


def test_the_echoes_of_a_flight_are_those_of_its_draws(frame):
    draws = Draws("n_theta", "n_r", seed=3)
    echoes = echoes_of(frame, draws, 2)
    data = dict(zip(("n_theta", "n_r"), draws.of(1, len(frame)), strict=True))
    other = evaluate(cannonball, data, columns=["theta_obs", "r_obs"]).to_numpy()
    np.testing.assert_allclose(echoes[1], other[1:], rtol=1e-12)


@pytest.mark.parametrize("seed", [11, 12])
def test_a_filter_with_the_wrong_sign_could_notice_in_every_second_flight(frame, truth, seed):
    """By an independent calculation the mean NIS is above 2 + 1.96 deviations in 54 %."""
    echoes = echoes_of(frame, Draws("n_theta", "n_r", seed=seed), FLIGHTS)
    limit = 2 + 1.96 * 2 / 1319**0.5
    beyond = [(fly(echoes, truth, minus=m).NIS.mean(axis=1) > limit).mean() for m in (True, False)]
    assert beyond[0] < 0.025 + 4 * (0.025 / FLIGHTS) ** 0.5
    assert abs(beyond[1] - 0.54) < 4 * 0.5 / FLIGHTS**0.5


def test_flights_not_sweeps_say_whether_a_filter_is_honest(frame, truth):
    """The right one passes; one that is told half the error, or distrusts its model, does not."""
    echoes = echoes_of(frame, Draws("n_theta", "n_r", seed=21), FLIGHTS)
    right = fly(echoes, truth)
    assert consistency(right.NIS.mean(axis=1), 2).p > 0.001
    assert consistency(right.NEES.mean(axis=1), 4).p > 0.001
    told = fly(echoes, truth, belief_theta=0.5, belief_r=0.5)
    assert consistency(told.NIS.mean(axis=1), 2).mean == pytest.approx(8, rel=0.02)
    assert consistency(told.NEES.mean(axis=1), 4).low > 10
    assert consistency(fly(echoes, truth, Phi_s=1).NEES.mean(axis=1), 4).high < 3
