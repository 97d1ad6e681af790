"""Marks: what each answer of a workbook is worth, and what kind of mistake is in it.

Every row's own formula is calculated in its own row, in several runs of the model and with the
student's own numbers; it is right if it gives the key's value in all of them and needs nothing that
follows from it. A formula that we cannot calculate is handed to ``recalculated``, which asks a
spreadsheet engine. What is wrong gets a name from :mod:`kfsheet.coursework.judging.diagnosis`.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

from openpyxl.utils import FORMULAE

from kfsheet.coursework.judging.answer_key import asked_steps
from kfsheet.coursework.judging.answer_rows import AnswerCell, content_of, not_in, rows_of
from kfsheet.coursework.judging.calculated_answers import CalculatedAnswers
from kfsheet.coursework.judging.circular_references import (
    circular_reference,
    quantities_named,
)
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
    Diagnosis,
    digest_of,
)
from kfsheet.coursework.judging.formula_meaning import Interpreter, forbidden
from kfsheet.coursework.judging.model_runs import ModelRuns
from kfsheet.coursework.judging.random_samples import OwnNumbers, Sampler
from kfsheet.coursework.judging.rearrangements import rearrangements
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.coursework.reading.worksheet import Formula
from kfsheet.errors import ForbiddenError, KfsheetError
from kfsheet.model.exercise import Question
from kfsheet.model.recurrence import Recurrence
from kfsheet.parsing.calculator import TooMuchWorkError
from kfsheet.parsing.references import relative_key

CREDIT = {RIGHT: 1.0, HARD_CODED: 0.5, PARTLY: 0.5, GAPS: 0.5, NEARLY: 0.5}
"""Share of the points by status; what is not listed gets none."""
NUMBER = re.compile(r"\{[^}]*\}|(?<![\w.])\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")  # {row,column} is none
FORMULA = "formula"  # a cell that is not judged yet
UNKNOWN = re.compile(r"the function (\S+) is not known")
GIVEN_UP = "given up: "
FEW = 40  # rows of one formula that are all calculated; of more, those at which something changes


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
"""Right or wrong by step, found by a spreadsheet engine, of the answer of that name; steps about
which no engine can tell are left out."""


class Judge:
    """Judges one workbook."""

    def __init__(
        self,
        runs: ModelRuns,
        sampler: Sampler,
        book: Book,
        own: OwnNumbers,
        recalculated: Recalculated,
    ) -> None:
        self._exercise, self._model, self._sampler = runs.exercise, runs.model, sampler
        self._runs = runs
        self.book, self._recalculated = book, recalculated
        self.addresses = CellAddresses.find(book, runs.model)
        self._calculated = CalculatedAnswers(book, self.addresses, runs, own)
        self._interpreter = Interpreter(book, self.addresses)
        self._diagnosis = Diagnosis(book, self.addresses, self._interpreter, sampler, own)

    def marks(self) -> list[Mark]:
        """One mark for each question."""
        return [self._mark(asked) for asked in self._exercise.questions]

    def _mark(self, asked: Question) -> Mark:
        cells = [self._found(asked.name, step) for step in asked_steps(self._model, asked.name)]
        if any(cell is None for cell in cells):
            words = "the table or the label of this answer is gone; hand in a file that has it"
            return Mark(asked.name, asked.points, 0.0, GONE, words)
        self._calculated.begin()
        judged = {c.step: c for group in _alike(cells) for c in self._judged(asked.name, group)}
        cells = [judged.get(cell.step, cell) for cell in cells]
        # An engine calculates the whole workbook several times over: only where nothing else can.
        if any(_may_be_known(cell) for cell in cells):
            found = self._recalculated(self.addresses, asked.name)
            cells = [self._own_work(asked.name, _decided(c, found), c) for c in cells]
        return self._marked(asked, cells)

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
        if self._calculated.is_formula(address):
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
        statuses = {cell.status for cell in found}
        if len(looked) < len(group) and len(statuses) > 1:
            known = {cell.step: cell for cell in found}
            found = [known.get(c.step) or self._calculate(name, c) for c in group]
        if _only_gaps(found):
            found = [replace(cell, status=WRONG) for cell in found]
        right = [cell for cell in found if cell.status == RIGHT]
        if right and (words := self._not_its_own(name, right)):
            found = [replace(c, status=WRONG, words=words) if c in right else c for c in found]
        yield from found
        steps = {cell.step for cell in found}
        for cell in group:
            if cell.step not in steps:
                yield replace(cell, status=found[0].status, words=found[0].words)

    def _looked_at(self, name: str, group: list[AnswerCell]) -> list[AnswerCell]:
        if len(group) <= FEW:
            return group
        kinds = [self._calculated.kind(cell.address) for cell in group]
        at = {0, 1, 2, 3, len(group) - 2, len(group) - 1}
        at |= set(range(0, len(group), len(group) // 12))
        changes = [n for n, (a, b) in enumerate(pairwise(kinds)) if a != b][:6]
        at |= {n + more for n in changes for more in (0, 1)}
        return [group[n] for n in sorted(at)]

    def _calculate(self, name: str, cell: AnswerCell) -> AnswerCell:
        try:
            outcomes = tuple(self._calculated.outcomes(name, cell.step, cell.address))
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
        try:
            self._interpreter.meaning(cell.address, cell.step)
        except ForbiddenError as error:
            return str(error)
        except Exception:  # whatever else is wrong with it has been said
            return ""
        return ""

    def _not_its_own(self, name: str, right: list[AnswerCell]) -> str:
        """Words, if an answer with the right values is computed from itself, or copied."""
        try:
            for cell in {right[0].step: right[0], right[-1].step: right[-1]}.values():
                if words := self._circle(name, cell):
                    return words
            some = {right[n].step: right[n] for n in (0, len(right) // 2, -1)}
            return next(filter(None, (self._repeats(name, c) for c in some.values())), "")
        except KfsheetError:
            return ""

    def _circle(self, name: str, cell: AnswerCell) -> str:
        if not self._calculated.reads(self._consequences(name, cell.step), cell.address):
            return ""
        # Who reads the analysis for the innovation may have written the analysis without it.
        if self._calculated.works(name, cell.address):
            return ""
        return self._circle_in_words(name, cell) or "it goes in a circle: it needs its own result"

    def _consequences(self, name: str, step: int) -> list[tuple[str, int]]:
        """The cells that follow from an answer in a row, itself included."""
        if name in self._model.derived_scalars:
            found = self._sampler.consequences(name)
            scalars = [(n, 0) for n in found if n in self._model.derived_scalars]
            return scalars + [
                (n, k) for n in found if n in self._model.table for k in range(self._model.rows)
            ]
        later = min(step + 3, self._model.rows)
        own_row = [(n, step) for n in self._sampler.consequences(name)]
        return own_row + [
            (n, k) for n in self._sampler.consequences(name) for k in range(step + 1, later)
        ]

    def _circle_in_words(self, name: str, cell: AnswerCell) -> str:
        circle = circular_reference(self.book, self.addresses, name, cell.step)
        if len(circle) == 2:
            return "the formula refers to its own cell"
        return f"it goes in a circle: {' -> '.join(circle)}" if circle else ""

    def _repeats(self, name: str, cell: AnswerCell) -> str:
        """Words, if the answer is a given quantity in other words."""
        known = rearrangements(self._runs)
        # What follows for few answers is looked for only if there is something to ask of it.
        if not self._reads(known.strangers(name), cell):
            return ""
        forbidden = sorted(known.forbidden(name))
        if not self._reads(forbidden, cell):
            return ""
        culprit = next(n for n in forbidden if self._reads([n], cell))
        return f"{culprit} repeats the answer; derive it"

    def _own_work(self, name: str, cell: AnswerCell, before: AnswerCell) -> AnswerCell:
        """A cell that an engine has found right, unless its text names what repeats the answer."""
        if cell is before or cell.status != RIGHT:
            return cell
        named = quantities_named(self.book, self.addresses, cell.address)
        repeats = sorted(named & rearrangements(self._runs).forbidden(name))
        words = f"{repeats[0]} repeats the answer; derive it" if repeats else ""
        return replace(cell, status=WRONG, words=words) if repeats else cell

    def _reads(self, names: list[str], cell: AnswerCell) -> bool:
        """Whether an answer needs one of some columns and scalars, be it behind an IFERROR."""
        cells = list(_rows(names, self._model))
        known = self._calculated
        return bool(cells) and (
            known.reads(cells, cell.address) or known.follows(cells, cell.address)
        )

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

    def _shape(self, cell: AnswerCell) -> tuple | str:
        try:
            return self._interpreter.shape(cell.address, cell.step) if cell.pattern else ""
        except Exception:  # what cannot be read as mathematics may be filled down all the same
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
            return TYPED, "another number stands in every row; it moves with no parameter", ""
        if culprit.words:
            return WRONG, culprit.words, ""
        status, words, fingerprint = self._diagnosis.of(name, group, len(rest) > 1)
        if status == WRONG and (words == PLAIN_WORDS[WRONG] or "recalculated" in words):
            words = self._circle_in_words(name, culprit) or words
        return status, words, fingerprint

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


def _rows(names: list[str], model: Recurrence) -> Iterator[tuple[str, int]]:
    """All cells of columns and scalars."""
    columns = model.table
    return ((n, step) for n in names for step in range(model.rows if n in columns else 1))


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
    known = not unknown or unknown[1] in FORMULAE
    return cell.status == UNREADABLE and known and not cell.words.startswith(GIVEN_UP)


def _decided(cell: AnswerCell, found: dict[int, bool]) -> AnswerCell:
    if cell.status != UNREADABLE or cell.step not in found:
        return cell
    if found[cell.step]:
        return replace(cell, status=RIGHT, words="")
    words = f"recalculated, since {cell.words}: other values than the key"
    return replace(cell, status=WRONG, words=words)


def _numbers_in_disguise(rest: list[AnswerCell]) -> bool:
    """Whether rows differ in nothing but their numbers: pasted values with something around."""
    found = {c.pattern.partition(": ")[2] for c in rest if c.status == WRONG}
    if len(found) < 4 or 2 * len(found) <= len(rest):
        return False
    shapes = Counter(NUMBER.sub(lambda m: m[0] if m[0][0] == "{" else "#", p) for p in found)
    return 2 * shapes.most_common(1)[0][1] > len(found)
