"""The cells to which a formula refers, and those to which they refer: found in the text alone."""

from __future__ import annotations

from collections.abc import Iterator

from openpyxl.utils import get_column_letter

from kfsheet.coursework.reading.cell_addresses import CellAddresses, find_sheet, named_cell
from kfsheet.coursework.reading.formula_text import forbidden, parsed
from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import FormulaError
from kfsheet.parsing.calculator import Formula
from kfsheet.parsing.references import Address

MOST = 2_000  # cells that are looked at
WIDEST = 200  # cells of a range that are


def precedents(book: Book, cell: Address) -> Iterator[Address]:
    """What the text of a formula refers to, whatever its value makes of it."""
    content = book.sheets[cell[0]].get(cell[1:])
    if not isinstance(content, Formula):
        return
    try:
        found = parsed(content).references
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


def circular_reference(book: Book, start: Address) -> list[str]:
    """Addresses from a cell back to itself; empty if there is no such circle."""
    paths, seen = [[start]], set()
    while paths and len(seen) < MOST:
        path = paths.pop(0)
        for cell in precedents(book, path[-1]):
            if cell == start:
                return [f"{get_column_letter(c)}{row}" for _, row, c in [*path, start]]
            if cell not in seen:
                seen.add(cell)
                paths.append([*path, cell])
    return []


def circle_in_words(book: Book, start: Address) -> str:
    """Words about a cell that refers to itself, if it does."""
    circle = circular_reference(book, start)
    if len(circle) == 2:
        return "the formula refers to its own cell"
    return f"it goes in a circle: {' -> '.join(circle)}" if circle else ""


def own_cells(book: Book, addresses: CellAddresses, start: Address) -> Iterator[Address]:
    """A cell and the student's own cells from which it follows; the model's cells end the way."""
    waiting, seen = [start], {start}
    while waiting and len(seen) < MOST:
        cell = waiting.pop()
        yield cell
        for other in precedents(book, cell):
            if other not in seen and not addresses.role(other):
                seen.add(other)
                waiting.append(other)


def quantities_named(
    book: Book, addresses: CellAddresses, start: Address
) -> Iterator[tuple[str, int]]:
    """Columns, with their steps, and scalars to which a formula and its helper cells refer."""
    for cell in own_cells(book, addresses, start):
        for role in filter(None, map(addresses.role, precedents(book, cell))):
            yield (role, 0) if isinstance(role, str) else role


def forbidden_precedent(book: Book, addresses: CellAddresses, start: Address) -> str:
    """What a formula, or one of the student's own cells that it needs, must not use."""
    for sheet, *place in own_cells(book, addresses, start):
        content = book.sheets[sheet].get(tuple(place))
        if isinstance(content, Formula) and (words := forbidden(content.text)):
            return words
    return ""


def typed_numbers(book: Book, addresses: CellAddresses, start: Address) -> set[float]:
    """Numbers in a formula and in the student's own cells that it needs, without their signs."""
    found: set[float] = set()
    for sheet, *place in own_cells(book, addresses, start):
        content = book.sheets[sheet].get(tuple(place))
        if isinstance(content, Formula):
            try:
                found |= set(_numbers(parsed(content).tree))
            except FormulaError:
                continue
        elif isinstance(content, float):
            found.add(abs(content))
    return found


def _numbers(tree: tuple) -> Iterator[float]:
    if tree[0] == "number":
        yield abs(float(tree[1]))
        return
    for part in tree:
        if isinstance(part, tuple):
            yield from _numbers(part)
