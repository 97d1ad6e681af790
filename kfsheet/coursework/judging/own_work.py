"""Whether an answer with the right values is computed from itself, or copied."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from math import inf

from kfsheet.coursework.judging.answer_rows import AnswerCell
from kfsheet.coursework.judging.calculated_answers import CalculatedAnswers
from kfsheet.coursework.judging.dependencies import closed, delays
from kfsheet.coursework.judging.model_runs import ModelRuns
from kfsheet.coursework.judging.precedents import circle_in_words, quantities_named
from kfsheet.coursework.judging.rearrangements import rearrangements
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book


class OwnWork:
    """Looks at the answers of one workbook."""

    def __init__(
        self, runs: ModelRuns, book: Book, addresses: CellAddresses, calculated: CalculatedAnswers
    ) -> None:
        self._runs, self._model = runs, runs.model
        self._book, self._addresses, self._calculated = book, addresses, calculated

    def objection(self, name: str, right: list[AnswerCell]) -> str:
        """Words, if an answer with the right values is computed from itself, or copied."""
        ends = {right[n].step: right[n] for n in (0, len(right) // 2, -1)}.values()
        for cell in right if any(self._mentions_itself(name, cell) for cell in ends) else ends:
            if words := self._circle(name, cell):
                return words
        return next(filter(None, (self._repeats(name, cell) for cell in ends)), "")

    def _follows(self, name: str, cell: AnswerCell) -> Callable[[str, int], bool]:
        after = delays(self._model, name)
        return lambda other, step: step - cell.step >= after.get(other, inf)

    def _mentions_itself(self, name: str, cell: AnswerCell) -> bool:
        """Whether the text of a formula names a cell that follows from it, used or not."""
        follows = self._follows(name, cell)
        return any(
            follows(*role) for role in quantities_named(self._book, self._addresses, cell.address)
        )

    def _circle(self, name: str, cell: AnswerCell) -> str:
        if not self._calculated.reads(self._follows(name, cell), cell.address):
            return ""
        # Who reads the analysis for the innovation may have written the analysis without it.
        if self._calculated.works(name, cell.step, cell.address):
            return ""
        return (
            circle_in_words(self._book, cell.address)
            or "it goes in a circle: it needs its own result"
        )

    def circles(self, right: Mapping[str, AnswerCell]) -> dict[str, str]:
        """Words by name, for answers that are each right and lean on each other.

        ``right`` has a cell of each answer. Whoever reads another one from which the key does not
        follow in its row has closed the circle.
        """
        reads = {name: self._answers_read(name, cell, right) for name, cell in right.items()}
        reached = {name: closed(reads, reads[name]) for name in reads}
        return {
            name: f"it goes in a circle with {other}, which needs {name}"
            for name in right
            for other in sorted(reads[name])
            if name in reached[other] and self._leans(name, right[name], other)
        }

    def _leans(self, name: str, cell: AnswerCell, other: str) -> bool:
        """Whether an answer needs another one, or what follows from that, and the key does not."""
        after = delays(self._model, other)
        return after.get(name, inf) > 0 and self._calculated.reads(
            lambda n, step: step - cell.step >= after.get(n, inf), cell.address
        )

    def _answers_read(
        self, name: str, cell: AnswerCell, right: Mapping[str, AnswerCell]
    ) -> set[str]:
        """Other answers of the same row that a formula names, or names what follows from them."""
        named = {
            role for role, step in quantities_named(self._book, self._addresses, cell.address)
            if step == cell.step or role not in self._model.table
        }  # fmt: skip
        return {
            other
            for other in right
            if other != name and any(delays(self._model, other).get(n, inf) <= 0 for n in named)
        }

    def _repeats(self, name: str, cell: AnswerCell) -> str:
        """Words, if the answer is a given quantity in other words."""
        known = rearrangements(self._runs)
        # What follows for few answers is looked for only if there is something to ask of it.
        if not self._needs(known.strangers(name), cell):
            return ""
        forbidden = sorted(known.forbidden(name))
        if not self._needs(forbidden, cell):
            return ""
        culprit = next((n for n in forbidden if self._needs([n], cell)), forbidden[0])
        return f"{culprit} repeats the answer; derive it"

    def objection_by_text(self, name: str, cell: AnswerCell) -> str:
        """The same for a formula that only an engine can calculate: from what its text names."""
        named = {n for n, _ in quantities_named(self._book, self._addresses, cell.address)}
        repeats = sorted(named & rearrangements(self._runs).forbidden(name))
        return f"{repeats[0]} repeats the answer; derive it" if repeats else ""

    def _needs(self, names: Collection[str], cell: AnswerCell) -> bool:
        """Whether an answer needs one of some columns and scalars."""
        return bool(names) and self._calculated.needs(lambda n, _: n in names, cell.address)
