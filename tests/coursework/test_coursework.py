"""Handing out and grading a whole course: files, tables, resuming, whose file is whose."""

import csv
import os
import shutil
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import openpyxl
import pytest
import students as do
from students import ADA, SECRET, Paper

from kfsheet import DataError, ModelError, load_exercise
from kfsheet.cli import commands as cli
from kfsheet.coursework.handout.course_secret import read_secret, read_token, token
from kfsheet.coursework.handout.handout_workbook import handout_bytes, own_run
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.handout.questions_sheet import EMPTY, FIRST
from kfsheet.coursework.judging.judge import CREDIT, Mark
from kfsheet.coursework.reading.roster import Student, harmless, read_roster
from kfsheet.coursework.reading.submitted_files import owner
from kfsheet.coursework.reports.assessment import Assessment
from kfsheet.coursework.reports.grading import STATUSES, Handed, _fingerprint, _result, grade
from kfsheet.coursework.reports.marked_workbook import _with_words
from kfsheet.exercises import exercise_names
from kfsheet.model.exercise import Exercise
from kfsheet.workbook.check.check_workbook import check_workbook
from kfsheet.workbook.engines.recalculate import recalculate

FOOTBALL = load_exercise("football")
NAMES = ["Ada Lovelace", "Bob =Evil", "Zoë Čapek", "Dan Dee", "Eve Ess", "Finn Foo", "Gil Goo"]
STUDENTS = [Student(f"s{n:03d}", name) for n, name in enumerate(NAMES, 1)]


# -- rosters, secrets, tokens --------------------------------------------------------------------


@pytest.mark.parametrize("delimiter", [",", ";"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_a_roster_is_read_as_spreadsheets_write_it(tmp_path, delimiter, mark):
    lines = [["Name", "ID"], ["Čapek, Zoë", "z1"], ["=cmd", "z2"]]
    text = "\n".join(delimiter.join(f'"{field}"' for field in line) for line in lines)
    (tmp_path / "r.csv").write_text(mark + text, encoding="utf-8")
    assert read_roster(tmp_path / "r.csv") == [Student("z1", "Čapek, Zoë"), Student("z2", "=cmd")]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no column 'id'"),
        ("id,email\n1,a@b\n", "no column 'name'"),
        ("id,name\n", "names nobody"),
        ("id,name\n../x,A\n", "names a folder"),
        ("id,name\n,A\n", "names a folder"),
        ("id,name\n1,A\n1,B\n", "twice"),
    ],
)
def test_a_roster_that_cannot_work_is_refused(tmp_path, text, words):
    (tmp_path / "r.csv").write_text(text)
    with pytest.raises(DataError, match=words):
        read_roster(tmp_path / "r.csv")


def test_a_secret_is_made_once_and_only_its_owner_reads_it(tmp_path):
    path = tmp_path / "secret"
    secret = read_secret(path, make=True)
    assert read_secret(path) == read_secret(path, make=True) == secret
    assert os.name != "posix" or path.stat().st_mode & 0o777 == 0o600
    with pytest.raises(DataError, match="nowhere"):
        read_secret(tmp_path / "nowhere")


@pytest.mark.parametrize("change", ["football|", "s001|", "kfsheet1|"])
def test_a_token_that_was_changed_anywhere_is_no_token(change):
    good = token(SECRET, "football", "s001")
    assert read_token(SECRET, good) == ("football", "s001")
    assert read_token(SECRET, good.replace(change, "x" + change)) is None
    assert read_token(SECRET, good[:-1] + ("0" if good[-1] != "0" else "1")) is None


def test_exports_hold_no_formula():
    for text in ("=1", "+1", "-1", "@x", "\t=1"):
        assert not harmless(text).startswith(("=", "+", "-", "@", "\t"))
    assert harmless("Ada") == "Ada"


@pytest.fixture
def small(tmp_path):
    """A course of one student, and the call that hands out."""
    (tmp_path / "roster.csv").write_text("id,name\nq7,Ada\n")
    ask = ("handout", "football", "--roster", tmp_path / "roster.csv", "--out", tmp_path / "out")
    return tmp_path, ask


def test_the_first_handout_says_where_the_secret_is(small, capsys):
    home, ask = small
    assert call(*ask) == 0
    words = f"made the secret of the course: {home / 'kfsheet.secret'}; keep it, and to yourself"
    assert words in capsys.readouterr().out
    assert call(*ask) == 0, "the same bytes again"
    assert "made the secret" not in capsys.readouterr().out


def test_a_lost_or_another_secret_does_not_replace_what_was_handed_out(small, capsys):
    home, ask = small
    assert call(*ask) == 0
    path = home / "out/students/q7/football.xlsx"
    before, secret = path.read_bytes(), (home / "kfsheet.secret").read_text()
    assert secret.strip() not in (home / "out/kfsheet.json").read_text()
    (home / "kfsheet.secret").unlink()
    assert call(*ask, "--force") == 2
    assert "--secret" in capsys.readouterr().err
    assert not (home / "kfsheet.secret").exists()
    read_secret(home / "other", make=True)
    assert call(*ask, "--secret", home / "other", "--force") == 2
    assert "another secret" in capsys.readouterr().err
    assert path.read_bytes() == before
    (home / "kfsheet.secret").write_text(secret)
    assert call(*ask) == 0


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_handout_that_would_change_is_replaced_by_force_only(small, jobs, capsys):
    home, ask = small
    assert call(*ask) == 0
    path = home / "out/students/q7/football.xlsx"
    before = path.read_bytes()
    (home / "roster.csv").write_text("id,name\nq7,Ada Lovelace\n")
    assert call(*ask, "--jobs", jobs) == 2
    assert "--force" in capsys.readouterr().err
    assert path.read_bytes() == before
    assert call(*ask, "--jobs", jobs, "--force") == 0
    assert path.read_bytes() != before


# -- handouts ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def handout(tmp_path_factory):
    path = tmp_path_factory.mktemp("handout") / "football.xlsx"
    path.write_bytes(handout_bytes(FOOTBALL, ADA, SECRET))
    return path


@pytest.mark.parametrize("name", exercise_names())
def test_every_student_has_own_numbers_within_the_ranges_and_always_the_same(name):
    exercise = load_exercise(name)
    drawn = [own_numbers(exercise, SECRET, s.id) for s in STUDENTS]
    again = [own_numbers(exercise, SECRET, s.id) for s in STUDENTS]
    assert repr(again) == repr(drawn)  # as text, where a missing value equals itself
    assert len({own.parameters for own in drawn}) == len(STUDENTS)
    for own in drawn:
        for parameter, value in own.parameters:
            low, high = exercise.vary.get(parameter, (value, value))
            assert low <= value <= high
    assert own_numbers(exercise, b"another secret of 32 bytes......", "s001") != drawn[0]


def test_the_football_noise_is_as_large_as_the_camera_says():
    """Photo minus the true pixel, over all students: mean 0, variance r_i."""
    errors = []
    for n in range(60):
        own = own_numbers(FOOTBALL, SECRET, f"n{n}")
        p, data = dict(own.parameters), dict(own.data)
        pairs = zip(data["i"], data["x_true"], strict=True)
        errors += [i - p["a"] * x for i, x in pairs if i == i]
        assert sum(i != i for i in data["i"]) == 1
    mean = sum(errors) / len(errors)
    assert abs(mean) < 4 * 3 / len(errors) ** 0.5
    assert sum(e * e for e in errors) / len(errors) == pytest.approx(9, rel=0.15)


def test_the_same_call_makes_the_same_bytes(handout):
    assert handout.read_bytes() == handout_bytes(FOOTBALL, ADA, SECRET)


def test_answers_are_empty_open_and_the_rest_is_locked(handout):
    book = openpyxl.load_workbook(handout)
    paper = Paper(FOOTBALL)
    paper.book = book
    answers = {id(cell) for q in FOOTBALL.questions for cell, _ in paper.cells(q.name)}
    for sheet in book:
        assert sheet.protection.sheet
        for row in sheet.iter_rows():
            for cell in row:
                if id(cell) in answers:
                    assert (cell.value, cell.protection.locked) == (None, False)
                elif cell.value is not None:
                    assert cell.protection.locked, (sheet.title, cell.coordinate)
    rest = book["Reanalysis"].column_dimensions["M"]  # the first column beside the table
    assert (rest.min, rest.max, rest.protection.locked) == (13, 16_384, False)
    assert "Check" not in book.sheetnames


def test_a_sheet_whose_formulas_are_answers_holds_numbers_only(handout):
    """The free run steps the same model: its formulas would give u, w, x_f, z_f away."""
    sheet = openpyxl.load_workbook(handout)["Free run"]
    values = [cell.value for row in sheet.iter_rows(min_row=4) for cell in row if cell.value]
    assert len(values) > 60
    assert not any(isinstance(value, str) for value in values)


def test_formulas_that_repeat_an_answer_are_live_and_not_shown(handout):
    """The velocities of the next step, on the goal line's sheet, are u and w one photo later."""
    book = openpyxl.load_workbook(handout)
    for sheet in book:
        shown = {
            cell.coordinate: cell.protection.hidden
            for row in sheet.iter_rows(min_row=5)
            for cell in row
            if isinstance(cell.value, str) and "*SIGN(" in cell.value
        }
        assert all(shown.values())
        assert bool(shown) == (sheet.title == "Goal line")


def test_the_sheet_of_questions_says_what_its_feedback_is_worth(handout):
    sheet = openpyxl.load_workbook(handout)["Questions"]
    words = " ".join(str(c.value) for row in sheet.iter_rows(max_row=FIRST - 1) for c in row)
    assert "a typed number may look right here and earns nothing" in words
    assert "the rest needs x, which is not right yet" in words
    read_me = openpyxl.load_workbook(handout)["Read me"]
    assert "notebook" not in [cell.value for cell in read_me["A"]], "it holds the formulas"


def test_points_stand_on_the_sheet_of_questions_only(handout):
    book = openpyxl.load_workbook(handout)
    told = {s.title for s in book for row in s.values for v in row if "points" in str(v).split()}
    assert told == {"Questions"}
    assert book["Reanalysis"]["G3"].value == FOOTBALL.model.column("x_f").description


def test_check_says_what_a_handout_is_for(handout, capsys):
    assert call("check", handout) == 2
    assert "is a student's handout; use: kfsheet grade" in capsys.readouterr().err


def test_a_solution_is_a_sound_workbook(tmp_path):
    from kfsheet.coursework.handout.handout_workbook import solution_bytes

    (tmp_path / "s.xlsx").write_bytes(solution_bytes(FOOTBALL, own_numbers(FOOTBALL, SECRET, "a")))
    report = check_workbook(tmp_path / "s.xlsx", FOOTBALL)
    # The sheet "Check" was built with these numbers, not with those of the exercise.
    assert {p.address[0] for p in report.problems} <= {"Check"}, report.lines()


def test_the_stored_values_of_a_handout_are_those_of_a_workbook_without_answers(handout):
    stored = openpyxl.load_workbook(handout, data_only=True)
    found = recalculate(handout)
    assert stored["Questions"]["F7"].value == EMPTY
    run = own_run(FOOTBALL, own_numbers(FOOTBALL, SECRET, ADA.id))
    assert stored["Free run"]["E9"].value == pytest.approx(run.columns["x_free"][5])
    assert stored["Errors"]["G9"].value in (None, "")
    assert found["Errors"][9, 7] == "" != run.columns["e_x_a"][5]


def test_variation_that_cannot_work_is_refused():
    base = {"model": FOOTBALL.model, "about": ("x",), "source": "x"}
    for more, words in (
        ({"vary": {"nothing": (1, 2)}}, "no parameter"),
        ({"vary": {"a": (2, 1)}}, "lower and a higher"),
        ({"vary": {"a": (-1, 1)}}, "greater than 0"),
        ({"noise": ("x_f",)}, "no data column"),
    ):
        with pytest.raises((ModelError, DataError), match=words):
            Exercise(**base, **more)


# -- whose file ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("Ada Lovelace_12345_assignsubmission_file_/football.xlsx", "s001"),
        ("lovelaceada_4711_9912_football-1.xlsx", "s001"),
        ("capekzoe_LATE_1_2_x.xlsx", "s003"),
        ("s002/anything (1).xlsx", "s002"),
        ("Zoe Capek/x.xlsx", "s003"),
        ("football.xlsx", None),
        ("s001/s002.xlsx", None),
    ],
)
def test_the_owner_of_a_path_is_found_as_platforms_write_it(tmp_path, path, expected):
    found = owner(tmp_path / path, tmp_path, STUDENTS)
    assert (found and found.id) == expected


@pytest.mark.parametrize(
    ("path", "holder", "expected"),
    [
        ("football (1).xlsx", "2", None),
        ("Bob Ray_3_assignsubmission_file_/football.xlsx", "2", "2"),
        ("raybob_3_1_football.xlsx", "2", "2"),
        ("3/football.xlsx", "3", "3"),
        ("3/football.xlsx", "2", "3"),
        ("Cy Dee_2_assignsubmission_file_/football.xlsx", "2", "3"),
    ],
)
def test_the_numbers_of_a_platform_are_nobodys_id(tmp_path, path, holder, expected):
    """The token says whose the file is; a path contradicts it by a name or a folder only."""
    people = [Student("1", "Al Bo"), Student("2", "Bob Ray"), Student("3", "Cy Dee")]
    token_of = next(s for s in people if s.id == holder)
    found = owner(tmp_path / path, tmp_path, people, token_of)
    assert (found and found.id) == expected


# -- a course ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Seven students hand in; the command line grades."""
    home = tmp_path_factory.mktemp("course")
    lines = ["id;name;email", *(f"{s.id};{s.name};{s.id}@example.org" for s in STUDENTS)]
    (home / "roster.csv").write_text("\ufeff" + "\n".join(lines), encoding="utf-8")
    (home / "secret").write_bytes(SECRET)
    ask = ("--roster", home / "roster.csv", "--secret", home / "secret")
    assert call("handout", "football", *ask, "--out", home / "out", "--notebook", "--jobs", 2) == 0
    papers = {
        s.id: Paper(FOOTBALL, s, (home / f"out/students/{s.id}/football.xlsx").read_bytes())
        for s in STUDENTS
    }
    sub = home / "submissions"
    for folder in ("Ada Lovelace_1_file_", "x", "s004", "s005", "s006"):
        (sub / folder).mkdir(parents=True)
    papers["s001"].open(sub / "Ada Lovelace_1_file_" / "f.xlsx").answer_all().save()
    bob = papers["s002"].open(sub / "x" / "football (2).xlsx").answer_all()
    bob.answer("u", do.negated)
    bob.save()
    zoe = papers["s003"].open(sub / "capekzoe_1_2_old.xlsx")
    os.utime(zoe.save(), (1e9, 1e9))
    zoe.open(sub / "capekzoe_1_3_new.xlsx").answer_all("K_x").answer("u", do.negated)
    zoe.save()
    shutil.copy(sub / "Ada Lovelace_1_file_" / "f.xlsx", sub / "s004" / "f.xlsx")
    (sub / "s005" / "f.xlsx").write_bytes(b"")
    (sub / "s006" / "football.xlsm").write_text("no workbook")
    return home, ask, sub


def call(*arguments):
    return cli.main(list(map(str, arguments)))


def table(path):
    with path.open(encoding="utf-8-sig") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def graded(course):
    home, ask, sub = course
    assert call("grade", "football", sub, *ask, "--out", home / "g", "--jobs", 2) == 0
    return home / "g"


def test_everybody_on_the_roster_has_a_row_with_score_and_status(graded):
    rows = {row["id"]: row for row in table(graded / "grades.csv")}
    assert list(rows["s001"])[:5] == ["id", "name", "score", "max", "percent"]
    assert {i: (r["score"], r["status"]) for i, r in rows.items()} == {
        "s001": ("18", "graded"),
        "s002": ("16", "graded"),
        "s003": ("14", "graded"),
        "s004": ("0", "somebody else's file"),
        "s005": ("0", "empty file"),
        "s006": ("0", "wrong kind"),
        "s007": ("0", "no submission"),
    }
    assert (rows["s003"]["K_x"], rows["s003"]["u"], rows["s003"]["w"]) == ("0", "0", "2")
    assert rows["s003"]["remark"] == (
        "2 files came back; the newest with answers counts (capekzoe_1_3_new.xlsx), "
        "not (capekzoe_1_2_old.xlsx: untouched)"
    )


def marks_of(name, points):
    return [Mark(name, 9, points, "right", "")]


@pytest.mark.parametrize(
    ("later", "score", "words"),
    [
        (Assessment("untouched", "", "s001", marks_of("u", 0.0)), 7, "(1.xlsx: untouched)"),
        (Assessment("damaged", "cannot be opened"), 7, "(1.xlsx: damaged)"),
        (Assessment("timed out", "too long"), 7, "(1.xlsx: timed out)"),
        (Assessment("graded", "", "s002", marks_of("u", 9.0)), 7, "somebody else's file"),
        (Assessment("graded", "", "s001", marks_of("u", 3.0)), 3, "with different scores"),
    ],
)
def test_a_later_file_without_answers_takes_no_marks_away(tmp_path, later, score, words):
    ada, earlier = STUDENTS[0], Assessment("graded", "", "s001", marks_of("u", 7.0))
    handed = []
    for n, found in enumerate((earlier, later)):
        (tmp_path / f"{n}.xlsx").touch()
        os.utime(tmp_path / f"{n}.xlsx", (1e9 + n, 1e9 + n))
        handed.append(Handed(tmp_path / f"{n}.xlsx", ada, str(n), found))
    result = _result(ada, handed, 9)
    assert (result.status, result.score) == ("graded", score)
    assert words in result.remark
    assert "2 files came back" in result.remark


def test_every_process_writes_the_same_workbook(course):
    home, _, _ = course
    written = (home / "out/students/s002/football.xlsx").read_bytes()
    assert written == handout_bytes(FOOTBALL, STUDENTS[1], SECRET)


def test_any_executor_gives_the_same_marks(course, graded, tmp_path):
    _, _, sub = course
    with ThreadPoolExecutor(2) as executor:
        results, _ = grade(FOOTBALL, "football", sub, STUDENTS, SECRET, tmp_path, executor=executor)
    found = {r.student.id: (f"{r.score:g}", r.status) for r in results}
    assert found == {
        line["id"]: (line["score"], line["status"]) for line in table(graded / "grades.csv")
    }


def test_the_learning_platforms_get_grades_and_feedback(graded):
    moodle = {row["ID number"]: row for row in table(graded / "moodle.csv")}
    assert moodle["s002"]["Grade"] == "16"
    assert "u 0/2 wrong (a sign is wrong)" in moodle["s002"]["Feedback"]
    canvas = table(graded / "canvas.csv")
    assert list(canvas[0]) == ["Student", "ID", "SIS Login ID", "Section", FOOTBALL.title]
    assert canvas[1]["SIS Login ID"] == "s002@example.org"


def test_every_student_gets_the_own_workbook_with_marks_beside_the_answers(graded, engine):
    marked = graded / "feedback" / "s002.xlsx"
    book = openpyxl.load_workbook(marked)
    assert book["Marks"]["A4"].value == "u"
    assert book["Marks"]["E4"].value == "a sign is wrong"
    assert book["Reanalysis"]["E3"].value == "0/2: wrong. a sign is wrong"
    assert book["Reanalysis"]["E3"].fill.start_color.rgb == "FFFFC7CE"
    assert book["Reanalysis"]["G3"].fill.start_color.rgb == "FFC6EFCE"
    assert book["Parameters"]["D23"].value == "2/2: right."
    assert book["Charts"]._charts
    heights = book["Marks"].row_dimensions
    remarks = {row: len(book["Marks"].cell(row, 5).value or "") for row in range(2, 12)}
    assert all(heights[row].height >= 15 * length / 90 for row, length in remarks.items())
    page = book["Marks"].page_setup
    assert (page.orientation, page.fitToHeight) == ("landscape", 0)
    assert book["Marks"].sheet_properties.pageSetUpPr.fitToPage
    values = recalculate(marked, engine)
    scores = [values["Marks"][row, 3] for row in range(2, 13)]
    assert values["Marks"][12, 1] == "total"
    assert sum(scores[:-1]) == scores[-1] == 16, "numbers, to calculate with"
    assert "a sign is wrong" in (graded / "feedback" / "s002.html").read_text()
    assert (graded / "feedback" / "s007.html").exists()
    assert not (graded / "feedback" / "s007.xlsx").exists()


def test_the_class_page_shows_mistakes_copies_and_other_peoples_files(graded):
    page = (graded / "class.html").read_text()
    assert page.count("<svg") == 3  # scores, questions, mistakes
    assert "a sign is wrong" in page
    assert "s002, s003" in page  # the same wrong u
    assert "s004" in page.partition("somebody else's token")[2]
    assert "<script" not in page


def test_the_same_wrong_answer_has_one_fingerprint_for_all_students(graded):
    """Bob and Zoë made the same mistake with different numbers."""
    page = (graded / "class.html").read_text().partition("Identical wrong answers")[2]
    assert "<td>u</td><td>2</td>" in page


def test_a_second_run_goes_on_and_keeps_what_a_lecturer_changed(course, graded):
    home, ask, sub = course
    kept = {p.name: p.stat().st_mtime_ns for p in (graded / "work").glob("*.json")}
    assert (graded / "overrides.csv").read_text() == "id,question,score,remark\n"
    (graded / "overrides.csv").write_text(
        "id,question,score,remark\ns002,u,1.5,half seen\ns007,,9,oral\n"
    )
    before = (graded / "overrides.csv").read_bytes()
    next((graded / "work").glob("*.json")).write_text("{half a file")
    start = time.monotonic()
    assert call("grade", "football", sub, *ask, "--out", graded) == 0
    assert time.monotonic() - start < 30
    rows = {row["id"]: row for row in table(graded / "grades.csv")}
    assert (rows["s002"]["score"], rows["s002"]["u"]) == ("17.5", "1.5")
    assert rows["s002"]["remark"] == "u: half seen"
    assert (rows["s007"]["score"], rows["s007"]["remark"]) == ("9", "oral")
    assert (graded / "overrides.csv").read_bytes() == before
    again = {p.name: p.stat().st_mtime_ns for p in (graded / "work").glob("*.json")}
    assert sum(again[name] != kept[name] for name in kept) == 1
    (graded / "overrides.csv").write_text("id,question,score,remark\n")


def test_a_file_that_had_no_time_is_tried_again(course, tmp_path):
    """A machine was busy, or was switched off: the next run judges what this one could not."""
    _, _, sub = course
    (tmp_path / "in").mkdir()
    shutil.copy(sub / "x" / "football (2).xlsx", tmp_path / "in" / "bob.xlsx")

    def status(seconds):
        judge = (FOOTBALL, "football", tmp_path / "in", STUDENTS, SECRET, tmp_path / "out")
        _, (handed,) = grade(*judge, seconds=seconds)
        return handed.assessment.status, handed.assessment.student

    assert status(0.01) == ("timed out", "")
    assert status(60) == ("graded", "s002")
    assert status(0.01) == ("graded", "s002"), "that is kept"


def test_progress_is_told_by_student(course, tmp_path, capsys):
    home, ask, sub = course
    (tmp_path / "in").mkdir()
    shutil.copy(sub / "x" / "football (2).xlsx", tmp_path / "in" / "1.xlsx")
    (tmp_path / "in" / "2.xlsx").write_bytes(b"")
    assert call("grade", "football", tmp_path / "in", *ask, "--out", tmp_path / "g") == 0
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["grade 1/2: s002, graded", "grade 2/2: 2.xlsx, empty file"]
    (tmp_path / "roster.csv").write_text("id,name\nq7,Ada\n")
    ask = ("--roster", tmp_path / "roster.csv", "--out", tmp_path / "h")
    assert call("handout", "football", *ask) == 0
    assert capsys.readouterr().err.splitlines() == ["handout 1/1: q7"]
    assert (tmp_path / "kfsheet.secret").stat().st_mode & 0o777 == 0o600


def test_the_students_own_workbook_shows_what_a_lecturer_changed(course, graded):
    home, ask, sub = course
    (graded / "overrides.csv").write_text("id,question,score,remark\ns002,u,1.5,kind\n")
    assert call("grade", "football", sub, *ask, "--out", graded) == 0
    marks = openpyxl.load_workbook(graded / "feedback" / "s002.xlsx")["Marks"]
    line = next(row for row in marks.values if row[0] == "u")
    assert line[1:5] == (2, 1.5, "wrong", "kind")
    assert (
        "1.5/2" in openpyxl.load_workbook(graded / "feedback/s002.xlsx")["Reanalysis"]["E3"].value
    )
    (graded / "overrides.csv").write_text("id,question,score,remark\n")


def test_a_corrected_exercise_leaves_no_old_marks(course, tmp_path):
    """The same files and folder, another key: judged anew."""
    _, _, sub = course
    key = next(q for q in FOOTBALL.questions if q.name == "u")
    fewer = replace(FOOTBALL, questions=tuple(q for q in FOOTBALL.questions if q is not key))
    assert _fingerprint(FOOTBALL) == _fingerprint(load_exercise("football"))
    assert len({_fingerprint(FOOTBALL), _fingerprint(fewer)}) == 2


def test_files_of_nobody_and_files_passed_over_are_told(course, tmp_path, capsys):
    """A zip of the whole class, a page and notes of the platform, a link."""
    _, ask, sub = course
    (tmp_path / "in" / "a").mkdir(parents=True)
    with zipfile.ZipFile(tmp_path / "in" / "class.zip", "w") as archive:
        archive.write(sub / "x" / "football (2).xlsx", "s002/football.xlsx")
    for name in ("notes.txt", "a/page.html", ".DS_Store"):
        (tmp_path / "in" / name).write_text("x")
    (tmp_path / "in" / "link.xlsx").symlink_to(sub / "x" / "football (2).xlsx")
    assert call("grade", "football", tmp_path / "in", *ask, "--out", tmp_path / "in/g") == 0
    out = capsys.readouterr().out
    assert "files that belong to nobody: 1" in out
    assert "files passed over: 4 (.DS_Store, " in out
    page = (tmp_path / "in/g/class.html").read_text().partition("Files that belong to nobody")[2]
    for words in ("class.zip", "wrong kind", "unpack it first", "named by its student"):
        assert words in page


def test_a_secret_that_fits_no_file_is_told(course, tmp_path, capsys):
    home, _, sub = course
    (tmp_path / "other").write_bytes(b"another secret of 32 bytes......")
    ask = ("--roster", home / "roster.csv", "--secret", tmp_path / "other")
    assert call("grade", "football", sub, *ask, "--out", tmp_path / "g") == 1
    assert "is --secret the right file?" in capsys.readouterr().err


def test_the_page_on_grading_has_a_row_for_every_status():
    readme = (Path(__file__).parents[2] / "docs" / "grading.md").read_text(encoding="utf-8")
    for status in (*STATUSES, *CREDIT):
        assert f"| {status} |" in readme, status


def test_two_exercises_do_not_share_a_folder_of_results(course, tmp_path, capsys):
    _, ask, _ = course
    (tmp_path / "in").mkdir()
    out = ("--out", tmp_path / "g")
    assert call("grade", "football", tmp_path / "in", *ask, *out) == 0
    before = {p.name: p.read_bytes() for p in (tmp_path / "g").iterdir() if p.is_file()}
    assert call("grade", "cannonball", tmp_path / "in", *ask, *out) == 2
    assert "holds the results of football" in capsys.readouterr().err
    assert {p.name: p.read_bytes() for p in (tmp_path / "g").iterdir() if p.is_file()} == before
    assert call("grade", "football", tmp_path / "in", *ask, *out) == 0


def test_reports_inside_the_folder_of_submissions_are_no_submissions(course, tmp_path):
    _, ask, sub = course
    shutil.copytree(sub, tmp_path / "in")
    for _ in range(2):
        assert call("grade", "football", tmp_path / "in", *ask, "--out", tmp_path / "in/out") == 0
    lines = table(tmp_path / "in/out/grades.csv")
    assert [line["id"] for line in lines if "files came back" in line["remark"]] == ["s003"]


def test_a_mark_leaves_the_cell_beside_it():
    xml = '<row r="3"><c r="G3" s="11"/><c r="H3" s="11"/></row>'
    mark = Mark("x_f", 2, 2.0, "right", "")
    found = _with_words(xml, {"G3": mark}, {"full": 7})
    assert found.endswith('<c r="H3" s="11"/></row>')
    assert "2/2: right" in found


@pytest.mark.parametrize(
    ("line", "words"),
    [("x,u,1,", "not on the roster"), ("s001,q,1,", "no question"), ("s001,u,a,", "no number")],
)
def test_overrides_that_mean_nothing_are_refused(course, tmp_path, line, words, capsys):
    home, ask, sub = course
    (tmp_path / "overrides.csv").write_text(f"id,question,score,remark\n{line}\n")
    assert call("grade", "football", sub, *ask, "--out", tmp_path) == 2
    assert words in capsys.readouterr().err


def test_nothing_is_written_outside_the_folder(course, graded):
    home, _, _ = course
    assert {p.name for p in home.iterdir()} == {
        "roster.csv", "secret", "out", "submissions", "g"
    }  # fmt: skip


def test_an_assignment_for_nbgrader_is_made_on_request(course):
    home, _, _ = course
    assert (home / "out/nbgrader/release/football/football.ipynb").is_file()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("handout", "football"), "--roster"),
        (("handout", "football", "--roster", "no.csv", "--out", "x"), "no.csv cannot be read"),
        (("grade", "football", "nowhere", "--roster", "r.csv", "--out", "x"), "r.csv"),
        (("grade", "football", "x", "--roster", "r", "--out", "x", "--jobs", "0"), "1 to 256"),
    ],
)
def test_a_wrong_call_is_told_in_one_line(arguments, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    try:
        status = call(*arguments)
    except SystemExit as leaving:
        status = leaving.code
    err = capsys.readouterr().err
    assert status == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1
