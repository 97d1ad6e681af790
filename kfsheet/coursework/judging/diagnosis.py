"""What kind of mistake a wrong formula is, in words that do not tell the key."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from functools import lru_cache

from sympy import Basic, Indexed, Number, Rational

from kfsheet.coursework.judging.answer_key import ROUGH, AnswerKey, answer_key
from kfsheet.coursework.judging.random_samples import OwnNumbers, Sampler
from kfsheet.coursework.judging.typical_mistakes import MOST, typical_mistakes
from kfsheet.model.expressions import t, walk
from kfsheet.model.recurrence import Recurrence

RIGHT, EMPTY, TYPED, WRONG = "right", "empty", "typed", "wrong"
HARD_CODED, PARTLY, GAPS, NEARLY = "hard-coded", "partly right", "gaps forgotten", "nearly right"
REFUSED, UNREADABLE, GONE = "refused", "unreadable", "gone"
PLAIN_WORDS = {
    EMPTY: "empty",
    TYPED: "a number stands where a formula is asked for; it will not move with the parameters",
    UNREADABLE: "the formula could not be judged",
    WRONG: "the formula gives another value than the right one",
}
NEAR = 0.01
"""How far a typed number may be from a parameter's own value and still stand for it."""


@lru_cache(maxsize=200_000)
def is_right(sampler: Sampler, name: str, step: int, expression: Basic) -> bool:
    """Whether an expression is the key's function in a step."""
    return answer_key(sampler, name, step).same(expression)


def judged_in(model: Recurrence, name: str, step: int, expression: Basic) -> list[int]:
    """Steps in which a formula is judged for all rows that hold it."""
    if name in model.derived_scalars:
        return [0]
    starts = len(model.column(name).start)
    if step < starts or asks_for_its_row(model, expression):
        return [step]
    return sorted({starts, (starts + model.rows - 1) // 2, model.rows - 1})


@lru_cache(maxsize=20_000)
def asks_for_its_row(model: Recurrence, expression: Basic) -> bool:
    """Whether an expression reads the number or the time of its row, not cells beside it only."""
    clock = model.clock and model.clock.base
    nodes = list(walk(expression))
    return t in nodes or any(isinstance(node, Indexed) and node.base == clock for node in nodes)


def digest_of(name: str, values: Sequence[str]) -> str:
    """A fingerprint: the same for the same values of the same answer."""
    return hashlib.sha256("/".join((name, *values)).encode()).hexdigest()[:12]


@lru_cache(maxsize=20_000)
def diagnose(
    sampler: Sampler, name: str, steps: tuple[int, ...], expression: Basic, own: OwnNumbers
) -> tuple[str, str, str]:
    """Status, words and fingerprint of a formula that is wrong in one of the steps."""
    step = next((k for k in steps if not is_right(sampler, name, k, expression)), steps[0])
    asked = answer_key(sampler, name, step)
    values = asked.values(expression)
    fingerprint = digest_of(name, values)
    everywhere = [answer_key(sampler, name, k) for k in steps]
    parameters = OwnNumbers(own.parameters)
    # The order matters: a constant that is typed is also "nearly right", and its words say more.
    if _has_a_number(asked, expression) and all(q.same(expression, parameters) for q in everywhere):
        names = _still(asked, expression, own) or ["a parameter"]
        many = len(names) > 1
        keep, place = ("keep their values", "their") if many else ("keeps its value", "its")
        words = f"right only as long as {', '.join(names)} {keep}"
        return HARD_CODED, f"{words}: a number stands in {place} place", fingerprint
    if all(q.same(expression, gaps=False) for q in everywhere):
        words = "right where there is an observation, wrong where one is missing"
        return GAPS, words, fingerprint
    if _has_a_number(asked, expression) and all(q.same(expression, own) for q in everywhere):
        return HARD_CODED, "a number from the data stands where its cell belongs", fingerprint
    if words := _rounded(everywhere, expression, own):
        return HARD_CODED, words, fingerprint
    if all(q.nearly(expression) for q in everywhere):
        words = f"most values lie within {100 * ROUGH:g} % of the right ones, and are not equal"
        return NEARLY, words, fingerprint
    return WRONG, _words_of(sampler, name, step, expression, values), fingerprint


def _has_a_number(asked: AnswerKey, expression: Basic) -> bool:
    """Whether something that the key reads is missing, so that a number may stand for it."""
    return bool(expression.atoms(Number) - asked.key.atoms(Number)) or bool(
        asked.key.free_symbols - expression.free_symbols
    )


def _rounded(everywhere: list[AnswerKey], expression: Basic, own: OwnNumbers) -> str:
    """Words, if the formula is right where one parameter has a number near its own value."""
    typed = {abs(float(c)) for c in expression.atoms(Rational)}
    typed |= {2 * c for c in typed}  # half of a number is left of it where it is multiplied by 1/2
    for name, value in own.parameters:
        others = tuple(p for p in own.parameters if p[0] != name)
        for number in sorted(typed):
            near = math.copysign(number, value)
            if near == value or not math.isclose(near, value, rel_tol=NEAR):
                continue
            if all(q.same(expression, OwnNumbers((*others, (name, near)))) for q in everywhere):
                words = f"{near:.10g} stands in the place of {name}, which is {value:.10g}"
                return f"{words}: refer to its cell"
    return ""


def _still(asked: AnswerKey, expression: Basic, own: OwnNumbers) -> list[str]:
    """Parameters that the formula should follow and does not."""
    found = []
    for name, _ in own.parameters:
        others = OwnNumbers(tuple(p for p in own.parameters if p[0] != name))
        if not asked.same(expression, others):
            found.append(name)
    return found


def _words_of(
    sampler: Sampler, name: str, step: int, expression: Basic, values: Sequence[str]
) -> str:
    if name in sampler.model.table and expression.has(sampler.model[name][t]):
        return "the formula refers to its own cell"
    if name in sampler.model.derived_scalars and expression.has(sampler.model[name]):
        return "the formula refers to its own cell"
    known = known_mistakes(sampler, name, step).get(tuple(values))
    return known or PLAIN_WORDS[WRONG]


@lru_cache(maxsize=2_000)
def known_mistakes(sampler: Sampler, name: str, step: int) -> dict[tuple[str, ...], str]:
    """Words by the values that a mutated key has; without those that change nothing."""
    asked = answer_key(sampler, name, step)
    found: dict[tuple[str, ...], str] = {}
    for n, (words, key) in enumerate(typical_mistakes(sampler.model, asked.key)):
        if n >= MOST:  # a long key has more; likely mistakes come first
            break
        found.setdefault(asked.values(key), words)
    found.pop(asked.values(asked.key), None)
    return found
