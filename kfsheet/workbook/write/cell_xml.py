"""The cells of a worksheet as XML, written directly.

openpyxl makes an object and an XML element of every cell, which is most of the time that a large
workbook takes. What is around the cells (styles, names, charts, widths) is left to it; the cells
are put into its file by :func:`kfsheet.workbook.write.reproducible_zip.finish`.

A formula that is filled down is written once and shared by the cells below, as Excel writes it:
a program that opens the file reads one formula, not a thousand. (As in Excel, a formula that refers
to another worksheet is not shared; there a relative reference would not move.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import count
from xml.sax.saxutils import escape

from openpyxl.formula.translate import Translator
from openpyxl.utils import get_column_letter

from kfsheet.workbook.write.sheet import Cell, FilledColumn, Formula, Sheet, is_formula

StyleOf = Callable[[str, str, str], int]
"""Number of a style, by kind, number format and alignment."""


def sheet_data(sheet: Sheet, style_of: StyleOf) -> str:
    """The element ``sheetData`` of a sheet, stored values with the formulas."""
    single: dict[int, dict[int, Cell]] = {}
    for (row, column), cell in sheet.cells.items():
        single.setdefault(row, {})[column] = cell
    numbers = count()
    columns = [
        (at, _Column(sheet, at, filled, style_of(filled.kind, filled.format, ""), numbers))
        for at, filled in sorted(sheet.columns.items())
    ]
    rows = {row for filled in sheet.columns.values() for row in filled.rows}
    parts = ["<sheetData>"]
    for row in sorted({*rows, *single, *sheet.heights}):
        height = sheet.heights.get(row)
        tall = f' ht="{height:g}" customHeight="1"' if height else ""
        own = single.get(row, {})
        cells = {at: c.cell(row) for at, c in columns if row in c.rows and at not in own}
        cells |= {at: _cell(row, at, cell, style_of) for at, cell in own.items()}
        inside = "".join(cells[at] for at in sorted(cells))
        parts.append(f'<row r="{row}"{tall}>{inside}</row>')
    parts.append("</sheetData>")
    return "".join(parts)


class _Column:
    """Writes the cells of a column that is filled down."""

    def __init__(
        self, sheet: Sheet, at: int, filled: FilledColumn, style: int, numbers: Iterator[int]
    ) -> None:
        self.rows, self._filled, self._letter = filled.rows, filled, _letter(at)
        self._style = style
        self._heads: dict[int, str] = {}
        """First cell of each rule that is shared, by row, and what the other cells hold."""
        self._shared: dict[int, str] = {}
        for number, rule in enumerate(filled.rules):
            # Each start has a rule of one row; the last rule fills what remains.
            last = filled.rows[-1] if number == len(filled.rules) - 1 else filled.first + number
            rows = range(filled.first + number, last + 1)
            rows = [row for row in rows if (row, at) not in sheet.cells]
            if rule and len(rows) > 1 and _moves(rule, self._letter, *rows[:2]):
                si = next(numbers)
                area = f"{self._letter}{rows[0]}:{self._letter}{rows[-1]}"
                head = f'<f t="shared" ref="{area}" si="{si}">'
                self._heads[rows[0]] = f"{head}{escape(rule(rows[0])[1:])}</f>"
                self._shared[number] = f'<f t="shared" si="{si}"/>'

    def cell(self, row: int) -> str:
        """One cell."""
        filled = self._filled
        number = filled.rule_number(row)
        if not filled.rules or filled.rules[number] is None:
            return _plain(f"{self._letter}{row}", self._style, filled.cell(row).content)
        formula = self._heads.get(row) or self._shared.get(number)
        kind, value = typed(filled.stored(row))
        formula = formula or f"<f>{escape(filled.rules[number](row)[1:])}</f>"
        return f'<c r="{self._letter}{row}" s="{self._style}"{kind}>{formula}<v>{value}</v></c>'


_letter = lru_cache(maxsize=20_000)(get_column_letter)


def _moves(rule: Formula, letter: str, row: int, other: int) -> bool:
    """Whether the formula in ``other`` is the one in ``row``, filled down, on its own sheet."""
    text = rule(row)
    if "!" in text:  # Excel shares no formula that refers to another worksheet
        return False
    return Translator(text, f"{letter}{row}").translate_formula(f"{letter}{other}") == rule(other)


def _cell(row: int, column: int, cell: Cell, style_of: StyleOf) -> str:
    address, style = f"{_letter(column)}{row}", style_of(cell.kind, cell.format, cell.align)
    if not is_formula(cell.content):
        return _plain(address, style, cell.content)
    kind, value = typed(cell.stored)
    return f'<c r="{address}" s="{style}"{kind}><f>{escape(cell.content[1:])}</f><v>{value}</v></c>'


def _plain(address: str, style: int, content: float | int | str | None) -> str:
    head = f'<c r="{address}" s="{style}"'
    if content is None:
        return f"{head}/>"
    if isinstance(content, str):
        # In the cell itself: openpyxl has saved the table of shared strings without our cells.
        kept = ' xml:space="preserve"' if content != content.strip() else ""
        return f'{head} t="inlineStr"><is><t{kept}>{escape(content)}</t></is></c>'
    kind, value = typed(content)
    return f"{head}{kind}><v>{value}</v></c>"


def typed(value: float | int | str | bool | None) -> tuple[str, str]:
    """Type attribute and text of a value; numbers with all their digits."""
    if isinstance(value, float):
        return "", repr(float(value))  # NumPy's own repr is "np.float64(...)"
    if isinstance(value, bool):
        return ' t="b"', str(int(value))
    if isinstance(value, str):
        return (' t="e"' if value.startswith("#") else ' t="str"'), escape(value)
    return "", "" if value is None else str(value)
