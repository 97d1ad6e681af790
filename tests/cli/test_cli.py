"""The command line: what it prints, its exit status, and no traceback whatever happens."""

import subprocess
import sys
import zipfile
from pathlib import Path

import openpyxl
import pytest

from kfsheet import load_exercise
from kfsheet.cli import terminal
from kfsheet.cli.commands import main
from kfsheet.exercises import exercise_names

STONE = str(Path(__file__).parents[1] / "stone.py")


@pytest.fixture
def run(capsys):
    """Call the command line and return status, standard output and standard error."""

    def call(*arguments):
        try:
            status = main(list(map(str, arguments)))
        except SystemExit as leaving:  # argparse leaves this way
            status = leaving.code
        return status, *capsys.readouterr()

    return call


def test_build_writes_every_exercise_and_says_where(run, tmp_path):
    status, out, err = run("build", "--out", tmp_path)
    assert status == 0
    assert out.split() == [str(tmp_path / f"{name}.xlsx") for name in exercise_names()]
    assert err.splitlines()[0] == f"build 1/{len(exercise_names())}: {exercise_names()[0]}"
    assert {p.name for p in tmp_path.iterdir()} == {f"{name}.xlsx" for name in exercise_names()}


def test_check_says_how_well_a_workbook_agrees(run, football_file):
    status, out, _ = run("check", football_file)
    assert status == 0
    assert out.startswith(f"{football_file}: ")
    assert "formulas agree with NumPy in IronCalc" in out


def test_check_names_the_cell_and_leaves_with_1(run, football_file, tmp_path):
    book = openpyxl.load_workbook(football_file)
    book["Reanalysis"]["G9"] = "=K8"
    book.save(tmp_path / "wrong.xlsx")
    status, out, _ = run("check", tmp_path / "wrong.xlsx")
    assert status == 1
    assert "Reanalysis!G9: x_f, photo 5: the sheet has" in out
    assert "1 cell is wrong in IronCalc" in out


@pytest.mark.parametrize("property_", ["cannonball", "no_exercise_of_ours", None])
def test_the_cell_says_which_exercise_it_is_whatever_the_properties_say(
    run, football_file, tmp_path, property_
):
    path, part = tmp_path / "other.xlsx", "docProps/custom.xml"
    with zipfile.ZipFile(football_file) as old, zipfile.ZipFile(path, "w") as new:
        assert b">football<" in old.read(part)
        for item in old.infolist():
            content = old.read(item)
            if item.filename == part and property_:
                content = content.replace(b">football<", f">{property_}<".encode())
            if item.filename != part or property_:
                new.writestr(item, content)
    status, out, _ = run("check", path)
    assert status == 0
    assert "formulas agree with NumPy" in out


def test_one_bad_file_does_not_keep_the_others_from_being_checked(run, football_file, tmp_path):
    bad = tmp_path / "bad.xlsx"
    bad.write_text("nothing")
    status, out, err = run("check", bad, football_file)
    assert status == 2
    assert "formulas agree" in out
    assert "bad.xlsx is not a workbook" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "required: COMMAND"),
        (("bake",), "invalid choice: 'bake'"),
        (("build", "rugby"), "unknown exercise 'rugby'; there is cannonball"),
        (("build", "rugby.py"), "rugby.py does not exist"),
        (("build", "--out", "/dev/null/x"), "cannot be written"),
        (("check",), "WORKBOOK"),
        (("check", "nowhere.xlsx"), "nowhere.xlsx cannot be read: No such file"),
        (("check", "--engine", "abacus", "x.xlsx"), "invalid choice: 'abacus'"),
        (("show", "football", "--as", "song"), "invalid choice: 'song'"),
    ],
)
def test_a_wrong_call_is_told_in_one_line_and_leaves_with_2(run, arguments, message):
    status, _, err = run(*arguments)
    lines = [line for line in err.splitlines() if line.startswith("kfsheet")]
    assert status == 2
    assert len(lines) == 1
    assert message in lines[0]


def test_a_workbook_that_is_not_ours_is_told_so(run, tmp_path):
    openpyxl.Workbook().save(tmp_path / "foreign.xlsx")
    status, _, err = run("check", tmp_path / "foreign.xlsx")
    assert status == 2
    assert "not one of ours" in err


@pytest.mark.parametrize(
    ("dress", "line"),
    [
        ("python", "x_a[t] = x_f[t] + K_x*d_i[t] if observed(d_i[t]) else x_f[t]"),
        ("latex", r"K_{x} &= \frac{a b_{x}}{r_{i} + a^{2} b_{x}} \\"),
        ("excel", '=IF(ISNUMBER(C5),C5-a*G5,"")'),
        ("table", "K_x          0.01548899     m/px"),
    ],
)
def test_show_prints_the_model_in_every_dress(run, dress, line):
    status, out, _ = run("show", "football", "--as", dress)
    assert status == 0
    assert line in out


def test_the_table_fits_into_a_terminal_of_80_columns(run):
    _, out, _ = run("show", "football", "--as", "table")
    assert max(map(len, out.splitlines())) <= 80


def test_a_defect_of_ours_reaches_a_user_as_one_line(run, monkeypatch):
    def defect(_):
        raise RuntimeError("two\nlines")

    monkeypatch.setattr("kfsheet.exercises.load_exercise", defect)
    status, _, err = run("show", "football")
    assert status == 2
    assert err == "kfsheet: RuntimeError: two lines; set KFSHEET_DEBUG=1 for more\n"


def test_an_interrupt_ends_quietly(run, monkeypatch):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr("kfsheet.exercises.load_exercise", interrupt)
    status, _, err = run("show", "football")
    assert status != 0
    assert "interrupted" in err


def test_a_reader_that_leaves_early_is_no_error():
    command = f"{sys.executable} -m kfsheet show football --as python | head -n 1"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True)
    assert done.stderr == ""


def test_a_terminal_sees_a_progress_bar(monkeypatch, capsys):
    monkeypatch.setattr(terminal.sys.stderr, "isatty", lambda: True)
    assert list(terminal.progress([1, 2], "build", 2)) == [1, 2]
    assert "build" in capsys.readouterr().err


# -- an exercise in a file of one's own ------------------------------------------------------


def test_an_exercise_in_a_users_own_file_has_every_privilege_of_ours(run, tmp_path):
    assert len(Path(STONE).read_text().splitlines()) < 45
    status, out, _ = run("build", STONE, "--out", tmp_path)
    assert (status, out.strip()) == (0, str(tmp_path / "stone.xlsx"))
    status, out, _ = run("check", tmp_path / "stone.xlsx", "--exercise", STONE)
    assert status == 0
    assert "formulas agree" in out
    assert run("show", STONE, "--as", "excel")[0] == 0


def test_the_stone_falls_towards_its_exact_solution():
    model = load_exercise(STONE).model
    assert model.check_units() == []


def test_build_warns_of_units_that_do_not_agree_in_a_users_own_file(run, tmp_path):
    """The workbook is written all the same; a sound file, and ours, build without a word."""
    path = tmp_path / "stone.py"
    text = Path(STONE).read_text()
    path.write_text(text.replace("z_a[t - 1] + v[t] * dt", "z_a[t - 1] + v[t] + dt"))
    status, out, err = run("build", path, "--out", tmp_path)
    assert (status, out.strip()) == (0, str(tmp_path / "stone.xlsx"))
    (warning,) = (line for line in err.splitlines() if "warning" in line)
    assert warning == "kfsheet: warning: stone, units of z_f: dt is in s but v[t] is in m/s"
    for sound in (STONE, "football"):
        assert "warning" not in run("build", sound, "--out", tmp_path, "--force")[2]


def test_check_asks_for_the_file_of_an_exercise_it_does_not_know(run, tmp_path):
    run("build", STONE, "--out", tmp_path)
    status, _, err = run("check", tmp_path / "stone.xlsx")
    assert status == 2
    assert "--exercise stone.py" in err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\ny = (\n", "line 2: SyntaxError"),
        ("import kfsheet\n1/0\n", "line 2: ZeroDivisionError: division by zero"),
        (
            "from kfsheet import Recurrence\nRecurrence('a b', title='')\n",
            "line 2: recurrence 'a b'",
        ),
        ("exercise = 5\n", "defines no exercise"),
    ],
)
def test_a_users_file_that_fails_is_told_by_file_and_line(
    run, tmp_path, monkeypatch, text, message
):
    path = tmp_path / "mine.py"
    path.write_text(text)
    monkeypatch.chdir(tmp_path)
    status, _, err = run("build", "mine.py", "--out", tmp_path / "out")
    assert status == 2
    assert "mine.py" in err
    assert message in err
    assert not (tmp_path / "out").exists()
