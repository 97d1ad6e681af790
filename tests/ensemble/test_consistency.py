"""One test of honesty for all notebooks: flights are judged, not their sweeps."""

import numpy as np
import pytest
from scipy.stats import binom, ttest_1samp

from kfsheet import DataError, consistency


def test_it_is_students_test_of_one_mean():
    values = np.random.RandomState(1).chisquare(4, 30)
    found, other = consistency(values, 4), ttest_1samp(values, 4)
    assert found.p == pytest.approx(other.pvalue)
    low, high = other.confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((low, high))
    assert found.holds == (other.pvalue > 0.05)
    assert str(found).endswith("honest, as far as this tells" if found.holds else "not honest")


def test_an_honest_filter_with_a_memory_passes_19_times_of_20():
    """Where the share of the steps within their bounds would fail it many times."""
    generator, sets, runs, steps = np.random.RandomState(2), 200, 40, 300
    noise = generator.standard_normal((sets, runs, steps))
    e = noise.copy()
    for k in range(1, steps):  # errors of variance 1 that remember: each is 0.98 of the last
        e[..., k] = 0.98 * e[..., k - 1] + (1 - 0.98**2) ** 0.5 * noise[..., k]
    passed = sum(consistency(one, 1).holds for one in (e**2).mean(axis=2))
    low, high = binom.interval(0.9999, sets, 0.95)
    assert low - 8 <= passed <= high  # chi-square is skew: a t interval holds a little less


@pytest.mark.parametrize("runs", [[], [2.0], [2.0, np.nan], [2.0, 2.0], [[1.0, 2.0]]])
def test_what_says_nothing_is_refused(runs):
    with pytest.raises(DataError, match="run"):
        consistency(runs, 2)
