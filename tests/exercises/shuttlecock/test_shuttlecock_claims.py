"""What the source of the shuttlecock claims, put to the test on many flights.

Two forecasts of one flight see the same noise, so they are compared in pairs: the logarithm of the
ratio of their errors, averaged over some frames, is one number for each flight. Its mean over the
flights has a standard error, and every claim holds, or fails, by several of these. Other seeds
therefore give the same verdict. Errors of positions are compared in the same way.
"""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import binom, chi2

from kfsheet import DataError
from kfsheet.evaluation.evaluate import run
from kfsheet.exercises.shuttlecock import FORECASTS, shuttlecock
from kfsheet.exercises.shuttlecock.outliers import struck_frames, with_outliers
from tests.exercises.shuttlecock.test_shuttlecock import TIME, V_0, G, K, N, rms, track

RUNS = 400
POSITIONS = [f"e_{a}_{r}" for a in "xyz" for r in ("obs", "a")]
KINDS = (*(f"e_fall_{r}" for r in FORECASTS), *POSITIONS)
FIRST, SETTLED, LATE = [2, 3], slice(6, N), slice(22, N)
AFTER = np.array([6, 10, 14, 18, 22, 26])
INDEPENDENT = {
    "e_fall_raw": [0.366, 0.164, 0.092, 0.068, 0.045, 0.035],
    "e_fall_kf": [0.381, 0.177, 0.094, 0.069, 0.046, 0.036],
}
"""Medians (m) of an independent calculation: 400 flights, after so many frames."""
INDEPENDENT_RMS = dict(zip(POSITIONS, [0.111, 0.079, 0.060, 0.043, 0.172, 0.125], strict=True))
ROUNDED = 0.00051


def draws(seed):
    noise = np.random.RandomState(seed).standard_normal((N, 3))
    return dict(zip(("n_x", "n_y", "n_z"), noise.T, strict=True))


def other_draws(seed):
    """Another generator: with its draws the independent figures come out to the last digit."""
    noise = np.random.default_rng(seed).standard_normal((N, 3))
    return dict(zip(("n_x", "n_y", "n_z"), noise.T, strict=True))


def outliers(seed):
    return with_outliers(draws(seed), (1, seed))


def fly(data=draws, kinds=KINDS, **parameters):
    """Errors of fall points and of positions, each of shape (runs, frames)."""
    found = [run(shuttlecock, data(seed), parameters, kinds)[0] for seed in range(RUNS)]
    return {kind: np.array([f[kind] for f in found]) for kind in kinds}


def exact_and_raw(**parameters):
    return fly(kinds=("e_fall_raw", "e_fall_ex"), **parameters)


@pytest.fixture(scope="module")
def sound():
    return fly()


@pytest.fixture(scope="module")
def wild():
    return {gate: fly(outliers, gate=gate) for gate in (1000, 3)}


def gain(flights, one, other, frames):
    """How much less `one` errs than `other`: mean of the logarithm, and its standard error."""
    pair = flights[f"e_fall_{other}"][:, frames] / flights[f"e_fall_{one}"][:, frames]
    with np.errstate(invalid="ignore"):
        each = np.nanmean(np.log(np.where(pair > 0, pair, np.nan)), axis=1)
    assert np.isfinite(each).mean() > 0.95
    each = each[np.isfinite(each)]
    return each.mean(), each.std(ddof=1) / np.sqrt(len(each))


def wins(flights, one, other, frames, by=4):
    """Whether `one` errs less, by so many standard errors."""
    mean, error = gain(flights, one, other, frames)
    return mean > by * error


# -- the figures of an independent calculation --------------------------------------------------


def after(errors, frames):
    return np.median(np.nan_to_num(errors, nan=np.inf)[:, frames], axis=0)


def test_an_independent_calculation_is_reproduced_to_its_last_digit():
    """After 6 frames means the frames 0 to 5, and its filter counts the first frame twice."""
    flights = fly(other_draws, f_start=0.5)
    for kind, medians in INDEPENDENT.items():
        np.testing.assert_allclose(after(flights[kind], AFTER - 1), medians, atol=ROUNDED)
        assert np.abs(after(flights[kind], AFTER) - medians).max() > 50 * ROUNDED
    for kind, error in INDEPENDENT_RMS.items():
        assert rms(flights[kind]) == pytest.approx(error, abs=ROUNDED)


def test_a_first_frame_that_counts_once_gives_other_medians():
    flights = fly(other_draws, kinds=tuple(INDEPENDENT))
    np.testing.assert_allclose(
        after(flights["e_fall_raw"], AFTER - 1), INDEPENDENT["e_fall_raw"], atol=ROUNDED
    )
    filtered = after(flights["e_fall_kf"], AFTER - 1)
    assert np.abs(filtered - INDEPENDENT["e_fall_kf"]).max() > 5 * ROUNDED


# -- claim 1 -------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", "xyz")
def test_claim_1_holds_positions_are_better_filtered(sound, axis):
    """By a quarter to a third, as in the independent figures; 4 standard errors on either side."""
    raw, filtered = (np.mean(sound[f"e_{axis}_{kind}"] ** 2, axis=1) for kind in ("obs", "a"))
    ratio = np.sqrt(filtered.mean() / raw.mean())
    # Of a ratio of means: the residuals of one flight, over the mean, are its contribution.
    error = np.std(filtered / filtered.mean() - raw / raw.mean()) / np.sqrt(RUNS) * ratio / 2
    assert ratio + 4 * error < 0.8
    independent = INDEPENDENT_RMS[f"e_{axis}_a"] / INDEPENDENT_RMS[f"e_{axis}_obs"]
    assert abs(ratio - independent) < 4 * np.sqrt(2) * error + 0.01  # it is rounded to two digits


def test_the_cameras_err_as_the_signal_to_noise_ratio_says(sound):
    low, high = np.sqrt(chi2.interval(0.9999, RUNS * N) / np.float64(RUNS * N))
    for axis, sigma in zip("xyz", rms(track(TIME), axis=0) / 5, strict=True):
        assert low < rms(sound[f"e_{axis}_obs"]) / sigma < high


# -- claim 2 -------------------------------------------------------------------------------------


def test_claim_2_does_not_hold_fall_points_are_no_better_from_filtered_positions(sound):
    """In no frame of the table is the filtered fit better in more flights than chance allows."""
    better = sound["e_fall_kf"][:, AFTER] < sound["e_fall_raw"][:, AFTER]
    assert (better.sum(axis=0) <= binom.ppf(0.9999, RUNS, 0.5)).all()


def test_filtering_first_costs_some_percent(sound):
    """Three, by 400 flights within 1.2; three standard errors leave one seed of 700 by chance."""
    mean, error = gain(sound, "kf", "raw", SETTLED)
    assert mean < -3 * error
    assert mean > -0.05 - 4 * error


@pytest.mark.parametrize("k_m", [0.3, 3])
def test_claim_2_does_not_hold_for_other_drags_either(k_m):
    flights = fly(kinds=("e_fall_raw", "e_fall_kf"), k_m=k_m)
    better = flights["e_fall_kf"][:, AFTER] < flights["e_fall_raw"][:, AFTER]
    assert (better.sum(axis=0) <= binom.ppf(0.9999, RUNS, 0.5)).all()


def test_filtering_first_helps_while_there_are_few_frames(sound):
    assert wins(sound, "kf", "raw", [2])


def test_the_fit_to_raw_positions_errs_as_theory_says(sound):
    """Gauss and Markov: variance of the fall point from that of the fit, to first order."""
    X = (1 - np.exp(-TIME)) / K
    sigma = rms(track(TIME), axis=0) / 5
    end = brentq(lambda s: track(s)[2], 0.5, 2)
    X_end, falling = 1 - np.exp(-end), (V_0[2] + G) * np.exp(-end) - G
    theory = run(shuttlecock)[0]["e_theory"]
    for last in range(1, N):
        design = np.column_stack([np.ones(last + 1), X[: last + 1]])
        spread = np.array([1, X_end]) @ np.linalg.inv(design.T @ design) @ np.array([1, X_end])
        late = spread * sigma[2] ** 2 / falling**2  # variance of the time of the fall
        drift = V_0[:2] * np.exp(-end)
        expected = spread * (sigma[:2] ** 2).sum() + late * (drift**2).sum()
        assert theory[last] ** 2 == pytest.approx(expected)
        if last >= 18:  # before, the errors are too large for a first order
            found = np.mean(sound["e_fall_raw"][:, last] ** 2)
            assert found == pytest.approx(expected, rel=5 * np.sqrt(2 / RUNS))


# -- where a filter wins, and why ----------------------------------------------------------------


@pytest.mark.parametrize("filtered", ["ex", "now"])
def test_a_filter_wins_while_there_are_few_frames(sound, filtered):
    """It knows that velocities are of some metres per second; a line through three points not."""
    assert wins(sound, filtered, "raw", FIRST, by=6)


def test_the_latest_state_of_the_three_state_filter_forgets(sound):
    mean, error = gain(sound, "now", "raw", LATE)
    assert mean + 4 * error < -0.3


WORLDS = {
    "sound": {},
    "drag too small": {"f_k": 0.7},
    "twice": {"f_k": 2},
    "quadratic": {"k_2": 0.2},
}


@pytest.mark.parametrize("world", WORLDS)
def test_an_exact_filter_without_doubt_ties_with_the_fit_in_every_world(world):
    """Within 2 % at the end, right model or wrong: it is the fit, but for what it knew before."""
    mean, error = gain(exact_and_raw(**WORLDS[world]), "ex", "raw", LATE)
    assert abs(mean) + 4 * error < 0.03


def test_a_little_doubt_is_nearly_free_and_wins_if_the_drag_is_twice_too_large():
    mean, error = gain(exact_and_raw(Phi_s=0.05), "ex", "raw", LATE)
    assert mean - 4 * error > -0.1
    assert wins(exact_and_raw(f_k=2, Phi_s=0.05), "ex", "raw", LATE, by=6)


@pytest.mark.parametrize("world", WORLDS)
def test_much_doubt_pays_only_if_the_model_is_wrong_enough(world):
    flights = exact_and_raw(Phi_s=0.5, **WORLDS[world])
    winner, loser = ("ex", "raw") if world == "twice" else ("raw", "ex")
    assert wins(flights, winner, loser, LATE)


def test_a_gate_of_three_sigmas_wins_against_outliers_in_a_typical_flight(wild):
    for gate, beats in ((1000, False), (3, True)):
        better = wild[gate]["e_fall_ex"][:, 26] < wild[gate]["e_fall_raw"][:, 26]
        assert (better.sum() > binom.ppf(0.9999, RUNS, 0.5)) == beats
    assert not wins(wild[3], "kf", "raw", SETTLED)


def test_with_twice_the_drag_the_latest_state_loses_early_and_with_too_little_it_wins():
    kinds = ("e_fall_raw", "e_fall_now")
    assert wins(fly(kinds=kinds, f_k=2), "raw", "now", [4, 5, 6])
    assert wins(fly(kinds=kinds, f_k=0.7), "now", "raw", [4, 5, 6])


def test_outliers_strike_all_axes_of_a_frame_each_by_a_draw_of_its_own():
    flights = [(draws(s), outliers(s), struck_frames((1, s), N)) for s in range(RUNS)]
    struck = np.array([hit for *_, hit in flights])
    more = np.array([[wild[n] - quiet[n] for n in quiet] for quiet, wild, _ in flights])
    assert (more.any(axis=1) == struck).all()
    low, high = binom.interval(0.9999, RUNS, 0.1)
    assert ((low <= struck.sum(axis=0)) & (struck.sum(axis=0) <= high)).mean() > 0.95
    hits = more.transpose(1, 0, 2)[:, struck] / 8
    error = 1 / np.sqrt(hits.shape[1])
    np.testing.assert_allclose(np.cov(hits), np.eye(3), atol=5 * np.sqrt(2) * error)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"share": 1.1}, "share is 1.1"),
        ({"scale": -1}, "scale is -1"),
        ({"scale": np.nan}, "scale is nan"),
        ({"seed": "one"}, "seed is 'one'"),
        ({"draws": {"n_x": [0, 1], "n_y": [0]}}, "columns of"),
        ({"draws": {"n_x": []}}, "there are 0 frames"),
    ],
)
def test_outliers_that_make_no_sense_are_refused(changed, words):
    with pytest.raises(DataError, match=words):
        with_outliers(**{"draws": {"n_x": [0.0, 1]}, "seed": 1, **changed})


def test_a_gate_of_three_sigmas_loses_flights_that_begin_with_an_outlier(wild):
    """A filter that starts at an outlier takes the good frames for outliers, for ever."""
    struck = np.array([struck_frames((1, seed), N) for seed in range(RUNS)])
    begins, quiet = struck[:, 0], ~struck[:, :4].any(axis=1)
    lost = wild[3]["e_fall_ex"][:, 26] > 1
    assert begins.sum() > 20
    assert lost[begins].mean() > 0.3
    assert lost[quiet].mean() < 0.05
    assert not (wild[1000]["e_fall_ex"][:, 26] > 1).any()


def test_r_004_makes_the_filter_modest():
    """NIS far below 3: R claims more noise than there is; the exact filter claims what there is."""
    found = [run(shuttlecock, draws(seed))[1] for seed in range(40)]
    low, high = chi2.interval(0.9999, 3 * 26 * 40)
    exact = np.mean([s["mean_NIS_ex"] for s in found]) * 26 * 40
    assert low < exact < high
    assert np.mean([s["mean_NIS"] for s in found]) < 1.5
