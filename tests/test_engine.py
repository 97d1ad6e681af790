"""IronCalc in a process of its own answers like IronCalc in this one, and may fail."""

import datetime
import os
import re
import subprocess
import time
import zipfile
from pathlib import Path

import numpy as np
import openpyxl
import pytest

from kfsheet import EngineError, WorkbookError
from kfsheet.coursework.engine import calculated
from kfsheet.excel.apart import Apart
from kfsheet.excel.engine import IronCalc
from kfsheet.excel.recalculate import recalculate
from kfsheet.processes import completed

FOOTBALL = Path(__file__).parents[1] / "workbooks" / "football.xlsx"
KICK = {"Parameters": {(5, 2): np.float64(25.0)}}


def test_a_process_of_its_own_finds_what_this_one_finds_with_other_numbers_too():
    here, apart = IronCalc(FOOTBALL), Apart(FOOTBALL)
    for changes in (None, KICK, None):
        apart.ask(changes)
        assert apart.values(changes) == here.values(changes)


def test_an_engine_that_ends_is_an_error_in_one_line():
    apart = Apart(FOOTBALL)
    apart._process.kill()
    apart.ask()
    with pytest.raises(EngineError, match="ended while it calculated"):
        apart.values()


def test_an_engine_that_takes_too_long_is_stopped(monkeypatch):
    monkeypatch.setattr("kfsheet.excel.apart.TIMEOUT", 0.01)
    apart = Apart(FOOTBALL)
    apart.ask()
    with pytest.raises(EngineError, match=r"ended while it calculated .*, after 0.01 s"):
        apart.values()


def test_a_module_of_the_current_folder_does_not_pass_for_one_of_the_library(tmp_path, monkeypatch):
    (tmp_path / "ironcalc.py").write_text("raise SystemExit('not this one')")
    monkeypatch.chdir(tmp_path)
    apart = Apart(FOOTBALL)
    apart.ask()
    assert apart.values() == IronCalc(FOOTBALL).values()


def test_what_cannot_be_read_is_said_by_the_process_too(tmp_path):
    path = tmp_path / "a.xlsx"
    path.write_bytes(b"no workbook")
    apart = Apart(path)
    apart.ask()
    with pytest.raises(WorkbookError, match="is not a workbook"):
        apart.values()


def test_an_engine_that_is_no_longer_wanted_is_stopped_at_work():
    apart = Apart(FOOTBALL.with_name("cannonball.xlsx"))
    apart.ask()
    process = apart._process
    del apart
    assert process.poll() not in (None, 0)  # 0: it was waited for until it was done


def test_what_an_engine_prints_is_no_answer(tmp_path):
    """IronCalc prints a line for a date as ISO 8601 writes it."""
    book = openpyxl.load_workbook(FOOTBALL)
    book.iso_dates = True
    book["Parameters"]["B40"] = datetime.date(2026, 11, 22)
    book.save(tmp_path / "a.xlsx")
    assert b't="d"' in zipfile.ZipFile(tmp_path / "a.xlsx").read("xl/worksheets/sheet2.xml")
    apart, kick = Apart(tmp_path / "a.xlsx"), ("Parameters", 5, 2)
    apart.ask(KICK)
    assert apart.values(KICK)["Parameters"][5, 2] == 25
    assert calculated(tmp_path / "a.xlsx", [KICK], [kick], 60) == [[25]]


def test_an_engine_that_panics_is_an_error_that_names_the_file(tmp_path):
    """A name of a sheet that the file does not have; Rust's panic is no Exception to Python."""
    path = tmp_path / "a.xlsx"
    with zipfile.ZipFile(FOOTBALL) as old, zipfile.ZipFile(path, "w") as new:
        for item in old.infolist():
            content = old.read(item)
            if item.filename == "xl/workbook.xml":
                odd = b'<definedName name="odd" localSheetId="99">Parameters!$B$5</definedName>'
                content = content.replace(b"<definedNames>", b"<definedNames>" + odd)
            new.writestr(item.filename, content)
    apart = Apart(path)
    apart.ask()
    for compute in (lambda: recalculate(path), apart.values):
        with pytest.raises(EngineError, match=f"IronCalc cannot read {re.escape(str(path))}: .+"):
            compute()


def test_an_engine_leaves_no_copy_behind(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    apart = Apart(FOOTBALL.with_name("cannonball.xlsx"))
    apart.ask()
    end = time.monotonic() + 60
    while not list(tmp_path.rglob("*.xlsx")) and time.monotonic() < end:
        time.sleep(0.001)
    assert list(tmp_path.rglob("*.xlsx"))
    del apart
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="asks for a process as Unix does")
def test_a_program_that_is_late_leaves_none_of_those_it_started(tmp_path):
    started = tmp_path / "pid"
    with pytest.raises(subprocess.TimeoutExpired):
        completed(["sh", "-c", f"sleep 60 & echo $! > {started}; wait"], 1)
    status = Path(f"/proc/{started.read_text().strip()}/stat")
    assert not status.exists() or ") Z " in status.read_text()  # ended, perhaps not yet waited for
