"""Compiled runs and many runs compute what single runs by Python compute."""

import os
import subprocess
import sys

import numpy as np
import pytest
from sympy import Max, Piecewise, Rational, acos, atan2, cos, floor, log, sin, sqrt

from kfsheet import (
    RMS,
    DataError,
    Largest,
    Last,
    Mean,
    Missing,
    ModelError,
    Recurrence,
    Smallest,
    Std,
    Sum,
    evaluate,
    t,
    warm_up,
    when_observed,
)
from kfsheet import evaluation as engine
from kfsheet.exercises.cannonball import cannonball
from kfsheet.exercises.football import football
from kfsheet.kernel import cache_folder, compiled_function, is_ready, kernel_of
from kfsheet.streaming import Sums

ROWS = 25


def mixed():
    """Lags, start rows, gaps, several passes and every kind of function."""
    m = Recurrence("mixed", title="A bit of everything")
    a = m.parameter("a", 0.3, "", "a", sign="positive")
    p = m.parameter("p", 1.5, "", "an exponent")
    values = np.random.RandomState(1).standard_normal(ROWS)
    gaps = values.copy()
    gaps[[3, 7, 8]] = np.nan
    x = m.data("x", values, "", "complete", section="S")
    y = m.data("y", gaps, "", "with gaps", section="S", may_be_missing=True)
    u, v, w, z, c = m.columns("u", "v", "w", "z", "c", section="S")
    m.define(u[t], u[t - 1] + a * v[t - 2] - x[t], "", "u", start=[0, 1 + a])
    m.define(v[t], cos(u[t]) * (1 + x[t] ** 2) ** p, "", "v", start=[sqrt(a)])
    m.define(w[t], when_observed(y[t], atan2(y[t], x[t - 1]) + floor(2 * y[t])), "", "w", start=[0])
    mean = m.summary("mean_w", Mean(w), "", "mean")
    m.define(z[t], log(1 + v[t] ** 2) * mean + z[t - 1] / 2, "", "second pass", start=[mean])
    m.summary("std_z", Std(z), "", "spread")
    clipped = Piecewise((Missing, z[t] > 1), (Max(z[t], acos(sin(x[t])), Rational(1, 3)), True))
    m.define(c[t], clipped, "", "gaps of its own")
    for aggregate in (RMS, Sum, Largest, Smallest, Last):
        m.summary(f"{aggregate.__name__.lower()}_c", aggregate(c), "", "of c")
    return m


@pytest.fixture
def by_python(monkeypatch):
    """What Python alone computes."""

    def compute(*arguments, **options):
        with monkeypatch.context() as patch:
            patch.setattr(engine, "can_compile", lambda: False)
            return evaluate(*arguments, **options)

    return compute


def assert_same(ours, theirs, tolerance):
    assert list(ours.columns) == list(theirs.columns)
    for name in ours:
        a, b = ours[name].to_numpy(), theirs[name].to_numpy()
        assert (np.isnan(a) == np.isnan(b)).all(), name
        scale = np.sqrt(np.nanmean(b**2)) if not np.isnan(b).all() else 1
        assert np.nanmax(np.abs(a - b), initial=0) <= tolerance * max(scale, 1e-300), name


@pytest.mark.parametrize(
    ("model", "tolerance"),
    [(mixed(), 1e-13), (football, 1e-13), (cannonball, 2e-12)],
    ids=["mixed", "football", "cannonball"],
)
def test_compiled_and_python_agree(by_python, model, tolerance):
    pytest.importorskip("numba")
    warm_up(model)
    ours, theirs = evaluate(model), by_python(model)
    assert_same(ours, theirs, tolerance)
    for name, value in theirs.attrs["scalars"].items():
        found = ours.attrs["scalars"][name]
        assert found == pytest.approx(value, rel=10 * tolerance, nan_ok=True), name


def test_a_few_columns_are_the_same_as_all():
    some = ["z", "u"]
    model = mixed()
    warm_up(model, some)
    warm_up(model)
    assert evaluate(model, columns=some).equals(evaluate(model)[some])
    with pytest.raises(ModelError, match="no column 'q'"):
        evaluate(model, columns=["q"])


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
    engine.facts_of(m).python_cells = engine.WORTH_COMPILING
    with pytest.raises(DataError, match=message):
        evaluate(m)


def test_a_first_small_run_does_not_wait_for_a_compiler():
    model = mixed()
    model.parameter("unlike", 0, "", "so that its kernel is a new one")
    evaluate(model)
    assert not is_ready(kernel_of(model, model.version))
    for _ in range(engine.WORTH_COMPILING // (ROWS * len(model.all_columns())) + 1):
        evaluate(model)
    assert is_ready(kernel_of(model, model.version))


PROGRAM = """
import sys
sys.path.insert(0, {folder!r})
from test_members import mixed
from kfsheet import evaluate, warm_up
from kfsheet.kernel import compiled_function, kernel_of
model = mixed()
warm_up(model)
stats = compiled_function(kernel_of(model, model.version).source).stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


def test_a_second_process_finds_the_machine_code_on_disk(tmp_path):
    program = PROGRAM.format(folder=os.path.dirname(__file__))
    environment = {**os.environ, "KFSHEET_CACHE": str(tmp_path)}
    found = [
        subprocess.run(
            [sys.executable, "-c", program],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.split()
        for _ in range(2)
    ]
    assert found == [["0", "1"], ["1", "0"]]


def test_a_cache_that_cannot_be_written_does_not_stop_anybody(monkeypatch, tmp_path):
    blocker = tmp_path / "file"
    blocker.write_text("in the way")
    monkeypatch.setenv("KFSHEET_CACHE", str(blocker))
    assert cache_folder().is_dir()
    assert blocker.read_text() == "in the way"


# -- many members ----------------------------------------------------------------------------

MANY = 50


@pytest.fixture(autouse=True)
def small_groups(monkeypatch):
    """So that a few members make several groups."""
    monkeypatch.setattr("kfsheet.members.MOST", 16)


def flights(count=MANY, **options):
    return evaluate(football, members=count, columns=["e_x_a", "d_i"], **options)


@pytest.fixture(scope="module")
def photos():
    noise = np.random.RandomState(5).standard_normal((MANY, 16))
    pixels = np.array(football.table["i"].values) + 3 * noise
    pixels[7, 3] = pixels[40, 15] = np.nan
    return {"i": pixels}


def single(model, columns, scalars, data, **parameters):
    run = evaluate(model, data, **parameters)
    return run[columns].to_numpy().T, [run.attrs["scalars"][name] for name in scalars]


@pytest.mark.parametrize("model", [football, cannonball], ids=["football", "cannonball"])
def test_members_are_the_single_runs_bit_for_bit(monkeypatch, model):
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
    own = {"r_i": np.linspace(1, 100, MANY)} if model is football else {}
    every = [c.name for c in model.all_columns()]
    evaluate(model, given, members=MANY, columns=every, **own)
    warm_up(model)
    rows, results = np.concatenate(seen[::2]), np.concatenate(seen[1::2])
    names = [*model.derived_scalars, *model.summaries]
    for k in range(MANY):
        data = {name: values[k] for name, values in given.items()}
        out, scalars = single(model, every, names, data, **{n: v[k] for n, v in own.items()})
        assert np.array_equal(rows[k], out, equal_nan=True)
        assert np.array_equal(results[k], scalars, equal_nan=True)


def test_statistics_are_those_of_the_single_runs(photos):
    r_i = np.linspace(1, 100, MANY)
    study = flights(data=photos, r_i=r_i, h=0, p=2)
    singles = [evaluate(football, {"i": photos["i"][k]}, r_i=r_i[k], h=0, p=2) for k in range(MANY)]
    for name in ("e_x_a", "d_i"):
        stack = np.array([run[name] for run in singles])
        found = study.rows[name]
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
    study = flights(data=photos, quantiles=(0.05, 0.5))
    values = [
        evaluate(football, {"i": photos["i"][k]}).attrs["scalars"]["rms_x_a"] for k in range(MANY)
    ]
    found = study.scalars.loc["rms_x_a", ["0.05 quantile", "0.5 quantile"]]
    np.testing.assert_allclose(found, np.quantile(values, [0.05, 0.5]), rtol=1e-12)


def test_a_small_spread_about_a_large_mean_keeps_its_figures(monkeypatch):
    """Millimetres about a thousand kilometres, in groups that have other means."""
    from kfsheet import members

    monkeypatch.setattr(members, "MOST", 16)
    m = Recurrence("far", title="Far away")
    x = m.data("x", [0.0, 0.0], "m", "given", section="S")
    (y,) = m.columns("y", section="S")
    m.define(y[t], x[t] + 0, "m", "seen")
    values = 1e6 + 1e-3 * np.random.RandomState(3).standard_normal((50, 2))
    values[:, 1] = 1e6
    found = evaluate(m, {"x": values}, members=50, columns=["y"], scalars=()).rows["y"]
    assert found["std"][0] == pytest.approx(np.std(values[:, 0] - 1e6, ddof=1), rel=1e-6)
    assert found["std"][1] == 0
    np.testing.assert_allclose(found["rms"], np.sqrt(np.mean(values**2, axis=0)), rtol=1e-15)


def test_without_a_compiler_the_statistics_are_the_same(monkeypatch, photos):
    from kfsheet import members

    fast = flights(data=photos)
    monkeypatch.setattr(members, "can_compile", lambda: False)
    slow = flights(data=photos)
    for name in fast.rows:
        np.testing.assert_allclose(slow.rows[name], fast.rows[name], rtol=1e-9, atol=1e-12)


def test_the_compiled_function_is_the_same_object_for_the_same_model():
    kernel = kernel_of(football, football.version)
    assert compiled_function(kernel.source) is compiled_function(kernel.source)
