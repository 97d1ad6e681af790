"""Where the columns and scalars of an exercise stand in a workbook that came back.

Rows and columns may have been inserted, sheets renamed or moved. A table is found by its header
(the symbols of one section in one row, most of which must still be there), its rows by the step
index beside them; a scalar by its defined name, or else by the label to its left.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import FormulaError
from kfsheet.model.recurrence import Recurrence
from kfsheet.parsing.calculator import Content
from kfsheet.parsing.references import Address, Cell, read_reference

Rows = dict[int, dict[str, int]]
"""Column by text, by row: whatever might be the header of a table."""


@dataclass
class Table:
    """One section: its sheet, columns by position, and step by row and row by step."""

    sheet: str
    columns: dict[int, str]
    steps: dict[int, int]
    rows: dict[int, int]
    header: int


@dataclass
class CellAddresses:
    """What stands where; a section or scalar that is gone is simply not there."""

    model: Recurrence
    tables: dict[str, list[Table]] = field(default_factory=dict)
    scalars: dict[Address, str] = field(default_factory=dict)
    columns: dict[str, tuple[Table, int]] = field(default_factory=dict)

    @classmethod
    def find(cls, book: Book, model: Recurrence) -> CellAddresses:
        """Look through a workbook."""
        addresses = cls(model)
        headers = {sheet: _headers(cells) for sheet, cells in book.sheets.items()}
        for section in model.sections:
            table = _find_table(book, headers, model, section)
            if table:
                addresses.tables.setdefault(table.sheet, []).append(table)
                for number, name in table.columns.items():
                    addresses.columns.setdefault(name, (table, number))
        for name in (*model.parameters, *model.derived_scalars, *model.summaries):
            address = named_cell(book, name)
            # Rows inserted by a program that does not move names leave the name on another cell;
            # the label to the left tells, and is what a person goes by.
            if address is None or _left_of(book, address) != name:
                address = _labelled(book, name) or address
            if address:
                addresses.scalars[address] = name
        return addresses

    def of(self, name: str, step: int = 0) -> Address | None:
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


def _find_table(
    book: Book, headers: dict[str, Rows], model: Recurrence, section: str
) -> Table | None:
    """Below the row that holds the most of a section's symbols, and more than half of them."""
    step = model.step_of(section)
    order = [step, *(c.name for c in (*model.clock_of(section), *model.sections[section]))]
    symbols = set(order)
    counts = {
        (sheet, row): len(header.keys() & symbols)
        for sheet, rows in headers.items()
        for row, header in rows.items()
    }
    # More than half: a copy of a few columns, which students make, is not the table.
    if 2 * max(counts.values(), default=0) <= len(order):
        return None
    sheet, row = max(counts, key=counts.get)
    addresses = {name: _column_of(name, order, headers[sheet][row]) for name in order}
    columns = {at: "t" if name == step else name for name, at in addresses.items() if at and at > 0}
    steps = _steps(book.sheets[sheet], addresses[step], row, model.rows)
    return Table(sheet, columns, steps, {k: r for r, k in steps.items()}, row)


def _headers(cells: dict[Cell, Content]) -> Rows:
    """Column by text, the first of equal ones, of every row that holds texts."""
    rows: Rows = {}
    for (row, column), content in cells.items():
        if type(content) is str and content:
            header = rows.setdefault(row, {})
            text = content.strip()
            header[text] = min(column, header.get(text, column))
    return rows


def _column_of(name: str, order: list[str], header: dict[str, int]) -> int | None:
    """Where a column stands: below its symbol, or where that was, between its neighbours."""
    if name in header:
        return header[name]
    at = order.index(name)
    known = [(n, header[other] - n) for n, other in enumerate(order) if other in header]
    left = [shift for n, shift in known if n < at][-1:]
    right = [shift for n, shift in known if n > at][:1]
    shifts = {*left, *right}
    return at + shifts.pop() if len(shifts) == 1 else None


def _steps(
    cells: dict[Cell, Content], column: int | None, header: int, rows: int
) -> dict[int, int]:
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
