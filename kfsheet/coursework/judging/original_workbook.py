"""The tables of an exercise as they are handed out, read like those that come back."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from openpyxl.utils import get_column_letter

from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.model.recurrence import Recurrence
from kfsheet.parsing.calculator import Content, Formula
from kfsheet.parsing.references import Address
from kfsheet.workbook.write.exercise_sheets import section_sheet
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Cell, is_formula


class OriginalWorkbook(NamedTuple):
    """All formulas of a model where its layout has them."""

    layout: Layout
    book: Book
    addresses: CellAddresses


@lru_cache(maxsize=8)
def original_workbook(model: Recurrence, waiting: frozenset[str] = frozenset()) -> OriginalWorkbook:
    """The workbook of a model, made once; what waits for an answer is guarded, as in handouts."""
    layout = Layout.standard(model, waiting)
    book, now = Book(""), Run.of(model)
    for page in (section_sheet(layout, section, now) for section in model.sections):
        book.sheets[page.title] = {
            cell: Formula(piece.content, cell) if is_formula(piece.content) else _plain(piece)
            for cell, piece in page.all_cells()
            if piece.content is not None
        }
    book.sheets["Parameters"] = {}
    book.names = {n.lower(): _reference(address) for n, address in layout.scalars.items()}
    return OriginalWorkbook(layout, book, CellAddresses.find(book, model))


def _reference(address: Address) -> str:
    sheet, row, column = address
    return f"{sheet}!${get_column_letter(column)}${row}"


def _plain(piece: Cell) -> Content:
    content = piece.content
    return float(content) if isinstance(content, int | float) else str(content)
