"""Marks: what each answer of a workbook is worth, and what kind of mistake is in it.

Every row of a question is judged by its formula alone; equal formulas are judged once. A formula
that cannot be read as mathematics is handed to ``recalculated``, which asks a spreadsheet engine.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from sympy import Basic, Indexed

from kfsheet.coursework.judging.answer_key import answer_key, asked_steps
from kfsheet.coursework.judging.answer_rows import (
    AnswerCell,
    content_of,
    fixed_row,
    not_in,
    rows_of,
)
from kfsheet.coursework.judging.circular_references import circular_reference
from kfsheet.coursework.judging.diagnosis import (
    EMPTY,
    GAPS,
    GONE,
    HARD_CODED,
    NEARLY,
    PARTLY,
    PLAIN_WORDS,
    REFUSED,
    RIGHT,
    TYPED,
    UNREADABLE,
    WRONG,
    asks_for_its_row,
    diagnose,
    digest_of,
    is_right,
    judged_in,
)
from kfsheet.coursework.judging.formula_meaning import Interpreter, parsed
from kfsheet.coursework.judging.random_samples import OwnNumbers, Sampler
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.coursework.reading.worksheet import Formula
from kfsheet.errors import ForbiddenError, FormulaError
from kfsheet.model.exercise import Exercise, Question
from kfsheet.model.expressions import Aggregate, columns_read, lag, t

CREDIT = {RIGHT: 1.0, HARD_CODED: 0.5, PARTLY: 0.5, GAPS: 0.5, NEARLY: 0.5}
"""Share of the points by status; what is not listed gets none."""
NUMBER = re.compile(r"(?<!\w)\d+(?:\.\d+)?(?:e[+-]?\d+)?")
FARTHEST = 8  # rows back; keys look one or two back, and every row is computed at every sample


@dataclass(frozen=True)
class Mark:
    """What one question is worth, why, and a fingerprint that equal wrong answers share."""

    name: str
    points: int
    score: float
    status: str
    remark: str
    fingerprint: str = ""


Recalculated = Callable[[CellAddresses, str], dict[int, bool]]
"""Right or wrong by step, found by a spreadsheet engine, of the answer of that name."""


class Judge:
    """Judges one workbook."""

    def __init__(
        self,
        exercise: Exercise,
        sampler: Sampler,
        book: Book,
        own: OwnNumbers,
        recalculated: Recalculated,
    ) -> None:
        self._model, self._sampler, self._own = exercise.model, sampler, own
        self.book, self._recalculated = book, recalculated
        self.addresses = CellAddresses.find(book, exercise.model)
        self._interpreter = Interpreter(book, self.addresses)
        self._exercise = exercise
        self._starts: dict[str, int] = {}
        self._verdicts: dict[tuple, tuple[str, str]] = {}

    def marks(self) -> list[Mark]:
        """One mark for each question."""
        return [self._mark(asked) for asked in self._exercise.questions]

    def _mark(self, asked: Question) -> Mark:
        cells = [self._read(asked.name, step) for step in asked_steps(self._model, asked.name)]
        if any(cell is None for cell in cells):
            words = "the table or the label of this answer is gone; hand in a file that has it"
            return Mark(asked.name, asked.points, 0.0, GONE, words)
        # An engine calculates the whole workbook several times over: only where nothing else can.
        if any(cell.status == UNREADABLE for cell in cells):
            found = self._recalculated(self.addresses, asked.name)
            cells = [_decided(cell, found) for cell in cells]
        return self._marked(asked, cells)

    def _read(self, name: str, step: int) -> AnswerCell | None:
        address = self.addresses.of(name, step)
        if address is None:
            return None
        content = self.book.sheets[address[0]].get(address[1:])
        if content is None or content == "":
            return AnswerCell(step, address, EMPTY)
        if not isinstance(content, Formula):
            words = "a text stands where a formula is asked for"
            return AnswerCell(step, address, TYPED, words=words if isinstance(content, str) else "")
        try:
            meaning = self._interpreter.meaning(address, step)
        except ForbiddenError as error:
            return AnswerCell(step, address, REFUSED, words=str(error))
        except FormulaError as error:
            return AnswerCell(step, address, UNREADABLE, words=str(error))
        lagged = as_lags(meaning.expression, step) if meaning.fixed_rows else meaning.expression
        # D$5 filled down reads one cell in every row. As a lag it is another formula in each of
        # them, and right only in the row where that lag is the key's.
        own_row = asks_for_its_row(self._model, lagged)
        # A formula that asks for its own row is another function in every row.
        key = (name, lagged, step if own_row else self._rule(name, step), own_row)
        if key not in self._verdicts:
            self._verdicts[key] = self._judged(name, AnswerCell(step, address, WRONG, lagged))
        status, words = self._verdicts[key]
        expression = None if status in (UNREADABLE, TYPED) else meaning.expression
        return AnswerCell(step, address, status, expression, meaning.fixed_rows, words)

    def _rule(self, name: str, step: int) -> int:
        """Number of the rule that holds in a step: a start value, or the general one."""
        if name not in self._starts:
            scalar = name in self._model.derived_scalars
            self._starts[name] = 0 if scalar else len(self._model.column(name).start)
        return min(step, self._starts[name])

    def _judged(self, name: str, cell: AnswerCell) -> tuple[str, str]:
        # At random samples a column is not computed, so that its sum there would mean nothing.
        if cell.expression.has(Aggregate):
            return UNREADABLE, "it takes a whole column"
        if not cell.expression.free_symbols and self._reads_nothing(cell):
            return TYPED, ""
        if farthest(cell.expression) > FARTHEST:
            return WRONG, ""
        if repeated := self._repeats(name, cell):
            return WRONG, f"{repeated} repeats the answer; derive it"
        steps = judged_in(self._model, name, cell.step, cell.expression)
        right = all(is_right(self._sampler, name, step, cell.expression) for step in steps)
        if right and asks_for_its_row(self._model, cell.expression):
            own = OwnNumbers(self._own.parameters)  # only with these is a time met exactly
            right = answer_key(self._sampler, name, cell.step).same(cell.expression, own)
        return RIGHT if right else WRONG, ""

    def _repeats(self, name: str, cell: AnswerCell) -> str:
        """A column that hides the answer's own formula, if this one reads it unlike the key."""
        key = answer_key(self._sampler, name, cell.step).key
        given = columns_read(cell.expression) - columns_read(key)
        return next((column for column in self._exercise.veiled if column in given), "")

    def _reads_nothing(self, cell: AnswerCell) -> bool:
        return not parsed(content_of(self.book, cell))[1]

    # -- from cells to a mark --------------------------------------------------------------

    def _marked(self, asked: Question, cells: list[AnswerCell]) -> Mark:
        right = [c for c in cells if c.status == RIGHT]
        rest = [c for c in cells if c.status != RIGHT]
        if not rest:
            return Mark(asked.name, asked.points, float(asked.points), RIGHT, "")
        group = _largest_group(rest, lambda cell: self._rule(asked.name, cell.step))
        status, words, fingerprint = self._diagnosis(asked.name, group, rest)
        # Half of the points are for an answer that is nearly one formula, not for a lucky row.
        if CREDIT.get(status) and 2 * (len(group) + len(right)) <= len(cells):
            status, words = WRONG, PLAIN_WORDS[WRONG]
        if right:
            words = f"right in {rows_of(right)}; {not_in(self.book, rest, right)}: {words}"
            status = PARTLY if len(right) >= len(rest) else status
        elif status == EMPTY:
            words = ""  # the status says it
        score = asked.points * CREDIT.get(status, 0.0)
        return Mark(asked.name, asked.points, score, status, words, fingerprint)

    def _diagnosis(
        self, name: str, group: list[AnswerCell], rest: list[AnswerCell]
    ) -> tuple[str, str, str]:
        """Status, words and fingerprint of the most frequent kind of cell that is not right."""
        culprit = group[0]
        if culprit.expression is None:
            typed = culprit.status == TYPED
            fingerprint = self._typed_fingerprint(name, group) if typed else ""
            return culprit.status, culprit.words or PLAIN_WORDS[culprit.status], fingerprint
        if _numbers_in_disguise(rest):
            return TYPED, "another number stands in every row; it moves with no parameter", ""
        expression = culprit.expression
        if culprit.fixed:
            expression = as_lags(expression, culprit.step)
        if culprit.words:
            return WRONG, culprit.words, ""
        steps = tuple(judged_in(self._model, name, culprit.step, expression))
        status, words, fingerprint = diagnose(self._sampler, name, steps, expression, self._own)
        if words == PLAIN_WORDS[WRONG]:
            circle = circular_reference(self._interpreter, self.addresses, name, culprit.step)
            words = f"it goes in a circle: {' -> '.join(circle)}" if circle else words
        if status == WRONG and culprit.fixed and len(rest) > 1:
            words = f"every row refers to {fixed_row(self.book, self.addresses, culprit)}; {words}"
        return status, words, fingerprint

    def _typed_fingerprint(self, name: str, group: list[AnswerCell]) -> str:
        """Equal numbers in the files of two students, whose data differ, were not computed."""
        found = [content_of(self.book, cell) for cell in group]
        return digest_of(name, [f"{v:.9g}" if isinstance(v, float) else str(v) for v in found])


def _decided(cell: AnswerCell, found: dict[int, bool]) -> AnswerCell:
    if cell.status != UNREADABLE or cell.step not in found:
        return cell
    if found[cell.step]:
        return AnswerCell(cell.step, cell.address, RIGHT)
    words = f"recalculated, since {cell.words}: other values than the key"
    return AnswerCell(cell.step, cell.address, WRONG, words=words)


def as_lags(expression: Basic, step: int) -> Basic:
    """The same cells as rows above ``step``: ``x[3]`` is ``x[t - 1]`` in step 4."""
    cells = {c for c in expression.atoms(Indexed) if c.indices[0].is_Integer}
    return expression.xreplace({c: c.base[t - (step - int(c.indices[0]))] for c in cells})


def farthest(expression: Basic) -> int:
    """How many rows away the farthest cell is that an expression reads."""
    return max((abs(int(lag(c))) for c in expression.atoms(Indexed)), default=0)


def _largest_group(
    rest: list[AnswerCell], rule_of: Callable[[AnswerCell], int]
) -> list[AnswerCell]:
    """Cells with the same formula under the same rule; of equally many those of the later rule."""
    groups: dict[tuple, list[AnswerCell]] = {}
    for cell in rest:
        key = (cell.status, cell.expression, cell.words, rule_of(cell))
        groups.setdefault(key, []).append(cell)
    return max(groups.items(), key=lambda group: (len(group[1]), group[0][-1]))[1]


def _numbers_in_disguise(rest: list[AnswerCell]) -> bool:
    """Whether rows differ in nothing but their numbers: pasted values with something around."""
    found = {c.expression for c in rest if c.expression is not None}
    if len(found) < 4 or 2 * len(found) <= len(rest):
        return False
    shapes = Counter(NUMBER.sub("#", str(e)) for e in found)
    return 2 * shapes.most_common(1)[0][1] > len(found)
