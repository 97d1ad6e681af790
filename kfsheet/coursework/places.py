"""Where the columns and scalars of an exercise stand in a workbook that came back.

Rows and columns may have been inserted, sheets renamed or moved. A table is found by its header
(the symbols of one section, all in one row), its rows by the step index beside them; a scalar by
its defined name, or else by the label to its left.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from kfsheet.coursework.submission import Book
from kfsheet.coursework.worksheet import Content
from kfsheet.errors import FormulaError
from kfsheet.excel.references import Address, Cell, read_reference
from kfsheet.recurrence import Recurrence


@dataclass
class Table:
    """One section: its sheet, columns by position, and step by row and row by step."""

    sheet: str
    columns: dict[int, str]
    steps: dict[int, int]
    rows: dict[int, int]
    header: int


@dataclass
class Places:
    """What stands where; a section or scalar that is gone is simply not there."""

    model: Recurrence
    tables: dict[str, list[Table]] = field(default_factory=dict)
    scalars: dict[Address, str] = field(default_factory=dict)
    columns: dict[str, tuple[Table, int]] = field(default_factory=dict)

    @classmethod
    def find(cls, book: Book, model: Recurrence) -> Places:
        """Look through a workbook."""
        places = cls(model)
        for section in model.sections:
            table = _find_table(book, model, section)
            if table:
                places.tables.setdefault(table.sheet, []).append(table)
                for number, name in table.columns.items():
                    places.columns.setdefault(name, (table, number))
        for name in (*model.parameters, *model.derived_scalars, *model.summaries):
            address = named_cell(book, name)
            if address is None or _left_of(book, address) != name:
                address = _labelled(book, name) or address
            if address:
                places.scalars[address] = name
        return places

    def address(self, name: str, step: int = 0) -> Address | None:
        """The cell of a column in a step, or of a scalar."""
        if name in self.columns:
            table, number = self.columns[name]
            return (table.sheet, table.rows[step], number) if step in table.rows else None
        return next((a for a, n in self.scalars.items() if n == name), None)

    def role(self, address: Address) -> tuple[str, int] | str | None:
        """What a cell is: a scalar's name, or a column's name and step; None for other cells."""
        if address in self.scalars:
            return self.scalars[address]
        sheet, row, column = address
        for table in self.tables.get(sheet, ()):
            if column in table.columns and row in table.steps:
                return table.columns[column], table.steps[row]
        return None


def _find_table(book: Book, model: Recurrence, section: str) -> Table | None:
    wanted = {column.name for column in model.sections[section]}
    step = model.step_of(section)
    keys = {step, *(clock.name for clock in model.clock_of(section)), *wanted}
    anchor = next(iter(wanted))
    for sheet, cells in book.sheets.items():
        for (row, _), content in cells.items():
            if content == anchor and (header := _header(cells, row)).keys() >= keys:
                columns = {header[name]: name for name in keys}
                columns[header[step]] = "t"
                steps = _steps(cells, header[step], row, model.rows)
                return Table(sheet, columns, steps, {k: r for r, k in steps.items()}, row)
    return None


def _header(cells: dict[Cell, Content], row: int) -> dict[str, int]:
    """Column by text, the first of equal ones, of one row."""
    width = 2 * max((c for r, c in cells if r == row), default=0)
    found: dict[str, int] = {}
    for column in range(1, min(width, 2_000) + 1):
        content = cells.get((row, column))
        if type(content) is str:
            found.setdefault(content, column)
    return found


def _steps(cells: dict[Cell, Content], column: int, header: int, rows: int) -> dict[int, int]:
    """Step by row: below the header, where the index column counts 0, 1, 2, ..."""
    numbers = sorted((r, v) for (r, c), v in cells.items() if c == column and r > header)
    found: dict[int, int] = {}
    for row, value in numbers:
        if type(value) is float and value == len(found) and len(found) < rows:
            found[row] = len(found)
    return found


def named_cell(book: Book, name: str) -> Address | None:
    """The one cell that a defined name stands for."""
    try:
        reference = read_reference(book.names.get(name.lower(), ""))
    except FormulaError:
        return None
    sheet = find_sheet(book, reference.sheet)
    if reference.first is None or reference.last is not None or sheet is None:
        return None
    return sheet, reference.first.row, reference.first.column


def find_sheet(book: Book, name: str | None) -> str | None:
    """A worksheet by name, as Excel finds it: capitals do not matter."""
    if name is None or name in book.sheets:
        return name
    return next((s for s in book.sheets if s.lower() == name.lower()), None)


def _left_of(book: Book, address: Address) -> Content | None:
    sheet, row, column = address
    return book.sheets[sheet].get((row, column - 1))


def _labelled(book: Book, name: str) -> Address | None:
    """The cell to the right of the only label ``name`` on the sheet of parameters."""
    cells = book.sheets.get("Parameters", {})
    labels = [place for place, content in cells.items() if content == name]
    return ("Parameters", labels[0][0], labels[0][1] + 1) if len(labels) == 1 else None
