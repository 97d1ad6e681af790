"""Can the questions of an exercise be answered from what its students are told?"""

import re

import pytest
from students import ADA, SECRET
from sympy import Indexed

from kfsheet import load_exercise
from kfsheet.coursework.handout.empty_answers import with_empty_answers
from kfsheet.coursework.handout.handout_workbook import own_run
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.handout.questions_sheet import question_pages
from kfsheet.exercises import exercise_names
from kfsheet.model.expressions import Missing
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.run import Run


def words_told(exercise):
    """The words on a student's sheet of questions: task, hints, names of the answers."""
    layout, own = Layout.standard(exercise.model), own_numbers(exercise, SECRET, ADA.id)
    page, _ = question_pages(exercise, layout, own_run(exercise, own), SECRET, (ADA.id, ADA.name))
    texts = [p.content for p in page.cells.values() if isinstance(p.content, str)]
    return set(re.findall(r"[A-Za-z]\w*", " ".join(t for t in texts if not t.startswith("="))))


def names_read(model, name):
    """Columns and parameters in the rules of an answer."""
    scalar = model.derived_scalars.get(name)
    rules = [scalar.expression] if scalar else model.column(name).rules
    symbols = {s for r in rules if r is not Missing for s in r.free_symbols}
    return {str(s) for s in symbols if not isinstance(s, Indexed)}


@pytest.mark.parametrize("name", exercise_names())
def test_the_sheet_of_questions_names_all_that_an_answer_is_made_of(name):
    exercise = load_exercise(name)
    assert exercise.task, "the words that a student needs"
    told = words_told(exercise)
    for question in exercise.questions:
        needed = names_read(exercise.model, question.name)
        assert needed
        assert needed | {question.name} <= told, question.name


@pytest.mark.parametrize("name", ["cannonball", "tennis"])
def test_what_looks_like_an_answer_in_a_sealed_worksheet_is_live_and_not_shown(name):
    exercise = load_exercise(name)
    layout, now = Layout.standard(exercise.model), Run.of(exercise.model)
    pages = [p for p in with_empty_answers(exercise, layout, now) if p.title in exercise.sealed]
    asked = {(layout.home(q.name)) for q in exercise.questions if q.name in exercise.model.table}
    assert {sheet for sheet, _ in asked} == {page.title for page in pages}
    for page in pages:
        kinds = {filled.kind for filled in page.columns.values() if filled.rules}
        assert kinds <= {"veiled", "index"}
        assert any(piece.kind == "answer" for piece in page.cells.values())
