"""Answers that are computed from themselves, through other answers and what follows from them."""

from __future__ import annotations

from collections.abc import Iterator

from openpyxl.utils import get_column_letter

from kfsheet.coursework.judging.formula_meaning import parsed
from kfsheet.coursework.reading.cell_addresses import CellAddresses, find_sheet, named_cell
from kfsheet.coursework.reading.submission import Book
from kfsheet.coursework.reading.worksheet import Formula
from kfsheet.errors import FormulaError
from kfsheet.parsing.references import Address

MOST = 2_000  # cells that are looked at
WIDEST = 200  # cells of a range that are


def circular_reference(book: Book, addresses: CellAddresses, name: str, step: int) -> list[str]:
    """Addresses from an answer back to itself; empty if there is no such circle."""
    start = addresses.of(name, step)
    paths, seen = [[start]], set()
    while start and paths and len(seen) < MOST:
        path = paths.pop(0)
        for cell in _read_by(book, path[-1]):
            if cell == start:
                return [f"{get_column_letter(c)}{row}" for _, row, c in [*path, start]]
            if cell not in seen:
                seen.add(cell)
                paths.append([*path, cell])
    return []


def quantities_named(book: Book, addresses: CellAddresses, start: Address) -> set[str]:
    """Columns and scalars to which a formula refers, itself or through cells beside the tables."""
    waiting, seen, found = [start], {start}, set()
    while waiting and len(seen) < MOST:
        for cell in _read_by(book, waiting.pop()):
            role = addresses.role(cell)
            if role is not None:
                found.add(role[0] if isinstance(role, tuple) else role)
            elif cell not in seen:
                seen.add(cell)
                waiting.append(cell)
    return found


def _read_by(book: Book, cell: Address) -> Iterator[Address]:
    """What the text of a formula refers to, whatever its value makes of it."""
    content = book.sheets[cell[0]].get(cell[1:])
    if not isinstance(content, Formula):
        return
    try:
        found = parsed(content)[1]
    except FormulaError:
        return
    for reference in found:
        if reference.name:
            if named := named_cell(book, reference.name):
                yield named
            continue
        sheet = find_sheet(book, reference.sheet or cell[0])
        try:
            rows = reference.cells(cell[1:], WIDEST) if sheet in book.sheets else []
        except FormulaError:
            continue
        yield from ((sheet, *place) for row in rows for place in row)
