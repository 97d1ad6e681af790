"""The live feedback of a handout: row by row, in any program, and without the right numbers."""

import re
from functools import lru_cache
from itertools import pairwise
from math import isnan, nan

import numpy as np
import openpyxl
import pytest
import students as do
from conftest import need
from openpyxl.utils import FORMULAE, get_column_letter
from students import ADA, SECRET, Paper

from kfsheet import Missing, Question, Recurrence, load_exercise, t, when_observed
from kfsheet.coursework.handout import check_numbers
from kfsheet.coursework.handout.answer_order import Need, needs
from kfsheet.coursework.handout.check_numbers import checked_steps, looks_right, salt, sizes
from kfsheet.coursework.handout.handout_workbook import handout_bytes, own_run
from kfsheet.coursework.handout.live_checks import A_CHECK, FIRST_COLUMN, FIRST_LINE, HIDDEN
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.handout.questions_sheet import EMPTY, FIRST, LOOKS_RIGHT, NOT_YET
from kfsheet.coursework.judging.calculated_answers import CalculatedAnswers
from kfsheet.coursework.judging.changed_cells import changed_cells
from kfsheet.coursework.judging.model_runs import ModelRuns
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import read_submission
from kfsheet.exercises import exercise_names
from kfsheet.model.exercise import Exercise, asked_steps
from kfsheet.workbook.engines.recalculate import recalculate
from kfsheet.workbook.write.layout import FIRST_ROW

FOOTBALL = load_exercise("football")
OWN = check_numbers.factor(SECRET, "football", ADA.id)
WRONG = {
    "a sign": lambda v: -v,
    "twice": lambda v: 2 * v,
    "a half": lambda v: v / 2,
    "a step more": lambda v: v * 1.1,
    "a step less": lambda v: v * 0.9,
    "g rounded": lambda v: v * 9.81 / 9.80665,
    "a square": lambda v: v * v,
    "a root": lambda v: abs(v) ** 0.5,
    "an inverse": lambda v: 1 / v if v else 1.0,
    "degrees": lambda v: v * 57.29577951308232,
    "plus one": lambda v: v + 1,
    "three figures": lambda v: float(f"{v:.3g}"),
    "five figures": lambda v: float(f"{v:.5g}"),
    "one": lambda v: 1.0,
    "zero": lambda v: 0.0,
}


@lru_cache
def paper(name):
    return Paper(load_exercise(name))


@lru_cache
def answers_of(name, student=ADA.id):
    """Values of every answer, in the steps that are asked, with those that are given."""
    exercise = load_exercise(name)
    run = own_run(exercise, own_numbers(exercise, SECRET, student))
    return {
        q.name: run.columns[q.name] if q.name in run.columns else [run.scalars[q.name]]
        for q in exercise.questions
    }


def feedback(file, engine="ironcalc"):
    """The words about each answer, and those at their head."""
    sheet = recalculate(file, engine)["Questions"]
    names = {content: row for (row, column), content in sheet.items() if column == 1}
    asked = [n for n, row in names.items() if row >= FIRST and (row, 6) in sheet]
    return {n: sheet[names[n], 6] for n in asked}, sheet[FIRST - 1, 6]


# -- up to where, and why not further ------------------------------------------------------------


def test_the_columns_of_a_loop_turn_green_as_far_as_they_are_right(engine, tmp_path):
    sheet = paper("football").open(tmp_path / "a.xlsx")
    assert feedback(sheet.save(), engine)[0] == dict.fromkeys(answers_of("football"), EMPTY)
    for name in ("K_x", "u", "x_f"):
        sheet.answer(name)
    words, head = feedback(sheet.save(), engine)
    assert head == "1 of 10 look right"
    assert words["K_x"] == LOOKS_RIGHT
    assert words["u"] == "right up to photo 1; waits for x_a"
    assert words["x_f"] == "right up to photo 0; waits for x_a"
    assert words["x_a"] == EMPTY
    sheet.answer_all()
    words, head = feedback(sheet.save(), engine)
    assert set(words.values()) == {LOOKS_RIGHT}
    assert head == "10 of 10 look right"


def test_one_typed_number_is_named_where_it_stands_and_nowhere_else(tmp_path):
    sheet = paper("football").open(tmp_path / "a.xlsx").answer_all()
    sheet.cells("z_a")[3][0].value = 2.5
    words, head = feedback(sheet.save())
    assert words["z_a"] == "right up to photo 2; differs in photo 3"
    assert words["w"] == words["z_f"].replace("waits for w", "waits for z_a")
    assert words["w"] == "right up to photo 3; waits for z_a"
    assert words["d_j"] == "right up to photo 3; waits for z_f"
    assert head == "6 of 10 look right"
    assert not any(NOT_YET in said for said in words.values())


def test_an_answer_that_is_partly_filled_says_so(tmp_path):
    sheet = paper("football").open(tmp_path / "a.xlsx").answer_all()
    for cell, _ in sheet.cells("x_a")[5:]:
        cell.value = None
    sheet.answer("K_z", do.negated)
    values = recalculate(sheet.save())["Questions"]
    words = feedback(sheet.path)[0]
    assert words["x_a"] == "right up to photo 4; partly filled"
    assert values[FIRST + 8, 5] == "5 of 16"
    assert words["K_z"] == NOT_YET
    sheet.cells("x_f")[0][0].value = "=1/0"
    assert feedback(sheet.save())[0]["x_f"] == "not yet; differs in photo 0"


def test_a_value_where_there_is_none_differs(tmp_path):
    """Photo 5 is missing for some: 0 there is not "", and an empty cell is neither."""
    sheet = paper("football").open(tmp_path / "a.xlsx").answer_all()
    gap = next(n for n, v in enumerate(answers_of("football")["d_i"]) if n and isnan(v))
    cell = sheet.cells("d_i")[gap - 1][0]
    for content, words in (("=0", "; differs in photo {}"), (None, "; partly filled"), ('=""', "")):
        cell.value = content
        found = feedback(sheet.save())[0]["d_i"]
        begin = f"right up to photo {gap - 1}" if words else LOOKS_RIGHT
        assert found == begin + words.format(gap)


@pytest.mark.parametrize("name", exercise_names())
def test_right_answers_look_right_in_every_exercise_and_give_the_keys_values(name, tmp_path):
    """Also what is given follows as it does in the exercise, guards or not."""
    sheet = paper(name).open(tmp_path / "a.xlsx").answer_all()
    values = recalculate(sheet.save())
    words = {content for (row, column), content in values["Questions"].items() if column == 6}
    assert words == {LOOKS_RIGHT, f"{len(sheet.exercise.questions)} of "
                     f"{len(sheet.exercise.questions)} look right"}  # fmt: skip
    run = own_run(sheet.exercise, sheet.own)
    for column in sheet.exercise.waiting & set(run.columns):
        title, at = sheet.layout.home(column)
        wanted = run.columns[column]
        scale = max((abs(v) for v in wanted if not isnan(v)), default=1)
        for step, value in enumerate(wanted):
            found = values[title].get((FIRST_ROW + step, at), "")
            same = found == "" if isnan(value) else abs(found - value) <= 1e-9 * scale
            assert same, (column, step, found, value)


def test_formulas_in_other_words_look_right(engine, tmp_path):
    """Terms in another order round in another way; helper cells change nothing."""
    sheet = paper("shuttlecock").open(tmp_path / "a.xlsx").answer_all()
    for number, name in enumerate(answers_of("shuttlecock")):
        do.helper_columns(sheet, name) if number % 3 == 0 else sheet.answer(name, do.rearranged)
    assert set(feedback(sheet.save(), engine)[0].values()) == {LOOKS_RIGHT}


def test_a_long_table_is_checked_in_blocks_after_its_first_rows(tmp_path):
    steps = checked_steps(1320)
    assert [s.first for s in steps[:30]] == list(range(30))
    assert (steps[0].first, steps[-1].last) == (0, 1319)
    assert all(a.last + 1 == b.first for a, b in pairwise(steps))
    assert len(checked_steps(101)) == 101
    sheet = paper("cannonball").open(tmp_path / "a.xlsx").answer_all()
    cells = sheet.cells("H_r_x")
    cells[599][0].value = cells[598][1]  # step 600 reads the row above
    words = feedback(sheet.save())[0]
    assert words["H_r_x"] == "right up to sweep 599; differs in sweep 600"
    assert words["x_a"] == "right up to sweep 599; waits for H_r_x"
    assert words["x_f"] == "right up to sweep 600; waits for H_r_x"


def test_what_an_answer_needs_is_found_through_columns_that_are_given():
    found = needs(FOOTBALL)
    assert found["u"] == {"x_a": Need(1, 1)}
    assert found["x_f"] == {"u": Need(0, 0), "x_a": Need(0, 1)}
    assert found["x_a"] == {"x_f": Need(-1, 0), "d_i": Need(0, 0), "K_x": Need(0, None)}
    assert found["K_x"] == {}
    cannonball = needs(load_exercise("cannonball"))
    assert cannonball["vy_f"]["x_f"] == Need(1, 1), "through the gain, which is given"
    tennis = needs(load_exercise("tennis"))
    assert tennis["x1_f"]["x1_tri"].lag is None, "the start is made of all rows"


# -- what the file tells -------------------------------------------------------------------------


@lru_cache
def kept_numbers(name):
    """What stands in a file about the values of each answer, by step."""
    from io import BytesIO

    exercise = load_exercise(name)
    content = BytesIO(handout_bytes(exercise, ADA, SECRET))
    sheet = openpyxl.load_workbook(content)[HIDDEN]
    grid, found = FIRST_LINE + len(exercise.questions) + 2, {}
    for number, question in enumerate(exercise.questions):
        letter = get_column_letter(FIRST_COLUMN + A_CHECK * number)
        cells = ((row, sheet[f"{letter}{row}"].value) for row in range(grid, sheet.max_row + 1))
        steps = {sheet[f"A{row}"].value: kept for row, kept in cells if type(kept) in (int, float)}
        found[question.name] = steps
    return sheet["B1"].value, found


def candidates(kept, own):
    """All numbers between a half and the whole of the power of 2 that is told, and pass."""
    power = np.floor(kept)
    period = 2.0**power / own
    fraction = (0.5 - kept) % 1
    whole = np.arange(int(own / 2) + 1, int(own) - 1)
    return (np.concatenate([whole, -whole]) + fraction) * period


@pytest.mark.parametrize("name", ["football", "shuttlecock", "tennis"])
def test_thousands_of_numbers_fit_all_that_a_file_tells_of_one(name):
    """Of every row of every answer, even for those who know it to one part in a hundred."""
    own, kept = kept_numbers(name)
    for answer, values in answers_of(name).items():
        for step, number in list(kept[answer].items())[:20]:
            value = values[step]
            fit = candidates(number, own)
            assert all(looks_right(float(v), number, own) for v in fit[:: len(fit) // 50])
            assert len(fit) > 200_000
            if value and abs(value) > 2.0 ** (np.floor(number) - 1):
                assert looks_right(value, number, own)
                assert (abs(fit / value - 1) < 0.01).sum() > 1_000, (answer, step)


def test_equal_values_are_kept_alike_so_that_many_rows_tell_no_more_than_one():
    """Under different periods the remainders of one number would, together, tell it."""
    value = 0.021904482
    assert len({salt(value, s, OWN) for s in sizes([value] * 40)}) == 1
    for more in (2, 4):  # a longer period holds what the shorter one tells, and no more
        short, long = salt(value, value, OWN), salt(value, more * value, OWN)
        known = (candidates(long, OWN) / 2.0 ** np.floor(short) * OWN + short) % 1
        assert np.abs(known - 0.5).max() < (more + 1) * check_numbers.WINDOW
    own, kept = kept_numbers("football")
    values = answers_of("football")
    assert values["x_f"][0] == values["x_a"][0]
    assert kept["x_f"][0] == kept["x_a"][0], "of two answers, too"


def test_nothing_of_the_answers_is_stored_but_a_power_of_2_and_three_figures():
    for name in ("football", "cannonball"):
        own, kept = kept_numbers(name)
        assert own == round(own, 3)
        for numbers in kept.values():
            for number in numbers.values():
                assert round(number, 3) == pytest.approx(number, abs=1e-9)


@pytest.mark.parametrize("name", exercise_names())
def test_wrong_numbers_seldom_pass(name):
    """One of five hundred by the window; with fifteen kinds of mistakes in every row."""
    own = check_numbers.factor(SECRET, name, ADA.id)
    tried = passed = 0
    for answer, values in answers_of(name).items():
        asked = asked_steps(load_exercise(name).model, answer)[:150]
        measure = sizes(values)
        for change in WRONG.values():
            rows = []
            for step in asked:
                value = values[step]
                wrong = nan if isnan(value) else change(value)
                if abs(wrong - value) > 1e-6 * measure[step]:
                    rows.append(looks_right(wrong, salt(value, measure[step], own), own))
            tried, passed = tried + len(rows), passed + sum(rows)
            assert len(rows) < 3 or not all(rows)
    assert tried > 400
    assert passed / tried < 0.004


@pytest.mark.parametrize("name", exercise_names())
def test_what_rounding_does_to_a_right_number_never_matters(name):
    """A part in a thousand million of it, and of what stands beside a value near zero less."""
    dice = np.random.RandomState(1)
    exercise = load_exercise(name)
    for student in ("s001", "s002", "s003", "s004")[: 4 if exercise.model.rows < 200 else 1]:
        own = check_numbers.factor(SECRET, name, student)
        for values in answers_of(name, student).values():
            for value, size in zip(values, sizes(values), strict=True):
                if isnan(value):
                    continue
                kept = salt(value, size, own)
                kept = float(f"{kept:.15g}")  # as LibreOffice saves it
                for noise in (0, *dice.uniform(-0.9e-9, 0.9e-9, 4)):
                    assert looks_right(value + noise * size, kept, own), (value, size)


@pytest.mark.parametrize("value", [1e300, -1e300, 1e307, 1e12, 0.0, 5e-324])
def test_numbers_of_any_size_are_looked_at(value):
    assert not looks_right(value, salt(1.25, 1.25, OWN), OWN) or value == 0
    assert looks_right(value, salt(value, abs(value) or 1.0, OWN), OWN) or abs(value) < 1e-300


def test_the_cells_use_functions_that_every_program_has(tmp_path):
    book = openpyxl.load_workbook(paper("cannonball").open(tmp_path / "a.xlsx").path)
    for title in (HIDDEN, "Questions"):
        texts = {str(c.value) for row in book[title].iter_rows() for c in row if c.data_type == "f"}
        words = {word for text in texts for word in re.findall(r"([A-Z][A-Z0-9]*)\(", text)}
        assert words <= set(FORMULAE), words - set(FORMULAE)
        assert all(len(text) < 255 for text in texts)
    assert book[HIDDEN].sheet_state == "veryHidden"


# -- what a student sees before anything is filled in ---------------------------------------------


@pytest.mark.parametrize("engine", ["ironcalc", "libreoffice"])
@pytest.mark.parametrize("name", exercise_names())
def test_an_untouched_handout_shows_no_error(name, engine, tmp_path):
    """But for #N/A, in white, in the columns from which the charts take what they leave out."""
    need(engine)
    path = paper(name).open(tmp_path / "a.xlsx").path
    for title, cells in recalculate(path, engine).items():
        errors = {v for v in cells.values() if isinstance(v, str) and v.startswith("#")}
        assert errors <= ({"#N/A"} if title == "Charts" else set()), title
    charts = openpyxl.load_workbook(path)["Charts"]
    shown = [r for area in charts.conditional_formatting for r in area.rules]
    assert all("ISNA(" in rule.formula[0] for rule in shown)


@pytest.mark.parametrize("name", ["football", "shuttlecock", "tennis"])
def test_what_needs_an_answer_is_empty_until_it_is_there_and_nothing_else_is(name, tmp_path):
    sheet = paper(name).open(tmp_path / "a.xlsx")
    values = recalculate(sheet.path)
    exercise, run = sheet.exercise, own_run(sheet.exercise, sheet.own)
    asked = {q.name for q in exercise.questions}
    for column in exercise.model.table.values():
        title, at = sheet.layout.home(column.name)
        found = [values[title].get((FIRST_ROW + k, at), "") for k in range(exercise.model.rows)]
        there = [not isnan(v) for v in run.columns[column.name]]
        if column.name not in exercise.waiting:
            assert [v != "" for v in found] == there, column.name
        elif column.name not in asked:
            assert found.count("") > len(found) / 2, column.name


def test_guarded_formulas_are_no_changed_cells(tmp_path):
    for name in ("football", "shuttlecock"):
        sheet = paper(name).open(tmp_path / f"{name}.xlsx").answer_all()
        book = read_submission(sheet.save())
        addresses = CellAddresses.find(book, sheet.model)
        runs = ModelRuns(sheet.exercise)
        calculated = CalculatedAnswers(book, addresses, runs.own_worlds(sheet.own))
        assert changed_cells(sheet.exercise, book, addresses, sheet.own, calculated) == []


def small(**more):
    """An exercise of a lecturer's own, with a gap, and a summary of what follows from an answer."""
    m = Recurrence("small", title="Small", step="hour")
    a = m.parameter("a", 7.25, "m", "a length", sign="positive")
    seen = m.data("seen", [1, None, 3, 4], "m", "seen", section="S", may_be_missing=True)
    x, d, y = m.columns("x", "d", "y", section="S")
    m.define(x[t], x[t - 1] + a, "m", "answer", start=[0])
    m.define(d[t], when_observed(seen[t], seen[t] - x[t]), "m", "answer", start=[Missing])
    m.define(y[t], 1 / x[t], "1/m", "given", start=[Missing])
    about = ("It is 7.25 m long. It has {a} m. It was seen 4 times, {b}.",)
    questions = (Question("x", 1, "Add."), Question("d", 2, "Subtract."))
    return Exercise(m, about, "own", questions=questions, vary={"a": (5, 6)}, **more)


def test_where_names_the_cells_that_are_to_be_filled_in_and_no_other(tmp_path):
    for exercise in (small(), *map(load_exercise, ("football", "shuttlecock", "tennis"))):
        sheet = Paper(exercise).open(tmp_path / "a.xlsx")
        for row, question in enumerate(exercise.questions, FIRST):
            place = sheet.book["Questions"].cell(row, 3).value
            cells = set()
            for part in place.split(","):
                title, _, area = part.rpartition("!")
                found = sheet.book[title.strip("'")][area]
                found = found if isinstance(found, tuple) else ((found,),)
                cells |= {id(cell) for line in found for cell in line}
            assert cells == {id(cell) for cell, _ in sheet.cells(question.name)}


def test_the_read_me_tells_the_students_own_numbers_and_asks_to_change_none(tmp_path):
    for name in exercise_names():
        sheet = paper(name).open(tmp_path / "a.xlsx")
        words = " ".join(str(c.value) for r in sheet.book["Read me"].iter_rows() for c in r)
        own, varied = dict(sheet.own.parameters), sheet.exercise.vary
        assert "{" not in words
        assert not re.search(r"\b(change|try this|set)\b", words, re.IGNORECASE), words
        for parameter, value in own.items():
            if parameter in varied and f"{{{parameter}}}" in sheet.exercise.about[0]:
                assert f"{value:.10g}" in words
        shipped = {f"{sheet.model.parameters[n].value:.10g}" for n in varied}
        shipped -= {f"{v:.10g}" for v in own.values()}
        assert not shipped & set(re.findall(r"\d+(?:\.\d+)?", words)), shipped


def test_a_sentence_with_the_exercises_own_number_is_left_out_where_it_is_false(tmp_path):
    sheet = Paper(small()).open(tmp_path / "a.xlsx")
    own = dict(sheet.own.parameters)["a"]
    assert sheet.book["Read me"]["A4"].value == f"It has {own:g} m. It was seen 4 times, {{b}}."


def test_sheets_of_numbers_say_so_at_their_top(tmp_path):
    for name in ("football", "cannonball", "shuttlecock"):
        sheet = paper(name).open(tmp_path / "a.xlsx")
        for title in sheet.model.sections:
            top = " ".join(str(c.value) for r in sheet.book[title].iter_rows(max_row=3) for c in r)
            assert ("holds numbers" in top) == (title in sheet.exercise.frozen)
