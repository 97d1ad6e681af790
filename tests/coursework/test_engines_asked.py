"""Spreadsheet engines are asked about what only they may know, and about nothing else."""

import signal
import subprocess
import sys
import time

import pytest
from students import ADA, SECRET, Paper

from kfsheet import load_exercise
from kfsheet.coursework.handout.handout_workbook import handout_bytes
from kfsheet.coursework.judging import recalculated_answers
from kfsheet.coursework.reports.assessment import assess

EXERCISE = load_exercise("football")


@pytest.fixture(scope="module")
def handout():
    return handout_bytes(EXERCISE, ADA, SECRET)


@pytest.fixture
def judged(handout, tmp_path):
    """The mark of the column x_f for a formula in each of its rows."""

    def mark(formula):
        paper = Paper(EXERCISE, ADA, handout).open(tmp_path / "a.xlsx").answer_all()
        for row in range(4, 20):
            cell = paper.book["Reanalysis"][f"G{row}"]
            cell.data_type, cell._value = "f", formula.format(r=row)
        found = assess("football", SECRET, paper.save())
        return {mark.name: mark for mark in found.marks}["x_f"]

    return mark


@pytest.mark.parametrize(
    "formula",
    [
        "=IF(ISNUMBER(I{r}),G{r}+K_x*I{r},G18",
        "=" + "'" * 8000,
        "=" + "9" * 8000,
        "=SUM(" + ",".join(["A1"] * 2700) + ")",
        "=" + "(" * 4000 + "1" + ")" * 4000,
        "=" + "IF(A1>0,1," * 700 + "1" + ")" * 700,
        '=LET(d,LAMBDA(f,x,f(f,x&x)),d(d,"ab"))',
        "=SUM(SEQUENCE(1E6,1E4))",
        '=IFERROR(__xludf.DUMMYFUNCTION("""COMPUTED_VALUE"""),23.4)',
    ],
    ids=lambda formula: formula[:20],
)
def test_no_engine_is_asked_about_what_is_no_formula_or_too_much(formula, judged, monkeypatch):
    def refuse(*_):
        raise AssertionError("an engine was asked")

    judged("=1")  # what is made once for all students is made
    monkeypatch.setattr(recalculated_answers, "calculated", refuse)
    began = time.process_time()
    mark = judged(formula)
    assert (mark.status, mark.score) == ("unreadable", 0), mark
    assert time.process_time() - began < 4


def test_an_engine_is_asked_about_a_function_that_is_not_ours_and_may_compute_for_seconds(
    judged, monkeypatch
):
    asked = []

    def calculated(path, trials, cells, seconds, engine, work):
        asked.append((engine, work))
        return found(path, trials, cells, seconds, engine, work)

    found = recalculated_answers.calculated
    monkeypatch.setattr(recalculated_answers, "calculated", calculated)
    monkeypatch.setattr(recalculated_answers, "libreoffice", lambda: None)
    assert judged("=DEC2BIN(ROW())+0").status == "wrong"
    ((engine, work),) = asked
    assert engine == "ironcalc"
    assert 3 <= work < 4


@pytest.mark.skipif(sys.platform == "win32", reason="Windows limits no seconds of computing")
def test_who_computes_for_too_long_is_ended():
    module = "kfsheet.coursework.judging.recalculation_process"
    program = f"from {module} import _limit\n_limit(0.5)\nwhile True: pass"
    done = subprocess.run([sys.executable, "-c", program], timeout=120, capture_output=True)
    assert done.returncode == -signal.SIGXCPU
