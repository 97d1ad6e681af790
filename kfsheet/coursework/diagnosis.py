"""What kind of mistake a wrong formula is, in words that do not tell the key."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import lru_cache

from sympy import Basic

from kfsheet.coursework.comparing import Question, question
from kfsheet.coursework.mutations import MOST, mutations
from kfsheet.coursework.worlds import Own, Scene
from kfsheet.expressions import t

RIGHT, EMPTY, TYPED, WRONG = "right", "empty", "typed", "wrong"
HARD_CODED, PARTLY, GAPS, ROUNDED = "hard-coded", "partly right", "gaps forgotten", "rounded"
REFUSED, UNREADABLE, GONE = "refused", "unreadable", "gone"
PLAIN_WORDS = {
    EMPTY: "empty",
    TYPED: "a number stands where a formula is asked for; it will not move with the parameters",
    UNREADABLE: "the formula could not be judged",
    WRONG: "the formula gives another value than the right one",
}


@lru_cache(maxsize=200_000)
def is_right(scene: Scene, name: str, step: int, expression: Basic) -> bool:
    """Whether an expression is the key's function in a step."""
    return question(scene, name, step).same(expression)


@lru_cache(maxsize=20_000)
def diagnose(
    scene: Scene, name: str, step: int, expression: Basic, own: Own
) -> tuple[str, str, str]:
    """Status, words and fingerprint of a wrong formula."""
    asked = question(scene, name, step)
    values = asked.values(expression)
    fingerprint = hashlib.sha256("/".join((name, *values)).encode()).hexdigest()[:12]
    parameters = Own(own.parameters)
    if asked.same(expression, parameters):
        names = ", ".join(_still(asked, expression, own)) or "a parameter"
        words = f"right only as long as {names} keeps its value: a number stands in its place"
        return HARD_CODED, words, fingerprint
    if asked.same(expression, gaps=False):
        words = "right where there is an observation, wrong where one is missing"
        return GAPS, words, fingerprint
    if asked.same(expression, own):
        return HARD_CODED, "a number from the data stands where its cell belongs", fingerprint
    if asked.nearly(expression):
        return ROUNDED, "nearly right: a constant in it is rounded", fingerprint
    return WRONG, _words_of(scene, name, step, expression, values), fingerprint


def _still(asked: Question, expression: Basic, own: Own) -> list[str]:
    """Parameters that the formula should follow and does not."""
    found = []
    for name, _ in own.parameters:
        others = Own(tuple(p for p in own.parameters if p[0] != name))
        if not asked.same(expression, others):
            found.append(name)
    return found


def _words_of(scene: Scene, name: str, step: int, expression: Basic, values: Sequence[str]) -> str:
    if name in scene.model.table and expression.has(scene.model[name][t]):
        return "the formula refers to its own cell"
    known = known_mistakes(scene, name, step).get(tuple(values))
    return known or PLAIN_WORDS[WRONG]


@lru_cache(maxsize=2_000)
def known_mistakes(scene: Scene, name: str, step: int) -> dict[tuple[str, ...], str]:
    """Words by the values that a mutated key has; without those that change nothing."""
    asked = question(scene, name, step)
    found: dict[tuple[str, ...], str] = {}
    for n, (words, key) in enumerate(mutations(scene.model, asked.key)):
        if n >= MOST:
            break
        found.setdefault(asked.values(key), words)
    found.pop(asked.values(asked.key), None)
    return found
