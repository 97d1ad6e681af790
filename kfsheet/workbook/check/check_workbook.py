"""Does a workbook compute what NumPy computes, from the parameters and data that stand in it?

The file is recalculated from nothing, as it stands and with other inputs; which, and what that
finds, stands in :mod:`kfsheet.workbook.check.trials`. What "agrees" means, and how the cell that is
wrong is told from those that follow from it, stands in :mod:`kfsheet.workbook.check.comparison`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from kfsheet.model.exercise import Exercise
from kfsheet.parsing.references import Address
from kfsheet.workbook.check.frozen_figures import built_from
from kfsheet.workbook.check.opened_workbook import (
    Inputs,
    OpenedWorkbook,
    inputs_in,
    layout_of,
    place,
)
from kfsheet.workbook.check.trials import Foreseen, compared, foreseen, trials_of
from kfsheet.workbook.write.check_sheet import TOLERANCE, probes
from kfsheet.workbook.write.run import Run


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
    book = OpenedWorkbook(path, engine)
    return check(book, exercise, foreseen(book, exercise))


def check(book: OpenedWorkbook, exercise: Exercise, ahead: Foreseen) -> Report:
    """Compare a workbook that is open in an engine; see :func:`check_workbook`.

    ``ahead`` is what :func:`foreseen` gave. The file may hold other inputs, and may have been built
    from others still; see :mod:`kfsheet.workbook.check.frozen_figures`.
    """
    inputs = inputs_in(book, layout_of(book, exercise))
    same, now = inputs == ahead.inputs, ahead.run
    if not same and any(_changed(inputs, now, now)):
        now = Run.of(exercise.model, inputs.data, inputs.parameters)
    built = built_from(book, inputs, ahead.run, now)
    if same and built is ahead.run:
        trials = ahead.trials
    else:
        trials = trials_of(book, exercise, inputs, now, built)
    first, *others = compared(book, trials)
    found, differing = first.expected.problems, set(first.expected.differing)
    for trial in others:
        problems = trial.expected.problems.items()
        told = {address: f"{reason} ({trial.words})" for address, reason in problems}
        found, differing = {**told, **found}, differing | set(trial.expected.differing)
    return Report(
        book.path,
        book.engine_name,
        first.expected.cells,
        first.expected.largest,
        list(_changed(inputs, now, built)),
        _in_order(found, book.package.titles),
        len(differing - set(found)),
    )


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
