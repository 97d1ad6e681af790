"""A recurrence and one run of it -> the content of every cell, before any file exists.

The same composition is what :mod:`kfsheet.workbook.write.workbook` writes and what
:mod:`kfsheet.workbook.check.check` expects, so that neither can drift from the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from openpyxl.utils import get_column_letter

from kfsheet.evaluation.evaluate import run
from kfsheet.evaluation.numerics import rms
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import Missing
from kfsheet.model.quantities import Column
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.unit_text import pretty_unit
from kfsheet.model.validation import columns_read
from kfsheet.workbook.write.layout import (
    EXERCISE_NAME,
    FIRST_ROW,
    PARAMETER_ROW,
    Layout,
    chart_place,
    quote,
)
from kfsheet.workbook.write.page import Filled, Page, Piece, stored
from kfsheet.workbook.write.styles import LEGEND, number_format

NOT_AVAILABLE = "#N/A"


@dataclass(frozen=True)
class Run:
    """Numbers of one run: columns, scalars (parameters, derived, summaries)."""

    columns: dict[str, list[float]]
    scalars: dict[str, float]
    _figures: dict[tuple[Callable, str], float] = field(default_factory=dict, repr=False)

    def figure(self, function: Callable[[list[float]], float], name: str) -> float:
        """A figure of a column, such as its root mean square, computed once."""
        key = (function, name)
        if key not in self._figures:
            self._figures[key] = function(self.columns[name])
        return self._figures[key]

    @classmethod
    def of(
        cls,
        model: Recurrence,
        data: Mapping[str, Sequence[float]] | None = None,
        parameters: Mapping[str, float] | None = None,
    ) -> Run:
        """Evaluate a model once."""
        columns, scalars, values = run(model, data, parameters)
        return cls(columns, {**values, **scalars})


def section_page(layout: Layout, section: str, now: Run) -> Page:
    """The worksheet of one section."""
    model, columns = layout.model, layout.columns[section]
    step, clock = model.step_of(section), model.clock_of(section)
    page = Page(section, freeze=f"{get_column_letter(2 + len(clock))}{FIRST_ROW}")
    page.heights[3] = 48
    _head(page, columns["t"], step, "", f"number of the {step}", 8)
    page.columns[columns["t"]] = Filled(FIRST_ROW, range(model.rows), "index", "0")
    for column in clock:
        _formula_column(page, layout, column, columns["time"], now)
    for column in model.sections[section]:
        if column.is_data:
            _data_column(page, column, columns[column.name], now)
        else:
            _formula_column(page, layout, column, columns[column.name], now)
    return page


def _head(page: Page, at: int, symbol: str, unit: str, words: str, width: float = 14) -> None:
    page.put(1, at, symbol, "header", align="center")
    page.put(2, at, pretty_unit(unit), "unit", align="center")
    page.put(3, at, words, "words", align="wrap")
    page.widths[at] = width


def _data_column(page: Page, column: Column, at: int, now: Run) -> None:
    _head(page, at, column.name, column.unit, column.description)
    values = now.columns[column.name]
    page.columns[at] = Filled(FIRST_ROW, values, "data", number_format(values))


def _formula_column(page: Page, layout: Layout, column: Column, at: int, now: Run) -> None:
    _head(page, at, column.name, column.unit, column.description)
    values = now.columns[column.name]
    shape, size = number_format(values), now.figure(rms, column.name)
    kind = "formula"
    if column is layout.model.clock:
        kind, shape = "index", "0.0##"
    # A start without a value is an empty cell, not a formula that says so.
    rules = tuple(None if r is Missing else layout.formula(r, page.title) for r in column.rules)
    page.columns[at] = Filled(FIRST_ROW, values, kind, shape, size, rules)


def parameters_page(layout: Layout, now: Run) -> Page:
    """The worksheet of parameters, derived scalars and results."""
    model = layout.model
    page = Page("Parameters", widths={1: 13, 2: 14, 3: 9, 4: 52, 5: 3, 6: 14, 7: 14, 8: 9, 9: 52})
    page.put(1, 1, model.title, "title")
    page.put(2, 1, "Change a value in a yellow cell; every sheet and chart follows.")
    _table(page, PARAMETER_ROW - 1, 1, "Parameters")
    for name, parameter in model.parameters.items():
        _, row, column = layout.scalars[name]
        _line(page, row, column, parameter, Piece(parameter_value(now, name), "parameter"))
    if model.derived_scalars:
        first = min(layout.scalars[name][1] for name in model.derived_scalars)
        _table(page, first - 1, 1, "Derived: formulas of the parameters")
    if model.summaries:
        _table(page, PARAMETER_ROW - 1, 6, "Results: formulas of all rows")
    for name, scalar in {**model.derived_scalars, **model.summaries}.items():
        sheet, row, column = layout.scalars[name]
        value = now.scalars[name]
        text = layout.formula(scalar.expression, sheet)(row)
        sizes = [now.figure(rms, c) for c in columns_read(scalar.expression)]
        piece = Piece(
            text, "formula", stored(value), number_format([value]), "", max(sizes, default=0)
        )
        _line(page, row, column, scalar, piece)
    return page


def parameter_value(now: Run, name: str) -> float | int:
    """A parameter as it is typed: 9, not 9.0."""
    value = now.scalars[name]
    return int(value) if value.is_integer() and abs(value) < 2**53 else value


def _table(page: Page, row: int, column: int, title: str) -> None:
    page.put(row - 1, column, title, "heading")
    for n, word in enumerate(("symbol", "value", "unit", "meaning")):
        page.put(row, column + n, word, "header")


def _line(page: Page, row: int, column: int, item: Any, value: Piece) -> None:
    page.put(row, column - 1, item.name, "index")
    page.pieces[row, column] = value
    page.put(row, column + 1, pretty_unit(item.unit), "unit", align="center")
    page.put(row, column + 2, item.description, "meaning", align="wrap")


def plotted(exercise: Exercise) -> list[tuple[str, str]]:
    """Formula columns on charts that may have no value; a chart would show their "" as 0.

    Each with the column that is 0 where it is not drawn, ``""`` if it has gaps of its own.
    """
    found = {}
    for chart in exercise.charts:
        for name in (n for s in chart.series for n in (s.x, s.y)):
            rules = exercise.model.column(name).rules
            if any(r is not Missing and r.has(Missing) for r in rules):
                found[name, ""] = None
            elif chart.where:
                found[name, chart.where] = None
    return list(found)


PLOTTED_COLUMN = 27  # AA: to the right of the charts


def charts_page(exercise: Exercise, layout: Layout, now: Run) -> Page:
    """The worksheet of charts, with a copy of each column that a chart could misread."""
    page = Page("Charts")
    page.put(1, 1, exercise.title, "title")
    for number, chart in enumerate(exercise.charts):
        page.put(*chart_place(number), chart.note, "note")
    names = plotted(exercise)
    if names:
        page.put(2, 1, "Helper columns for the charts stand from AA on.")
    for at, (name, where) in enumerate(names, PLOTTED_COLUMN):
        column = exercise.model.column(name)
        _head(
            page, at, name, column.unit, f"plotted where {where} is not 0" if where else "plotted"
        )
        page.columns[at] = _plotted(layout, name, where, now)
    return page


def _plotted(layout: Layout, name: str, where: str, now: Run) -> Filled:
    cells, mask = (_cells(layout, n) if n else "" for n in (name, where))

    def rule(row: int) -> str:
        asked = f"ISNUMBER({cells}{row})"
        asked = f"AND({asked},{mask}{row}<>0)" if where else asked
        return f"=IF({asked},{cells}{row},NA())"

    values = now.columns[name]
    if where:
        drawn = zip(values, now.columns[where], strict=True)
        values = [value if shown else math.nan for value, shown in drawn]
    shape, size = number_format(values), rms(values)
    return Filled(FIRST_ROW, values, "formula", shape, size, (rule,), NOT_AVAILABLE)


def _cells(layout: Layout, name: str) -> str:
    """Sheet and letter of a column, as a formula on another sheet reads it."""
    sheet, number = layout.home(name)
    return f"{quote(sheet)}!{get_column_letter(number)}"


def chart_range(exercise: Exercise, layout: Layout, name: str, where: str = "") -> tuple[str, int]:
    """Sheet and column number from which a chart, with its ``where``, takes a column."""
    names = plotted(exercise)
    for copy in ((name, ""), (name, where)):
        if copy in names:
            return "Charts", PLOTTED_COLUMN + names.index(copy)
    return layout.home(name)


CHARACTERS_A_LINE = 130  # of the two columns of "Read me" together


def readme_page(exercise: Exercise, layout: Layout) -> Page:
    """The first worksheet: what this is, how to use it, what the colours mean."""
    page = Page("Read me", widths={1: 22, 2: 100})
    page.put(1, 1, exercise.title, "title")
    row = 3
    for paragraph in exercise.about:
        page.put(row, 1, paragraph, "text", align="wrap")
        page.merges.append(f"A{row}:B{row}")
        page.heights[row] = 16 * (1 + len(paragraph) // CHARACTERS_A_LINE) + 4
        row += 1
    row = _block(page, row + 1, "Colours", [(w, k, k) for k, w in LEGEND.items()])
    sheets = {"Parameters": "what you can change, and what follows: gains, errors, results"}
    sheets |= {s: exercise.sections.get(s, "") for s in exercise.model.sections}
    sheets["Charts"] = "live charts of the columns"
    sheets["Check"] = "does the program that opened this file compute what kfsheet computed?"
    row = _block(page, row + 1, "Sheets", [(w, "index", s) for s, w in sheets.items()])
    facts = {"exercise": exercise.name, "source": exercise.source, "notebook": exercise.notebook}
    _block(page, row + 1, "About", [(w, "index", name) for name, w in facts.items() if w])
    page.names[EXERCISE_NAME] = (row + 2, 2)
    return page


def _block(page: Page, row: int, title: str, lines: list[tuple[str, str, str]]) -> int:
    page.put(row, 1, title, "heading")
    for words, kind, name in lines:
        row += 1
        page.put(row, 1, name, kind)
        page.put(row, 2, words, "text", align="wrap")
    return row + 1
