"""What a student gets back: marks in front, the own formula, and nothing that contradicts them."""

import csv
import os
import re
from pathlib import Path

import openpyxl
import pytest
import students as do
from students import ADA, SECRET, Paper

from kfsheet import load_exercise
from kfsheet.cli import commands as cli
from kfsheet.coursework.handout.questions_sheet import FIRST
from kfsheet.coursework.reports.marked_workbook import _not_selected, _opened_at
from kfsheet.workbook.engines.recalculate import recalculate

FOOTBALL = load_exercise("football")


def grade(home, *more):
    """Grade what lies in ``home/in``; scores by answer."""
    (home / "roster.csv").write_text(f"id,name\n{ADA.id},{ADA.name}\n")
    (home / "secret").write_bytes(SECRET)
    ask = ("--roster", home / "roster.csv", "--secret", home / "secret", "--out", home / "g", *more)
    assert cli.main(list(map(str, ("grade", "football", home / "in", *ask)))) == 0
    with (home / "g" / "grades.csv").open(encoding="utf-8-sig") as file:
        return next(csv.DictReader(file))


@pytest.fixture(scope="module")
def handed_in(tmp_path_factory):
    """Right, wrong, typed, empty and broken answers, and what came of them."""
    home = tmp_path_factory.mktemp("feedback")
    (home / "in").mkdir()
    paper = Paper(FOOTBALL).open(home / "in" / "a.xlsx").answer_all("w")
    do.values_pasted(paper, "d_i")
    paper.answer("K_z", do.negated)
    paper.answer("u", lambda text, n: text if n < 4 else f"{text}+1")
    do.inserted(paper.book, FOOTBALL.model.sections)
    paper.save()
    grade(home)
    return home


@pytest.fixture(scope="module")
def marked(handed_in):
    return openpyxl.load_workbook(handed_in / "g" / "feedback" / f"{ADA.id}.xlsx")


def lines(book):
    """Rows of the sheet Marks by answer, and by head."""
    heads, *rows = book["Marks"].values
    return {row[0]: dict(zip(heads, row, strict=True)) for row in rows if row[0]}


def test_a_marked_workbook_opens_at_the_marks_and_at_nothing_else(marked):
    assert marked.active.title == "Marks"
    assert [sheet.title for sheet in marked if sheet.sheet_view.tabSelected] == ["Marks"]


def test_beside_each_answer_stand_the_own_formula_and_where_it_first_differs(marked):
    found = lines(marked)
    # Two rows and a column were inserted: what a student sees is in the own cells' terms.
    assert found["u"]["first differs"] == "Reanalysis!F10"
    assert found["u"]["your formula"] == marked["Reanalysis"]["F10"].value
    assert found["u"]["your formula"].endswith("+1")
    assert found["d_i"]["first differs"] == "Reanalysis!J7"
    assert float(found["d_i"]["your formula"]) == pytest.approx(marked["Reanalysis"]["J7"].value)
    assert (found["w"]["first differs"], found["w"]["your formula"]) == (None, None)
    assert found["x_a"]["first differs"] is None
    assert found["x_a"]["your formula"].startswith("=IF(ISNUMBER(J8)")


def test_no_right_formula_is_told_unless_the_lecturer_asks(handed_in, marked):
    assert "a right formula" not in [cell.value for cell in marked["Marks"][1]]
    page = (handed_in / "g" / "feedback" / f"{ADA.id}.html").read_text()
    assert "your formula" in page
    assert "a right formula" not in page.partition("<p>The feedback")[0]
    key = lines_of_key(handed_in)["K_z"]
    assert key not in [cell.value for row in marked["Marks"].iter_rows() for cell in row]


def lines_of_key(home):
    """Right formulas by answer, from a second grading that shows them; the first stays."""
    before = {p: p.read_bytes() for p in (home / "g" / "feedback").iterdir()}
    grade(home, "--show-key")
    found = lines(openpyxl.load_workbook(home / "g" / "feedback" / f"{ADA.id}.xlsx"))
    page = (home / "g" / "feedback" / f"{ADA.id}.html").read_text()
    for path, content in before.items():
        path.write_bytes(content)
    keys = {name: line["a right formula"] for name, line in found.items() if name != "total"}
    keys.pop(next((n for n in keys if n.startswith("The feedback")), ""), None)
    assert all(f"<td>{key.split(';')[0]}".split('"')[0] in page for key in keys.values())
    return keys


def test_the_right_formulas_typed_into_the_own_cells_earn_all_points(handed_in, tmp_path):
    """They speak of the student's own cells, which were moved."""
    paper = openpyxl.load_workbook(handed_in / "in" / "a.xlsx")
    places = {
        row[0].value: row[2].value for row in paper["Questions"].iter_rows(min_row=FIRST, max_col=3)
    }
    for name, key in lines_of_key(handed_in).items():
        sheet = paper[places[name].split("!")[0]]
        parts = dict(part.split(": ", 1) for part in key.split("; ")) if ": " in key else {}
        if not parts and sheet.title == "Parameters":
            sheet[places[name].split("!")[1]] = key
            continue
        column, rows = cells_of(sheet, name)
        for row in rows:
            if f"{column}{row}" in parts:
                text, at = parts[f"{column}{row}"], row
            elif not parts and row == rows[0]:
                text, at = key, row
            shift = row - at
            sheet[f"{column}{row}"] = moved(text, shift)
    (tmp_path / "in").mkdir()
    paper.save(tmp_path / "in" / "a.xlsx")
    found = grade(tmp_path)
    assert found["score"] == found["max"], found


def cells_of(sheet, name):
    """Letter of a column, and the rows in which an answer belongs."""
    head = next(c for row in sheet.iter_rows(max_row=6) for c in row if c.value == name)
    steps = len(FOOTBALL.model.table["x_f"].start) and range(FOOTBALL.model.rows)
    first = head.row + 3 + (name in ("d_i", "d_j"))
    return head.column_letter, range(first, head.row + 3 + len(steps))


def moved(text, rows):
    return re.sub(r"(?<![\w$])([A-Z]{1,2})(\d+)\b", lambda m: f"{m[1]}{int(m[2]) + rows}", text)


def test_nothing_in_it_contradicts_a_mark(handed_in, marked):
    """The live feedback, which saw that typed numbers are right, gives way to the marks."""
    found, sheet = lines(marked), marked["Questions"]
    assert found["d_i"]["status"] == "typed"
    for row in range(FIRST, FIRST + len(FOOTBALL.questions)):
        line = found[sheet.cell(row, 1).value]
        words = f"{line['score']:g} of {line['points']} points: {line['status']}"
        assert sheet.cell(row, 6).value == words
        colour = {0: "FFFFC7CE", line["points"]: "FFC6EFCE"}[line["score"]]
        assert sheet.cell(row, 6).fill.start_color.rgb == colour
    assert sheet.cell(FIRST - 1, 6).value == "your marks"
    assert sheet.cell(FIRST - 1, 6).font.bold, "it looks as it did"
    why = [c.value for c in marked["Marks"]["A"] if c.value and "saw values" in c.value]
    assert why
    assert why[0] in (handed_in / "g" / "feedback" / f"{ADA.id}.html").read_text()


def test_a_right_answer_gets_full_points_beside_feedback_that_waits(handed_in, engine):
    """x_a is right and follows from a wrong u: the student saw "waits for ..."."""
    values = recalculate(handed_in / "g" / "feedback" / f"{ADA.id}.xlsx", engine)
    questions = values["Questions"]
    row = next(r for (r, c), v in questions.items() if c == 1 and v == "x_a")
    assert questions[row, 6] == "2 of 2 points: right"
    before = recalculate(handed_in / "in" / "a.xlsx", engine)["Questions"]
    assert "waits for" in before[row, 6]


@pytest.mark.parametrize(
    ("xml", "wanted"),
    [
        ("<sheets/>", '<bookViews><workbookView activeTab="3"/></bookViews><sheets/>'),
        ('<workbookView activeTab="1" firstSheet="2"/>', '<workbookView activeTab="3"/>'),
        (
            '<workbookView activeTab="0"><extLst/></workbookView>',
            '<workbookView activeTab="3"><extLst/></workbookView>',
        ),
    ],
)
def test_a_workbook_is_opened_at_a_sheet_whatever_program_wrote_it(xml, wanted):
    assert _opened_at(xml, 3) == wanted
    assert _not_selected('<sheetView tabSelected="1" a="b"/><sheetData> tabSelected="1"') == (
        '<sheetView a="b"/><sheetData> tabSelected="1"'
    )


def test_the_second_grading_is_no_slower_for_the_marks_that_are_known(handed_in):
    work = handed_in / "g" / "work"
    before = {p.name: p.stat().st_mtime_ns for p in Path(work).glob("*.json")}
    lines_of_key(handed_in)
    assert before == {p: os.stat(work / p).st_mtime_ns for p in before}
