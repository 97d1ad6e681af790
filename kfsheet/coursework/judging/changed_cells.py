"""Cells that were not to be changed, and were: worth a remark, since no mark depends on them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from math import isclose, isnan
from typing import NamedTuple

from openpyxl.utils import get_column_letter

from kfsheet.coursework.judging.answer_key import asked_steps
from kfsheet.coursework.judging.formula_meaning import Interpreter, Meaning
from kfsheet.coursework.judging.random_samples import OwnNumbers
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.coursework.reading.worksheet import Content, Formula
from kfsheet.errors import FormulaError
from kfsheet.model.exercise import Exercise
from kfsheet.parsing.references import Address, relative_key
from kfsheet.workbook.write.exercise_sheets import section_sheet
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Cell, is_formula

ROWS_CHECKED = 40  # rows of a long table that are looked at


def changed_cells(
    exercise: Exercise, book: Book, addresses: CellAddresses, own: OwnNumbers
) -> list[str]:
    """Names of parameters, data and given columns that differ from what was handed out."""
    return [
        *_parameters(book, addresses, own),
        *_data(exercise, book, addresses, own),
        *_formulas(exercise, book, addresses),
    ]


def _content(book: Book, address: Address | None) -> Content | None:
    return book.sheets[address[0]].get(address[1:]) if address else None


def _same(found: Content | None, wanted: float) -> bool:
    if isnan(wanted):
        return found in (None, "")
    return type(found) is float and isclose(found, wanted, rel_tol=1e-9)


def _parameters(book: Book, addresses: CellAddresses, own: OwnNumbers) -> Iterator[str]:
    for name, value in own.parameters:
        if not _same(_content(book, addresses.of(name)), value):
            yield name


def _data(
    exercise: Exercise, book: Book, addresses: CellAddresses, own: OwnNumbers
) -> Iterator[str]:
    for name, values in own.data:
        found = (_content(book, addresses.of(name, step)) for step in range(exercise.model.rows))
        if not all(map(_same, found, values)):
            yield name


def _formulas(exercise: Exercise, book: Book, addresses: CellAddresses) -> Iterator[str]:
    asked = {q.name for q in exercise.questions}
    interpreter = Interpreter(book, addresses)
    original = _original(exercise)
    unmoved = original.addresses.tables == addresses.tables
    unmoved &= original.addresses.scalars == addresses.scalars
    for column in exercise.model.table.values():
        if column.is_data or column.name in asked or column.section in exercise.frozen:
            continue
        steps = asked_steps(exercise.model, column.name)
        for step in steps[:: max(1, len(steps) // ROWS_CHECKED)]:
            found = addresses.of(column.name, step)
            if unmoved and _same_text(_content(book, found), _content(original.book, found)):
                continue  # what it means needs no look
            wanted = _given(exercise.name, column.name, step)
            try:
                same = found and interpreter.meaning(found, step) == wanted
            except FormulaError:
                same = False
            if not same:
                yield column.name
                break


def _same_text(found: Content | None, given: Content | None) -> bool:
    """Whether two cells hold one formula, as text, shared or not."""
    if not (isinstance(found, Formula) and isinstance(given, Formula)) or found.area:
        return False
    return found == given or relative_key(*found[:2]) == relative_key(*given[:2])


@lru_cache(maxsize=50_000)
def _given(exercise: str, column: str, step: int) -> Meaning | None:
    """What a cell meant when it was handed out."""
    original = _originals[exercise]
    return original.interpreter.meaning(original.addresses.of(column, step), step)


class _Original(NamedTuple):
    """The tables as they are handed out, to be read like those that come back."""

    book: Book
    addresses: CellAddresses
    interpreter: Interpreter


_originals: dict[str, _Original] = {}


def _original(exercise: Exercise) -> _Original:
    if exercise.name not in _originals:
        layout = Layout.standard(exercise.model, exercise.waiting)
        book = Book("")
        now = Run.of(exercise.model)
        for page in (section_sheet(layout, section, now) for section in exercise.model.sections):
            book.sheets[page.title] = {
                cell: Formula(piece.content, cell) if is_formula(piece.content) else _plain(piece)
                for cell, piece in page.all_cells()
                if piece.content is not None
            }
        book.sheets["Parameters"] = {}
        book.names = {n.lower(): _reference(address) for n, address in layout.scalars.items()}
        addresses = CellAddresses.find(book, exercise.model)
        _originals[exercise.name] = _Original(book, addresses, Interpreter(book, addresses))
    return _originals[exercise.name]


def _reference(address: Address) -> str:
    sheet, row, column = address
    return f"{sheet}!${get_column_letter(column)}${row}"


def _plain(piece: Cell) -> Content:
    content = piece.content
    return float(content) if isinstance(content, int | float) else str(content)
