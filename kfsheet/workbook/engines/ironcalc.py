"""IronCalc, the spreadsheet engine of the extra ``check``, in this process."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import groupby, starmap
from operator import itemgetter
from pathlib import Path
from types import ModuleType

from kfsheet.errors import EngineError, MissingEngineError
from kfsheet.workbook.engines.copies_for_engines import copy_for_ironcalc
from kfsheet.workbook.engines.spreadsheet_engine import CellValue, Changes, Values

Place = tuple[int, int, int]
"""Number of the sheet, counted from 0, row and column, counted from 1."""
Cells = dict[str, list[tuple[int, int]]]
"""Row and column, counted from 1, of the cells of each sheet."""


@contextmanager
def _one_line(words: str) -> Iterator[None]:
    """What IronCalc raises, in one line; a panic of Rust is no Exception to Python."""
    try:
        yield
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:
        first = (str(error).splitlines() or [type(error).__name__])[0]
        raise EngineError(f"{words}: {first}") from None


def _ironcalc() -> ModuleType:
    try:
        import ironcalc
    except ImportError:
        raise MissingEngineError(
            'IronCalc is not installed; pip install "kfsheet[check]", or use libreoffice'
        ) from None
    return ironcalc


class IronCalc:
    """A workbook in IronCalc: loaded once, calculated as often as inputs change."""

    def __init__(self, path: Path, folder: str | None = None) -> None:
        """``folder`` is where a copy of the file may lie for a moment."""
        ironcalc = _ironcalc()
        self._path = path
        with tempfile.TemporaryDirectory(prefix="kfsheet-", dir=folder) as own:
            copy = Path(own) / "copy.xlsx"
            copy_for_ironcalc(path, copy)
            with _one_line(f"IronCalc cannot read {path}"):
                self._model = ironcalc.load_from_xlsx(str(copy), "en", "UTC")
        self._titles = [sheet["name"] for sheet in self._model.get_worksheets_properties()]
        self._before: dict[Place, CellValue] = {}
        self._places: list[Place] = []
        self._sorted: list[Place] = []
        self._cells: Cells = {}

    def ask(self, changes: Changes | None = None) -> None:
        """Nothing begins here: this process has something else to do."""

    def values(self, changes: Changes | None = None) -> Values:
        """Values of all cells that are not empty, with numbers put in first."""
        return by_address(*self.calculated(changes))

    def calculated(self, changes: Changes | None = None) -> tuple[Cells, list[CellValue]]:
        """All cells, and the values of one after the other, with numbers put in first."""
        if unknown := [sheet for sheet in changes or {} if sheet not in self._titles]:
            raise EngineError(f"{self._path} has no worksheet {unknown[0]!r} to put numbers in")
        with _one_line(f"IronCalc cannot put numbers into {self._path}"):
            # The last question's numbers would be part of this one's answer.
            self._restore()
            for sheet, cells in (changes or {}).items():
                number = self._titles.index(sheet)
                for (row, column), value in cells.items():
                    self._put(number, row, column, value)
        with _one_line(f"IronCalc cannot calculate {self._path}"):
            self._model.evaluate()
        cells = self.cells()
        return cells, list(starmap(self._model.get_cell_value, self._sorted))

    def cells(self) -> Cells:
        """All cells that are there; the very same object as long as they are the same."""
        places = self._model.get_all_cells()
        if places != self._places:
            self._places = places
            # The cells of a sheet together; within one, the order of IronCalc will do.
            self._sorted = sorted(places, key=itemgetter(0))
            self._cells = {title: [] for title in self._titles}
            for sheet, those in groupby(self._sorted, itemgetter(0)):
                self._cells[self._titles[sheet]] = [place[1:] for place in those]
        return self._cells

    def _put(self, sheet: int, row: int, column: int, value: float | None) -> None:
        place = sheet, row, column
        formula = self._model.get_cell_formula(*place)
        self._before[place] = formula or self._model.get_cell_value(*place)
        self._write(place, value)

    def _write(self, place: Place, content: CellValue) -> None:
        if content is None:
            self._model.clear_cell_contents(*place)
        elif isinstance(content, bool):
            self._model.update_cell_with_bool(*place, content)
        elif isinstance(content, int | float):
            self._model.update_cell_with_number(*place, content)
        elif content.startswith("="):
            self._model.update_cell_with_formula(*place, content)
        else:
            self._model.update_cell_with_text(*place, content)

    def _restore(self) -> None:
        """Take the last changes back."""
        for place, content in self._before.items():
            self._write(place, content)
        self._before.clear()


def by_address(cells: Cells, values: list[CellValue]) -> Values:
    """Values that are not empty, sheet by sheet."""
    found, start = {}, 0
    for title, places in cells.items():
        those = zip(places, values[start : start + len(places)], strict=True)
        found[title] = {place: value for place, value in those if value is not None}
        start += len(places)
    return found
