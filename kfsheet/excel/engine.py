"""IronCalc, the spreadsheet engine that comes with kfsheet; in this process or in one of its own.

A process of its own works while this one does something else, and can be stopped. It calls
:func:`main`; little is imported here, so that it starts at once.
"""

from __future__ import annotations

import marshal
import shutil
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import groupby, starmap
from operator import itemgetter
from pathlib import Path
from threading import Timer
from typing import Any, BinaryIO

from kfsheet.errors import EngineError, KfsheetError, WorkbookError
from kfsheet.excel.stripping import Changes, strip_values
from kfsheet.processes import answers, command

TIMEOUT = 300  # seconds

CellValue = float | int | str | bool | None
Place = tuple[int, int, int]
"""Number of the sheet, counted from 0, row and column, counted from 1."""
Cells = dict[str, list[tuple[int, int]]]
"""Row and column, counted from 1, of the cells of each sheet."""
Values = dict[str, dict[tuple[int, int], CellValue]]
"""Value by sheet and (row, column), counted from 1; errors are strings such as '#DIV/0!'."""


@contextmanager
def _words(words: str) -> Iterator[None]:
    """What IronCalc raises, in one line; a panic of Rust is no Exception to Python."""
    try:
        yield
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:
        first = (str(error).splitlines() or [type(error).__name__])[0]
        raise EngineError(f"{words}: {first}") from None


class IronCalc:
    """A workbook in IronCalc: loaded once, calculated as often as inputs change."""

    def __init__(self, path: Path, folder: str | None = None) -> None:
        """``folder`` is where a copy of the file may lie for a moment."""
        import ironcalc

        self._path = path
        with tempfile.TemporaryDirectory(prefix="kfsheet-", dir=folder) as own:
            copy = Path(own) / "copy.xlsx"
            strip_values(path, copy)
            with _words(f"IronCalc cannot read {path}"):
                self._model = ironcalc.load_from_xlsx(str(copy), "en", "UTC")
        self._titles = [sheet["name"] for sheet in self._model.get_worksheets_properties()]
        self._before: dict[Place, CellValue] = {}
        self._places: list[Place] = []
        self._sorted: list[Place] = []
        self._cells: Cells = {}

    def values(self, changes: Changes | None = None) -> Values:
        """Values of all cells that are not empty, with numbers put in first."""
        return _by_address(*self.calculated(changes))

    def calculated(self, changes: Changes | None = None) -> tuple[Cells, list[CellValue]]:
        """All cells, and the values of one after the other, with numbers put in first."""
        self._restore()
        for sheet, cells in (changes or {}).items():
            number = self._titles.index(sheet)
            for (row, column), value in cells.items():
                self._put(number, row, column, value)
        with _words(f"IronCalc cannot calculate {self._path}"):
            self._model.evaluate()
        places = self._model.get_all_cells()
        if places != self._places:
            self._places = places
            self._sorted = sorted(places, key=itemgetter(0))
            self._cells = {title: [] for title in self._titles}
            for sheet, those in groupby(self._sorted, itemgetter(0)):
                self._cells[self._titles[sheet]] = [place[1:] for place in those]
        return self._cells, list(starmap(self._model.get_cell_value, self._sorted))

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


def _by_address(cells: Cells, values: list[CellValue]) -> Values:
    """Values that are not empty, sheet by sheet."""
    found, start = {}, 0
    for title, places in cells.items():
        those = zip(places, values[start : start + len(places)], strict=True)
        found[title] = {place: value for place, value in those if value is not None}
        start += len(places)
    return found


class Apart:
    """IronCalc in a process of its own: it is asked first, and answers when it is done.

    Each question wants its answer before the next one. Errors come with the answers.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._folder = tempfile.mkdtemp(prefix="kfsheet-")  # ours, who live longer
        self._process = subprocess.Popen(
            command("kfsheet.excel.engine", "main", str(path), self._folder),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        weakref.finalize(self, _end, self._process, self._folder)
        self._cells: Cells = {}

    def ask(self, changes: Changes | None = None) -> None:
        """Calculate, with numbers put in first."""
        plain = {  # marshal writes NumPy's numbers as bytes
            sheet: {cell: value if value is None else float(value) for cell, value in cells.items()}
            for sheet, cells in (changes or {}).items()
        }
        with suppress(OSError):  # it has ended; the answer will say so
            _send(self._process.stdin, plain)

    def answer(self) -> Values:
        """Values of all cells that are not empty."""
        limit = Timer(TIMEOUT, self._process.kill)
        limit.start()
        try:
            kind, *found = _received(self._process.stdout)
        except EOFError:
            late = f", after {TIMEOUT} s" if limit.finished.is_set() else ""
            raise EngineError(f"IronCalc ended while it calculated {self.path}{late}") from None
        finally:
            limit.cancel()
        if kind != "values":
            raise {"WorkbookError": WorkbookError}.get(kind, EngineError)(*found)
        cells, values = found
        self._cells = cells or self._cells
        return _by_address(self._cells, values)


def _send(pipe: BinaryIO, value: object) -> None:
    content = marshal.dumps(value)
    pipe.write(len(content).to_bytes(8, "little") + content)
    pipe.flush()


def _received(pipe: BinaryIO) -> Any:
    """What was sent; all of it is read at once, since marshal.load asks for every few bytes."""
    head = pipe.read(8)
    content = pipe.read(int.from_bytes(head, "little")) if len(head) == 8 else b""
    return marshal.loads(content)  # EOFError where the other side has ended


def _end(process: subprocess.Popen, folder: str) -> None:
    process.kill()
    process.communicate()
    shutil.rmtree(folder, ignore_errors=True)


def main(path: str, folder: str) -> None:
    """Answer what standard input asks, until it ends."""
    pipe = answers()
    engine: IronCalc | None = None
    told: Cells = {}
    while True:
        try:
            changes = _received(sys.stdin.buffer)
        except EOFError:
            return
        try:
            engine = engine or IronCalc(Path(path), folder)
            cells, values = engine.calculated(changes)
            # The same cells each time, unless one was emptied: they are sent once.
            answer = "values", None if cells is told else cells, values
            told = cells
        except KfsheetError as error:
            answer = type(error).__name__, str(error)
        _send(pipe, answer)
