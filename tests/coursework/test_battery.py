"""Answers written by hand get what they deserve; LibreOffice says that they deserve it."""

import sys
from functools import cache
from pathlib import Path

import pytest
from conftest import need
from fuzz.course import Course
from fuzz_marks import MINI, SHORT_CANNONBALL

sys.path.append(str(Path(__file__).parent / "cases"))
from battery import BATTERY, FULL, LESS

SPECS = {"mini": MINI, "cannonball": SHORT_CANNONBALL}
CASES = [(name, *case) for name, cases in BATTERY.items() for case in cases]


@cache
def course(name):
    return Course(SPECS.get(name, name))


@pytest.mark.parametrize(
    ("name", "deserved", "question", "form"), CASES, ids=[f"{c[0]} {c[2]} {c[3]}" for c in CASES]
)
def test_an_answer_by_hand_gets_what_it_deserves(name, deserved, question, form, tmp_path):
    answer = course(name).written(question, form)
    mark = course(name).marks([answer], tmp_path / "answer.xlsx")[question]
    assert (mark.score == mark.points) == (deserved == FULL), (mark.status, mark.remark)


@pytest.mark.parametrize("name", BATTERY)
def test_libreoffice_agrees_on_what_answers_by_hand_deserve(name):
    need("libreoffice")
    cases = [case for case in BATTERY[name] if case[0] in (FULL, LESS)]
    answers = [course(name).written(question, form) for _, question, form in cases]
    told = course(name).verdicts(answers)
    expected = ["right" if deserved == FULL else "wrong" for deserved, *_ in cases]
    wrong = [(str(a), a.seen) for a, x, y in zip(answers, told, expected, strict=True) if x != y]
    assert not wrong
