"""Recalculate a workbook from nothing in a spreadsheet engine that is not ours.

A file that carries stored values invites an engine to believe them: LibreOffice does. So every
engine is given a copy whose formulas have no values.
"""

from __future__ import annotations

import datetime
import shutil
import subprocess
import tempfile
import warnings
import zipfile
import zlib
from pathlib import Path
from typing import Any, Protocol
from xml.etree.ElementTree import ParseError

import openpyxl
from openpyxl.utils.datetime import to_excel
from openpyxl.utils.exceptions import InvalidFileException

from kfsheet.errors import EngineError, WorkbookError
from kfsheet.processes import completed
from kfsheet.workbook.engines.copies import Changes, strip_values
from kfsheet.workbook.engines.ironcalc import CellValue, IronCalc, Values
from kfsheet.workbook.engines.ironcalc_process import TIMEOUT, Apart

# Where installers put it on macOS and Windows without a word to PATH.
LIBREOFFICE_HOMES = (
    "/Applications/LibreOffice.app/Contents/MacOS/soffice",
    r"C:\Program Files\LibreOffice\program\soffice.exe",
)


class Engine(Protocol):
    """A workbook in an engine, which calculates it as often as it is asked to."""

    def values(self, changes: Changes | None = None) -> Values:
        """Values of all cells that are not empty, with numbers put in first."""
        ...


class Asked(Engine, Protocol):
    """A workbook in an engine that can be told beforehand what will be wanted."""

    def ask(self, changes: Changes | None = None) -> None:
        """Say what numbers may be put in; an engine that can begins to calculate."""
        ...


def recalculate(
    path: str | Path, engine: str = "ironcalc", changes: Changes | None = None
) -> Values:
    """Values of all cells of a workbook, computed from nothing by an independent engine.

    Parameters
    ----------
    path : path
        An ``.xlsx`` file; it is not changed.
    engine : {'ironcalc', 'libreoffice'}
        IronCalc is embedded; LibreOffice must be installed.
    changes : dict, optional
        Numbers that replace the content of cells before the calculation.

    Returns
    -------
    dict
        ``values[sheet][row, column]`` of every cell that is not empty.

    Raises
    ------
    WorkbookError
        If the file is no workbook.
    EngineError
        If the engine is unknown, missing, fails or takes longer than five minutes.
    """
    return open_in(path, engine).values(changes)


def open_in(path: str | Path, engine: str = "ironcalc") -> Engine:
    """A workbook in an engine; see :func:`recalculate`. The file is read once, here."""
    if engine not in ENGINES:
        raise EngineError(f"no engine {engine!r}; there is {', '.join(ENGINES)}")
    return ENGINES[engine](Path(path))


def ask_about(path: str | Path, engine: str = "ironcalc") -> Asked:
    """An engine that is asked about a file as it stands; see :func:`recalculate`.

    IronCalc works in a process of its own meanwhile, LibreOffice once the values are wanted.
    """
    asked = Apart(path) if engine == "ironcalc" else open_in(path, engine)
    asked.ask()
    return asked


def open_workbook(path: str | Path, *, data_only: bool = False) -> openpyxl.Workbook:
    """Open an ``.xlsx`` file, or say in one line why it is none."""
    try:
        with warnings.catch_warnings():
            # openpyxl warns of parts that it does not keep; we only read.
            warnings.simplefilter("ignore", UserWarning)
            return openpyxl.load_workbook(path, data_only=data_only)
    except OSError as error:
        raise WorkbookError(f"{path} cannot be read: {error.strerror or error}") from None
    except (
        InvalidFileException,
        zipfile.BadZipFile,
        zlib.error,
        ParseError,
        KeyError,
        ValueError,
        TypeError,
        AttributeError,
        IndexError,
    ) as error:
        detail = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise WorkbookError(f"{path} is not a workbook (.xlsx): {detail}") from None


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
        with tempfile.TemporaryDirectory(prefix="kfsheet-") as folder:
            copy = Path(folder) / "copy.xlsx"
            strip_values(self._path, copy, changes)
            converted = convert(copy, Path(folder) / "out", "xlsx:Calc MS Excel 2007 XML")
            book = open_workbook(converted, data_only=True)
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

    Each call has a profile of its own: two LibreOffices with one profile block each other.
    """
    command = libreoffice()
    if command is None:
        raise EngineError("LibreOffice is not installed; install it, or use --engine ironcalc")
    with tempfile.TemporaryDirectory(prefix="kfsheet-profile-") as profile:
        arguments = [
            command,
            f"-env:UserInstallation={Path(profile).as_uri()}",
            "--headless",
            "--convert-to",
            kind,
            "--outdir",
            str(folder),
            str(path),
        ]
        try:
            done = completed(arguments, TIMEOUT)
        except subprocess.TimeoutExpired:
            raise EngineError(f"LibreOffice took longer than {TIMEOUT} s") from None
    result = folder / f"{path.stem}.{kind.partition(':')[0]}"
    if not result.exists():
        words = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
        raise EngineError(f"LibreOffice cannot convert {path.name}: {words[-1]}")
    return result


ENGINES: dict[str, type[IronCalc] | type[LibreOffice]] = {
    "ironcalc": IronCalc,
    "libreoffice": LibreOffice,
}
