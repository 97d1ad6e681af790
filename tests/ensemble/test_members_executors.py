"""Whoever computes a study, its result is the same; an interrupt leaves nothing behind."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from kfsheet import Draws, study
from kfsheet.ensemble import executors as running
from kfsheet.ensemble.group import BATCH
from kfsheet.evaluation.compiling import can_compile
from kfsheet.exercises.football import football

MANY = 600


@pytest.fixture(autouse=True)
def small_groups(monkeypatch):
    """So that a few members make several batches."""
    monkeypatch.setattr("kfsheet.ensemble.study.MOST", 16)
    assert MANY > 2 * 16 * BATCH


def asked(executor=None):
    draws = Draws("i", seed=2, data={"j": np.array(football.table["j"].values)})
    wanted = {"columns": ["e_x_a", "d_i"], "quantiles": (0.1, 0.5), "compiled": can_compile()}
    return study(football, MANY, draws, executor=executor, **wanted)


def same(here, there):
    assert here.members == there.members == MANY
    assert all(here.rows[name].equals(there.rows[name]) for name in ("e_x_a", "d_i"))
    assert here.scalars.equals(there.scalars)


class Counting(Executor):
    """Computes at once, and counts; it does not say how many workers it has."""

    def __init__(self):
        self.tasks = 0

    def submit(self, function, /, *arguments):
        self.tasks += 1
        future = Future()
        future.set_result(function(*arguments))
        return future


def executors():
    yield "one thread", lambda: ThreadPoolExecutor(1)
    yield "processes", lambda: ProcessPoolExecutor(2, mp_context=get_context("spawn"))
    yield "unknown", Counting


@pytest.mark.parametrize("make", [m for _, m in executors()], ids=[n for n, _ in executors()])
def test_whoever_computes_the_result_is_the_same_to_the_last_bit(make):
    here = asked()
    with make() as executor:
        same(here, asked(executor))


def test_threads_and_none_compute_the_same(monkeypatch):
    here = asked()
    monkeypatch.setattr(running, "WORTH_THREADS", 0)
    monkeypatch.setattr(running, "cores", lambda: 3)
    same(here, asked())


def test_an_executor_gets_batches_not_groups():
    counting = Counting()
    asked(counting)
    assert counting.tasks == -(-MANY // (16 * BATCH))


def test_as_many_tasks_are_under_way_as_the_executor_has_workers_for():
    with ThreadPoolExecutor(7) as pool:
        assert running._workers(pool) == 7
    assert running._workers(Counting()) == running.UNKNOWN_WORKERS

    class Client:
        def ncores(self):
            return {"tcp://one": 4, "tcp://two": 8}

    class OfACluster:
        _client = Client()

    assert running._workers(OfACluster()) == 12


def test_this_process_may_use_no_more_cores_than_it_is_allowed():
    allowed = getattr(os, "sched_getaffinity", lambda _: range(os.cpu_count()))(0)
    assert running.cores() == len(allowed)


INTERRUPTED = """
import signal, threading
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
from kfsheet import Draws, study
from kfsheet.evaluation.compiling import can_compile
from kfsheet.exercises.cannonball import cannonball
options = {"columns": ["NIS"], "scalars": (), "compiled": can_compile()}
study(cannonball, 1, Draws("n_r"), **options)
print("started", flush=True)
try:
    study(cannonball, 10**7, Draws("n_r"), quantiles=(0.5,), **options)
except KeyboardInterrupt:
    pool = [thread for thread in threading.enumerate() if "Pool" in thread.name]
    print(len(pool), study(cannonball, 5, **options).members, flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGINT to send")
def test_an_interrupt_leaves_nothing_running():
    """Ctrl-C in a study that would take an hour: its threads end, and the next one runs."""
    program = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert program.stdout.readline() == "started\n"
        time.sleep(1)
        program.send_signal(signal.SIGINT)
        out, err = program.communicate(timeout=120)
    finally:
        program.kill()
        program.communicate()
    assert out.split() == ["0", "5"]
    assert not err
    assert program.returncode == 0


def test_what_fails_in_one_group_cancels_the_others(monkeypatch):
    """An error of the first group is raised at once, with the futures behind it cancelled."""
    monkeypatch.setattr(running, "WORTH_THREADS", 0)
    monkeypatch.setattr(running, "cores", lambda: 2)
    before, done = threading.active_count(), []

    def failing(task):
        done.append(task.first)
        raise RuntimeError("broken")

    monkeypatch.setattr(running, "run_group", failing)
    with pytest.raises(RuntimeError, match="broken"):
        study(football, 10_000, columns=["x_a"])
    assert threading.active_count() == before
    assert len(done) < 20
    monkeypatch.undo()
    assert study(football, 10, columns=["x_a"]).members == 10


def test_the_progress_bar_waits_and_is_seen_on_terminals_only(monkeypatch, capsys):
    bar = running._bar(10, True)
    assert bar.disable  # standard error is caught here, so it is no terminal
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with running._bar(10, True) as bar:
        assert not bar.disable
        assert bar.delay > 0
        bar.update(10)
    assert capsys.readouterr().err == ""  # done before anybody had to wait
    assert running._bar(10, False).disable
    monkeypatch.setenv("TQDM_DISABLE", "1")
    assert running._bar(10, True).disable


MEMORY = """
import sys
from pathlib import Path
from kfsheet import Draws, study
{imports}
study({what})
status = Path("/proc/self/status")  # unlike getrusage, it knows nothing of the parent
peak = [int(line.split()[1]) for line in status.read_text().splitlines() if "VmHWM" in line]
print(peak[0] / 1024)
"""

FOOTBALLS = """football, {members}, columns=["e_x_a"], quantiles=(0.05, 0.5, 0.95)"""


def peak(what, imports):
    found = subprocess.run(
        [sys.executable, "-c", MEMORY.format(what=what, imports=imports)],
        capture_output=True,
        text=True,
        check=True,
    )
    return float(found.stdout)


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="no /proc to ask")
def test_memory_stays_small_for_a_million_members_with_quantiles():
    imports = "from kfsheet.exercises.football import football"
    used = [peak(FOOTBALLS.format(members=n), imports) for n in (100_000, 1_000_000)]
    assert max(used) < 500
    # All scalars of all members would be 144 MB more.
    assert used[1] - used[0] < 60


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="no /proc to ask")
def test_memory_does_not_grow_with_flights_that_are_drawn():
    """A thousand flights more have 21 MB of draws and 74 MB of columns."""
    imports = "from kfsheet import NEES\nfrom kfsheet.exercises.cannonball import cannonball"
    what = (
        'cannonball, {}, Draws("n_theta", "n_r"), columns=["NIS", "e_x_a"], '
        'nees={{"NEES": NEES(("x", "vx", "y", "vy"))}}, quantiles=(0.5,)'
    )
    used = [peak(what.format(n), imports) for n in (500, 1500)]
    assert max(used) < 500
    assert used[1] - used[0] < 15
