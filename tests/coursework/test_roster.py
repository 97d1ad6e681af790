"""Rosters as spreadsheet programs and platforms write them; files in tests/coursework/rosters."""

import csv
from pathlib import Path

import pytest

from kfsheet import load_exercise
from kfsheet.coursework.reading.roster import Student, harmless, read_roster
from kfsheet.coursework.reports.overrides import read_overrides
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


@pytest.mark.parametrize(
    "content",
    [
        "id,name\n1,Zo\u00eb B\n2,C\n".encode("utf-16"),
        b"\xfe\xff" + "id\tname\r\n1\tZo\u00eb B\r\n2\tC\r\n".encode("utf-16-be"),
        "\ufeff\ufeffid,name\n1,Zo\u00eb B\n2,C\n".encode(),
        "id,name\r\n1,Zo\u00eb B\r2,C\n".encode(),
        "id,name\r1,Zo\u00eb B\r2,C".encode(),
        "\n \r\nid,name\n1,Zo\u00eb B\n\u200b,\u2060\n2,C\n".encode(),
        '"sep=;"\r\nID;"Name"\n1;Zo\u00eb\u00a0B\n2;C\n'.encode(),
        "sep=;;\nid;name;\n1;Zo\u00eb\u3000\u200bB;\n2;C;\n".encode(),
        "sep= |\nid|name\n1|Zo\u00eb B\n2|C\n".encode(),
        "\u200bid,\u00a0name\u00a0\n1\u200b,\u202aZo\u00eb B\u202c\n\ufeff2,C\n".encode(),
        "ｉｄ,ＮＡＭＥ\n１,Zo\u00eb B\n２,C\n".encode(),
        'id,name,x;y;z\n1,"Zo\u00eb\r\n\u000bB",\n2,C,\n'.encode(),
    ],
)
def test_what_nobody_sees_and_how_a_file_is_stored_makes_no_other_student(tmp_path, content):
    (tmp_path / "r.csv").write_bytes(content)
    assert read_roster(tmp_path / "r.csv") == [Student("1", "Zo\u00eb B"), Student("2", "C")]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b'id,name\n1,"Doe\n2,B\n3,C\n', "up to line 4: a quote is not closed"),
        (b'id,name\n1,"Doe\n2,"B"\n3,C\n', "up to line 3: a quote is not closed"),
        (b"id,name,name\n1,A,B\n", "2 columns 'name'"),
        ("id,name\n1,A\n".encode("utf-16-le"), "save it as CSV UTF-8"),
        (b"id,name\n1,A\x00\n", "save it as CSV UTF-8"),
        ("id,name\n1,Zo\u00eb\n".encode("latin-1"), "save it as CSV UTF-8"),
        (b'id,name\n1,"' + b"a" * 200_000 + b'"\n', "field larger"),
        ("id,name\n\u200b,A\n".encode(), "names a folder"),
        (b"sep=;\nid;name\n1;A\n1;B\n", "in lines 3 and 4"),
    ],
)
def test_a_file_that_would_lose_a_student_is_refused(tmp_path, content, words):
    (tmp_path / "r.csv").write_bytes(content)
    with pytest.raises(DataError, match=words) as caught:
        read_roster(tmp_path / "r.csv")
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("a@x", "\uff41@x"),
        ("\u00e9@x", "e\u0301@x"),
        ("a@x", "a\u200b@x"),
        ("stra\u00dfe@x", "STRASSE@X"),
        ("a@x", "\u00a0a@x\u2028"),
    ],
    ids=["wide letters", "accents", "unseen characters", "sharp s", "spaces"],
)
def test_two_logins_that_look_alike_are_one(tmp_path, one, other):
    text = f"id,name,email\n1,A,{one}\n2,B,{other}\n"
    (tmp_path / "r.csv").write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=r"the login .* twice, in lines 2 and 3"):
        read_roster(tmp_path / "r.csv")


def test_names_keep_what_their_script_needs(tmp_path):
    names = ["\u0645\u06cc\u200c\u0646\u0627", "\u0b95\u0bcd\u200d\u0bb7", "Zoe\u0308"]
    text = "id,name\n" + "".join(f"{n},{name}\n" for n, name in enumerate(names))
    (tmp_path / "r.csv").write_text(text, encoding="utf-8")
    assert [s.name for s in read_roster(tmp_path / "r.csv")] == names


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("begin", list("=+-@＝＋－＠"))
def test_no_cell_is_a_formula_in_any_locale(separator, begin):
    text = harmless(f"{begin}1{separator} {begin}1{separator}a\n{begin}1")
    cells = [c for line in csv.reader(text.splitlines(), delimiter=separator) for c in line]
    assert not any(cell.strip().startswith(begin) for cell in cells)
    assert harmless("Doe-Jane, 3 = 1 + 2") == "Doe-Jane, 3 = 1 + 2"


@pytest.mark.parametrize(
    "text",
    [
        "id,question,score,remark\nq7,u,1.5,kind\n",
        "\ufeffsep=;\r\nid;question;score;remark\r\nq7;u;1,5;kind\r\n;;;\r\n",
        "id\tquestion\tscore\tremark\nq7\tu\t1.5\tkind\n\t\t\t\n",
    ],
    ids=["comma", "as Excel writes it", "tabs"],
)
def test_a_lecturers_own_marks_are_read_as_rosters_are(tmp_path, text):
    path = tmp_path / "overrides.csv"
    path.write_bytes(text.encode())
    found = read_overrides(path, load_exercise("football"), {"q7"})
    assert found == [{"id": "q7", "question": "u", "score": 1.5, "remark": "kind"}]
