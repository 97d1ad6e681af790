"""Workbooks that are right, and were once called wrong, changed or dangerous."""

import random

import openpyxl
import pytest
from sympy import Integer, cos, exp, sin

from kfsheet import Chart, Exercise, Question, Recurrence, Series, check_workbook, t, write_workbook
from kfsheet.coursework.handout.handout_workbook import handout_bytes
from kfsheet.coursework.reading.roster import Student


def table(values, formula, name="odd"):
    """An exercise of one datum and one formula of it."""
    m = Recurrence(name, title="One formula")
    d = m.data("d", values, "", "datum", section="D")
    (x,) = m.columns("x", section="D")
    m.define(x[t], formula(d[t]), "", "formula")
    return Exercise(model=m, about=("x.",), source="own")


DICE = random.Random(1)
LONG = [
    1 / 3,
    2 / 3,
    0.1 + 0.2,
    *(DICE.gauss(0, 1) * 10.0 ** DICE.randint(-9, 9) for _ in range(40)),
]


def test_data_of_seventeen_digits_are_not_changed_by_a_program_that_saves_fifteen(engine, tmp_path):
    exercise = table(LONG, lambda d: 2 * d)
    report = check_workbook(write_workbook(exercise, tmp_path), exercise, engine)
    assert report.holds
    assert report.changed == []


def test_a_datum_that_somebody_changed_in_its_tenth_digit_is_named(tmp_path):
    path = write_workbook(table(LONG, lambda d: 2 * d), tmp_path)
    book = openpyxl.load_workbook(path)
    book["D"]["B4"] = LONG[0] * (1 + 1e-10)
    book.save(path)
    report = check_workbook(path, table(LONG, lambda d: 2 * d))
    assert report.changed == ["1 value of d"]


SMALL = [0.0001 / 3, 0.0002 / 3, 0.00007 / 3]
CANCEL = {
    "difference quotient": lambda d: (sin(1 + d) - sin(Integer(1))) / d - cos(Integer(1)),
    "versed sine": lambda d: (1 - cos(d)) / d**2,
    "expm1": lambda d: (exp(d) - 1) / d - 1,
}


@pytest.mark.parametrize("name", CANCEL)
def test_a_right_formula_whose_terms_cancel_is_right_in_every_engine(name, engine, tmp_path):
    exercise = table(SMALL, CANCEL[name])
    report = check_workbook(write_workbook(exercise, tmp_path), exercise, engine)
    assert report.holds, report.lines()


def test_a_wrong_formula_whose_terms_cancel_is_still_found(tmp_path):
    exercise = table(SMALL, CANCEL["difference quotient"])
    path = write_workbook(exercise, tmp_path)
    book = openpyxl.load_workbook(path)
    book["D"]["C5"] = book["D"]["C5"].value + "+0.000001"
    book.save(path)
    assert [p.address for p in check_workbook(path, exercise).problems] == [("D", 5, 3)]


def test_words_that_begin_with_a_sign_of_equality_are_words(tmp_path):
    m = table([1.0, 2, 3], lambda d: 2 * d, "words").model
    exercise = Exercise(
        model=m,
        about=("= sign of a good filter: NIS near 1",),
        source='=HYPERLINK("http://example.org")',
        task=("=1+1 is a task",),
        sections={"D": "=2+2 section words"},
        questions=(Question("x", 1, "=A1*2 as a hint"),),
        charts=(Chart("=3+3", "=x", "=y", (Series("d", "x", "=label", "line"),), note="=4+4"),),
    )
    files = {"built": write_workbook(exercise, tmp_path).read_bytes()}
    files["handout"] = handout_bytes(exercise, Student("s1", "=Ada"), b"x" * 32)
    for name, content in files.items():
        (tmp_path / f"{name}.xlsx").write_bytes(content)
        book = openpyxl.load_workbook(tmp_path / f"{name}.xlsx")
        cells = [c for sheet in book for row in sheet.iter_rows() for c in row if c.value]
        formulas = {str(c.value) for c in cells if c.data_type == "f"}
        words = ("sign of", "HYPERLINK", "=1+1", "=2+2", "=A1*2", "=4+4")
        assert not [f for f in formulas if any(word in f for word in words)]
        assert "= sign of a good filter: NIS near 1" in {c.value for c in cells}
    assert check_workbook(tmp_path / "built.xlsx", exercise).holds
