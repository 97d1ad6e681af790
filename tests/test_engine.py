"""IronCalc in a process of its own answers like IronCalc in this one, and may fail."""

from pathlib import Path

import numpy as np
import pytest

from kfsheet import EngineError, WorkbookError
from kfsheet.excel.engine import Apart, IronCalc

FOOTBALL = Path(__file__).parents[1] / "workbooks" / "football.xlsx"
KICK = {"Parameters": {(5, 2): np.float64(25.0)}}


def test_a_process_of_its_own_finds_what_this_one_finds_with_other_numbers_too():
    here, apart = IronCalc(FOOTBALL), Apart(FOOTBALL)
    for changes in (None, KICK, None):
        apart.ask(changes)
        assert apart.answer() == here.values(changes)


def test_an_engine_that_ends_is_an_error_in_one_line():
    apart = Apart(FOOTBALL)
    apart._process.kill()
    apart.ask()
    with pytest.raises(EngineError, match="ended while it calculated"):
        apart.answer()


def test_an_engine_that_takes_too_long_is_stopped(monkeypatch):
    monkeypatch.setattr("kfsheet.excel.engine.TIMEOUT", 0.01)
    apart = Apart(FOOTBALL)
    apart.ask()
    with pytest.raises(EngineError, match=r"ended while it calculated .*, after 0.01 s"):
        apart.answer()


def test_a_module_of_the_current_folder_does_not_pass_for_one_of_the_library(tmp_path, monkeypatch):
    (tmp_path / "ironcalc.py").write_text("raise SystemExit('not this one')")
    monkeypatch.chdir(tmp_path)
    apart = Apart(FOOTBALL)
    apart.ask()
    assert apart.answer() == IronCalc(FOOTBALL).values()


def test_what_cannot_be_read_is_said_by_the_process_too(tmp_path):
    path = tmp_path / "a.xlsx"
    path.write_bytes(b"no workbook")
    apart = Apart(path)
    apart.ask()
    with pytest.raises(WorkbookError, match="is not a workbook"):
        apart.answer()


def test_an_engine_that_is_no_longer_wanted_is_stopped_at_work():
    apart = Apart(FOOTBALL.with_name("cannonball.xlsx"))
    apart.ask()
    process = apart._process
    del apart
    assert process.poll() not in (None, 0)  # 0: it was waited for until it was done
