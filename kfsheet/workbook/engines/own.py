"""Our own calculator as an engine: it opens whatever can be read, and needs nothing installed.

It reads formulas as text and knows nothing of models; but it is ours, so that others come first.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from kfsheet.errors import KfsheetError
from kfsheet.parsing.calculator import Error, Formula, SheetCalculator
from kfsheet.parsing.references import Cell
from kfsheet.workbook.engines.spreadsheet_engine import UNREAD, CellValue, Changes, Values
from kfsheet.workbook.reading.archive import Container, refusing
from kfsheet.workbook.reading.book import read_book


class Own:
    """A workbook in our own calculator, in this process."""

    def __init__(self, path: Path) -> None:
        with refusing(path):
            book = read_book(Container.open(path))
        self._sheets = book.sheets
        self._calculator = SheetCalculator(book.sheets, {**book.names, **book.sheet_names})

    def ask(self, changes: Changes | None = None) -> None:
        """Nothing begins here: this process has something else to do."""

    def values(self, changes: Changes | None = None) -> Values:
        """Values of all cells that are not empty, with numbers put in first."""
        new = {(s, *at): v for s, cells in (changes or {}).items() for at, v in cells.items()}
        calculator = self._calculator.with_changes(new) if new else self._calculator
        found: Values = {}
        for title, cells in self._sheets.items():
            places = dict.fromkeys(place for cell in cells for place in _filled(cells[cell], cell))
            places |= dict.fromkeys((changes or {}).get(title, ()))
            values = ((place, _value(calculator, title, place)) for place in places)
            found[title] = {place: value for place, value in values if value is not None}
        return found


def _filled(content: object, cell: Cell) -> Iterator[Cell]:
    """The cells that a content fills: an array formula more than its own."""
    if not isinstance(content, Formula) or not content.area:
        yield cell
        return
    top, left, bottom, right = content.area
    yield from ((r, c) for r in range(top, bottom + 1) for c in range(left, right + 1))


def _value(calculator: SheetCalculator, title: str, place: Cell) -> CellValue:
    try:
        value = calculator.value((title, *place))
    except KfsheetError:
        return UNREAD
    return value.value if isinstance(value, Error) else value
