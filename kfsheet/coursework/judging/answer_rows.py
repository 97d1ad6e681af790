"""Words about rows and references of an answer: where it is right, where not, and what is there."""

from __future__ import annotations

import re
from collections.abc import Hashable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from openpyxl.formula.tokenizer import TokenizerError
from openpyxl.formula.translate import Translator, TranslatorError
from openpyxl.utils import get_column_letter

from kfsheet.coursework.judging.calculated_answers import Outcome
from kfsheet.coursework.reading.cell_addresses import CellAddresses, find_sheet
from kfsheet.coursework.reading.formula_text import parsed
from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import FormulaError
from kfsheet.parsing.calculator import Content, Formula
from kfsheet.parsing.references import Address, Cell, Reference

DISTANCE = re.compile(r"\{[^{}]*\}")

ALIKE = 2  # of a column that is filled down, a cell after those that begin it


@dataclass(frozen=True)
class AnswerCell:
    """One row of an answer: what was found there."""

    step: int
    address: Address
    status: str
    words: str = ""
    pattern: str = ""
    """What the formulas of a column that was filled down have in common."""
    outcomes: tuple[Outcome, ...] = field(default=(), repr=False)


def content_of(book: Book, cell: AnswerCell) -> Content | None:
    """What stands in the cell."""
    return book.sheets[cell.address[0]].get(cell.address[1:])


def looked_at(book: Book, cells: list[AnswerCell], first: AnswerCell | None) -> dict[str, Any]:
    """What a student is shown of an answer: the ``first`` cell that is not right, or any."""
    cell = first or cells[min(ALIKE, len(cells) - 1)]
    sheet, row, column = cell.address
    place = f"{get_column_letter(column)}{row}"
    content = content_of(book, cell)
    if isinstance(content, Formula):
        words = _as_in(content, place)
    else:
        words = "" if content is None else f"{content:.10g}" if type(content) is float else content
    nowhere = first is None or content is None
    return {"step": cell.step, "formula": words, "differs": "" if nowhere else f"{sheet}!{place}"}


def _as_in(formula: Formula, place: str) -> str:
    """A formula that is shared as its own cell shows it."""
    host = f"{get_column_letter(formula.host[1])}{formula.host[0]}"
    try:
        return Translator(formula.text, host).translate_formula(place)
    except (TranslatorError, TokenizerError):
        return formula.text


def not_in(book: Book, rest: list[AnswerCell], right: list[AnswerCell]) -> str:
    """Rows that are not right, and what the first of them reads that the right ones do not."""
    first, content = rest[0], content_of(book, rest[0])
    words = f"not in {rows_of(rest)}"
    if not isinstance(content, Formula) or not isinstance(content_of(book, right[-1]), Formula):
        return words
    try:
        known = set(parsed(content_of(book, right[-1])).references)
        strange = [r for r in parsed(content).references if r not in known]
    except FormulaError:
        return words
    names = ", ".join(dict.fromkeys(shown(r, first.address[1:]) for r in strange))
    return f"{words} (row {first.address[1]} refers to {names})" if names else words


def fixed_row(book: Book, addresses: CellAddresses, cell: AnswerCell) -> str:
    """The cells of the tables to which a formula refers with a fixed row, such as D$5."""
    content = content_of(book, cell)
    if not isinstance(content, Formula):
        return ""
    sheet, *host = cell.address
    found = []
    for reference in parsed(content).references:
        if reference.first and reference.first.row_fixed and not reference.last:
            _, column = reference.first.at(tuple(host))
            place = (find_sheet(book, reference.sheet or sheet), reference.first.row, column)
            if isinstance(addresses.role(place), tuple):
                found.append(shown(reference, tuple(host)))
    return ", ".join(dict.fromkeys(found))


def shape(book: Book, addresses: CellAddresses, cell: AnswerCell) -> Hashable:
    """The same for formulas that differ only in how far they are from what they refer to."""
    content = content_of(book, cell)
    if not isinstance(content, Formula):
        return cell.pattern
    sheet, *host = cell.address
    key, _, found = parsed(content)
    return DISTANCE.sub("{}", key), tuple(
        reference.name or _role(book, addresses, reference, sheet, tuple(host))
        for reference in found
    )


def _role(
    book: Book, addresses: CellAddresses, reference: Reference, sheet: str, host: Cell
) -> Hashable:
    """Which quantity of which row a reference reads, seen from its own row unless that is fixed."""
    corner = reference.first
    role = addresses.role((find_sheet(book, reference.sheet or sheet), *corner.at(host)))
    if isinstance(role, tuple) and not corner.row_fixed:
        own = addresses.role((sheet, *host))
        return role[0], role[1] - (own[1] if isinstance(own, tuple) else 0)
    return role or (corner.row, corner.column)


def rows_of(cells: list[AnswerCell]) -> str:
    """Rows of a sheet in words: "rows 6-13, 15"."""
    numbers = sorted(cell.address[1] for cell in cells)
    runs: list[list[int]] = [[numbers[0]]]
    for before, now in pairwise(numbers):
        if now == before + 1:
            runs[-1].append(now)
        else:
            runs.append([now])
    runs_shown = [f"{run[0]}-{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs]
    more = ", ..." if len(runs_shown) > 5 else ""
    return f"row{'s' * (len(numbers) > 1)} {', '.join(runs_shown[:5])}{more}"


def shown(reference: Reference, host: tuple[int, int]) -> str:
    """A reference as the student typed it."""
    if reference.name:
        return reference.name
    ends = []
    for corner in filter(None, (reference.first, reference.last)):
        row, column = corner.at(host)
        if row < 1 or column < 1:
            return "a cell outside the sheet"
        ends.append(
            f"{'$' * corner.column_fixed}{get_column_letter(column)}{'$' * corner.row_fixed}{row}"
        )
    return (f"{reference.sheet}!" if reference.sheet else "") + ":".join(ends)
