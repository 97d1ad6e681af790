"""What a workbook is asked, and what is expected of it.

It is calculated as it stands and three times more: with every parameter and datum moved by about
one percent, which finds a number typed over a formula, or a parameter's value typed into one, even
while it is still right; and with half of the observations taken out, then with the other half,
which finds a formula that no longer asks whether there is one.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from kfsheet.errors import DataError
from kfsheet.model.exercise import Exercise
from kfsheet.parsing.references import Address
from kfsheet.workbook.check.comparison import Comparison
from kfsheet.workbook.check.opened_workbook import Inputs, OpenedWorkbook
from kfsheet.workbook.engines.spreadsheet_engine import Changes
from kfsheet.workbook.write.check_sheet import FIGURES
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.run import Run

NUDGE = 0.01
GOLDEN = (math.sqrt(5) - 1) / 2

Data = dict[str, list[float | None]]


@dataclass
class Trial:
    """One calculation: the numbers put in first, in words too, and the run that is expected."""

    words: str
    changes: Changes
    book: OpenedWorkbook
    exercise: Exercise
    layout: Layout
    run: Run
    built: Run
    """The run that the workbook was built from."""

    @cached_property
    def expected(self) -> Comparison:
        """What is expected, beside what the engine finds."""
        return Comparison(self.book, self.layout, self.exercise, self.run, self.built)


def trials_of(
    book: OpenedWorkbook, exercise: Exercise, inputs: Inputs, now: Run, built: Run
) -> Iterator[Trial]:
    """The trials of a workbook that holds some inputs, whose run is ``now``."""
    yield Trial("", {}, book, exercise, inputs.layout, now, built)
    for words, changes, data, parameters in _others(inputs):
        try:
            run = Run.of(exercise.model, data, parameters)
        except DataError:
            continue  # the model has no value there; the other trials have to do
        yield Trial(words, changes, book, exercise, inputs.layout, run, built)


def compared(book: OpenedWorkbook, trials: Iterator[Trial]) -> Iterator[Trial]:
    """Trials beside what the engine finds; while one is compared, it calculates the next."""
    trial = next(trials)
    while trial:
        following = next(trials, None)
        if following:
            book.engine.ask(following.changes)
        expected = trial.expected  # found, if it is not yet, while the engine works
        expected.run(book.values_with(trial.changes))
        yield trial
        trial = following


@dataclass
class Foreseen:
    """The trials of a workbook that nobody has changed."""

    inputs: Inputs
    run: Run
    trials: Iterator[Trial]


def foreseen(book: OpenedWorkbook, exercise: Exercise) -> Foreseen:
    """What can be found before the engine has answered; it is told what may be asked next."""
    run, layout = Run.of(exercise.model), Layout.standard(exercise.model)
    inputs = Inputs.of(layout, run)
    trials = trials_of(book, exercise, inputs, run, run)
    likely = list(itertools.islice(trials, 2))
    for trial in likely:
        book.engine.ask(trial.changes)
    for name, function in itertools.product(exercise.model.table, FIGURES.values()):
        run.figure(function, name)
    for trial in likely:
        trial.expected.prepare()
    return Foreseen(inputs, run, itertools.chain(likely, trials))


def _others(inputs: Inputs) -> Iterator[tuple[str, Changes, Data, dict[str, float]]]:
    """Other inputs to calculate with, and what was done to them."""
    changes, data, parameters = _nudged(inputs)
    yield "inputs moved by 1 %", changes, data, parameters
    optional = [n for n in data if inputs.layout.model.table[n].may_be_missing]
    for half in (0, 1) if optional else ():
        emptied = {sheet: dict(cells) for sheet, cells in changes.items()}
        fewer = {name: list(series) for name, series in data.items()}
        for number, name in enumerate(optional):
            for row, (sheet, *cell) in enumerate(inputs.cells(name)):
                if (row + number) % 2 == half:
                    fewer[name][row] = emptied.setdefault(sheet, {})[tuple(cell)] = None
        yield "half of the observations taken out", emptied, fewer, parameters


def _nudged(inputs: Inputs) -> tuple[Changes, Data, dict[str, float]]:
    """Every input a little larger, each by another factor, so that no change hides another."""
    changes: Changes = {}
    factors = (1 + NUDGE * (0.5 + (n * GOLDEN) % 1) for n in itertools.count(1))

    def move(value: float, address: Address) -> float:
        moved = value * next(factors) if value else NUDGE
        changes.setdefault(address[0], {})[address[1:]] = moved
        return moved

    parameters = {n: move(v, inputs.layout.scalars[n]) for n, v in inputs.parameters.items()}
    data = {
        name: [
            None if value is None else move(value, cell)
            for value, cell in zip(series, inputs.cells(name), strict=True)
        ]
        for name, series in inputs.data.items()
    }
    return changes, data, parameters
