"""Sentences with live numbers read alike in Python and in every spreadsheet program."""

import math
import random

import openpyxl
import pytest
from sympy import Symbol

from kfsheet import ModelError, PrintError, Verdict, load_exercise
from kfsheet.printing.sentence import Choice, Number, excel_sentence, plain_sentence
from kfsheet.workbook.check.comparison import same_words
from kfsheet.workbook.engines.libreoffice import libreoffice
from kfsheet.workbook.engines.recalculate import open_in

x, y = Symbol("x_1_", real=True), Symbol("y_1_", real=True)
LARGER = Choice(((x > y, 'the "first"'), (x < y, "the second")), "neither")
SENTENCES = [
    ["x is ", Number(x, 2), " m"],
    [Number(x, 0), " of ", Number(y, 3)],
    [Number(x / (1 + x**2), 1, percent=True), " inside"],
    ["about ", Number(x * y, 3, significant=True)],
    ["larger is ", LARGER, "."],
]


def values():
    dice = random.Random(1)
    yield {"x_1_": 0.0, "y_1_": 0.0}
    yield {"x_1_": 2.675, "y_1_": -0.5}
    for _ in range(40):
        yield {n: dice.gauss(0, 1) * 10 ** dice.randint(-3, 4) for n in ("x_1_", "y_1_")}


@pytest.mark.parametrize("engine", ["ironcalc", "libreoffice"])
def test_a_spreadsheet_program_writes_the_sentence_that_python_writes(engine, tmp_path):
    if engine == "libreoffice" and not libreoffice():
        pytest.skip("LibreOffice is not installed")
    book, wanted = openpyxl.Workbook(), {}
    book.remove(book.active)
    for n, given in enumerate(values()):
        sheet = book.create_sheet(f"S{n}")
        sheet["A1"], sheet["A2"] = given["x_1_"], given["y_1_"]
        for row, pieces in enumerate(SENTENCES, 1):
            sheet.cell(row, 2).value = excel_sentence(pieces, {x: "A1", y: "A2"})
            wanted[sheet.title, row, 2] = plain_sentence(pieces, given)
    book.save(tmp_path / "a.xlsx")
    found = open_in(tmp_path / "a.xlsx", engine).values({})
    for (sheet, row, column), words in wanted.items():
        assert same_words(words, found[sheet][row, column]), words
    assert len(wanted) == 42 * len(SENTENCES)


def test_a_number_without_a_value_is_said_to_have_none():
    assert plain_sentence([Number(x, 2), " m"], {"x_1_": math.nan}) == "(no value) m"
    assert "IFERROR" in excel_sentence([Number(x, 2)], {x: "A1"})


def test_a_sentence_too_long_for_a_cell_is_refused():
    with pytest.raises(PrintError, match="longer than 255"):
        excel_sentence(["word " * 60])


def test_a_text_that_differs_in_more_than_a_last_figure_is_another_text():
    assert same_words("errs by 0.12 m", "errs by 0.13 m")
    assert not same_words("errs by 0.12 m", "errs by 0.14 m")
    assert not same_words("4 of 15", "5 of 15")
    assert not same_words("errs by 0.12 m", "err by 0.12 m")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("errs by {nothing:.2f}", "nothing is no scalar of football"),
        ("errs by {r_i}", r"write \{r_i:\.2f\}"),
        ("errs by {r_i:.2e}", r"write \{r_i:\.2f\}"),
        ("errs by {r_i:.2f", "the sentence"),
    ],
)
def test_what_a_verdict_cannot_say_is_refused_in_words(text, words):
    with pytest.raises(ModelError, match=words):
        Verdict(text).check(load_exercise("football").model.scalars(), "football")


def test_a_verdict_chooses_words_by_the_numbers_of_the_run():
    verdict = Verdict(
        "The camera is {kind}: {ratio:.0%}.",
        numbers={"ratio": x / y},
        choices={"kind": ((x > y, "rough"), "fine")},
    )
    assert verdict.words({"x_1_": 3, "y_1_": 2}) == "The camera is rough: 150 %."
    assert verdict.words({"x_1_": 1, "y_1_": 2}) == "The camera is fine: 50 %."
    assert excel_sentence(verdict.pieces(), {x: "A1", y: "A2"}).startswith('="The camera is "&IF(')
