"""The cells of a worksheet as XML, written directly.

openpyxl makes an object and an XML element of every cell, which is most of the time that a large
workbook takes. What is around the cells (styles, names, charts, widths) is left to it; the cells
are put into its file by :func:`kfsheet.excel.finish.finish`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from xml.sax.saxutils import escape

from openpyxl.utils import get_column_letter

from kfsheet.excel.compose import Page, Piece

StyleOf = Callable[[str, str, str], int]
"""Number of a style, by kind, number format and alignment."""


def sheet_data(page: Page, style_of: StyleOf) -> str:
    """The element ``sheetData`` of a page, stored values with the formulas."""
    rows: dict[int, list[tuple[int, Piece]]] = {}
    for (row, column), piece in page.pieces.items():
        rows.setdefault(row, []).append((column, piece))
    parts = ["<sheetData>"]
    for row in sorted({*rows, *page.heights}):
        height = page.heights.get(row)
        tall = f' ht="{height:g}" customHeight="1"' if height else ""
        cells = "".join(
            _cell(f"{_letter(column)}{row}", piece, style_of)
            for column, piece in sorted(rows.get(row, ()), key=_column)
        )
        parts.append(f'<row r="{row}"{tall}>{cells}</row>')
    parts.append("</sheetData>")
    return "".join(parts)


def _column(cell: tuple[int, Piece]) -> int:
    return cell[0]


_letter = lru_cache(maxsize=20_000)(get_column_letter)


def _cell(address: str, piece: Piece, style_of: StyleOf) -> str:
    content = piece.content
    head = f'<c r="{address}" s="{style_of(piece.kind, piece.format, piece.align)}"'
    if content is None:
        return f"{head}/>"
    if isinstance(content, str):
        if content.startswith("="):
            kind, value = typed(piece.stored)
            return f"{head}{kind}><f>{escape(content[1:])}</f><v>{value}</v></c>"
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
