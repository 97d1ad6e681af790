"""Processes that share nothing with this one but the installation compute and judge the same."""

import multiprocessing
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import students as do

from kfsheet import Draws, study
from kfsheet.coursework.reading.roster import Student
from kfsheet.coursework.reports.grading import grade
from kfsheet.coursework.worker_pool import run_on
from kfsheet.errors import EngineError
from kfsheet.evaluation.compiling import can_compile
from kfsheet.exercises.football import exercise, football

# What a cluster warns of is its own affair.
pytestmark = pytest.mark.filterwarnings("ignore")
MANY = 50


def pixels():
    noise = np.random.RandomState(5).standard_normal((MANY, 16))
    return {"i": np.array(football.table["i"].values) + 3 * noise}


@pytest.mark.parametrize("compiled", [False, can_compile()])
@pytest.mark.parametrize(
    "options",
    [
        {"data": Draws("i", "j", seed=4), "quantiles": (0.05, 0.5)},
        {"data": pixels(), "r_i": np.linspace(1, 100, MANY)},
    ],
    ids=["draws", "data"],
)
def test_a_cluster_computes_the_same_to_the_last_bit(cluster, monkeypatch, options, compiled):
    monkeypatch.setattr("kfsheet.ensemble.study.MOST", 8)  # seven groups for two processes
    asked = {"columns": ["e_x_a"], "scalars": ("rms_x_a", "K_x"), "compiled": compiled}
    here = study(football, MANY, **asked, **options)
    with cluster.get_executor() as executor:
        there = study(football, MANY, executor=executor, **asked, **options)
    assert there.rows["e_x_a"].equals(here.rows["e_x_a"])
    assert there.scalars.equals(here.scalars)
    assert here.scalars.loc["rms_x_a", "std"] > 0


def test_the_processes_are_others(cluster):
    assert len({os.getpid(), *cluster.run(os.getpid).values()}) == 3


def test_a_cluster_gives_the_marks_that_were_earned(cluster, monkeypatch, tmp_path):
    """Its workers judge in processes of their own, with limits, as grading does here."""
    monkeypatch.setattr("kfsheet.coursework.worker_pool.BATCH", 1)  # work for both
    bob = Student("s002", "Bob")
    returned = tmp_path / "returned"
    returned.mkdir()
    do.Paper(exercise).open(returned / "ada.xlsx").answer_all().save()
    paper = do.Paper(exercise, bob).open(returned / "bob.xlsx").answer_all("K_x")
    paper.answer("u", do.negated)
    paper.save()
    given = (exercise, "football", returned, [do.ADA, bob], do.SECRET, tmp_path / "graded")
    with cluster.get_executor() as executor:
        results, _ = grade(*given, executor=executor)
    names = [question.name for question in exercise.questions]
    earned = dict.fromkeys(names, "right")
    found = [{m.name: m.status for m in r.marks} for r in results]
    assert found == [earned, {**earned, "K_x": "empty", "u": "wrong"}]


def test_workers_that_may_not_start_processes_are_no_fault_of_the_files(monkeypatch):
    """As dask's by default: every file would else be called crashed."""
    monkeypatch.setitem(multiprocessing.current_process()._config, "daemon", True)
    with (
        ThreadPoolExecutor(1) as executor,
        pytest.raises(EngineError, match=r"distributed\.worker\.daemon: False"),
    ):
        list(run_on(executor, print, [(1,), (2,)]))
