"""Which typical mistake a wrong formula is: the one that gives the same values in all worlds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import islice, tee

from kfsheet.coursework.judging.calculated_answers import CalculatedAnswers, Outcome, same
from kfsheet.coursework.judging.mistakes.typical_mistakes import typical_mistakes
from kfsheet.coursework.judging.model_runs import ModelRuns
from kfsheet.coursework.judging.original_workbook import original_workbook
from kfsheet.errors import KfsheetError
from kfsheet.parsing.calculator import Formula
from kfsheet.parsing.references import Address

MOST = 400  # mistakes that are tried; a long key has more, likely ones come first
ENOUGH = 2  # worlds in which there must be a number
TOLERANCE = 1e-8


class KnownMistakes:
    """The mistakes of one exercise, printed as formulas and calculated as answers are."""

    def __init__(self, runs: ModelRuns) -> None:
        self._runs, self._model = runs, runs.model
        self._printed: dict[tuple[str, int], Iterator[tuple[str, Formula]]] = {}

    @cached_property
    def _calculated(self) -> CalculatedAnswers:
        original = original_workbook(self._model)
        return CalculatedAnswers(original.book, original.addresses, self._runs.worlds)

    def words(self, name: str, step: int, outcomes: Sequence[Outcome]) -> str:
        """Words for the mistake that gives what a formula gives in a step; "" if none does."""
        seen = [o for o in outcomes if o.world in self._runs.worlds and not o.world.gaps]
        if sum(type(o.found) is float for o in seen) < ENOUGH:
            return ""
        address = original_workbook(self._model).addresses.of(name, step)
        for words, formula in self._formulas(name, step, address):
            if all(self._gives(formula, name, step, address, o) for o in seen):
                return words
        return ""

    def _gives(
        self, formula: Formula, name: str, step: int, address: Address, outcome: Outcome
    ) -> bool:
        try:
            found = self._calculated.outcome(outcome.world, name, step, address, formula).found
        except KfsheetError:
            return False
        size = outcome.world.sizes.get(name, 0.0)
        return same(outcome.found, found, size, TOLERANCE)

    def _formulas(self, name: str, step: int, address: Address) -> Iterator[tuple[str, Formula]]:
        """Words and formulas; printed as they are needed, and kept."""
        scalar = self._model.derived_scalars.get(name)
        rule = 0 if scalar else min(step, len(self._model.column(name).start))
        if (name, rule) not in self._printed:
            self._printed[name, rule] = islice(self._mistakes(name, rule, address), MOST)
        self._printed[name, rule], again = tee(self._printed[name, rule])
        return again

    def _mistakes(self, name: str, rule: int, address: Address) -> Iterator[tuple[str, Formula]]:
        scalar = self._model.derived_scalars.get(name)
        key = (scalar or self._model.column(name)).rules[rule]
        layout, (sheet, row, column) = original_workbook(self._model).layout, address
        for words, mistaken in typical_mistakes(self._model, key):
            try:
                text = layout.formula(mistaken, sheet)(row)
            except KfsheetError:  # too long for a cell
                continue
            yield words, Formula(text, (row, column))
