"""Does a workbook compute what NumPy computes, from the parameters and data that stand in it?

The file is recalculated from nothing, as it stands and three times more: with every parameter and
datum moved by about one percent, which finds a number typed over a formula, or a parameter's value
typed into one, even while it is still right; and with half of the observations taken out, then
with the other half, which finds a formula that no longer asks whether there is one.

What "agrees" means, and how the cell that is wrong is told from those that follow from it, stands
in :mod:`kfsheet.excel.compare`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from kfsheet.errors import DataError
from kfsheet.excel.checkpage import FIGURES, TOLERANCE, probes
from kfsheet.excel.compare import Comparison
from kfsheet.excel.compose import Run
from kfsheet.excel.frozen import built_from
from kfsheet.excel.reading import Inputs, Opened, layout_of, place
from kfsheet.excel.references import Address
from kfsheet.excel.stripping import Changes
from kfsheet.exercise import Exercise

NUDGE = 0.01
GOLDEN = (math.sqrt(5) - 1) / 2

Data = dict[str, list[float | None]]


@dataclass(frozen=True)
class Problem:
    """One cell that is wrong in itself, and why."""

    address: Address
    reason: str

    def __str__(self) -> str:
        return f"{place(self.address)}: {self.reason}"

    def follows(self, other: Problem) -> bool:
        """Whether this is the cell below, with the same reason."""
        sheet, row, column = other.address
        return self.address == (sheet, row + 1, column) and self.reason == other.reason


@dataclass
class Report:
    """What a check found."""

    path: Path
    engine: str
    cells: int
    largest: float
    """Largest relative difference, by the rule above, with the inputs as they stand."""
    changed: list[str]
    problems: list[Problem]
    followers: int
    """How many more cells differ only because they follow from one that is wrong."""

    def lines(self) -> list[str]:
        """The problems in words, neighbours in a column with the same reason as one line."""
        groups: list[list[Problem]] = []
        for problem in self.problems:
            if groups and problem.follows(groups[-1][-1]):
                groups[-1].append(problem)
            else:
                groups.append([problem])
        return [
            str(g[0])
            if len(g) == 1
            else f"{place(g[0].address)} to {place(g[-1].address)}: each {g[0].reason}"
            for g in groups
        ]

    @property
    def holds(self) -> bool:
        """Whether every formula cell agrees."""
        return not self.problems


def check_workbook(path: str | Path, exercise: Exercise, engine: str = "ironcalc") -> Report:
    """Recalculate a workbook from nothing and compare every formula cell with NumPy.

    Parameters
    ----------
    path : path
        A workbook built from ``exercise``; parameters, photos and other data may be changed, and
        columns inserted.
    exercise : Exercise
        The exercise that it was built from.
    engine : {'ironcalc', 'libreoffice'}
        Who recalculates.

    Raises
    ------
    WorkbookError
        If the file is no workbook, not one of ours, or lost a sheet, a column or a name.
    DataError
        If a parameter or datum in it is not allowed, or the model has no value for them.
    EngineError
        If the engine cannot do its work.
    """
    return check(Opened(path, engine), exercise)


def check(book: Opened, exercise: Exercise, built: Run | None = None) -> Report:
    """Compare a workbook that is open in an engine; see :func:`check_workbook`.

    ``built`` is the run of the exercise as it is, if that is prepared. The file may have been built
    from other numbers; see :mod:`kfsheet.excel.frozen`.
    """
    default = built or prepared(exercise)
    layout = layout_of(book, exercise)
    inputs = Inputs(book, layout)
    same = not any(_changed(inputs, default, default))
    now = default if same else Run.of(exercise.model, inputs.data, inputs.parameters)

    @cache
    def origin() -> Run:  # found when it is needed, while the engine works
        return built_from(book, inputs, default, now)

    def expecting(run: Run) -> Comparison:
        return Comparison(book, layout, exercise, run, origin())

    trials = _compared(book, inputs, now, expecting)
    _, first = next(trials)
    found, differing = first.problems, set(first.differing)
    for words, trial in trials:
        told = {address: f"{reason} ({words})" for address, reason in trial.problems.items()}
        found, differing = {**told, **found}, differing | set(trial.differing)
    return Report(
        book.path,
        book.engine_name,
        first.cells,
        first.largest,
        list(_changed(inputs, now, origin())),
        _in_order(found, book.package.titles),
        len(differing - set(found)),
    )


def prepared(exercise: Exercise) -> Run:
    """The run of an exercise with all its figures: what can be found before the engine answers."""
    run = Run.of(exercise.model)
    for name in exercise.model.table:
        for function in FIGURES.values():
            run.figure(function, name)
    return run


def _in_order(found: dict[Address, str], sheets: list[str]) -> list[Problem]:
    """Problems as the book shows them: sheet by sheet, and there column by column."""

    def key(address: Address) -> tuple[int, int, int]:
        sheet, row, column = address
        return sheets.index(sheet), column, row

    return [Problem(address, found[address]) for address in sorted(found, key=key)]


def _changed(inputs: Inputs, now: Run, built: Run) -> Iterator[str]:
    """What a user has changed since the workbook was built, in words."""
    if not built.columns:  # the data are gone; their figures are left
        other = (p for p in probes(inputs.layout, now, built) if not p.difference <= TOLERANCE)
        yield from dict.fromkeys(f"values of {p.name}" for p in other if p.what == "data")
    for name, value in inputs.parameters.items():
        if value != built.scalars[name]:
            yield f"{name} {built.scalars[name]:g} -> {value:g}"
    for name, series in inputs.data.items() if built.columns else ():
        before = [None if math.isnan(value) else value for value in built.columns[name]]
        if count := sum(a != b for a, b in zip(series, before, strict=True)):
            yield f"{count} value{'s' * (count > 1)} of {name}"


def _compared(
    book: Opened, inputs: Inputs, now: Run, expecting: Callable[[Run], Comparison]
) -> Iterator[tuple[str, Comparison]]:
    """Engine and NumPy compared, as the file stands and then with other inputs.

    While numbers are compared, and those prepared that are expected, the engine works.
    """
    words, values, expected = "", book.values, None
    for change, (changes, data, parameters) in _trials(inputs):
        try:
            other = Run.of(inputs.layout.model, data, parameters)
        except DataError:
            continue  # the model has no value there; the other comparisons have to do
        book.engine.ask(changes)
        expected = expected or expecting(now)
        expected.run(values)
        yield words, expected
        words, expected = change, expecting(other)
        values = book.engine.answer()
    expected = expected or expecting(now)
    expected.run(values)
    yield words, expected


def _trials(inputs: Inputs) -> Iterator[tuple[str, tuple[Changes, Data, dict[str, float]]]]:
    """Other inputs to calculate with, and what was done to them."""
    changes, data, parameters = _nudged(inputs)
    yield "inputs moved by 1 %", (changes, data, parameters)
    optional = [n for n in data if inputs.layout.model.table[n].may_be_missing]
    for half in (0, 1) if optional else ():
        emptied = {sheet: dict(cells) for sheet, cells in changes.items()}
        fewer = {name: list(series) for name, series in data.items()}
        for number, name in enumerate(optional):
            for row, (sheet, *cell) in enumerate(inputs.cells(name)):
                if (row + number) % 2 == half:
                    fewer[name][row] = emptied.setdefault(sheet, {})[tuple(cell)] = None
        yield "half of the observations taken out", (emptied, fewer, parameters)


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
