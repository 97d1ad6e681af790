"""Cells that were not to be changed, and were: worth a remark, since no mark depends on them."""

from __future__ import annotations

from collections.abc import Iterator
from math import isclose, isnan

from kfsheet.coursework.judging.calculated_answers import CalculatedAnswers
from kfsheet.coursework.judging.model_runs import OwnNumbers
from kfsheet.coursework.judging.original_workbook import original_workbook
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import KfsheetError
from kfsheet.model.exercise import Exercise, asked_steps
from kfsheet.model.expressions import columns_read
from kfsheet.parsing.calculator import Content, Formula
from kfsheet.parsing.references import Address, relative_key

WORLDS_CHECKED = 3  # with the student's own numbers, with and without observations
ROWS_CHECKED = 40  # rows of a long table that are looked at


def changed_cells(
    exercise: Exercise,
    book: Book,
    addresses: CellAddresses,
    own: OwnNumbers,
    calculated: CalculatedAnswers,
) -> list[str]:
    """Names of parameters, data and given columns that differ from what was handed out."""
    return [
        *_parameters(book, addresses, own),
        *_data(exercise, book, addresses, own),
        *_formulas(exercise, book, addresses, calculated),
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


def _formulas(
    exercise: Exercise, book: Book, addresses: CellAddresses, calculated: CalculatedAnswers
) -> Iterator[str]:
    asked = {q.name for q in exercise.questions}
    original = original_workbook(exercise.model, exercise.waiting)
    unmoved = original.addresses.tables == addresses.tables
    unmoved &= original.addresses.scalars == addresses.scalars
    for column in exercise.model.table.values():
        if column.is_data or column.name in asked or column.section in exercise.frozen:
            continue
        frozen = any(
            exercise.model.table[name].section in exercise.frozen
            for rule in column.rules
            for name in columns_read(rule)
            if name in exercise.model.table
        )
        if frozen and not unmoved:
            continue  # it follows from numbers of the handout, which no world has
        steps = asked_steps(exercise.model, column.name)
        for step in steps[:: max(1, len(steps) // ROWS_CHECKED)]:
            found = addresses.of(column.name, step)
            given = original.addresses.of(column.name, step)
            if unmoved and _same_text(_content(book, found), _content(original.book, given)):
                continue  # what it gives needs no look
            if frozen or not _right(calculated, column.name, step, found):
                yield column.name
                break


def _right(calculated: CalculatedAnswers, name: str, step: int, address: Address | None) -> bool:
    if address is None or not calculated.is_formula(address):
        return False
    try:
        worlds = calculated.worlds[:WORLDS_CHECKED]
        return all(calculated.outcome(w, name, step, address).right for w in worlds)
    except KfsheetError:
        return False


def _same_text(found: Content | None, given: Content | None) -> bool:
    """Whether two cells hold one formula, as text, shared or not."""
    if not (isinstance(found, Formula) and isinstance(given, Formula)) or found.area:
        return False
    return found == given or relative_key(*found[:2]) == relative_key(*given[:2])
