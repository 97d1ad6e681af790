"""What stands in a workbook of ours: where its columns are, its parameters and its data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from openpyxl import Workbook
from openpyxl.utils import coordinate_to_tuple, get_column_letter

from kfsheet.errors import DataError, WorkbookError
from kfsheet.excel.layout import FIRST_ROW, SYMBOL_ROW, Address, Layout, quote
from kfsheet.excel.recalculate import Values
from kfsheet.exercise import Exercise
from kfsheet.recurrence import Recurrence

EXERCISE_NAME = "kfsheet_exercise"


def exercise_name(book: Workbook, path: Path) -> str:
    """Name of the exercise that a workbook was built from.

    Raises
    ------
    WorkbookError
        If the workbook is not one of ours.
    """
    address = _named(book, EXERCISE_NAME)
    value = address and book[address[0]].cell(*address[1:]).value
    if not isinstance(value, str):
        raise WorkbookError(
            f"{path} is a workbook, but not one of ours (no cell is named {EXERCISE_NAME}); "
            "make one with: kfsheet build"
        )
    return value


def _named(book: Workbook, name: str) -> Address | None:
    """The one cell that a defined name stands for, if there is such a cell."""
    if name not in book.defined_names:
        return None
    places = list(book.defined_names[name].destinations)
    if len(places) != 1 or places[0][0] not in book.sheetnames:
        return None
    try:
        return (places[0][0], *coordinate_to_tuple(places[0][1].replace("$", "")))
    except ValueError:
        return None


def layout_of(book: Workbook, exercise: Exercise, path: Path) -> Layout:
    """The layout of a workbook in which a user may have inserted or moved columns.

    Raises
    ------
    WorkbookError
        If a sheet, a column or a name is gone.
    """
    model = exercise.model
    for sheet in ("Charts", "Check"):
        if sheet not in book.sheetnames:
            raise WorkbookError(f"{path}: the sheet {sheet!r} is gone or renamed")
    columns = {section: _columns_of(book, model, section, path) for section in model.sections}
    scalars = {}
    for name in (*model.parameters, *model.derived_scalars, *model.summaries):
        address = _named(book, name)
        if address is None:
            raise WorkbookError(f"{path}: no cell is named {name}; build the workbook anew")
        sheet, row, column = address
        if column == 1 or book[sheet].cell(row, column - 1).value != name:
            raise WorkbookError(
                f"{path}: the name {name} leads to {place(address)}, which is not labelled {name}; "
                "move the name or the cell back"
            )
        scalars[name] = address
    return Layout(model, columns, scalars)


def _columns_of(book: Workbook, model: Recurrence, section: str, path: Path) -> dict[str, int]:
    if section not in book.sheetnames:
        raise WorkbookError(f"{path}: the sheet {section!r} is gone or renamed")
    headers = [cell.value for cell in book[section][SYMBOL_ROW]]
    found = {value: column for column, value in enumerate(headers, 1)}
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


class Inputs:
    """Parameters and data that stand in a workbook, with the cells that hold them."""

    def __init__(self, book: Workbook, layout: Layout, values: Values, path: Path) -> None:
        self.path, self.layout = path, layout
        self._book, self._values = book, values
        model = layout.model
        self.parameters = {
            name: p.checked(self._content(layout.scalars[name]), self._where(layout.scalars[name]))
            for name, p in model.parameters.items()
        }
        self.data = {c.name: self._series(c.name) for c in model.table.values() if c.is_data}

    def cells(self, name: str) -> list[Address]:
        """Cells of a data column."""
        sheet, column = self.layout.home(name)
        return [(sheet, FIRST_ROW + row, column) for row in range(self.layout.model.rows)]

    def _series(self, name: str) -> list[float | None]:
        column, cells = self.layout.model.table[name], self.cells(name)
        sheet, row, number = cells[-1]
        if self._book[sheet].cell(row + 1, number).value is not None:
            raise WorkbookError(
                f"{self.path}: {place((sheet, row + 1, number))} lies below the table; "
                f"its formulas end at row {row}"
            )
        series = [self._content(cell) for cell in cells]
        for value, cell in zip(series, cells, strict=True):
            if isinstance(value, str) or (value is None and not column.may_be_missing):
                found = repr(value) if value else "empty"
                raise DataError(f"{name}{self._where(cell)} is {found}; it must be a number")
        return series

    def _content(self, address: Address) -> Any:
        """The number in a cell; of a formula, the value that the engine found."""
        sheet, row, column = address
        content = self._book[sheet].cell(row, column).value
        if isinstance(content, str) and content.startswith("="):
            content = self._values[sheet].get((row, column))
        return None if isinstance(content, str) and not content.strip() else content

    def _where(self, address: Address) -> str:
        return f" in {place(address)} of {self.path.name}"
