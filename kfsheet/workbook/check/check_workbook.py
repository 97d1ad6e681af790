"""Does a workbook compute what NumPy computes, from the parameters and data that stand in it?

:func:`check_workbook` tells it from top to bottom. A workbook is calculated as it stands and, with
:mod:`~kfsheet.workbook.check.other_inputs`, up to three times more; what "agrees" means, and how
the cell that is wrong is told from those that follow from it, stands in
:mod:`~kfsheet.workbook.check.comparison`.

An engine needs about as long as NumPy and we do. So it is asked one question ahead, and whatever
can be found without its answer is found while it works.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from kfsheet.errors import DataError, EngineError, MissingEngineError, ModelError
from kfsheet.model.exercise import Exercise
from kfsheet.parsing.references import Address
from kfsheet.workbook.check.comparison import Comparison
from kfsheet.workbook.check.frozen_figures import built_from
from kfsheet.workbook.check.opened_workbook import (
    Inputs,
    OpenedWorkbook,
    inputs_in,
    layout_of,
    place,
)
from kfsheet.workbook.check.other_inputs import other_inputs
from kfsheet.workbook.check.report import Problem, Report
from kfsheet.workbook.engines.recalculate import ENGINES
from kfsheet.workbook.engines.spreadsheet_engine import UNREAD, Changes, Engine
from kfsheet.workbook.write.check_sheet import FIGURES, TOLERANCE, probes
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.run import Run

UNKNOWN = {
    "ironcalc": ("#NAME?", "#ERROR!", "#N/IMPL!", "#N/A", "#CIRC!", "#VALUE!"),
    "own": (UNREAD,),
    "libreoffice": ("#NAME?", "#VALUE!"),
}
"""What engines show where they do not know a formula, or perhaps know it badly."""
ROUNDED = 5.1e-15  # half of the fifteenth digit

Finder = Callable[[str], Exercise]
"""Finds an exercise by its name, or raises ModelError."""


def check_workbook(
    path: str | Path,
    exercise: Exercise | Finder,
    engine: str = "ironcalc",
    *,
    started: Engine | None = None,
) -> Report:
    """Recalculate a workbook from nothing and compare every formula cell with NumPy.

    Parameters
    ----------
    path : path
        A workbook built from ``exercise``; parameters, photos and other data may be changed, and
        columns inserted.
    exercise : Exercise, or function that finds one by name
        The exercise that it was built from.
    engine : {'ironcalc', 'libreoffice', 'own'}
        Who recalculates; where it cannot open the file or does not know a formula of it, another
        one does, and the report says so.
    started : Engine, optional
        The engine, where :func:`~kfsheet.workbook.engines.recalculate.start_engine` was called
        before: it works while this module is imported.

    Returns
    -------
    Report
        The cells that are wrong, what was changed since the workbook was built, and a verdict.

    Raises
    ------
    ModelError
        If the workbook was built from another exercise.
    WorkbookError
        If the file is no workbook, not one of ours, or lost a sheet, a column or a name.
    DataError
        If a parameter or datum in it is not allowed, or the model has no value for them.
    EngineError
        If the engine is not installed or cannot do its work.
    """
    try:
        report = _checked(path, exercise, engine, started)
    except MissingEngineError:
        raise
    except EngineError as error:
        if engine not in ENGINES:
            raise
        if found := _by_another(path, exercise, engine, str(error)):
            return found
        raise
    if report.holds or not report.unknown:
        return report
    words = f"{ENGINES[engine]} does not know the formula in {report.unknown[0]}"
    found = _by_another(path, exercise, engine, words)
    same = found and {p.address for p in found.problems} == {p.address for p in report.problems}
    return found if found and not same else report


def _by_another(
    path: str | Path, exercise: Exercise | Finder, engine: str, instead: str
) -> Report | None:
    """What the first engine finds that opens the workbook and knows all its formulas."""
    from kfsheet.workbook.engines.libreoffice import libreoffice  # it takes long to import

    others = ["own", "libreoffice"] if libreoffice() else ["own"]
    for other in others:
        if other != engine:
            with suppress(EngineError):
                report = _checked(path, exercise, other)
                if not report.unknown:
                    return replace(report, instead=instead)
    return None


def _checked(
    path: str | Path, exercise: Exercise | Finder, engine: str, started: Engine | None = None
) -> Report:
    """What one engine finds."""
    book = OpenedWorkbook(path, engine, started)

    # Most workbooks are as they were built. What is then asked and expected is found while the
    # engine calculates, and thrown away if this one is another.
    guess = _guessed(book, exercise)
    unchanged = guess and _unchanged(book, guess)

    # Here the engine's first answer is waited for.
    exercise = _built_exercise(book, exercise, guess)
    if exercise is not guess:
        unchanged = _unchanged(book, exercise)
    inputs = inputs_in(book, layout_of(book, exercise))
    now = unchanged.run
    if inputs != unchanged.inputs:
        now = Run.of(exercise.model, inputs.data, inputs.parameters)
    built = built_from(book, inputs, unchanged.run, now)
    trials = unchanged.trials
    if inputs != unchanged.inputs or built is not unchanged.run:
        trials = _trials(book, exercise, inputs, now, built)

    as_it_stands, *others = _compared(book, trials)
    problems = dict(as_it_stands.comparison.problems)
    for trial in others:
        for address, reason in trial.comparison.problems.items():
            problems.setdefault(address, f"{reason} ({trial.words})")
    differing = {a for trial in (as_it_stands, *others) for a in trial.comparison.differing}
    return Report(
        path=book.path,
        engine=engine,
        cells=as_it_stands.comparison.cells,
        largest=as_it_stands.comparison.largest,
        changed=list(_changes(inputs, now, built)),
        problems=_in_order(problems, book.package.titles),
        followers=len(differing - set(problems)),
        unknown=[place(a) for a in sorted(problems) if book.value(a) in UNKNOWN[engine]],
    )


# -- which exercise ------------------------------------------------------------------------


def _guessed(book: OpenedWorkbook, exercise: Exercise | Finder) -> Exercise | None:
    """The exercise that a file's properties name; a program that saved it may have lost them."""
    if isinstance(exercise, Exercise):
        return exercise
    with suppress(ModelError):
        return exercise(book.exercise_hint)
    return None


def _built_exercise(
    book: OpenedWorkbook, exercise: Exercise | Finder, guess: Exercise | None
) -> Exercise:
    """The exercise that a cell of the workbook names, which is where it was built from."""
    name = book.exercise_name()
    if guess and guess.name == name:
        return guess
    if isinstance(exercise, Exercise):
        raise ModelError(f"{book.path} was built from {name!r}, not from {exercise.name!r}")
    return exercise(name)


# -- what is asked, and what is expected ---------------------------------------------------


@dataclass
class Trial:
    """One calculation: the numbers put in first, in words too, and what is expected then."""

    words: str
    changes: Changes
    comparison: Comparison


def _trials(
    book: OpenedWorkbook, exercise: Exercise, inputs: Inputs, now: Run, built: Run
) -> Iterator[Trial]:
    """The trials of a workbook that holds some inputs, whose run is ``now``."""

    def expected(run: Run) -> Comparison:
        return Comparison(book, inputs.layout, exercise, run, built)

    yield Trial("", {}, expected(now))
    for words, changes, data, parameters in other_inputs(inputs):
        try:
            run = Run.of(exercise.model, data, parameters)
        except DataError:
            continue  # the model has no value there; the other trials have to do
        yield Trial(words, changes, expected(run))


@dataclass
class Unchanged:
    """What is expected of a workbook that nobody has changed."""

    inputs: Inputs
    run: Run
    trials: Iterator[Trial]


def _unchanged(book: OpenedWorkbook, exercise: Exercise) -> Unchanged:
    """Ask an engine what will be wanted if nobody has changed the workbook; prepare for it."""
    run, layout = Run.of(exercise.model), Layout.standard(exercise.model)
    inputs = Inputs.of(layout, run)
    trials = _trials(book, exercise, inputs, run, run)
    likely = list(itertools.islice(trials, 2))
    for trial in likely:
        book.engine.ask(trial.changes)
    for name, function in itertools.product(exercise.model.table, FIGURES.values()):
        run.figure(function, name)
    for trial in likely:
        trial.comparison.prepare()
    return Unchanged(inputs, run, itertools.chain(likely, trials))


def _compared(book: OpenedWorkbook, trials: Iterator[Trial]) -> Iterator[Trial]:
    """Trials beside what the engine finds; while one is compared, it calculates the next."""
    trial = next(trials)
    while trial:
        following = next(trials, None)
        if following:
            book.engine.ask(following.changes)
        trial.comparison.prepare()
        trial.comparison.compare(book.values_with(trial.changes))
        yield trial
        trial = following


# -- what is reported ----------------------------------------------------------------------


def _changes(inputs: Inputs, now: Run, built: Run) -> Iterator[str]:
    """What a user has changed since the workbook was built, in words."""
    if not built.columns:  # the data are gone; their figures are left
        other = (p for p in probes(inputs.layout, now, built) if not p.difference <= TOLERANCE)
        yield from dict.fromkeys(f"values of {p.name}" for p in other if p.what == "data")
    for name, value in inputs.parameters.items():
        if not _same(value, built.scalars[name]):
            yield f"{name} {built.scalars[name]:g} -> {value:g}"
    for name, series in inputs.data.items() if built.columns else ():
        before = [None if math.isnan(value) else value for value in built.columns[name]]
        if count := sum(not _same(a, b) for a, b in zip(series, before, strict=True)):
            yield f"{count} value{'s' * (count > 1)} of {name}"


def _same(value: float | None, built: float | None) -> bool:
    """Whether nobody changed a number: other programs save 15 or 16 of its 17 digits."""
    if value is None or built is None:
        return value is built
    return math.isclose(value, built, rel_tol=ROUNDED)


def _in_order(problems: dict[Address, str], sheets: list[str]) -> list[Problem]:
    """Problems as the book shows them: sheet by sheet, and there column by column."""

    def key(address: Address) -> tuple[int, int, int]:
        sheet, row, column = address
        return sheets.index(sheet), column, row

    return [Problem(address, problems[address]) for address in sorted(problems, key=key)]
