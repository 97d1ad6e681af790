"""A recurrence and one run of it -> the content of every cell, before any file exists.

The same composition is what :mod:`kfsheet.workbook.write.write_workbook` writes and what
:mod:`kfsheet.workbook.check.check_workbook` expects, so that neither can drift from the other.
"""

from __future__ import annotations

import math
from typing import Any

from openpyxl.utils import get_column_letter

from kfsheet.evaluation.numerics import rms
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import Missing, columns_read
from kfsheet.model.quantities import Column
from kfsheet.model.unit_text import pretty_unit
from kfsheet.printing.sentence import Verdict, excel_sentence, words_of
from kfsheet.workbook.write.layout import (
    EXERCISE_NAME,
    FIRST_ROW,
    PARAMETER_ROW,
    Layout,
    chart_place,
    quote,
)
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Cell, FilledColumn, Sheet, Words, stored_value
from kfsheet.workbook.write.styles import LEGEND, number_format

NOT_AVAILABLE = "#N/A"


def section_sheet(layout: Layout, section: str, now: Run) -> Sheet:
    """The worksheet of one section."""
    model, columns = layout.model, layout.columns[section]
    step, clock = model.step_of(section), model.clock_of(section)
    sheet = Sheet(section, freeze=f"{get_column_letter(2 + len(clock))}{FIRST_ROW}")
    sheet.heights[3] = 48
    _head(sheet, columns["t"], step, "", f"number of the {step}", 8)
    sheet.columns[columns["t"]] = FilledColumn(FIRST_ROW, range(model.rows), "index", "0")
    for column in clock:
        _formula_column(sheet, layout, column, columns["time"], now)
    for column in model.sections[section]:
        if column.is_data:
            _data_column(sheet, column, columns[column.name], now)
        else:
            _formula_column(sheet, layout, column, columns[column.name], now)
    return sheet


def _head(sheet: Sheet, at: int, symbol: str, unit: str, words: str, width: float = 14) -> None:
    sheet.put(1, at, symbol, "header", align="center")
    sheet.put(2, at, pretty_unit(unit), "unit", align="center")
    sheet.put(3, at, words, "words", align="wrap")
    sheet.widths[at] = width


def _data_column(sheet: Sheet, column: Column, at: int, now: Run) -> None:
    _head(sheet, at, column.name, column.unit, column.description)
    values = now.columns[column.name]
    sheet.columns[at] = FilledColumn(FIRST_ROW, values, "data", number_format(values))


def _formula_column(sheet: Sheet, layout: Layout, column: Column, at: int, now: Run) -> None:
    _head(sheet, at, column.name, column.unit, column.description)
    values = now.columns[column.name]
    shape, size = number_format(values), now.figure(rms, column.name)
    kind = "formula"
    if column is layout.model.clock:  # grey, as the step index beside it
        kind, shape = "index", "0.0##"
    # A start without a value is an empty cell, not a formula that says so.
    rules = tuple(None if r is Missing else layout.formula(r, sheet.title) for r in column.rules)
    sheet.columns[at] = FilledColumn(FIRST_ROW, values, kind, shape, size, rules)


def parameters_sheet(layout: Layout, now: Run) -> Sheet:
    """The worksheet of parameters, derived scalars and results."""
    model = layout.model
    sheet = Sheet("Parameters", widths={1: 13, 2: 14, 3: 9, 4: 52, 5: 3, 6: 14, 7: 14, 8: 9, 9: 52})
    sheet.put(1, 1, model.title, "title")
    sheet.put(2, 1, "Change a value in a yellow cell; every sheet and chart follows.")
    _table(sheet, PARAMETER_ROW - 1, 1, "Parameters")
    for name, parameter in model.parameters.items():
        _, row, column = layout.scalars[name]
        _line(sheet, row, column, parameter, Cell(parameter_value(now, name), "parameter"))
    if model.derived_scalars:
        first = min(layout.scalars[name][1] for name in model.derived_scalars)
        _table(sheet, first - 1, 1, "Derived: formulas of the parameters")
    if model.summaries:
        _table(sheet, PARAMETER_ROW - 1, 6, "Results: formulas of all rows")
    for name, scalar in {**model.derived_scalars, **model.summaries}.items():
        _, row, column = layout.scalars[name]
        value = now.scalars[name]
        text = layout.formula(scalar.expression, sheet.title)(row)
        # A mean may be small because its terms cancel; it is as exact as the columns it reads.
        sizes = [now.figure(rms, c) for c in columns_read(scalar.expression)]
        cell = Cell(
            text, "formula", stored_value(value), number_format([value]), "", max(sizes, default=0)
        )
        _line(sheet, row, column, scalar, cell)
    return sheet


def parameter_value(now: Run, name: str) -> float | int:
    """A parameter as it is typed: 9, not 9.0."""
    value = now.scalars[name]
    return int(value) if value.is_integer() and abs(value) < 2**53 else value


def _table(sheet: Sheet, row: int, column: int, title: str) -> None:
    sheet.put(row - 1, column, title, "heading")
    for n, word in enumerate(("symbol", "value", "unit", "meaning")):
        sheet.put(row, column + n, word, "header")


def _line(sheet: Sheet, row: int, column: int, item: Any, value: Cell) -> None:
    sheet.put(row, column - 1, item.name, "index")
    sheet.cells[row, column] = value
    sheet.put(row, column + 1, pretty_unit(item.unit), "unit", align="center")
    sheet.put(row, column + 2, item.description, "meaning", align="wrap")


def helper_columns(
    exercise: Exercise, waiting: frozenset[str] = frozenset()
) -> list[tuple[str, str]]:
    """Formula columns on charts that may have no value; a chart would show their "" as 0.

    Each with the column that is 0 where it is not drawn, ``""`` if it has gaps of its own, or no
    value yet.
    """
    found = {}
    given = waiting - {question.name for question in exercise.questions}  # these are empty cells
    for chart in exercise.charts:
        for name in (n for s in chart.series for n in (s.x, s.y)):
            # A start that is Missing is an empty cell, which a chart leaves out anyway.
            rules = exercise.model.column(name).rules
            later = rules and name in given
            if later or any(r is not Missing and r.has(Missing) for r in rules):
                found[name, ""] = None
            elif chart.where:
                found[name, chart.where] = None
    return list(found)


FIRST_HELPER_COLUMN = 27  # AA: to the right of the charts


def charts_sheet(exercise: Exercise, layout: Layout, now: Run) -> Sheet:
    """The worksheet of charts, with a copy of each column that a chart could misread."""
    sheet = Sheet("Charts")
    sheet.put(1, 1, exercise.title, "title")
    for number, chart in enumerate(exercise.charts):
        sheet.cells[chart_place(number)] = sentence_cell(chart.note, now, "note")
    names = helper_columns(exercise, layout.waiting)
    if names:
        sheet.put(2, 1, "Helper columns for the charts stand from AA on.")
    for at, (name, where) in enumerate(names, FIRST_HELPER_COLUMN):
        column = exercise.model.column(name)
        _head(
            sheet, at, name, column.unit, f"plotted where {where} is not 0" if where else "plotted"
        )
        sheet.columns[at] = _plotted(layout, name, where, now)
    return sheet


def _plotted(layout: Layout, name: str, where: str, now: Run) -> FilledColumn:
    cells, mask = (_cells(layout, n) if n else "" for n in (name, where))

    def rule(row: int) -> str:
        asked = f"ISNUMBER({cells}{row})"
        asked = f"AND({asked},{mask}{row}<>0)" if where else asked
        return f"=IF({asked},{cells}{row},NA())"  # a chart leaves #N/A out; "" it draws as 0

    values = now.columns[name]
    if where:
        drawn = zip(values, now.columns[where], strict=True)
        values = [value if shown else math.nan for value, shown in drawn]
    shape, size = number_format(values), rms(values)
    return FilledColumn(FIRST_ROW, values, "formula", shape, size, (rule,), NOT_AVAILABLE)


def _cells(layout: Layout, name: str) -> str:
    """Sheet and letter of a column, as a formula on another sheet reads it."""
    sheet, number = layout.home(name)
    return f"{quote(sheet)}!{get_column_letter(number)}"


def chart_range(exercise: Exercise, layout: Layout, name: str, where: str = "") -> tuple[str, int]:
    """Sheet and column number from which a chart, with its ``where``, takes a column."""
    names = helper_columns(exercise, layout.waiting)
    for copy in ((name, ""), (name, where)):
        if copy in names:
            return "Charts", FIRST_HELPER_COLUMN + names.index(copy)
    return layout.home(name)


CHARACTERS_A_LINE = 130  # of the two columns of "Read me" together


def sentence_cell(sentence: str | Verdict, now: Run, kind: str, align: str = "") -> Cell:
    """Words, or a formula that is a sentence."""
    if isinstance(sentence, str):
        return Cell(Words(sentence), kind, align=align)
    words = sentence.words(now.scalars)
    return Cell(excel_sentence(sentence.pieces()), kind, words, align=align)


def readme_sheet(exercise: Exercise, now: Run, built: Run) -> Sheet:
    """The first worksheet: what this is, how to use it, what the colours mean."""
    sheet = Sheet("Read me", widths={1: 22, 2: 100})
    sheet.put(1, 1, exercise.title, "title")
    row = 3
    for paragraph in exercise.story(built.scalars):
        sheet.cells[row, 1] = sentence_cell(paragraph, now, "text", "wrap")
        sheet.merges.append(f"A{row}:B{row}")
        length = len(words_of(paragraph, now.scalars))
        sheet.heights[row] = 16 * (1 + length // CHARACTERS_A_LINE) + 4
        row += 1
    row = _block(sheet, row + 1, "Colours", [(w, k, k) for k, w in LEGEND.items()])
    sheets = {"Parameters": "what you can change, and what follows: gains, errors, results"}
    sheets |= {s: exercise.sections.get(s, "") for s in exercise.model.sections}
    sheets["Charts"] = "live charts of the columns"
    sheets["Check"] = "does the program that opened this file compute what kfsheet computed?"
    row = _block(sheet, row + 1, "Sheets", [(w, "index", s) for s, w in sheets.items()])
    facts = {"exercise": exercise.name, "source": exercise.source, "notebook": exercise.notebook}
    _block(sheet, row + 1, "About", [(w, "index", name) for name, w in facts.items() if w])
    sheet.names[EXERCISE_NAME] = (row + 2, 2)
    return sheet


def _block(sheet: Sheet, row: int, title: str, lines: list[tuple[str, str, str]]) -> int:
    sheet.put(row, 1, title, "heading")
    for words, kind, name in lines:
        row += 1
        sheet.put(row, 1, name, kind)
        sheet.put(row, 2, Words(words), "text", align="wrap")
    return row + 1
