"""What every spreadsheet engine takes and gives."""

from __future__ import annotations

from typing import Protocol

TIMEOUT = 300  # seconds that an answer may take

UNREAD = "#ERROR!"  # what our own engine shows where it cannot calculate a formula

Changes = dict[str, dict[tuple[int, int], float | None]]
"""Numbers to put into cells before calculating, by sheet and (row, column); None empties one."""
CellValue = float | int | str | bool | None
SheetValues = dict[tuple[int, int], CellValue]
"""Value by row and column, counted from 1; errors are strings such as '#DIV/0!'."""
Values = dict[str, SheetValues]
"""Values by the sheet's title."""


class Engine(Protocol):
    """A workbook in an engine, which calculates it as often as it is asked to."""

    def ask(self, changes: Changes | None = None) -> None:
        """Say what numbers may be put in; an engine that works in the background begins."""
        ...

    def values(self, changes: Changes | None = None) -> Values:
        """Values of all cells that are not empty, with numbers put in first."""
        ...
