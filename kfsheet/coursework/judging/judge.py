"""Marks: what each answer of a workbook is worth, and what kind of mistake is in it.

Every row's own formula is calculated in its own row, in several runs of the model and with the
student's own numbers; it is right if it gives the key's value in all of them and needs nothing
that follows from it. A formula that we cannot calculate is handed to ``recalculated``, which asks a
spreadsheet engine. What is wrong gets a name in :mod:`kfsheet.coursework.judging.mistakes`.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from openpyxl.utils import FORMULAE

from kfsheet.coursework.judging.answer_rows import (
    AnswerCell,
    content_of,
    looked_at,
    not_in,
    rows_of,
    shape,
)
from kfsheet.coursework.judging.calculated_answers import CalculatedAnswers
from kfsheet.coursework.judging.mistakes.diagnosis import (
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
    Diagnosis,
    digest_of,
)
from kfsheet.coursework.judging.mistakes.known_mistakes import KnownMistakes
from kfsheet.coursework.judging.model_runs import ModelRuns, OwnNumbers, World
from kfsheet.coursework.judging.own_work import OwnWork
from kfsheet.coursework.judging.precedents import (
    forbidden_precedent,
)
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.formula_text import forbidden
from kfsheet.coursework.reading.submission import Book
from kfsheet.coursework.time_limit import OutOfTimeError, time_limit
from kfsheet.errors import ForbiddenError, KfsheetError
from kfsheet.model.exercise import Question, asked_steps
from kfsheet.parsing.calculator import Formula, TooMuchWorkError
from kfsheet.parsing.references import relative_key

CREDIT = {RIGHT: 1.0, HARD_CODED: 0.5, PARTLY: 0.5, GAPS: 0.5, NEARLY: 0.5}
"""Share of the points by status; what is not listed gets none."""
NUMBER = re.compile(r"\{[^}]*\}|(?<![\w.])\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")  # {row,column} is none
FORMULA = "formula"  # a cell that is not judged yet
UNKNOWN = re.compile(r"the function (\S+) is not known")
NEWER = frozenset(
    "ACOT ACOTH ARABIC ARRAYTOTEXT BASE BINOM.DIST.RANGE BITAND BITLSHIFT BITOR BITRSHIFT BITXOR "
    "CEILING.MATH CEILING.PRECISE COMBINA COT COTH CSC CSCH DAYS DECIMAL FLOOR.MATH FLOOR.PRECISE "
    "FORECAST.LINEAR FORMULATEXT GAMMA GAUSS IMCOSH IMCOT IMCSC IMCSCH IMSEC IMSECH IMSINH IMTAN "
    "ISFORMULA ISO.CEILING ISOWEEKNUM MUNIT NUMBERVALUE PDURATION PERMUTATIONA PHI RRI SEC SECH "
    "SHEET SHEETS SKEW.P UNICHAR UNICODE XOR".split()
)
"""Functions since Excel 2010, which openpyxl does not list, that an engine may know."""
GIVEN_UP = "given up: "
FEW = 40  # rows of one formula that are all calculated; of more, those at which something changes
OWN = 2  # worlds in which all rows are: the student's own numbers, and half of the observations


@dataclass(frozen=True)
class Mark:
    """What one question is worth, why, and a fingerprint that equal wrong answers share."""

    name: str
    points: int
    score: float
    status: str
    remark: str
    fingerprint: str = ""
    step: int = 0
    """The first step that is not right; of a right answer, one of those that are alike."""

    formula: str = ""
    """What stands in that step."""

    differs: str = ""
    """The cell of that step, if it is not right."""


Recalculated = Callable[[CellAddresses, str], dict[int, bool]]
"""Right or wrong by step, found by a spreadsheet engine, of the answer of that name; steps about
which no engine can tell are left out."""


class Judge:
    """Judges one workbook."""

    def __init__(
        self,
        runs: ModelRuns,
        mistakes: KnownMistakes,
        book: Book,
        own: OwnNumbers,
        recalculated: Recalculated,
    ) -> None:
        self._exercise, self._model = runs.exercise, runs.model
        self.book, self._recalculated = book, recalculated
        self.addresses = CellAddresses.find(book, runs.model)
        worlds = (*runs.own_worlds(own), *runs.worlds)
        self.calculated = CalculatedAnswers(book, self.addresses, worlds)
        self._own_work = OwnWork(runs, book, self.addresses, self.calculated)
        self._diagnosis = Diagnosis(book, self.addresses, self.calculated, runs, mistakes, own)

    def marks(self) -> list[Mark]:
        """One mark for each question."""
        marks = [self._mark_or_reason(asked) for asked in self._exercise.questions]
        circles = self._own_work.circles(
            {m.name: self._found(m.name, m.step) for m in marks if m.status == RIGHT}
        )
        return [
            replace(m, score=0.0, status=WRONG, remark=circles[m.name]) if m.name in circles else m
            for m in marks
        ]

    def _mark_or_reason(self, asked: Question) -> Mark:
        try:
            return self._mark(asked)
        except (Exception, OutOfTimeError) as error:  # a defect of ours costs one answer only
            words = f"judging it failed ({type(error).__name__}: {error}); look at it by hand"
            return Mark(asked.name, asked.points, 0.0, UNREADABLE, words)

    def _mark(self, asked: Question) -> Mark:
        cells = [self._found(asked.name, step) for step in asked_steps(self._model, asked.name)]
        if any(cell is None for cell in cells):
            words = "the table or the label of this answer is gone; hand in a file that has it"
            return Mark(asked.name, asked.points, 0.0, GONE, words)
        self.calculated.begin()
        judged = {c.step: c for group in _alike(cells) for c in self._judged(asked.name, group)}
        cells = [judged.get(cell.step, cell) for cell in cells]
        # An engine calculates the whole workbook several times over: only where nothing else can.
        if any(_may_be_known(cell) for cell in cells):
            found = self._recalculated(self.addresses, asked.name)
            cells = [self._decided(asked.name, cell, found) for cell in cells]
        first = next((cell for cell in cells if cell.status != RIGHT), None)
        return replace(self._marked(asked, cells), **looked_at(self.book, cells, first))

    def _found(self, name: str, step: int) -> AnswerCell | None:
        """What stands in a cell, by its kind."""
        address = self.addresses.of(name, step)
        if address is None:
            return None
        content = self.book.sheets[address[0]].get(address[1:])
        if isinstance(content, Formula):
            if words := forbidden(content.text):
                return AnswerCell(step, address, REFUSED, f"{words} is not allowed")
            rule = self._rule(name, step)
            pattern = f"{rule}: {relative_key(content.text, content.host)}"
            # An array formula stands in one cell and fills others: each is judged by itself.
            return AnswerCell(step, address, FORMULA, "", pattern)
        if self.calculated.is_formula(address):
            return AnswerCell(step, address, FORMULA, "", f"{self._rule(name, step)}: array")
        if content is None or content == "":
            return AnswerCell(step, address, EMPTY)
        words = "a text stands where a formula is asked for" if isinstance(content, str) else ""
        return AnswerCell(step, address, TYPED, words)

    def _rule(self, name: str, step: int) -> int:
        """Number of the rule that holds in a step: a start value, or the general one."""
        column = self._model.table.get(name)
        return min(step, len(column.start)) if column else 0

    # -- right or not ----------------------------------------------------------------------

    def _judged(self, name: str, group: list[AnswerCell]) -> Iterator[AnswerCell]:
        """The cells of one formula, judged."""
        looked = self._looked_at(name, group)
        found = [self._calculate(name, cell) for cell in looked]
        if len(looked) < len(group):
            found = self._with_the_rest(name, group, found)
        if _only_gaps(found):
            found = [replace(cell, status=WRONG) for cell in found]
        right = [cell for cell in found if cell.status == RIGHT]
        if right and (words := self._own_work.objection(name, right)):
            found = [replace(c, status=WRONG, words=words) if c in right else c for c in found]
        yield from found
        steps = {cell.step for cell in found}
        for cell in group:
            if cell.step not in steps:
                yield replace(cell, status=found[0].status, words=found[0].words)

    def _with_the_rest(
        self, name: str, group: list[AnswerCell], found: list[AnswerCell]
    ) -> list[AnswerCell]:
        """Those of which some were found alike, and all others that may differ."""
        known = {cell.step: cell for cell in found}
        others = [cell for cell in group if cell.step not in known]
        statuses = {cell.status for cell in found}
        if statuses == {RIGHT}:  # every row as the student sees it, with and without observations
            own = self.calculated.worlds[:OWN]
            others = [c for c in others if self._calculate(name, c, own).status != RIGHT]
        elif len(statuses) == 1:
            others = []
        return found + [self._calculate(name, cell) for cell in others]

    def _looked_at(self, name: str, group: list[AnswerCell]) -> list[AnswerCell]:
        if len(group) <= FEW:
            return group
        kinds = [self.calculated.kind(name, cell.step) for cell in group]
        at = {0, 1, 2, 3, len(group) - 2, len(group) - 1}
        at |= set(range(0, len(group), len(group) // 12))
        changes = [n for n, (a, b) in enumerate(pairwise(kinds)) if a != b][:6]
        at |= {n + more for n in changes for more in (0, 1)}
        return [group[n] for n in sorted(at)]

    def _calculate(
        self, name: str, cell: AnswerCell, worlds: Sequence[World] | None = None
    ) -> AnswerCell:
        try:
            with time_limit(self.calculated.time_left()):
                outcomes = tuple(self.calculated.outcomes(name, cell.step, cell.address, worlds))
        except OutOfTimeError:
            return replace(cell, status=UNREADABLE, words=f"{GIVEN_UP}calculating takes too long")
        except ForbiddenError as error:
            return replace(cell, status=REFUSED, words=str(error))
        except TooMuchWorkError as error:
            return replace(cell, status=UNREADABLE, words=f"{GIVEN_UP}{error}")
        except KfsheetError as error:
            words = self._reaches_out(cell)
            return replace(cell, status=REFUSED if words else UNREADABLE, words=words or str(error))
        except Exception as error:  # a defect of ours costs this answer, not the file
            return replace(cell, status=UNREADABLE, words=f"reading it failed: {error}")
        status = RIGHT if all(o.right for o in outcomes) else WRONG
        return replace(cell, status=status, outcomes=outcomes)

    def _reaches_out(self, cell: AnswerCell) -> str:
        """Words, if a helper cell of a formula holds what no answer may use."""
        words = forbidden_precedent(self.book, self.addresses, cell.address)
        return f"{words} is not allowed" if words else ""

    def _decided(self, name: str, cell: AnswerCell, found: dict[int, bool]) -> AnswerCell:
        """A cell that an engine has judged where we could not."""
        if cell.status != UNREADABLE or cell.step not in found:
            return cell
        if not found[cell.step]:
            words = f"recalculated, since {cell.words}: other values than the key"
            return replace(cell, status=WRONG, words=words)
        words = self._own_work.objection_by_text(name, cell)
        return replace(cell, status=WRONG if words else RIGHT, words=words)

    # -- from cells to a mark --------------------------------------------------------------

    def _marked(self, asked: Question, cells: list[AnswerCell]) -> Mark:
        right = [c for c in cells if c.status == RIGHT]
        rest = [c for c in cells if c.status != RIGHT]
        if not rest:
            return Mark(asked.name, asked.points, float(asked.points), RIGHT, "")
        group = self._largest_group(asked.name, rest)
        status, words, fingerprint = self._diagnosed(asked.name, group, rest)
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

    def _largest_group(self, name: str, rest: list[AnswerCell]) -> list[AnswerCell]:
        """Cells with one formula under one rule; of equally many those of the later rule."""
        groups: dict[tuple, list[AnswerCell]] = {}
        for cell in rest:
            key = (cell.status, self._shape(cell), cell.words, self._rule(name, cell.step))
            groups.setdefault(key, []).append(cell)
        return max(groups.items(), key=lambda group: (len(group[1]), group[0][-1]))[1]

    def _shape(self, cell: AnswerCell) -> Hashable:
        try:
            return shape(self.book, self.addresses, cell) if cell.pattern else ""
        except KfsheetError:  # what cannot be read may be filled down all the same
            return cell.pattern

    def _diagnosed(
        self, name: str, group: list[AnswerCell], rest: list[AnswerCell]
    ) -> tuple[str, str, str]:
        """Status, words and fingerprint of the most frequent kind of cell that is not right."""
        culprit = group[0]
        if culprit.status != WRONG:
            typed = culprit.status == TYPED
            fingerprint = self._typed_fingerprint(name, group) if typed else ""
            return culprit.status, culprit.words or PLAIN_WORDS[culprit.status], fingerprint
        if _numbers_in_disguise(rest):
            return TYPED, "another number stands in every row, in the place of one formula", ""
        if culprit.words:
            return WRONG, culprit.words, ""
        return self._diagnosis.of(name, group, len(rest) > 1)

    def _typed_fingerprint(self, name: str, group: list[AnswerCell]) -> str:
        """Equal numbers in the files of two students, whose data differ, were not computed."""
        found = [content_of(self.book, cell) for cell in group]
        return digest_of(name, [f"{v:.9g}" if isinstance(v, float) else str(v) for v in found])


def _only_gaps(cells: list[AnswerCell]) -> bool:
    """Whether a formula that was filled down is wrong nowhere but among missing observations.

    Where they are missing is chance: that it is right in some of the rows is no merit.
    """
    wrong = [o for cell in cells for o in cell.outcomes if not o.right]
    filled = not re.search(r"\{\d+\$", cells[0].pattern)  # D$5 is another formula in each row
    return filled and bool(wrong) and all(o.world.gaps for o in wrong)


def _alike(cells: list[AnswerCell]) -> list[list[AnswerCell]]:
    """Cells that one formula fills."""
    groups: dict[str, list[AnswerCell]] = {}
    for cell in cells:
        if cell.status == FORMULA:
            groups.setdefault(cell.pattern, []).append(cell)
    return list(groups.values())


def _may_be_known(cell: AnswerCell) -> bool:
    """Whether a spreadsheet engine may calculate what we cannot."""
    unknown = UNKNOWN.search(cell.words)
    known = not unknown or unknown[1] in FORMULAE or unknown[1] in NEWER
    return cell.status == UNREADABLE and known and not cell.words.startswith(GIVEN_UP)


def _numbers_in_disguise(rest: list[AnswerCell]) -> bool:
    """Whether rows differ in nothing but their numbers: pasted values with something around."""
    found = {c.pattern.partition(": ")[2] for c in rest if c.status == WRONG}
    if len(found) < 4 or 2 * len(found) <= len(rest):
        return False
    shapes = Counter(NUMBER.sub(lambda m: m[0] if m[0][0] == "{" else "#", p) for p in found)
    return 2 * shapes.most_common(1)[0][1] > len(found)
