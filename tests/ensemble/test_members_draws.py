"""Draws belong to members, and quantiles are exact, however the members are grouped."""

import numpy as np
import pytest

from kfsheet import DataError, Draws, Last, Recurrence, study, t, when_observed
from kfsheet.ensemble.quantiles import Kept, order_statistics

ROWS, MEMBERS = 3, 40


@pytest.fixture(autouse=True)
def small_groups(monkeypatch):
    """So that a few members make several groups."""
    monkeypatch.setattr("kfsheet.ensemble.study.MOST", 16)


def echo():
    """Columns that are their draws."""
    m = Recurrence("echo", title="Says what it was given", rows=ROWS)
    m.data("me", [0] * ROWS, "", "number of the member", section="S")
    a = m.data("a", [0] * ROWS, "", "drawn", section="S")
    b = m.data("b", [0] * ROWS, "", "drawn", section="S")
    gaps = m.data("gaps", [1] * ROWS, "", "seen or not", section="S", may_be_missing=True)
    x, y, z = m.columns("x", "y", "z", section="S")
    m.define(x[t], a[t] + 0, "", "first")
    m.define(y[t], b[t] + 0, "", "second")
    m.define(z[t], when_observed(gaps[t], a[t]), "", "first, where seen")
    return m


def drawn(seed, members=MEMBERS):
    """What the documentation promises, one new generator for each member."""
    return np.array(
        [np.random.RandomState((seed, k)).standard_normal((2, ROWS)) for k in range(members)]
    )


@pytest.mark.parametrize("seed", [0, 3, np.int64(2**32 - 1)])
def test_every_member_of_every_group_has_the_draws_of_its_number(seed):
    expected = drawn(int(seed))
    found = Draws("a", "b", seed=seed)
    for first, last in ((0, 40), (16, 32), (39, 40)):
        block = found.block(first, last, ROWS)
        assert (block == expected[first:last].transpose(1, 0, 2)).all()
    ensemble = study(echo(), MEMBERS, found, columns=["x", "y"])
    for name, column in (("x", 0), ("y", 1)):
        values = expected[:, column]
        np.testing.assert_allclose(ensemble.rows[name]["mean"], values.mean(axis=0), rtol=1e-12)
        np.testing.assert_allclose(
            ensemble.rows[name]["std"], values.std(axis=0, ddof=1), rtol=1e-12
        )


def test_draws_and_data_go_together():
    """The same gaps in every flight, the noise of each its own."""
    draws = Draws("a", "b", seed=5, data={"gaps": [1, None, 1], "me": np.ones((MEMBERS, ROWS))})
    found = study(echo(), MEMBERS, draws, columns=["z"]).rows["z"]
    assert found["count"].tolist() == [MEMBERS, 0, MEMBERS]
    np.testing.assert_allclose(found["mean"][[0, 2]], drawn(5)[:, 0].mean(axis=0)[[0, 2]])


@pytest.mark.parametrize(
    ("arguments", "options", "message"),
    [
        ((), {}, "names of data columns"),
        ((1,), {}, "names of data columns"),
        (("a", "a"), {}, "names a column twice"),
        (("a",), {"seed": -1}, "seed is -1"),
        (("a",), {"seed": True}, "seed is True"),
        (("a",), {"seed": 1.0}, "seed is 1.0"),
        (("a",), {"data": {"a": [1]}}, "a is drawn and given"),
        (("a",), {"data": [1]}, "data is a list"),
    ],
)
def test_draws_that_cannot_be_are_refused(arguments, options, message):
    with pytest.raises(DataError, match=message):
        Draws(*arguments, **options)


# -- quantiles -------------------------------------------------------------------------------

LEVELS = [0, 0.001, 0.05, 0.5, 0.95, 0.99999, 1]


@pytest.fixture
def tiny_blocks(monkeypatch):
    """So that a few thousand numbers go to a file and are read in many blocks."""
    monkeypatch.setattr("kfsheet.ensemble.quantiles.IN_MEMORY", 1000)
    monkeypatch.setattr("kfsheet.ensemble.quantiles.AT_ONCE", 512)
    monkeypatch.setattr("kfsheet.ensemble.quantiles.SPLITS", 32)


def awkward(n=5000):
    state = np.random.RandomState(8)
    far = 1e6 + 1e-6 * state.standard_normal(n)
    ties = state.randint(0, 3, n).astype(float)
    gaps = np.where(state.uniform(size=n) < 0.3, np.nan, state.standard_normal(n))
    wide = np.exp(100 * state.standard_normal(n)) * state.choice([-1, 1], n)
    return np.column_stack([far, ties, gaps, wide, np.arange(n)[::-1], np.full(n, 7.0)])


def test_quantiles_of_many_numbers_are_those_of_all_of_them_sorted(tiny_blocks):
    values = awkward()
    with Kept(values.shape[1]) as kept:
        for first in range(0, len(values), 300):
            kept.add(values[first : first + 300])
        found = kept.quantiles(LEVELS)
    # Neighbours of other orders of magnitude lose a few digits between them.
    np.testing.assert_allclose(found, np.nanquantile(values, LEVELS, axis=0), rtol=1e-12)


def test_quantiles_of_nothing_but_gaps_are_gaps(tiny_blocks):
    with Kept(1) as kept:
        kept.add(np.full((5000, 1), np.nan))
        assert np.isnan(kept.quantiles([0, 0.5])).all()


def test_order_statistics_are_the_sorted_numbers():
    values = np.random.RandomState(9).standard_normal(3000)
    found = order_statistics(lambda: np.split(values, 10), range(3000))
    assert [found[k] for k in range(3000)] == sorted(values)


def test_every_quantile_has_a_name_of_its_own():
    m = echo()
    m.summary("s", Last(m.table["x"].base), "", "of x")
    levels = np.linspace(0, 1, 401)
    ensemble = study(m, MEMBERS, Draws("a", "b"), quantiles=[0.99999, 1, 1, *levels])
    assert len(ensemble.scalars.columns) == 4 + 1 + 401
    values = drawn(0)[:, 0, -1]
    assert ensemble.scalars.loc["s", "1 quantile"] == values.max()
    assert ensemble.scalars.loc["s", "0.99999 quantile"] == pytest.approx(
        np.quantile(values, 0.99999), rel=1e-14
    )
