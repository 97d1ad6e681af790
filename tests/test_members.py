"""Many runs compute what single runs compute."""

import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from sympy import log, sqrt

from kfsheet import (
    NEES,
    DataError,
    Draws,
    ModelError,
    Recurrence,
    evaluate,
    t,
)
from kfsheet.compiling import can_compile
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
    monkeypatch.setattr("kfsheet.members.MOST", 16)


def flights(count=MANY, **options):
    options = {"columns": ["e_x_a", "d_i"], "compiled": can_compile(), **options}
    return evaluate(football, members=count, **options)


@pytest.fixture(scope="module")
def photos():
    noise = np.random.RandomState(5).standard_normal((MANY, 16))
    pixels = np.array(football.table["i"].values) + 3 * noise
    pixels[7, 3] = pixels[40, 15] = np.nan
    return {"i": pixels}


def test_members_are_the_single_runs_bit_for_bit(photos):
    r_i = np.linspace(1, 100, MANY)
    study = flights(data=photos, r_i=r_i, h=0, p=2)
    alone = {"h": 0, "p": 2, "compiled": can_compile()}
    singles = [evaluate(football, {"i": photos["i"][k]}, r_i=r_i[k], **alone) for k in range(MANY)]
    for name in ("e_x_a", "d_i"):
        stack = np.array([run[name] for run in singles])
        found = study.rows[name]
        assert (found["count"] == (~np.isnan(stack)).sum(axis=0)).all()
        some = found["count"] > 0
        np.testing.assert_allclose(
            found["mean"][some], np.nanmean(stack[:, some], axis=0), rtol=1e-12
        )
        np.testing.assert_allclose(
            found["std"][some], np.nanstd(stack[:, some], axis=0, ddof=1), rtol=1e-9
        )
    one = flights(1, data={"i": photos["i"][:1]}, r_i=r_i[:1], h=0, p=2)
    assert (one.rows["e_x_a"]["mean"] == singles[0]["e_x_a"]).all()
    assert one.scalars.loc["rms_x_a", "mean"] == singles[0].attrs["scalars"]["rms_x_a"]


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


def executors():
    yield "one thread", lambda: ThreadPoolExecutor(1)
    yield "processes", lambda: ProcessPoolExecutor(2, mp_context=get_context("spawn"))


@pytest.mark.parametrize("make", [m for _, m in executors()], ids=[n for n, _ in executors()])
def test_whoever_computes_the_result_is_the_same_to_the_last_bit(photos, make):
    here = flights(data=photos)
    with make() as executor:
        there = flights(data=photos, executor=executor)
    assert all(here.rows[name].equals(there.rows[name]) for name in here.rows)
    assert here.scalars.equals(there.scalars)


def test_without_a_compiler_the_statistics_are_the_same(photos):
    fast, slow = flights(data=photos), flights(data=photos, compiled=False)
    for name in fast.rows:
        np.testing.assert_allclose(slow.rows[name], fast.rows[name], rtol=1e-9, atol=1e-12)


def test_draws_belong_to_the_member_not_to_the_group():
    draws = Draws("n_theta", "n_r", seed=3)
    few = evaluate(cannonball, draws, members=3, columns=["NIS"])
    state = np.random.RandomState((3, 2)).standard_normal((2, 1320))
    last = evaluate(cannonball, {"n_theta": state[0], "n_r": state[1]})
    two = evaluate(cannonball, draws, members=2, columns=["NIS"])
    total = few.rows["NIS"]["mean"] * 3 - two.rows["NIS"]["mean"] * 2
    np.testing.assert_allclose(total[1:], last["NIS"][1:], rtol=1e-7, atol=1e-9)


def test_nees_is_the_quadratic_form_of_the_errors():
    draws = Draws("n_theta", "n_r", seed=3)
    study = evaluate(cannonball, draws, members=1, nees={"NEES": NEES(("x", "vx", "y", "vy"))})
    state = draws.of(0, 1320)
    run = evaluate(cannonball, {"n_theta": state[0], "n_r": state[1]})
    for row in (0, 1, 700, 1319):
        at, names = run.loc[row], ["x", "vx", "y", "vy"]
        P = np.array(
            [[at[f"P_{names[min(i, j)]}{names[max(i, j)]}_a"] for j in range(4)] for i in range(4)]
        )
        e = at[[f"e_{n}_a" for n in names]].to_numpy()
        assert study.rows["NEES"]["mean"][row] == pytest.approx(e @ np.linalg.inv(P) @ e, rel=1e-6)


MEMORY = """
import resource
from pathlib import Path
from kfsheet import Draws, NEES, evaluate
from kfsheet.exercises.cannonball import cannonball
evaluate(cannonball, Draws("n_theta", "n_r"), members={members}, columns=["NIS", "e_x_a"],
         nees={{"NEES": NEES(("x", "vx", "y", "vy"))}}, quantiles=(0.5,))
status = Path("/proc/self/status")  # unlike getrusage, it knows nothing of the parent
lines = status.read_text().splitlines() if status.exists() else []
peak = [int(line.split()[1]) for line in lines if "VmHWM" in line]
print((peak or [resource.getrusage(resource.RUSAGE_SELF).ru_maxrss])[0] / 1024)
"""


def test_memory_does_not_grow_with_the_number_of_members():
    used = [
        float(
            subprocess.run(
                [sys.executable, "-c", MEMORY.format(members=members)],
                capture_output=True,
                text=True,
                check=True,
            ).stdout
        )
        for members in (300, 1500)
    ]
    assert max(used) < 500
    assert used[1] - used[0] < 30


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"members": 0}, "give a whole number from 1 up"),
        ({"members": 2.5}, "give a whole number"),
        ({"members": 3, "quantiles": (2,)}, "between 0 and 1"),
        ({"members": 3, "columns": ["q"]}, "no column 'q'"),
        ({"members": 3, "q": 1}, "no parameter q"),
        ({"members": 3, "q": [1, 2, 3]}, "no parameter q"),
        ({"members": 3, "r_i": [1, 2]}, "2 values for 3 members"),
        ({"members": 3, "r_i": [1, -2, 3]}, "r_i of member 1 is -2"),
        ({"members": 3, "data": {"i": np.ones((2, 16))}}, "give 3 x 16 numbers"),
        ({"members": 3, "data": {"q": np.ones(16)}}, "no data column q"),
        ({"members": 3, "data": Draws("q")}, "no data column q"),
        ({"members": 2, "data": {"i": np.full((2, 16), np.inf)}}, "member 0, row 0 is inf"),
        ({"members": 2, "nees": {"N": NEES(("q",))}}, "no column 'e_q_a'|lacks"),
        ({"quantiles": (0.5,)}, "give members="),
    ],
)
def test_a_study_that_cannot_be_is_refused(options, message):
    data = options.pop("data", None)
    with pytest.raises((DataError, ModelError), match=message):
        evaluate(football, data, **options)


def test_a_member_without_a_value_is_named():
    m = Recurrence("fails", title="Fails", rows=3)
    a = m.parameter("a", 1, "", "a")
    (v,) = m.columns("v", section="S")
    m.define(v[t], sqrt(a) * v[t - 1], "", "v", start=[1])
    values = np.ones(100)
    values[83] = -1
    with pytest.raises(DataError, match="member 83 has no value"):
        evaluate(m, members=100, columns=["v"], a=values)


@pytest.mark.parametrize("arguments", [(), (1,)])
def test_draws_need_names(arguments):
    with pytest.raises(DataError, match="names of data columns"):
        Draws(*arguments)
    with pytest.raises(DataError, match="seed"):
        Draws("i", seed=-1)


def test_an_interrupt_leaves_nothing_running(monkeypatch):
    from kfsheet import members

    def interrupted(task):
        raise KeyboardInterrupt

    monkeypatch.setattr(members, "run_group", interrupted)
    with pytest.raises(KeyboardInterrupt):
        flights(1000)
    monkeypatch.undo()
    assert flights(10).members == 10
