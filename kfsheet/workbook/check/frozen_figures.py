"""What a workbook was built from, as the frozen figures of its own sheet "Check" tell.

A student's solution is built from the student's numbers, not from those of the exercise. Its frozen
figures are constants, so that somebody may have changed them; they are believed as far as they
agree with one run of the model.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from kfsheet.errors import DataError
from kfsheet.workbook.check.opened_workbook import Inputs, OpenedWorkbook
from kfsheet.workbook.write.check_sheet import FIGURES, TABLE_ROW, TOLERANCE, VALUE, probes
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.run import Run

Frozen = dict[tuple[str, str], float]
"""Frozen figures by name and kind of figure."""


def frozen_figures(book: OpenedWorkbook) -> Frozen:
    """Every line of the sheet "Check": its name, its kind of figure, and the number at build."""
    cells = book.values["Check"]
    rows = {row for row, _ in cells if row > TABLE_ROW}
    found = {(cells.get((row, 1)), cells.get((row, 3))): cells.get((row, 5)) for row in rows}
    return {key: value for key, value in found.items() if isinstance(value, int | float)}


def built_from(book: OpenedWorkbook, inputs: Inputs, default: Run, now: Run) -> Run:
    """The run that a workbook was built from.

    It is the one that agrees with most of the frozen figures: the exercise as it is
    (``default``), the inputs that stand in the file (``now``), or these with the frozen
    parameters. Where inputs and results both contradict it, data were changed in a file that was
    built from other data; those are gone, and the frozen figures are taken as they stand.
    """
    layout, frozen = inputs.layout, frozen_figures(book)
    # From the likeliest to what costs another run of the model; the first that fits is taken.
    best, fewest = default, _contradictions(layout, default, frozen)
    for candidate in _others(inputs, now, frozen):
        if not fewest:
            break
        counts = _contradictions(layout, candidate, frozen)
        if counts.total() < fewest.total():
            best, fewest = candidate, counts
    return _standing(layout, frozen) if fewest["data"] and fewest["result"] else best


def _others(inputs: Inputs, now: Run, frozen: Frozen) -> Iterator[Run]:
    yield now
    model = inputs.layout.model
    try:
        parameters = {n: p.checked(frozen.get((n, VALUE))) for n, p in model.parameters.items()}
        if parameters != inputs.parameters:
            yield Run.of(model, inputs.data, parameters)
    except DataError:
        return  # somebody froze what cannot be


def _contradictions(layout: Layout, run: Run, frozen: Frozen) -> Counter[str]:
    """How many parameters, data and results of a run are not what is frozen."""
    found: Counter[str] = Counter()
    for line in probes(layout, run, run):
        there = frozen.get((line.name, line.quantity))
        if there is None or not abs(there - line.built) <= TOLERANCE * line.scale:
            found[line.what] += 1
    return found


def _standing(layout: Layout, frozen: Frozen) -> Run:
    """A run of which nothing is known but the figures."""
    model, nan = layout.model, float("nan")
    names = {**model.parameters, **model.derived_scalars, **model.summaries}
    scalars = {name: frozen.get((name, VALUE), nan) for name in names}
    figures = {
        (function, name): frozen.get((name, quantity), nan)
        for name in model.table
        for quantity, function in FIGURES.items()
    }
    return Run({}, scalars, figures)
