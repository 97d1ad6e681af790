"""Answers of every kind that once was judged wrongly, and what each deserves."""

import json
import time
from pathlib import Path

import pytest
from students import ADA, SECRET, Paper

from kfsheet import load_exercise
from kfsheet.coursework.handout.handout_workbook import handout_bytes
from kfsheet.coursework.reports.assessment import assess

FOLDER = Path(__file__).parent / "cases"
FOOTBALL = json.loads((FOLDER / "football_answers.json").read_text())
SUBMISSIONS = sorted(p for p in (FOLDER / "submissions").iterdir() if p.is_dir())


@pytest.fixture(scope="module")
def handout():
    return handout_bytes(load_exercise("football"), ADA, SECRET)


@pytest.mark.parametrize("case", FOOTBALL["cases"], ids=lambda case: case["id"])
def test_an_answer_to_the_football_gets_what_it_deserves(case, handout, tmp_path):
    paper = Paper(load_exercise("football"), ADA, handout).open(tmp_path / "a.xlsx")
    for name, forms in {**FOOTBALL["key"], case["question"]: case["forms"]}.items():
        write(paper, name, forms)
    for place, content in case.get("cells", {}).items():
        sheet, _, cell = place.partition("!")
        # As it is typed: an apostrophe makes a text of a number.
        paper.book[sheet][cell] = content.removeprefix("'") if isinstance(content, str) else content
    began = time.monotonic()
    found = assess("football", SECRET, paper.save())
    assert found.status == "graded", found.remark
    assert time.monotonic() - began < case.get("within_s", 20)
    marks = {mark.name: mark for mark in found.marks}
    mark = marks.pop(case["question"])
    assert {m.status for m in marks.values()} == {"right"}, marks
    assert (mark.score == mark.points) == (case["expect"] == "full"), mark


def write(paper, name, forms):
    """The n-th form in the n-th data row, the last in all others; None leaves a cell empty."""
    cells = [cell for cell, _ in paper.cells(name)]
    if name in paper.model.table:
        sheet, number = paper.layout.home(name)
        cells = [paper.book[sheet].cell(4 + n, number) for n in range(paper.model.rows)]
    for n, cell in enumerate(cells):
        form = forms[min(n, len(forms) - 1)]
        if form is not None:
            cell.value = form.format(r=cell.row, p=cell.row - 1, q=cell.row - 2)


@pytest.mark.parametrize("folder", SUBMISSIONS, ids=lambda folder: folder.name)
def test_a_finished_file_gets_what_it_deserves(folder):
    secret = (FOLDER / "submissions/s.secret").read_bytes().strip()
    spec = str(FOLDER / "submissions/mini.py")
    found = assess(spec, secret, folder / "s01/mini.xlsx")
    assert found.status == "graded", found.remark
    kind = folder.name.split("_")[0]
    if kind == "G9":
        assert "unreadable" in {m.status for m in found.marks}, found.marks
        assert "wrong" not in {m.status for m in found.marks}
    elif kind == "G10":
        assert found.score < 5
    else:
        assert found.score == 5, found.marks
