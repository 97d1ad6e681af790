"""Where one engine cannot, another one calculates, and the report says so."""

import json
from pathlib import Path

import openpyxl
import pytest
from conftest import need
from odd_workbooks import parts_of, zipped

from kfsheet import check_workbook, load_exercise, recalculate, write_workbook
from kfsheet.cli.commands import main
from kfsheet.errors import EngineError

HERE = Path(__file__).parent
STONE = HERE.parent / "stone.py"
GNUMERIC = HERE / "saved" / "stone_gnumeric.xlsx"
PANIC = b'<definedName name="elsewhere" localSheetId="99">9.81</definedName><definedName '


@pytest.fixture(scope="module")
def stone():
    return load_exercise(str(STONE))


@pytest.fixture
def built(stone, tmp_path):
    return write_workbook(stone, tmp_path)


@pytest.fixture
def feared(built):
    """A workbook on which IronCalc panics: a name belongs to a worksheet that is not there."""
    parts = parts_of(built.read_bytes())
    book = "xl/workbook.xml"
    parts[book] = parts[book].replace(b"<definedName ", PANIC, 1)
    built.write_bytes(zipped(parts))
    return built


def with_formula(path, sheet, cell, formula):
    book = openpyxl.load_workbook(path)
    book[sheet][cell] = formula
    book.save(path)
    return path


@pytest.mark.parametrize("engine", ["ironcalc", "own"])
def test_what_gnumeric_saved_is_checked(engine, stone):
    report = check_workbook(GNUMERIC, stone, engine)
    assert report.holds, report.lines()
    assert (report.engine, report.instead) == (engine, "")


def test_a_workbook_on_which_ironcalc_panics_is_checked_by_our_own(stone, feared):
    with pytest.raises(EngineError):
        recalculate(feared)
    report = check_workbook(feared, stone)
    assert report.holds
    assert report.engine == "own"
    assert "IronCalc cannot read" in report.instead
    assert "in kfsheet's calculator" in report.verdict


def test_the_text_and_the_json_say_which_engine_calculated(feared, capsys):
    check = ["check", str(feared), "--exercise", str(STONE)]
    assert main(check) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "IronCalc cannot read" in lines[0]
    assert "agree with NumPy in kfsheet's calculator" in lines[-1]
    assert main([*check, "--format", "json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)
    assert (found["engine"], found["holds"], found["problems"]) == ("own", True, [])
    assert "IronCalc cannot read" in found["instead"]


def test_a_wrong_cell_is_named_by_our_own_too(stone, built):
    report = check_workbook(with_formula(built, "Fall", "D6", 1.5), stone, "own")
    assert [p.address[1:] for p in report.problems] == [(6, 4)], report.lines()


def test_a_function_that_ironcalc_does_not_know_is_no_mistake(stone, built):
    old = openpyxl.load_workbook(built)["Fall"]["D6"].value
    path = with_formula(built, "Fall", "D6", f"=AGGREGATE(9,6,D5)+({old[1:]})-D5")
    assert recalculate(path)["Fall"][6, 4] in ("#NAME?", "#ERROR!", "#N/IMPL!")
    report = check_workbook(path, stone)
    assert report.holds, report.lines()
    assert (report.engine, report.instead) == (
        "own",
        "IronCalc does not know the formula in Fall!D6",
    )


def test_a_misspelt_name_stays_a_mistake_in_the_engine_that_was_asked(stone, built):
    report = check_workbook(with_formula(built, "Fall", "D6", "=D5-gravity*dt"), stone)
    assert (report.engine, report.instead) == ("ironcalc", "")
    assert [p.address[1:] for p in report.problems] == [(6, 4)]


@pytest.mark.parametrize("engine", ["ironcalc", "libreoffice", "own"])
def test_a_number_may_be_put_into_a_cell_that_is_not_in_the_file(engine, built):
    if engine == "libreoffice":
        need("libreoffice")
    path = with_formula(built, "Fall", "Z5", "=Z4*2+Z90")
    values = recalculate(path, engine, {"Fall": {(4, 26): 3.0, (90, 26): 0.5, (91, 27): None}})
    assert values["Fall"][5, 26] == 6.5


def test_a_formula_that_is_not_closed_has_no_value_in_libreoffice(built):
    """Excel refuses such a file; LibreOffice would close the parenthesis."""
    need("libreoffice")
    path = with_formula(built, "Fall", "Z5", '=IF(1>0,LEN("("),7')
    values = recalculate(with_formula(path, "Fall", "Z6", '=LEN("((")+1'), "libreoffice")
    assert values["Fall"][5, 26] == "#N/A"
    assert values["Fall"][6, 26] == 3
