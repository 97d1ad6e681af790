"""What kind of mistake a wrong formula is, in words that do not tell the key."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from functools import lru_cache

from sympy import Basic, Indexed, Number, Rational

from kfsheet.coursework.judging.answer_key import ROUGH, AnswerKey, answer_key
from kfsheet.coursework.judging.answer_rows import AnswerCell, fixed_row
from kfsheet.coursework.judging.calculated_answers import Outcome, same
from kfsheet.coursework.judging.formula_meaning import Interpreter
from kfsheet.coursework.judging.random_samples import OwnNumbers, Sampler
from kfsheet.coursework.judging.time_limit import OutOfTimeError, time_limit
from kfsheet.coursework.judging.typical_mistakes import MOST, typical_mistakes
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import FormulaError, KfsheetError
from kfsheet.model.expressions import t, walk
from kfsheet.model.recurrence import Recurrence
from kfsheet.parsing.calculator import Error

RIGHT, EMPTY, TYPED, WRONG = "right", "empty", "typed", "wrong"
HARD_CODED, PARTLY, GAPS, NEARLY = "hard-coded", "partly right", "gaps forgotten", "nearly right"
REFUSED, UNREADABLE, GONE = "refused", "unreadable", "gone"
PLAIN_WORDS = {
    EMPTY: "empty",
    TYPED: "a number stands where a formula is asked for; it will not move with the parameters",
    UNREADABLE: "the formula could not be judged",
    WRONG: "the formula gives another value than the right one",
}
STILL = "right only as long as the parameters keep their values: a number stands in a place of one"
UNSEEN = "right where there is an observation, wrong where one is missing"
CLOSE = f"most values lie within {100 * ROUGH:g} % of the right ones, and are not equal"
SECONDS = 2.0  # for the name of one mistake
NEAR = 0.01
"""How far a typed number may be from a parameter's own value and still stand for it."""


class Diagnosis:
    """Names the mistakes of one workbook: the values decide what they cost, SymPy how they look."""

    def __init__(
        self,
        book: Book,
        addresses: CellAddresses,
        interpreter: Interpreter,
        sampler: Sampler,
        own: OwnNumbers,
    ) -> None:
        self._book, self._addresses, self._interpreter = book, addresses, interpreter
        self._sampler, self._own = sampler, own

    def of(self, name: str, group: list[AnswerCell], several: bool) -> tuple[str, str, str]:
        """Status, words and fingerprint of cells that hold one formula, which is not right."""
        culprit = group[0]
        outcomes = [outcome for cell in group for outcome in cell.outcomes]
        if not outcomes:  # an engine has judged it
            return WRONG, PLAIN_WORDS[WRONG], ""
        worth, words = _by_values(outcomes)
        fingerprint = digest_of(name, [_figure(o) for o in culprit.outcomes if not o.world.own])
        try:
            with time_limit(SECONDS):
                status, named = self._named(name, culprit, several)
        except KfsheetError as error:
            if worth == WRONG:
                words = f"recalculated, since {error}: {_reason(culprit)}"
            return worth, words, fingerprint
        # SymPy is read here for words only: whatever it makes of an odd formula, values count.
        except (Exception, OutOfTimeError):
            return worth, words if worth != WRONG else _reason(culprit), fingerprint
        rounded = status == HARD_CODED and worth in (WRONG, NEARLY) and _follows(outcomes)
        if status == worth or rounded:
            return status, named, fingerprint
        if "refers to" in named and worth == GAPS:
            words = named  # the guard asks a fixed row
        if worth == WRONG:
            words = named if status == WRONG else _reason(culprit)
        return worth, words, fingerprint

    def _named(self, name: str, culprit: AnswerCell, several: bool) -> tuple[str, str]:
        meaning = self._interpreter.meaning(culprit.address, culprit.step)
        if meaning is None:
            raise FormulaError("it is a part of an array formula")
        expression, model = meaning.expression, self._sampler.model
        if meaning.fixed_rows:
            expression = as_lags(expression, culprit.step)
        steps = tuple(judged_in(model, name, culprit.step, expression))
        if all(is_right(self._sampler, name, step, expression) for step in steps):
            return RIGHT, ""  # as algebra has it; the sheet has not
        status, words, _ = diagnose(self._sampler, name, steps, expression, self._own)
        if status == WRONG and meaning.fixed_rows and several:
            fixed = fixed_row(self._book, self._addresses, culprit)
            words = f"every row refers to {fixed}; {words}"
        return status, words


def _by_values(outcomes: Sequence[Outcome]) -> tuple[str, str]:
    """What a formula that is not right in every world is worth, and the plainest words for it."""
    if _is_typed(outcomes):
        return TYPED, PLAIN_WORDS[TYPED]
    if _right([o for o in outcomes if o.world.own]):
        return HARD_CODED, STILL
    seen = [o for o in outcomes if not o.world.gaps and o.wanted != ""]
    if _right(seen):
        return GAPS, UNSEEN
    close = [same(o.found, o.wanted, tolerance=ROUGH) for o in seen]
    return (NEARLY, CLOSE) if 4 * sum(close) > 3 * len(close) else (WRONG, PLAIN_WORDS[WRONG])


def _is_typed(outcomes: Sequence[Outcome]) -> bool:
    """Whether a formula gives one number whatever happens, as the key does not."""
    found, wanted = ({o.found for o in outcomes}, {o.wanted for o in outcomes})
    number = next(iter(found))
    return len(found) == 1 < len(wanted) and type(number) is float and number != 0


def _right(outcomes: Sequence[Outcome]) -> bool:
    return all(o.right for o in outcomes) and any(type(o.wanted) is float for o in outcomes)


def _follows(outcomes: Sequence[Outcome]) -> bool:
    """Whether there is a number where the key has one, with the student's own numbers."""
    own = [o for o in outcomes if o.world.own_data and type(o.wanted) is float]
    return all(type(o.found) is float for o in own)


def _reason(cell: AnswerCell) -> str:
    """Why a formula is not right, from what its cell shows; the key's value is not told."""
    wrong = [o for o in cell.outcomes if not o.right]
    outcome = next((o for o in wrong if not o.world.gaps), wrong[0])
    row, gone = cell.address[1], " where nothing is observed" * outcome.world.gaps
    if isinstance(outcome.found, Error):
        return f"row {row} shows {outcome.found.value}{gone}"
    if outcome.wanted == "":
        return f"row {row} has a value{gone or ' where there is none'}"
    if isinstance(outcome.found, str):
        return f"row {row} has a text where a number belongs"
    return f"{PLAIN_WORDS[WRONG]}, in row {row}{gone}"


def _figure(outcome: Outcome) -> str:
    return f"{outcome.found:.9g}" if type(outcome.found) is float else str(outcome.found)


def as_lags(expression: Basic, step: int) -> Basic:
    """The same cells as rows above ``step``: ``x[3]`` is ``x[t - 1]`` in step 4."""
    # D$5 filled down reads one cell in every row: as a lag it is another formula in each of them.
    cells = {c for c in expression.atoms(Indexed) if c.indices[0].is_Integer}
    return expression.xreplace({c: c.base[t - (step - int(c.indices[0]))] for c in cells})


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
        return GAPS, UNSEEN, fingerprint
    if _has_a_number(asked, expression) and all(q.same(expression, own) for q in everywhere):
        return HARD_CODED, "a number from the data stands where its cell belongs", fingerprint
    if words := _rounded(everywhere, expression, own):
        return HARD_CODED, words, fingerprint
    if all(q.nearly(expression) for q in everywhere):
        return NEARLY, CLOSE, fingerprint
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
