"""Sentences of a workbook that follow its numbers."""

from dataclasses import replace

import openpyxl
from sympy import Symbol

from kfsheet import Verdict, check_workbook, load_exercise, write_workbook
from kfsheet.workbook.engines.recalculate import open_in

r_i, a = Symbol("r_i", real=True), Symbol("a", real=True)
VERDICT = Verdict(
    "The camera is told to err by {error:.1f} px: {kind}.",
    numbers={"error": r_i ** (r_i / r_i / 2)},
    choices={"kind": ((r_i > 100, "a bad one"), "a good one")},
)


def workbook(tmp_path):
    football = load_exercise("football")
    chart = replace(football.charts[0], note=VERDICT)
    exercise = replace(football, about=(VERDICT,), charts=(chart, *football.charts[1:]))
    path = tmp_path / "football.xlsx"
    write_workbook(exercise, path)
    return exercise, path


def test_a_sentence_is_a_formula_that_carries_its_words(tmp_path):
    _, path = workbook(tmp_path)
    stored = openpyxl.load_workbook(path, data_only=True)["Read me"]["A3"].value
    assert stored == "The camera is told to err by 3.0 px: a good one."
    assert openpyxl.load_workbook(path)["Read me"]["A3"].value.startswith('="The camera')


def test_a_sentence_follows_a_parameter_in_another_program(tmp_path):
    _, path = workbook(tmp_path)
    changed = {"Parameters": {(12, 2): 900}}
    assert openpyxl.load_workbook(path)["Parameters"]["A12"].value == "r_i"
    found = open_in(path, "ironcalc").values(changed)["Read me"][3, 1]
    assert found == "The camera is told to err by 30.0 px: a bad one."


def test_check_takes_live_sentences_and_finds_a_false_one(tmp_path):
    exercise, path = workbook(tmp_path)
    assert check_workbook(path, exercise=exercise).holds
    book = openpyxl.load_workbook(path)
    book["Read me"]["A3"] = '="The camera is told to err by 4.0 px: a good one."'
    book.save(path)
    report = check_workbook(path, exercise=exercise)
    assert not report.holds
    assert "Read me" in str(report.problems)
