"""The cells of a worksheet as XML, written directly.

openpyxl makes an object and an XML element of every cell, which is most of the time that a large
workbook takes. What is around the cells (styles, names, charts, widths) is left to it; the cells
are put into its file by :func:`kfsheet.excel.finish.finish`.

A formula that is filled down is written once and shared by the cells below, as Excel writes it:
a program that opens the file reads one formula, not a thousand. (As in Excel, a formula that refers
to another worksheet is not shared; there a relative reference would not move.)
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import count
from typing import NamedTuple
from xml.sax.saxutils import escape

from openpyxl.formula.translate import Translator
from openpyxl.utils import get_column_letter

from kfsheet.excel.compose import Page, Piece, is_formula

StyleOf = Callable[[str, str, str], int]
"""Number of a style, by kind, number format and alignment."""


class _Fill(NamedTuple):
    """Cells that share a formula: its number, and the first and last row of them."""

    number: int
    first: int
    last: int


_Fills = dict[tuple[int, int | None], _Fill]


def sheet_data(page: Page, style_of: StyleOf) -> str:
    """The element ``sheetData`` of a page, stored values with the formulas."""
    fills = _fills(page)
    rows: dict[int, list[tuple[int, Piece]]] = {}
    for (row, column), piece in page.pieces.items():
        rows.setdefault(row, []).append((column, piece))
    parts = ["<sheetData>"]
    for row in sorted({*rows, *page.heights}):
        height = page.heights.get(row)
        tall = f' ht="{height:g}" customHeight="1"' if height else ""
        cells = "".join(
            _cell(row, column, piece, style_of, fills.get((column, piece.rule)))
            for column, piece in sorted(rows.get(row, ()), key=_column)
        )
        parts.append(f'<row r="{row}"{tall}>{cells}</row>')
    parts.append("</sheetData>")
    return "".join(parts)


def _column(cell: tuple[int, Piece]) -> int:
    return cell[0]


_letter = lru_cache(maxsize=20_000)(get_column_letter)


def _fills(page: Page) -> _Fills:
    """Formulas that may be shared, by column and number of the rule."""
    cells: dict[tuple[int, int | None], list[int]] = {}
    for (row, column), piece in page.pieces.items():
        if piece.rule is not None and is_formula(piece.content):
            cells.setdefault((column, piece.rule), []).append(row)
    numbers = count()
    return {
        (column, rule): _Fill(next(numbers), min(rows), max(rows))
        for (column, rule), rows in cells.items()
        if len(rows) > 1 and _moves(page, column, *sorted(rows)[:2])
    }


def _moves(page: Page, column: int, row: int, other: int) -> bool:
    """Whether the formula in ``other`` is the one in ``row``, filled down, on its own sheet."""
    texts = page.pieces[row, column].content, page.pieces[other, column].content
    places = f"{_letter(column)}{row}", f"{_letter(column)}{other}"
    return (
        "!" not in texts[0]
        and Translator(texts[0], places[0]).translate_formula(places[1]) == (texts[1])
    )


def _formula(row: int, column: int, text: str, fill: _Fill | None) -> str:
    if fill is None:
        return f"<f>{escape(text[1:])}</f>"
    if row != fill.first:
        return f'<f t="shared" si="{fill.number}"/>'
    letter = _letter(column)
    area = f"{letter}{fill.first}:{letter}{fill.last}"
    return f'<f t="shared" ref="{area}" si="{fill.number}">{escape(text[1:])}</f>'


def _cell(row: int, column: int, piece: Piece, style_of: StyleOf, fill: _Fill | None) -> str:
    content = piece.content
    address = f"{_letter(column)}{row}"
    head = f'<c r="{address}" s="{style_of(piece.kind, piece.format, piece.align)}"'
    if content is None:
        return f"{head}/>"
    if isinstance(content, str):
        if is_formula(content):
            kind, value = typed(piece.stored)
            formula = _formula(row, column, content, fill)
            return f"{head}{kind}>{formula}<v>{value}</v></c>"
        kept = ' xml:space="preserve"' if content != content.strip() else ""
        return f'{head} t="inlineStr"><is><t{kept}>{escape(content)}</t></is></c>'
    kind, value = typed(content)
    return f"{head}{kind}><v>{value}</v></c>"


def typed(value: float | int | str | bool | None) -> tuple[str, str]:
    """Type attribute and text of a value; numbers with all their digits."""
    if isinstance(value, float):
        return "", repr(float(value))
    if isinstance(value, bool):
        return ' t="b"', str(int(value))
    if isinstance(value, str):
        return (' t="e"' if value.startswith("#") else ' t="str"'), escape(value)
    return "", "" if value is None else str(value)
