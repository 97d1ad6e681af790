"""IronCalc in a process of its own answers like IronCalc in this one, and may fail."""

import datetime
import os
import re
import signal
import subprocess
import sys
import threading
import time
import zipfile
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from archives import rewrite, say_it_is_ours
from conftest import need
from openpyxl.comments import Comment

from kfsheet import EngineError, WorkbookError
from kfsheet.coursework.judging.recalculation_process import calculated
from kfsheet.processes import completed
from kfsheet.workbook.engines.copies_for_engines import copy_for_ironcalc
from kfsheet.workbook.engines.ironcalc import IronCalc
from kfsheet.workbook.engines.ironcalc_process import IronCalcProcess
from kfsheet.workbook.engines.recalculate import recalculate
from kfsheet.workbook.write.reproducible_zip import untouched

FOOTBALL = Path(__file__).parents[2] / "workbooks" / "football.xlsx"
CANNONBALL = FOOTBALL.with_name("cannonball.xlsx")
KICK = {"Parameters": {(5, 2): np.float64(25.0)}}
HARDER = {"Parameters": {(5, 2): 30.0}}


def is_running(process: int) -> bool:
    """Whether a process has not ended; one that has is a zombie until it is waited for."""
    try:
        return ") Z " not in Path(f"/proc/{process}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_a_process_of_its_own_finds_what_this_one_finds_with_other_numbers_too():
    here, background = IronCalc(FOOTBALL), IronCalcProcess(FOOTBALL)
    for changes in (None, KICK, None):
        background.ask(changes)
        assert background.values(changes) == here.values(changes)


def test_questions_that_are_asked_together_do_not_see_each_others_numbers():
    here, background = IronCalc(FOOTBALL), IronCalcProcess(FOOTBALL)
    for changes in (KICK, None, HARDER):
        background.ask(changes)
    for changes in (KICK, None, HARDER):
        assert background.values(changes) == here.values(changes)


def test_what_was_asked_in_vain_is_passed_over():
    background = IronCalcProcess(FOOTBALL)
    for changes in (KICK, None, HARDER):
        background.ask(changes)
    assert background.values(HARDER) == IronCalc(FOOTBALL).values(HARDER)
    assert background.values() == IronCalc(FOOTBALL).values()


def test_a_question_about_a_worksheet_that_is_not_there_is_an_error_and_the_next_is_answered():
    background, elsewhere = IronCalcProcess(FOOTBALL), {"Elsewhere": {(1, 1): 2.0}}
    background.ask(elsewhere)
    background.ask(KICK)
    with pytest.raises(EngineError, match="has no worksheet 'Elsewhere'"):
        background.values(elsewhere)
    assert background.values(KICK) == IronCalc(FOOTBALL).values(KICK)


def fail_to_fork(after: int | None) -> None:
    """Let this process fork so many times, and then no more; None where nothing knows of forks."""
    fork, left = os.fork, iter(range(after or 0))

    def few() -> int:
        if next(left, None) is None:
            raise BlockingIOError("no more processes")
        return fork()

    os.fork = few
    if after is None:
        del os.fork


@pytest.mark.parametrize("left", [None, 0, 1], ids=["on Windows", "at all", "after the first"])
def test_where_nothing_can_be_forked_the_answers_are_the_same(monkeypatch, left):
    def command(module: str, function: str, *arguments: str) -> list[str]:
        program = "import os, sys; from test_ironcalc_process import fail_to_fork; "
        program += f"fail_to_fork({left}); from {module} import {function} as main; "
        path = f"sys.path[:0] = {[str(folder) for folder in Path(__file__).parents[:2]]!r}; "
        return [
            sys.executable,
            "-c",
            "import sys; " + path + program + "main(*sys.argv[1:])",
            *arguments,
        ]

    monkeypatch.setattr("kfsheet.workbook.engines.ironcalc_process.command", command)
    here, background = IronCalc(FOOTBALL), IronCalcProcess(FOOTBALL)
    for changes in (None, KICK, HARDER):
        background.ask(changes)
    for changes in (None, HARDER, KICK):
        assert background.values(changes) == here.values(changes)


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds a fork as Linux does")
def test_a_fork_that_dies_is_an_error_and_not_an_answer():
    background, number = IronCalcProcess(CANNONBALL), 0
    background.ask()
    forks = Path(f"/proc/{background._process.pid}/task/{background._process.pid}/children")
    end = time.monotonic() + 60
    while not number and time.monotonic() < end:
        number = int(forks.read_text() or 0)
    os.kill(number, signal.SIGKILL)
    background.ask(KICK)
    for _ in range(2):
        with pytest.raises(EngineError, match="ended while it calculated"):
            background.values()


@pytest.mark.parametrize("engine", ["ironcalc", "libreoffice"])
@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_what_no_cell_can_hold_is_refused(engine, number):
    if engine == "libreoffice":
        need(engine)
    with pytest.raises(EngineError, match=r"cannot (hold|put)"):
        recalculate(FOOTBALL, engine, {"Parameters": {(5, 2): number}})


def test_after_numbers_that_are_refused_others_are_calculated():
    background, odd = IronCalcProcess(FOOTBALL), {"Parameters": {(5, 2): float("nan"), (0, 0): 1.0}}
    with pytest.raises(EngineError, match="cannot put numbers into"):
        background.values(odd)
    assert background.values(KICK) == IronCalc(FOOTBALL).values(KICK)


def test_a_folder_without_room_for_a_copy_is_named(tmp_path):
    with pytest.raises(EngineError, match=r"cannot be written to .*make room there"):
        copy_for_ironcalc(FOOTBALL, tmp_path / "gone" / "copy.xlsx")


def test_values_that_are_stored_in_a_file_of_ours_are_not_believed(tmp_path):
    """IronCalc reads such a file as it is."""
    path, value = tmp_path / "a.xlsx", rb"(</f>|<f [^>]*/>)<v>[^<]*</v>"
    rewrite(FOOTBALL, path, r"xl/worksheets/sheet\d+\.xml", value, rb"\1<v>42</v>")
    assert IronCalc(path).values() == IronCalc(FOOTBALL).values()
    assert untouched(path)


def test_a_file_that_only_says_that_it_is_ours_is_read_too(tmp_path):
    """IronCalc cannot load openpyxl's comments; the program that is named is ours all the same."""
    book = openpyxl.load_workbook(FOOTBALL)
    book["Parameters"]["B40"].comment = Comment("Is this right?", "a reader")
    book.save(tmp_path / "saved.xlsx")
    path = say_it_is_ours(tmp_path / "saved.xlsx", tmp_path / "a.xlsx")
    assert untouched(path)
    assert IronCalc(path).values(KICK)["Parameters"][5, 2] == 25


@pytest.mark.skipif(os.name == "nt", reason="stops a process as Unix does")
def test_who_is_interrupted_while_waiting_gets_the_right_answer_the_next_time():
    background, before = IronCalcProcess(FOOTBALL), threading.active_count()
    background.values()
    os.kill(background._process.pid, signal.SIGSTOP)
    here = threading.get_ident()
    interrupt = threading.Timer(0.5, signal.pthread_kill, [here, signal.SIGINT])
    interrupt.start()
    with pytest.raises(KeyboardInterrupt):
        background.values(KICK)
    end = time.monotonic() + 10
    while threading.active_count() > before and time.monotonic() < end:
        time.sleep(0.01)
    assert threading.active_count() == before  # no timer, for which the interpreter would wait
    os.kill(background._process.pid, signal.SIGCONT)
    assert background.values(HARDER) == IronCalc(FOOTBALL).values(HARDER)


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds a process as Linux does")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_command_that_is_ended_leaves_neither_processes_nor_files(tmp_path, number):
    around = {**os.environ, "TMPDIR": str(tmp_path)}
    program = [sys.executable, "-m", "kfsheet", "check", str(CANNONBALL)]
    with subprocess.Popen(program, env=around, stderr=subprocess.PIPE) as command:
        children, end = Path(f"/proc/{command.pid}/task/{command.pid}/children"), 0
        while not list(tmp_path.glob("*/question 1")):
            time.sleep(0.01)
        engine = int(children.read_text())
        os.kill(command.pid, number)
        assert command.wait(10) in (2, -number)
    end = time.monotonic() + 20
    while (is_running(engine) or list(tmp_path.iterdir())) and time.monotonic() < end:
        time.sleep(0.01)
    assert not is_running(engine)
    assert not list(tmp_path.iterdir())


def test_an_engine_that_ends_is_an_error_in_one_line():
    background = IronCalcProcess(FOOTBALL)
    background._process.kill()
    background.ask()
    with pytest.raises(EngineError, match="ended while it calculated"):
        background.values()


def test_an_engine_that_takes_too_long_is_stopped(monkeypatch):
    monkeypatch.setattr("kfsheet.workbook.engines.ironcalc_process.TIMEOUT", 0.01)
    background = IronCalcProcess(FOOTBALL)
    background.ask()
    with pytest.raises(EngineError, match=r"ended while it calculated .*, after 0.01 s"):
        background.values()


def test_a_module_of_the_current_folder_does_not_pass_for_one_of_the_library(tmp_path, monkeypatch):
    (tmp_path / "ironcalc.py").write_text("raise SystemExit('not this one')")
    monkeypatch.chdir(tmp_path)
    background = IronCalcProcess(FOOTBALL)
    background.ask()
    assert background.values() == IronCalc(FOOTBALL).values()


def test_what_cannot_be_read_is_said_by_the_process_too(tmp_path):
    path = tmp_path / "a.xlsx"
    path.write_bytes(b"no workbook")
    background = IronCalcProcess(path)
    background.ask()
    with pytest.raises(WorkbookError, match="is not a workbook"):
        background.values()


def test_an_engine_that_is_no_longer_wanted_is_stopped_at_work():
    background = IronCalcProcess(CANNONBALL)
    background.ask()
    process = background._process
    del background
    assert process.poll() not in (None, 0)  # 0: it was waited for until it was done


def test_what_an_engine_prints_is_no_answer(tmp_path):
    """IronCalc prints a line for a date as ISO 8601 writes it."""
    book = openpyxl.load_workbook(FOOTBALL)
    book.iso_dates = True
    book["Parameters"]["B40"] = datetime.date(2026, 11, 22)
    book.save(tmp_path / "a.xlsx")
    assert b't="d"' in zipfile.ZipFile(tmp_path / "a.xlsx").read("xl/worksheets/sheet2.xml")
    background, kick = IronCalcProcess(tmp_path / "a.xlsx"), ("Parameters", 5, 2)
    background.ask(KICK)
    assert background.values(KICK)["Parameters"][5, 2] == 25
    assert calculated(tmp_path / "a.xlsx", [KICK], [kick], 60) == [[25]]


def test_an_engine_that_panics_is_an_error_that_names_the_file(tmp_path):
    """A name of a sheet that the file does not have; Rust's panic is no Exception to Python."""
    path = tmp_path / "a.xlsx"
    odd = b'<definedName name="odd" localSheetId="99">Parameters!$B$5</definedName>'
    rewrite(FOOTBALL, path, r"xl/workbook\.xml", rb"<definedNames>", rb"\g<0>" + odd)
    background = IronCalcProcess(path)
    background.ask()
    for compute in (lambda: recalculate(path), background.values):
        with pytest.raises(EngineError, match=f"IronCalc cannot read {re.escape(str(path))}: .+"):
            compute()


def test_an_engine_leaves_no_copy_behind(tmp_path, monkeypatch):
    path = tmp_path / "by_another_program.xlsx"  # ours are read as they are
    rewrite(CANNONBALL, path, r"docProps/app\.xml", rb"kfsheet", b"Another")
    folder = tmp_path / "copies"
    folder.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    background = IronCalcProcess(path)
    background.ask()
    end = time.monotonic() + 60
    while not list(folder.rglob("*.xlsx")) and time.monotonic() < end:
        time.sleep(0.001)
    assert list(folder.rglob("*.xlsx"))
    del background
    assert not list(folder.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="asks for a process as Unix does")
def test_a_program_that_is_late_leaves_none_of_those_it_started(tmp_path):
    started = tmp_path / "pid"
    with pytest.raises(subprocess.TimeoutExpired):
        completed(["sh", "-c", f"sleep 60 & echo $! > {started}; wait"], 1)
    number, end = int(started.read_text()), time.monotonic() + 10
    while is_running(number) and time.monotonic() < end:
        time.sleep(0.01)  # a signal takes a moment
    assert not is_running(number)
