"""What kind of mistake a wrong formula is, in words that do not tell the key.

Values decide, as they do for what is right: a number in the place of a parameter is right with the
student's own parameters and in no other world, a forgotten gap where everything was observed.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence

from kfsheet.coursework.judging.answer_rows import AnswerCell, fixed_row
from kfsheet.coursework.judging.calculated_answers import CalculatedAnswers, Outcome, same
from kfsheet.coursework.judging.dependencies import parameters_of
from kfsheet.coursework.judging.mistakes.known_mistakes import KnownMistakes
from kfsheet.coursework.judging.model_runs import ModelRuns, OwnNumbers, World
from kfsheet.coursework.judging.precedents import circle_in_words, typed_numbers
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import KfsheetError
from kfsheet.parsing.calculator import Error

RIGHT, EMPTY, TYPED, WRONG = "right", "empty", "typed", "wrong"
HARD_CODED, PARTLY, GAPS, NEARLY = "hard-coded", "partly right", "gaps forgotten", "nearly right"
REFUSED, UNREADABLE, GONE = "refused", "unreadable", "gone"
ROUGH = 3e-3
"""How far most values of a formula may be off for it to be called nearly right."""
PLAIN_WORDS = {
    EMPTY: "empty",
    TYPED: "a number stands where a formula is asked for; it will not move with the parameters",
    UNREADABLE: "the formula could not be judged",
    WRONG: "the formula gives another value than the right one",
}
UNSEEN = "right where all is observed, wrong where an observation is missing"
CLOSE = f"most values lie within {100 * ROUGH:g} % of the right ones, and are not equal"
NEAR = 0.01
"""How far a typed number may be from a parameter's own value and still stand for it."""
FEW = 3  # rows in which a number in the place of a parameter is looked for
OTHER = 1.25  # times a parameter, to see what follows it


class Diagnosis:
    """Names the mistakes of one workbook."""

    def __init__(
        self,
        book: Book,
        addresses: CellAddresses,
        calculated: CalculatedAnswers,
        runs: ModelRuns,
        mistakes: KnownMistakes,
        own: OwnNumbers,
    ) -> None:
        self._book, self._addresses, self._calculated = book, addresses, calculated
        self._runs, self._mistakes, self._own = runs, mistakes, own

    def of(self, name: str, group: list[AnswerCell], several: bool) -> tuple[str, str, str]:
        """Status, words and fingerprint of cells that hold one formula, which is not right."""
        culprit = group[0]
        outcomes = [outcome for cell in group for outcome in cell.outcomes]
        if not outcomes:  # an engine has judged it
            return WRONG, PLAIN_WORDS[WRONG], ""
        fingerprint = digest_of(name, [_figure(o) for o in culprit.outcomes if not o.world.own])
        status = _worth(outcomes)
        if status == HARD_CODED:
            words = self._still(name, group)
        elif status in (WRONG, NEARLY) and (words := self._rounded(name, group)):
            status = HARD_CODED
        else:
            words = self._words(name, culprit, status)
            fixed = fixed_row(self._book, self._addresses, culprit) if several else ""
            if fixed and status in (WRONG, GAPS):
                words = f"every row refers to {fixed}; {words}"
        return status, words, fingerprint

    def _words(self, name: str, culprit: AnswerCell, status: str) -> str:
        if status in (GAPS, NEARLY):
            return UNSEEN if status == GAPS else CLOSE
        if status == TYPED:
            return PLAIN_WORDS[TYPED]
        return (
            self._mistakes.words(name, culprit.step, culprit.outcomes)
            or circle_in_words(self._book, culprit.address)
            or _reason(culprit)
        )

    # -- a number in the place of a parameter ----------------------------------------------------

    def _still(self, name: str, group: list[AnswerCell]) -> str:
        """Words about the parameters that the formula should follow and does not."""
        own = dict(self._own.parameters)
        names = [
            parameter
            for parameter in parameters_of(self._runs.model, name)
            if not self._right_with(name, group, {parameter: own[parameter] * OTHER or 1.0})
        ] or ["a parameter"]
        many = len(names) > 1
        keep, place = ("keep their values", "their") if many else ("keeps its value", "its")
        return f"right only as long as {', '.join(names)} {keep}: a number stands in {place} place"

    def _rounded(self, name: str, group: list[AnswerCell]) -> str:
        """Words, if the formula is right where one parameter has a number near its own value."""
        if not _follows(group):
            return ""
        typed = typed_numbers(self._book, self._addresses, group[0].address)
        typed |= {2 * c for c in typed}  # half of a number is left of it where 1/2 multiplies it
        own, asked = dict(self._own.parameters), parameters_of(self._runs.model, name)
        for parameter in asked:
            for near in sorted(_near(own[parameter], typed)):
                if self._right_with(name, group, {parameter: near}):
                    words = f"{near:.10g} stands in the place of {parameter}, which is "
                    return f"{words}{own[parameter]:.10g}: refer to its cell"
        return ""

    def _right_with(
        self, name: str, group: list[AnswerCell], parameters: Mapping[str, float]
    ) -> bool:
        """Whether the formula is right in a world of the student's own with other parameters."""
        world = self._runs.own_world(self._own, parameters)
        return world is None or all(o.right for o in self._outcomes(world, name, group))

    def _outcomes(self, world: World, name: str, group: list[AnswerCell]) -> Iterator[Outcome]:
        for cell in group[:FEW]:
            try:
                yield self._calculated.outcome(world, name, cell.step, cell.address)
            except KfsheetError:
                yield Outcome(None, None, False, world)


def _near(value: float, numbers: set[float]) -> set[float]:
    """Those that stand for a value, though they are not the same, with its sign."""
    signed = {math.copysign(number, value) for number in numbers}
    return {n for n in signed if n != value and math.isclose(n, value, rel_tol=NEAR)}


def _worth(outcomes: Sequence[Outcome]) -> str:
    """The status of a formula that is not right in every world."""
    if _is_typed(outcomes):
        return TYPED
    # What is nearly equal in every run was rounded; it may be equal in the student's own by chance.
    if all(same(o.found, o.wanted, tolerance=ROUGH) for o in outcomes):
        return NEARLY
    seen = [o for o in outcomes if not o.world.gaps and o.wanted != ""]
    if _right(seen):
        return GAPS
    if _right([o for o in outcomes if o.world.own]):
        return HARD_CODED
    # Also in the student's own sheet, where a formula may be wrong that is right elsewhere.
    own = [o for o in outcomes if o.world.own_data and type(o.wanted) is float]
    return NEARLY if _close(seen) > 3 / 4 and _close(own) > 1 / 2 else WRONG


def _close(outcomes: Sequence[Outcome]) -> float:
    """Share of the values that are about right."""
    close = [same(o.found, o.wanted, tolerance=ROUGH) for o in outcomes]
    return sum(close) / max(1, len(close))


def _is_typed(outcomes: Sequence[Outcome]) -> bool:
    """Whether a formula gives one number whatever happens, as the key does not."""
    found, wanted = ({o.found for o in outcomes}, {o.wanted for o in outcomes})
    number = next(iter(found))
    return len(found) == 1 < len(wanted) and type(number) is float and number != 0


def _right(outcomes: Sequence[Outcome]) -> bool:
    return all(o.right for o in outcomes) and any(type(o.wanted) is float for o in outcomes)


def _follows(group: Sequence[AnswerCell]) -> bool:
    """Whether there is a number where the key has one, with the student's own numbers."""
    found = (o for cell in group for o in cell.outcomes if o.world.own_data)
    return all(type(o.found) is float for o in found if type(o.wanted) is float)


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


def digest_of(name: str, values: Sequence[str]) -> str:
    """A fingerprint: the same for the same values of the same answer."""
    return hashlib.sha256("/".join((name, *values)).encode()).hexdigest()[:12]
