"""Many runs compute what single runs compute."""

import numpy as np
import pytest
from sympy import log, sqrt

from kfsheet import (
    DataError,
    Recurrence,
    evaluate,
    study,
    t,
)
from kfsheet.ensemble.statistics import Sums
from kfsheet.evaluation.compiling import can_compile
from kfsheet.exercises.cannonball import cannonball
from kfsheet.exercises.football import football


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (lambda v, a: sqrt(v[t - 1] - a), "v in row 3.*math domain error"),
        (lambda v, a: log(v[t - 1]) + v[t - 1] - a, "math domain error"),
        (lambda v, a: 1 / (v[t - 1] - 1), "division by zero"),
        (lambda v, a: (v[t - 1] + 12) ** 12, "beyond 1e308"),
    ],
)
def test_what_has_no_value_is_explained_as_before(rule, message):
    m = Recurrence("fails", title="Fails", rows=30)
    a = m.parameter("a", 0.5, "", "a")
    (v,) = m.columns("v", section="S")
    m.define(v[t], rule(v, a), "", "v", start=[1])
    for compiled in (False, can_compile()):
        with pytest.raises(DataError, match=message):
            evaluate(m, compiled=compiled)


# -- many members ----------------------------------------------------------------------------

MANY = 50


@pytest.fixture(autouse=True)
def small_groups(monkeypatch):
    """So that a few members make several groups."""
    monkeypatch.setattr("kfsheet.ensemble.study.MOST", 16)


def flights(count=MANY, **options):
    options = {"columns": ["e_x_a", "d_i"], "compiled": can_compile(), **options}
    return study(football, count, **options)


@pytest.fixture(scope="module")
def photos():
    noise = np.random.RandomState(5).standard_normal((MANY, 16))
    pixels = np.array(football.table["i"].values) + 3 * noise
    pixels[7, 3] = pixels[40, 15] = np.nan
    return {"i": pixels}


def single(model, columns, scalars, data, **parameters):
    run = evaluate(model, data, compiled=can_compile(), **parameters)
    return run[columns].to_numpy().T, [run.attrs["scalars"][name] for name in scalars]


@pytest.mark.parametrize(
    ("model", "columns", "own"),
    [
        (football, [], {"r_i": np.linspace(1, 100, MANY)}),
        (football, ["x_a", "z_a", "d_i"], {}),  # all share their parameters
        (cannonball, [], {}),
    ],
    ids=["football", "football with shared parameters", "cannonball"],
)
def test_members_are_the_single_runs_bit_for_bit(monkeypatch, model, columns, own):
    """Every number of every member, before any statistics."""
    pytest.importorskip("numba")
    state, seen = np.random.RandomState(5), []

    def watched(cls, values):
        seen.append(values.copy())
        return of(values)

    of = Sums.of
    monkeypatch.setattr(Sums, "of", classmethod(watched))
    given = {
        name: np.array(model.table[name].values) + state.standard_normal((MANY, model.rows)) / 9
        for name in (["i"] if model is football else ["n_theta", "n_r"])
    }
    names = [] if columns else [*model.derived_scalars, *model.summaries]
    columns = columns or [c.name for c in model.all_columns()]
    study(model, MANY, given, columns=columns, scalars=names, compiled=True, **own)
    rows, results = np.concatenate(seen[::2]), np.concatenate(seen[1::2])
    for k in range(MANY):
        data = {name: values[k] for name, values in given.items()}
        out, scalars = single(model, columns, names, data, **{n: v[k] for n, v in own.items()})
        assert np.array_equal(rows[k], out, equal_nan=True)
        assert np.array_equal(results[k], scalars, equal_nan=True)


def test_statistics_are_those_of_the_single_runs(photos):
    r_i = np.linspace(1, 100, MANY)
    ensemble = flights(data=photos, r_i=r_i, h=0, p=2)
    singles = [evaluate(football, {"i": photos["i"][k]}, r_i=r_i[k], h=0, p=2) for k in range(MANY)]
    for name in ("e_x_a", "d_i"):
        stack = np.array([run[name] for run in singles])
        found = ensemble.rows[name]
        assert (found["count"] == (~np.isnan(stack)).sum(axis=0)).all()
        some = found["count"] > 0
        for statistic, expected in (
            ("mean", np.nanmean(stack[:, some], axis=0)),
            ("rms", np.sqrt(np.nanmean(stack[:, some] ** 2, axis=0))),
            ("std", np.nanstd(stack[:, some], axis=0, ddof=1)),
        ):
            np.testing.assert_allclose(found[statistic][some], expected, rtol=1e-9)
    one = flights(1, data={"i": photos["i"][:1]}, r_i=r_i[:1], h=0, p=2)
    assert (one.rows["e_x_a"]["mean"] - singles[0]["e_x_a"]).abs().max() < 1e-9


def test_quantiles_of_scalars_are_those_of_the_members(photos):
    ensemble = flights(data=photos, quantiles=(0.05, 0.5))
    values = [
        evaluate(football, {"i": photos["i"][k]}).attrs["scalars"]["rms_x_a"] for k in range(MANY)
    ]
    assert len(repr(ensemble).splitlines()) == 1
    found = ensemble.scalars.loc["rms_x_a", ["0.05 quantile", "0.5 quantile"]]
    np.testing.assert_allclose(found, np.quantile(values, [0.05, 0.5]), rtol=1e-12)


def test_a_small_spread_about_a_large_mean_keeps_its_figures(monkeypatch):
    """Millimetres about a thousand kilometres, in groups that have other means."""
    m = Recurrence("far", title="Far away")
    x = m.data("x", [0.0, 0.0], "m", "given", section="S")
    (y,) = m.columns("y", section="S")
    m.define(y[t], x[t] + 0, "m", "seen")
    values = 1e6 + 1e-3 * np.random.RandomState(3).standard_normal((50, 2))
    values[:, 1] = 1e6
    found = study(m, 50, {"x": values}, columns=["y"], scalars=()).rows["y"]
    assert found["std"][0] == pytest.approx(np.std(values[:, 0] - 1e6, ddof=1), rel=1e-6)
    assert found["std"][1] == 0
    np.testing.assert_allclose(found["rms"], np.sqrt(np.mean(values**2, axis=0)), rtol=1e-15)


def test_without_a_compiler_the_statistics_are_the_same(photos):
    fast, slow = flights(data=photos), flights(data=photos, compiled=False)
    for name in fast.rows:
        np.testing.assert_allclose(slow.rows[name], fast.rows[name], rtol=1e-9, atol=1e-12)
