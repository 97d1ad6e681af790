"""Rosters as spreadsheet programs and platforms write them; files in tests/coursework/rosters."""

import csv
from pathlib import Path

import pytest

from kfsheet.coursework.reading.roster import Student, harmless, read_roster
from kfsheet.errors import DataError

ROSTERS = Path(__file__).parent / "rosters"


@pytest.mark.parametrize(
    ("name", "students"),
    [
        ("name_u2028", [Student("1", "A B"), Student("2", "C")]),
        ("name_vt", [Student("1", "A B"), Student("2", "C")]),
        ("sep_line", [Student("1", "A")]),
        ("trailing_empty_excel_rows", [Student("1", "A", "a@x")]),
    ],
)
def test_a_roster_that_a_program_wrote_is_read_whole(name, students):
    assert read_roster(ROSTERS / f"{name}.csv") == students


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("same_email", "login same@x.org twice, in lines 2 and 3"),
        ("too_many_fields", "line 2 has more fields than the header"),
    ],
)
def test_a_roster_that_would_mix_up_students_is_refused(name, words):
    with pytest.raises(DataError, match=words):
        read_roster(ROSTERS / f"{name}.csv")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("id\tname\n1\tDoe, Jane\n", [Student("1", "Doe, Jane")]),
        ("sep=,\r\nid,name\r\n1,Doe; Jane\r\n", [Student("1", "Doe; Jane")]),
        ('SEP=;\nid;name\n1;"Doe\nJane"\n', [Student("1", "Doe Jane")]),
        ("id,name\r\n\r\n1,A\r\n,\r\n \r\n", [Student("1", "A")]),
        ("id;name;email\n1;A;a@x;;\n", [Student("1", "A", "a@x")]),
        ("id,name\n1,A\x1c\x85B\n", [Student("1", "A B")]),
    ],
)
def test_separators_and_empty_fields_are_told_from_names(tmp_path, text, found):
    (tmp_path / "r.csv").write_bytes(text.encode())
    assert read_roster(tmp_path / "r.csv") == found


@pytest.mark.parametrize(
    "lines",
    ["1,A,x@y.org\n2,B,X@Y.ORG", "ada,A,\nx,B,ADA", "ada,A,\nAda,B,"],
    ids=["e-mails in other capitals", "an e-mail that is an id", "ids in other capitals"],
)
def test_two_students_with_one_login_are_refused_with_both_lines(tmp_path, lines):
    (tmp_path / "r.csv").write_text(f"id,name,email\n{lines}\n")
    with pytest.raises(DataError, match="in lines 2 and 3"):
        read_roster(tmp_path / "r.csv")


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("begin", list("=+-@＝＋－＠"))
def test_no_cell_is_a_formula_in_any_locale(separator, begin):
    text = harmless(f"{begin}1{separator} {begin}1{separator}a\n{begin}1")
    cells = [c for line in csv.reader(text.splitlines(), delimiter=separator) for c in line]
    assert not any(cell.strip().startswith(begin) for cell in cells)
    assert harmless("Doe-Jane, 3 = 1 + 2") == "Doe-Jane, 3 = 1 + 2"
