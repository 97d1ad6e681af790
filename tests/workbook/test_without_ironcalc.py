"""kfsheet without the extra ``check``: all works but for what an engine has to calculate."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

FOOTBALL = Path(__file__).parents[2] / "workbooks" / "football.xlsx"
REMEDY = 'pip install "kfsheet[check]"'


@pytest.fixture
def without_ironcalc(tmp_path):
    """Run Python where importing IronCalc fails, in the processes that it starts too."""
    gone = tmp_path / "gone"
    gone.mkdir()
    (gone / "ironcalc.py").write_text("raise ModuleNotFoundError('No module named ironcalc')\n")
    around = {**os.environ, "PYTHONPATH": str(gone), "KFSHEET_DEBUG": "1"}

    def run(*arguments):
        program = [sys.executable, *map(str, arguments)]
        return subprocess.run(program, env=around, capture_output=True, text=True)

    return run


def test_the_library_imports_evaluates_and_writes(without_ironcalc, tmp_path):
    program = (
        "import sys, kfsheet as kf\n"
        "exercise = kf.load_exercise('football')\n"
        "kf.evaluate(exercise.model)\n"
        "kf.write_workbook(exercise, sys.argv[1])\n"
        "from kfsheet import *\n"
    )
    done = without_ironcalc("-c", program, tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "football.xlsx").read_bytes() == FOOTBALL.read_bytes()


def test_the_commands_build_and_show_work(without_ironcalc, tmp_path):
    for arguments in (("build", "football", "--out", tmp_path), ("show", "football")):
        done = without_ironcalc("-m", "kfsheet", *arguments)
        assert done.returncode == 0, done.stderr


def test_check_names_the_extra_in_one_line(without_ironcalc):
    done = without_ironcalc("-m", "kfsheet", "check", FOOTBALL)
    (line,) = (line for line in done.stderr.splitlines() if line.startswith("kfsheet:"))
    assert done.returncode == 2
    assert REMEDY in line
    assert "Traceback" not in done.stderr


def test_recalculate_names_the_extra(without_ironcalc):
    done = without_ironcalc("-c", f"import kfsheet; kfsheet.recalculate({str(FOOTBALL)!r})")
    last = done.stderr.splitlines()[-1]
    assert last.startswith("kfsheet.errors.MissingEngineError: ")
    assert REMEDY in last
