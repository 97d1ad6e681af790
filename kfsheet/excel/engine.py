"""IronCalc, the spreadsheet engine that comes with kfsheet; in this process or in one of its own.

A process of its own works while this one does something else, and can be stopped. It is this
module, run with ``python -m``; little is imported here, so that it starts at once.
"""

from __future__ import annotations

import marshal
import subprocess
import sys
import tempfile
import weakref
from contextlib import suppress
from itertools import starmap
from pathlib import Path
from typing import Any, BinaryIO

from kfsheet.errors import EngineError, KfsheetError, WorkbookError
from kfsheet.excel.stripping import Changes, strip_values

CellValue = float | int | str | bool | None
Values = dict[str, dict[tuple[int, int], CellValue]]
"""Value by sheet and (row, column), counted from 1; errors are strings such as '#DIV/0!'."""


class IronCalc:
    """A workbook in IronCalc: loaded once, calculated as often as inputs change."""

    def __init__(self, path: Path) -> None:
        import ironcalc

        with tempfile.TemporaryDirectory(prefix="kfsheet-") as folder:
            copy = Path(folder) / "copy.xlsx"
            strip_values(path, copy)
            try:
                self._model = ironcalc.load_from_xlsx(str(copy), "en", "UTC")
            except Exception as error:  # its own kind and, from Rust, PanicException
                raise EngineError(f"IronCalc cannot read the workbook: {error}") from None
        self._sheets = [sheet["name"] for sheet in self._model.get_worksheets_properties()]
        self._before: dict[tuple[int, int, int], CellValue] = {}

    def values(self, changes: Changes | None = None) -> Values:
        """Values of all cells that are not empty, with numbers put in first."""
        self._restore()
        for sheet, cells in (changes or {}).items():
            number = self._sheets.index(sheet)
            for (row, column), value in cells.items():
                self._put(number, row, column, value)
        try:
            self._model.evaluate()
        except Exception as error:
            raise EngineError(f"IronCalc cannot calculate the workbook: {error}") from None
        found: list[dict[tuple[int, int], CellValue]] = [{} for _ in self._sheets]
        cells = self._model.get_all_cells()
        values = starmap(self._model.get_cell_value, cells)
        for (sheet, row, column), value in zip(cells, values, strict=True):
            if value is not None:
                found[sheet][row, column] = value
        return dict(zip(self._sheets, found, strict=True))

    def _put(self, sheet: int, row: int, column: int, value: float | None) -> None:
        place = sheet, row, column
        formula = self._model.get_cell_formula(*place)
        self._before[place] = formula or self._model.get_cell_value(*place)
        self._write(place, value)

    def _write(self, place: tuple[int, int, int], content: CellValue) -> None:
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


class Apart:
    """IronCalc in a process of its own: it is asked first, and answers when it is done.

    Each question wants its answer before the next one. Errors come with the answers.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        command = [sys.executable, "-m", "kfsheet.excel.engine", str(path)]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        weakref.finalize(self, _end, self._process)

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
        try:
            kind, found = _received(self._process.stdout)
        except EOFError:
            raise EngineError(f"IronCalc ended while it calculated {self.path}") from None
        if kind != "values":
            raise {"WorkbookError": WorkbookError}.get(kind, EngineError)(found)
        return found


def _send(pipe: BinaryIO, value: object) -> None:
    content = marshal.dumps(value)
    pipe.write(len(content).to_bytes(8, "little") + content)
    pipe.flush()


def _received(pipe: BinaryIO) -> Any:
    """What was sent; all of it is read at once, since marshal.load asks for every few bytes."""
    head = pipe.read(8)
    content = pipe.read(int.from_bytes(head, "little")) if len(head) == 8 else b""
    return marshal.loads(content)  # EOFError where the other side has ended


def _end(process: subprocess.Popen) -> None:
    process.kill()
    process.communicate()


def main(path: str) -> None:
    """Answer what standard input asks, until it ends."""
    engine: IronCalc | None = None
    while True:
        try:
            changes = _received(sys.stdin.buffer)
        except EOFError:
            return
        try:
            engine = engine or IronCalc(Path(path))
            answer = ("values", engine.values(changes))
        except KfsheetError as error:
            answer = (type(error).__name__, str(error))
        _send(sys.stdout.buffer, answer)


if __name__ == "__main__":
    main(sys.argv[1])
