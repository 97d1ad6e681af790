"""Formulas that cannot be read as mathematics are judged by what a spreadsheet engine computes.

The inputs of an answer, and every column beside it, are replaced by random numbers, the same that
formulas are compared at; an engine calculates the workbook from nothing; and what it finds in the
answer's cells must be what the key gives there. Several times, so that no accident counts.
"""

from __future__ import annotations

import time
from functools import lru_cache
from pathlib import Path

from kfsheet.coursework.judging.answer_key import (
    ERROR,
    answer_key,
    asked_steps,
    difference,
    value_at,
)
from kfsheet.coursework.judging.precise_values import MISSING, Value, exact, is_real
from kfsheet.coursework.judging.random_samples import ALONE, Sample, Sampler
from kfsheet.coursework.judging.recalculation_process import calculated
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.errors import KfsheetError
from kfsheet.workbook.engines.spreadsheet_engine import CellValue, Changes

RUNS = (0, 2, 4, 6, 1, 3)
"""Numbers of the samples: four near the model's own run, two anywhere."""
HUGE = 1e12  # where a column feeds itself with numbers from anywhere, it may grow beyond sense
TOLERANCE = 1e-9  # an engine has doubles, and rounds on the way
SECONDS = 60.0  # of an engine's time for one workbook, all answers together
FEWEST = 3
"""Runs in which an answer must have a number to be called right."""


class Recalculation:
    """Asks an engine about one workbook, as long as its time lasts."""

    def __init__(self, path: Path, sampler: Sampler) -> None:
        self._path, self._sampler, self._left = path, sampler, SECONDS
        self.late = False
        """Whether an answer was not judged because there was no time."""

    def __call__(self, addresses: CellAddresses, name: str) -> dict[int, bool]:
        """Whether each step of an answer has the key's value in every run; {} if none can tell."""
        sampler, began = self._sampler, time.monotonic()
        steps = asked_steps(sampler.model, name)
        cells = {step: addresses.of(name, step) for step in steps}
        samples = [_sample(sampler, number) for number in RUNS]
        trials = [_changes(sampler, addresses, name, sample) for sample in samples]
        try:
            found = calculated(self._path, trials, list(cells.values()), self._left)
        except KfsheetError:
            self.late |= time.monotonic() - began >= self._left
            return {}
        finally:
            self._left = max(1.0, self._left - (time.monotonic() - began))
        good, counts = dict.fromkeys(steps, True), dict.fromkeys(steps, 0)
        for sample, values in zip(samples, found, strict=True):
            live = _Live(sample, dict(zip(steps, values, strict=True)), name)
            for step in steps:
                live.row = step
                wanted = value_at(answer_key(sampler, name, step).key, live)
                far = difference(live.found(step), wanted)
                senseless = is_real(wanted) and abs(wanted) > HUGE
                if far is None or (
                    sample.wild and (ERROR in (live.found(step), wanted) or senseless)
                ):
                    continue
                good[step] &= far <= TOLERANCE
                counts[step] += is_real(wanted)
        return {step: good[step] and counts[step] >= FEWEST for step in steps}


@lru_cache(maxsize=len(RUNS))
def _sample(sampler: Sampler, number: int) -> Sample:
    return Sample(sampler, 0, ALONE, number)


def _changes(sampler: Sampler, addresses: CellAddresses, name: str, sample: Sample) -> Changes:
    """Random numbers for every cell of the model but those of the answer itself."""
    changes: Changes = {}
    model = sampler.model

    def put(address: tuple[str, int, int] | None, value: Value) -> None:
        if address:
            missing = value is None or value is MISSING
            changes.setdefault(address[0], {})[address[1:]] = None if missing else float(value)

    for other in (*model.parameters, *model.derived_scalars):
        if other != name:
            put(addresses.of(other), sample(other, 0))
    for column in model.table.values():
        if column.name != name:
            for step in range(model.rows):
                put(addresses.of(column.name, step), sample(column.name, step))
    return changes


class _Live:
    """A sample in which the answer's own column holds what the engine found."""

    wild = gaps = False

    def __init__(self, sample: Sample, values: dict[int, CellValue], name: str) -> None:
        self._sample, self._values, self._name = sample, values, name
        self.row = 0

    def __call__(self, name: str, row: int) -> Value:
        return self.found(row) if name == self._name else self._sample(name, row)

    def found(self, step: int) -> Value | str:
        """What the engine found in a cell of the answer."""
        value = self._values.get(step)
        if isinstance(value, bool) or (isinstance(value, str) and value.startswith("#")):
            return ERROR
        return exact(value) if isinstance(value, int | float) else MISSING
