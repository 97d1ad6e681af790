"""LibreOffice, the second opinion: a program of its own, which must be installed."""

from __future__ import annotations

import datetime
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from openpyxl.utils.datetime import to_excel

from kfsheet.errors import EngineError, MissingEngineError
from kfsheet.processes import completed
from kfsheet.workbook.engines.copies_for_engines import strip_values
from kfsheet.workbook.engines.spreadsheet_engine import TIMEOUT, CellValue, Changes, Values
from kfsheet.workbook.reading.open_workbook import open_workbook

# Where installers put it on macOS and Windows without a word to PATH.
LIBREOFFICE_HOMES = (
    "/Applications/LibreOffice.app/Contents/MacOS/soffice",
    r"C:\Program Files\LibreOffice\program\soffice.exe",
)


def libreoffice() -> str | None:
    """Path of LibreOffice's command, if it is installed."""
    on_path = shutil.which("soffice") or shutil.which("libreoffice")
    return on_path or next((place for place in LIBREOFFICE_HOMES if Path(place).exists()), None)


class LibreOffice:
    """A workbook in LibreOffice, which opens a copy of it each time."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def ask(self, changes: Changes | None = None) -> None:
        """Nothing begins here: it takes seconds, perhaps in vain."""

    def values(self, changes: Changes | None = None) -> Values:
        """Values of all cells that are not empty, with numbers put in first."""
        return self.values_of_all([changes])[0]

    def values_of_all(self, trials: Sequence[Changes | None]) -> list[Values]:
        """The same for several sets of numbers; the program starts once."""
        with tempfile.TemporaryDirectory(prefix="kfsheet-") as folder:
            copies = [Path(folder) / f"copy{n}.xlsx" for n in range(len(trials))]
            for copy, changes in zip(copies, trials, strict=True):
                # It believes stored values, and would answer what the file already says.
                strip_values(self._path, copy, changes)
            found = convert_all(copies, Path(folder) / "out", "xlsx:Calc MS Excel 2007 XML")
            return [_values_in(path) for path in found]


def _values_in(path: Path) -> Values:
    book = open_workbook(path, data_only=True)
    return {
        sheet.title: {
            (cell.row, cell.column): _number_of_a_date(cell.value, book.epoch)
            for row in sheet.iter_rows()
            for cell in row
            if cell.value is not None
        }
        for sheet in book.worksheets
    }


def _number_of_a_date(value: Any, epoch: datetime.datetime) -> CellValue:
    """What a cell holds that only looks like a date; openpyxl goes by the look."""
    dates = datetime.date | datetime.time | datetime.timedelta
    return to_excel(value, epoch) if isinstance(value, dates) else value


def convert(path: Path, folder: Path, kind: str) -> Path:
    """Convert a workbook with LibreOffice to ``kind`` ("pdf", "xlsx:...") in ``folder``.

    Raises
    ------
    EngineError
        If LibreOffice is not installed, fails or takes longer than five minutes.
    """
    return convert_all([path], folder, kind)[0]


def convert_all(paths: Sequence[Path], folder: Path, kind: str) -> list[Path]:
    """Convert several workbooks, in one start of the program; see :func:`convert`."""
    command = libreoffice()
    if command is None:
        raise MissingEngineError(
            "LibreOffice is not installed; install it, or use --engine ironcalc"
        )
    # A profile for each call: two LibreOffices with one profile block each other.
    with tempfile.TemporaryDirectory(prefix="kfsheet-profile-") as profile:
        arguments = [
            command,
            f"-env:UserInstallation={Path(profile).as_uri()}",
            "--headless",
            "--convert-to",
            kind,
            "--outdir",
            str(folder),
            *map(str, paths),
        ]
        try:
            done = completed(arguments, TIMEOUT)
        except subprocess.TimeoutExpired:
            raise EngineError(f"LibreOffice took longer than {TIMEOUT} s") from None
    results = [folder / f"{path.stem}.{kind.partition(':')[0]}" for path in paths]
    for path, result in zip(paths, results, strict=True):
        if not result.exists():  # its exit status is 0 even then
            words = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
            raise EngineError(f"LibreOffice cannot convert {path.name}: {words[-1]}")
    return results
