"""A workbook is the same workbook, whatever program packed it."""

import io
from pathlib import Path

import openpyxl
import pytest
from odd_workbooks import DRESSES, dressed
from openpyxl.formula import Tokenizer
from students import ADA, SECRET, Paper

from kfsheet import check_workbook, load_exercise
from kfsheet.coursework.handout.handout_workbook import handout_bytes
from kfsheet.coursework.reading.submission import read_submission
from kfsheet.coursework.reports.assessment import assess
from kfsheet.workbook.reading.archive import Container
from kfsheet.workbook.reading.normal_form import normal_form

WORKBOOKS = Path(__file__).parents[2] / "workbooks"


@pytest.fixture(scope="module")
def football():
    return load_exercise("football")


@pytest.fixture(scope="module")
def answered(football, tmp_path_factory):
    path = tmp_path_factory.mktemp("answered") / "a.xlsx"
    paper = Paper(football, ADA, handout_bytes(football, ADA, SECRET)).open(path)
    return paper.answer_all().save().read_bytes()


@pytest.mark.parametrize("dress", DRESSES)
def test_grade_reads_it_alike_and_hands_it_back_with_marks(dress, answered, tmp_path):
    plain, odd = tmp_path / "plain.xlsx", tmp_path / "odd.xlsx"
    plain.write_bytes(answered)
    odd.write_bytes(dressed(answered, dress))
    one, other = read_submission(plain), read_submission(odd)
    assert (one.sheets, one.names) == (other.sheets, other.names)
    assert one.properties == other.properties
    found = assess("football", SECRET, odd, tmp_path / "copy.xlsx")
    assert {mark.status for mark in found.marks} == {"right"}, found
    book = openpyxl.load_workbook(tmp_path / "copy.xlsx")
    assert "Marks" in book.sheetnames
    assert book["Parameters"]["A1"].value


@pytest.mark.parametrize("dress", DRESSES)
def test_check_finds_every_formula_of_it_and_the_engine_takes_it(dress, football, tmp_path):
    path = tmp_path / "odd.xlsx"
    path.write_bytes(dressed((WORKBOOKS / "football.xlsx").read_bytes(), dress))
    report = check_workbook(path, football)
    assert report.holds, report.lines()
    assert (report.engine, report.cells) == ("ironcalc", 1188)


def test_a_plain_workbook_is_left_as_it_is():
    for path in WORKBOOKS.glob("*.xlsx"):
        container = Container.open(path)
        assert normal_form(container) is container


def test_the_normal_form_is_its_own(answered):
    for dress in DRESSES:
        normal = normal_form(Container(dressed(answered, dress)))
        assert normal_form(normal) is normal, dress
        openpyxl.load_workbook(io.BytesIO(normal.content))


def test_check_reads_a_file_that_lost_its_names_and_properties(football, tmp_path):
    """A program without names writes out what they stand for; the labels tell what is what."""
    book = openpyxl.load_workbook(WORKBOOKS / "football.xlsx")
    places = {name: defined.attr_text for name, defined in book.defined_names.items()}
    for sheet in book:
        for row in sheet.iter_rows():
            for cell in row:
                if cell.data_type == "f":
                    found = Tokenizer(cell.value)
                    for token in found.items:
                        token.value = places.get(token.value, token.value)
                    cell.value = found.render()
    book.defined_names.clear()
    book.custom_doc_props.props.clear()
    book.save(tmp_path / "lost.xlsx")
    report = check_workbook(tmp_path / "lost.xlsx", load_exercise)
    assert report.holds, report.lines()
    assert report.cells == 1188
