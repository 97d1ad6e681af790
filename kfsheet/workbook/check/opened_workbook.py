"""What stands in a workbook of ours: where its columns are, its parameters and its data."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import isnan
from pathlib import Path
from typing import Any

from openpyxl.utils import get_column_letter

from kfsheet.errors import DataError, WorkbookError
from kfsheet.model.exercise import Exercise
from kfsheet.model.quantities import Column
from kfsheet.model.recurrence import Recurrence
from kfsheet.parsing.references import Address
from kfsheet.workbook.engines.recalculate import start_engine
from kfsheet.workbook.engines.spreadsheet_engine import CellValue, Changes, Engine, Values
from kfsheet.workbook.reading.package import Package
from kfsheet.workbook.write.layout import (
    EXERCISE_NAME,
    EXERCISE_PROPERTY,
    FIRST_ROW,
    SYMBOL_ROW,
    TOKEN_NAME,
    Layout,
    quote,
)
from kfsheet.workbook.write.run import Run


class OpenedWorkbook:
    """A workbook as it stands: its names and formula cells, and the values an engine finds."""

    def __init__(
        self, path: str | Path, engine: str = "ironcalc", started: Engine | None = None
    ) -> None:
        """``started`` is the engine, if it was asked about the file before."""
        self.path, self.engine_name = Path(path), engine
        self.engine = started or start_engine(path, engine)
        self.package = Package(path)
        self._among: dict[tuple[range, str, int], set[int]] = {}

    @cached_property
    def values(self) -> Values:
        """What the engine finds in the file as it stands."""
        return self.engine.values()

    def values_with(self, changes: Changes) -> Values:
        """What the engine finds with numbers put in first, if there are any."""
        return self.engine.values(changes) if changes else self.values

    def value(self, address: Address) -> CellValue:
        """What the engine found in a cell."""
        sheet, row, column = address
        return self.values.get(sheet, {}).get((row, column))

    @cached_property
    def _formulas(self) -> dict[str, dict[int, set[int]]]:
        return {title: self.package.formulas(title) for title in self.package.titles}

    def formula_rows(self, sheet: str, column: int) -> set[int]:
        """Rows of a column that hold formulas."""
        return self._formulas.get(sheet, {}).get(column, set())

    def formulas_among(self, rows: range, sheet: str, column: int) -> set[int]:
        """Those of some rows of a column that hold formulas."""
        key = rows, sheet, column
        if key not in self._among:
            self._among[key] = self.formula_rows(sheet, column).intersection(rows)
        return self._among[key]

    def is_formula(self, address: Address) -> bool:
        """Whether a cell holds a formula."""
        sheet, row, column = address
        return row in self.formula_rows(sheet, column)

    def text(self, address: Address) -> str | None:
        """The formula in a cell, written out where it is shared."""
        from openpyxl.formula.translate import Translator  # seldom needed

        sheet, *cell = address
        content = self._cells.get(sheet, {}).get(tuple(cell))
        if not hasattr(content, "host"):  # a constant
            return None
        here, there = (f"{get_column_letter(c)}{r}" for r, c in (content.host, cell))
        return Translator(content.text, here).translate_formula(there)

    @cached_property
    def _cells(self) -> dict[str, dict[tuple[int, int], Any]]:
        from kfsheet.workbook.reading.book import read_book  # it takes long to import

        return read_book(self.package.container).sheets

    @property
    def exercise_hint(self) -> str:
        """Name of the exercise as the file's properties have it, before the engine has answered."""
        return self.package.properties.get(EXERCISE_PROPERTY, "")

    def exercise_name(self) -> str:
        """Name of the exercise that the workbook was built from.

        Raises
        ------
        WorkbookError
            If the workbook is not one of ours.
        """
        address = self.named(EXERCISE_NAME) or self.labelled("exercise", "Read me")
        value = (address and self.value(address)) or self.exercise_hint
        if not value or not isinstance(value, str):
            raise WorkbookError(
                f"{self.path} is a workbook, but not one of ours (no cell is named "
                f"{EXERCISE_NAME}); make one with: kfsheet build"
            )
        return value

    def named(self, name: str) -> Address | None:
        """The cell that a defined name stands for."""
        return self.package.named(name)

    def labelled(self, name: str, sheet: str) -> Address | None:
        """The cell to the right of the only label ``name`` of a sheet: some programs lose names."""
        cells = self.values.get(sheet, {})
        labels = [place for place, value in cells.items() if value == name]
        return (sheet, labels[0][0], labels[0][1] + 1) if len(labels) == 1 else None


def layout_of(book: OpenedWorkbook, exercise: Exercise) -> Layout:
    """The layout of a workbook in which a user may have inserted or moved columns.

    Raises
    ------
    WorkbookError
        If a sheet, a column or a name is gone, or the workbook is a student's handout.
    """
    model, path = exercise.model, book.path
    if book.named(TOKEN_NAME):
        raise WorkbookError(f"{path} is a student's handout; use: kfsheet grade")
    for sheet in ("Charts", "Check"):
        if sheet not in book.package.titles:
            raise WorkbookError(f"{path}: the sheet {sheet!r} is gone or renamed")
    columns = {section: _columns_of(book, model, section) for section in model.sections}
    scalars = {}
    for name in (*model.parameters, *model.derived_scalars, *model.summaries):
        address = book.named(name) or book.labelled(name, "Parameters")
        if address is None:
            raise WorkbookError(f"{path}: no cell is named {name}; build the workbook anew")
        sheet, row, column = address
        # A name that was moved to another parameter's cell would compute, and mean another thing.
        if column == 1 or book.value((sheet, row, column - 1)) != name:
            raise WorkbookError(
                f"{path}: the name {name} leads to {place(address)}, which is not labelled {name}; "
                "move the name or the cell back"
            )
        scalars[name] = address
    return Layout(model, columns, scalars)


def _columns_of(book: OpenedWorkbook, model: Recurrence, section: str) -> dict[str, int]:
    path = book.path
    if section not in book.package.titles:
        raise WorkbookError(f"{path}: the sheet {section!r} is gone or renamed")
    cells = book.values[section].items()
    found = {value: column for (row, column), value in cells if row == SYMBOL_ROW}
    headers = [value for (row, _), value in cells if row == SYMBOL_ROW]
    keys = {"t": model.step_of(section)}
    columns = [*model.clock_of(section), *model.sections[section]]
    keys |= {column.name: column.name for column in columns}
    if missing := [header for header in keys.values() if header not in found]:
        raise WorkbookError(
            f"{path}: sheet {section!r} has no column {missing[0]!r} in row {SYMBOL_ROW}; "
            "leave the header row as it was"
        )
    if twins := [header for header in keys.values() if headers.count(header) > 1]:
        raise WorkbookError(f"{path}: sheet {section!r} has two columns {twins[0]!r}; rename one")
    return {key: found[header] for key, header in keys.items()}


def place(address: Address) -> str:
    """An address as a person reads it: Reanalysis!E5."""
    sheet, row, column = address
    return f"{quote(sheet)}!{get_column_letter(column)}{row}"


@dataclass(frozen=True)
class Inputs:
    """Parameters and data, with the layout that says which cells hold them.

    ``data[name]`` has None where there is no observation.
    """

    layout: Layout
    parameters: dict[str, float]
    data: dict[str, list[float | None]]

    @classmethod
    def of(cls, layout: Layout, run: Run) -> Inputs:
        """The inputs of a run."""
        model = layout.model
        series = {c.name: run.columns[c.name] for c in model.table.values() if c.is_data}
        return cls(
            layout,
            {name: run.scalars[name] for name in model.parameters},
            {name: [None if isnan(v) else v for v in values] for name, values in series.items()},
        )

    def cells(self, name: str) -> list[Address]:
        """Cells of a data column."""
        sheet, column = self.layout.home(name)
        return [(sheet, FIRST_ROW + row, column) for row in range(self.layout.model.rows)]


def inputs_in(book: OpenedWorkbook, layout: Layout) -> Inputs:
    """Parameters and data that stand in a workbook.

    Raises
    ------
    WorkbookError
        If there is something below a table, where no formula looks.
    DataError
        If a parameter or datum is not allowed.
    """
    inputs = Inputs(layout, {}, {})
    for name, parameter in layout.model.parameters.items():
        cell = layout.scalars[name]
        inputs.parameters[name] = parameter.checked(_content(book, cell), _where(book, cell))
    for column in layout.model.table.values():
        if column.is_data:
            inputs.data[column.name] = _series(book, column, inputs.cells(column.name))
    return inputs


def _series(book: OpenedWorkbook, column: Column, cells: list[Address]) -> list[float | None]:
    sheet, row, number = cells[-1]
    # Somebody added a row; it would be left out without a word.
    if book.value((sheet, row + 1, number)) is not None:
        raise WorkbookError(
            f"{book.path}: {place((sheet, row + 1, number))} lies below the table; "
            f"its formulas end at row {row}"
        )
    series = [_content(book, cell) for cell in cells]
    for value, cell in zip(series, cells, strict=True):
        if isinstance(value, str | bool) or (value is None and not column.may_be_missing):
            found = "empty" if value is None else repr(value)
            raise DataError(f"{column.name}{_where(book, cell)} is {found}; it must be a number")
    return series


def _content(book: OpenedWorkbook, address: Address) -> Any:
    """The number in a cell; of a formula, the value that the engine found."""
    content = book.value(address)
    return None if isinstance(content, str) and not content.strip() else content


def _where(book: OpenedWorkbook, address: Address) -> str:
    return f" in {place(address)} of {book.path.name}"
