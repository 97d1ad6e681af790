"""A right formula for each answer, in the terms of the student's own cells."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from openpyxl.utils import get_column_letter
from sympy import Basic, Indexed, IndexedBase, Symbol

from kfsheet.coursework.judging.judge import Mark
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import PrintError
from kfsheet.model.exercise import asked_steps
from kfsheet.model.expressions import Last, lag, t
from kfsheet.parsing.references import Address
from kfsheet.printing.excel import excel_code
from kfsheet.workbook.write.layout import quote


def right_formulas(book: Book, addresses: CellAddresses, marks: Sequence[Mark]) -> dict[str, str]:
    """Right formulas by the name of the answer; the rows that begin a column have their own.

    An answer whose table is gone, or a part of what it reads, has none.
    """
    found = {}
    for mark in marks:
        try:
            found[mark.name] = "; ".join(_formulas(book, addresses, mark.name))
        except PrintError:
            continue
    return found


def _formulas(book: Book, addresses: CellAddresses, name: str) -> Iterator[str]:
    model, asked = addresses.model, asked_steps(addresses.model, name)
    scalar = model.derived_scalars.get(name)
    starts = 0 if scalar else len(model.column(name).start)
    steps = [step for step in asked if step < starts]
    steps += [step for step in asked if step >= starts][:1]
    for step in steps:
        here = addresses.of(name, step)
        if here is None:
            raise PrintError(f"{name} is gone")
        rule = scalar.expression if scalar else model.column(name).definition(step)
        text = f"={excel_code(rule, _OwnCells(book, addresses, here, step))}"
        yield f"{get_column_letter(here[2])}{here[1]}: {text}" if len(steps) > 1 else text


class _OwnCells:
    """Names of symbols in the cell ``here`` of a workbook that came back."""

    def __init__(self, book: Book, addresses: CellAddresses, here: Address, step: int) -> None:
        self._book, self._addresses, self._here, self._step = book, addresses, here, step

    def __call__(self, node: Basic) -> str | None:
        model = self._addresses.model
        if node == t:
            return self._index()
        if isinstance(node, Indexed):
            return self._cell(str(node.base.label), self._step - int(lag(node)))
        if isinstance(node, Last):
            return self._cell(str(node.args[0].label), model.rows - 1)
        if isinstance(node, IndexedBase):
            first, last = (self._cell(str(node.label), step) for step in (0, model.rows - 1))
            return f"{first}:{last.rpartition('!')[2]}"
        if isinstance(node, Symbol):
            return node.name if node.name.lower() in self._book.names else self._cell(node.name, 0)
        return None

    def _cell(self, name: str, step: int) -> str:
        address = self._addresses.of(name, step)
        if address is None:
            raise PrintError(f"{name} is gone")
        sheet, row, column = address
        before = "" if sheet == self._here[0] else f"{quote(sheet)}!"
        return f"{before}{get_column_letter(column)}{row}"

    def _index(self) -> str:
        sheet, row, _ = self._here
        for table in self._addresses.tables.get(sheet, ()):
            for column, name in table.columns.items():
                if name == "t" and row in table.steps:
                    return f"${get_column_letter(column)}{row}"
        raise PrintError("the step index is gone")
