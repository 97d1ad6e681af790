"""A file is its student's by its numbers too: a token is put into a friend's file in a minute."""

import csv
import zipfile

import openpyxl
import pytest
from students import ADA, SECRET, Paper

from kfsheet import load_exercise
from kfsheet.cli import commands as cli
from kfsheet.coursework.handout.course_secret import token
from kfsheet.coursework.reading.roster import Student
from kfsheet.coursework.reports.assessment import assess

BOB = Student("s002", "Bob Ray")


def with_token_of(path, exercise, old, new):
    """Both tokens of a file replaced by those of another student."""
    before = token(SECRET, exercise, old).encode()
    after = token(SECRET, exercise, new).encode()
    with zipfile.ZipFile(path) as archive:
        parts = {n: archive.read(n).replace(before, after) for n in archive.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in parts.items():
            archive.writestr(name, text)
    return path


def answered(exercise, student, path):
    return Paper(load_exercise(exercise), student).open(path).answer_all()


@pytest.mark.parametrize("name", ["football", "shuttlecock", "tennis"])
def test_a_friends_file_with_both_tokens_replaced_is_not_own_data(name, tmp_path):
    path = Paper(load_exercise(name), BOB).open(tmp_path / "a.xlsx").save()
    found = assess(name, SECRET, with_token_of(path, name, BOB.id, ADA.id))
    assert (found.status, found.student, found.marks) == ("not own data", ADA.id, [])


def test_the_public_workbook_with_a_token_is_not_own_data(football_file, tmp_path):
    book = openpyxl.load_workbook(football_file)
    book["Read me"]["Z99"] = token(SECRET, "football", ADA.id)
    book.save(tmp_path / "a.xlsx")
    assert assess("football", SECRET, tmp_path / "a.xlsx").status == "not own data"


def one_parameter(paper):
    sheet, row, column = paper.layout.scalars["a"]
    paper.book[sheet].cell(row, column).value = 47.7


def all_parameters(paper):
    for name in paper.exercise.vary:
        sheet, row, column = paper.layout.scalars[name]
        paper.book[sheet].cell(row, column).value *= 1.1


def half_of_the_photos(paper):
    for row in range(4, 12):
        paper.book["Reanalysis"].cell(row, 3).value = 500.5


def all_photos_typed_anew(paper):
    for row in range(4, 20):
        for column in (3, 4):
            paper.book["Reanalysis"].cell(row, column).value = 300 + row


def rounded_to_15_figures(paper):
    for sheet in paper.book:
        for line in sheet.iter_rows():
            for cell in line:
                if isinstance(cell.value, float):
                    cell.value = float(f"{cell.value:.15g}")


def data_taken_out(paper):
    for row in range(4, 20):
        for column in (3, 4):
            paper.book["Reanalysis"].cell(row, column).value = None


@pytest.mark.parametrize(
    "change",
    [
        one_parameter,
        all_parameters,
        half_of_the_photos,
        all_photos_typed_anew,
        rounded_to_15_figures,
        data_taken_out,
    ],
)
def test_who_only_plays_with_numbers_is_not_blamed(change, tmp_path):
    paper = answered("football", ADA, tmp_path / "a.xlsx")
    change(paper)
    found = assess("football", SECRET, paper.save())
    assert found.status == "graded", found.remark
    assert found.score == sum(m.points for m in found.marks)


def test_the_lecturer_learns_whose_numbers_they_are_and_the_student_does_not(tmp_path):
    home = tmp_path
    (home / "r.csv").write_text("id,name\ns001,Ada Lovelace\ns002,Bob Ray\ns003,Cy Dee\n")
    (home / "s").write_bytes(SECRET)
    (home / "in").mkdir()
    answered("football", BOB, home / "in/bob.xlsx").save()
    path = answered("football", BOB, home / "in/ada.xlsx").save()
    with_token_of(path, "football", BOB.id, ADA.id)
    stranger = Student("x99", "Not On The Roster")
    path = answered("football", stranger, home / "in/cy.xlsx").save()
    with_token_of(path, "football", "x99", "s003")
    ask = ["--roster", home / "r.csv", "--secret", home / "s", "--out", home / "g"]
    assert cli.main([*map(str, ["grade", "football", home / "in", *ask])]) == 0
    with (home / "g/grades.csv").open(encoding="utf-8-sig") as file:
        ada, bob, cy = csv.DictReader(file)
    assert (ada["status"], ada["score"]) == ("not own data", "0")
    assert "the numbers are those of s002" in ada["remark"]
    assert "the numbers are those of nobody on the roster" in cy["remark"]
    assert (bob["status"], bob["score"]) == ("graded", bob["max"])
    page = (home / "g/class.html").read_text()
    assert "<td>ada.xlsx</td><td></td><td>s001</td><td>s002</td>" in page
    for name in ("feedback/s001.html", "moodle.csv"):
        text = (home / "g" / name).read_text()
        assert "not own data" in text
        assert "numbers are those of" not in text
