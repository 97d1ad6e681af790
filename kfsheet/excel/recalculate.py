"""Recalculate a workbook from nothing in a spreadsheet engine that is not ours.

A file that carries stored values invites an engine to believe them: LibreOffice does. So every
engine is given a copy whose formulas have no values.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
import warnings
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from xml.etree.ElementTree import ParseError

import openpyxl
from defusedxml import ElementTree
from openpyxl.utils import get_column_letter
from openpyxl.utils.exceptions import InvalidFileException

from kfsheet.errors import EngineError, WorkbookError

CellValue = float | int | str | bool | None
Values = dict[str, dict[tuple[int, int], CellValue]]
"""Value by sheet and (row, column), counted from 1; errors are strings such as '#DIV/0!'."""

TIMEOUT = 300  # seconds, for LibreOffice
# Where installers put it on macOS and Windows without a word to PATH.
LIBREOFFICE_HOMES = (
    "/Applications/LibreOffice.app/Contents/MacOS/soffice",
    r"C:\Program Files\LibreOffice\program\soffice.exe",
)
CELL = re.compile(rb"<((?:\w+:)?c)((?:\s[^>]*[^>/])?)>(.*?)</\1>", re.DOTALL)
VALUE = re.compile(rb"<((?:\w+:)?v)\b[^>]*?(?:/>|>.*?</\1>)", re.DOTALL)
TYPE = re.compile(rb'\s+t="[^"]*"')
# openpyxl types an empty cell as a number, and IronCalc then reads a 0: a photo that is not there.
EMPTY = re.compile(rb'(<(?:\w+:)?c\s[^>]*?)\s+t="n"(\s*/>|></(?:\w+:)?c>)')
HOLLOW = re.compile(rb"<((?:\w+:)?c)(\s[^>]*?)\s*/>")
ADDRESS = re.compile(rb'\sr="([A-Z]+\d+)"')
MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
LINKS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
# IronCalc 0.9.1 cannot load the comments that openpyxl writes; no formula needs them.
COMMENTS = re.compile(rb'<Relationship\b[^>]*/(?:comments|vmlDrawing)"[^>]*/>')
DRAWING = re.compile(rb"<legacyDrawing\b[^>]*/>")
HAS_FORMULA = re.compile(rb"<(?:\w+:)?f\b")


Changes = dict[str, dict[tuple[int, int], float | None]]
"""Numbers to put into cells before calculating, by sheet and (row, column); None empties one."""


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
    if engine not in ENGINES:
        raise EngineError(f"no engine {engine!r}; there is {', '.join(ENGINES)}")
    with tempfile.TemporaryDirectory(prefix="kfsheet-") as folder:
        copy = Path(folder) / "copy.xlsx"
        strip_values(path, copy, changes)
        return ENGINES[engine](copy)


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


def strip_values(path: str | Path, copy: str | Path, changes: Changes | None = None) -> None:
    """Copy a workbook without the stored values of its formulas, and with ``changes`` put in.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """
    try:
        with zipfile.ZipFile(path) as old, zipfile.ZipFile(copy, "w", zipfile.ZIP_DEFLATED) as new:
            new_numbers = {_parts(old)[sheet]: cells for sheet, cells in (changes or {}).items()}
            for item in old.infolist():
                content = old.read(item)
                if re.fullmatch(r"xl/worksheets/[^/]+\.xml", item.filename):
                    content = _strip(content, new_numbers.get(item.filename, {}))
                    content = DRAWING.sub(b"", content)
                elif item.filename.startswith("xl/worksheets/_rels/"):
                    content = COMMENTS.sub(b"", content)
                new.writestr(item.filename, content)
    except OSError as error:
        raise WorkbookError(f"{path} cannot be read: {error.strerror or error}") from None
    except (
        zipfile.BadZipFile,
        zipfile.LargeZipFile,
        zlib.error,
        EOFError,
        KeyError,
        ParseError,
    ) as error:
        raise WorkbookError(f"{path} is not a workbook (.xlsx): {error}") from None


def _parts(archive: zipfile.ZipFile) -> dict[str, str]:
    """Name inside the zip of every worksheet, by title."""
    links = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
    targets = {link.get("Id"): link.get("Target", "") for link in links}
    sheets = ElementTree.fromstring(archive.read("xl/workbook.xml")).iter(f"{{{MAIN}}}sheet")
    homes = {sheet.get("name"): targets[sheet.get(f"{{{LINKS}}}id")] for sheet in sheets}
    return {
        title: home.lstrip("/") if home.startswith("/") else f"xl/{home}"
        for title, home in homes.items()
    }


def _strip(xml: bytes, numbers: dict[tuple[int, int], float | None]) -> bytes:
    new = {f"{get_column_letter(c)}{r}".encode(): v for (r, c), v in numbers.items()}

    def cell(match: re.Match[bytes]) -> bytes:
        tag, attributes, inside = match.groups()
        address = ADDRESS.search(attributes)
        if address and address[1] in new:
            value = new[address[1]]
            content = b"" if value is None else b"<v>%s</v>" % repr(value).encode()
            return b"<%s%s>%s</%s>" % (tag, TYPE.sub(b"", attributes), content, tag)
        if not HAS_FORMULA.search(inside):
            return match[0]
        # An empty value, not none at all: IronCalc reports a formula that lacks the element.
        emptied = VALUE.sub(rb"<\1></\1>", inside)
        return b"<%s%s>%s</%s>" % (tag, TYPE.sub(b"", attributes), emptied, tag)

    def filled(match: re.Match[bytes]) -> bytes:
        tag, attributes = match.groups()
        address = ADDRESS.search(attributes)
        value = new.get(address[1]) if address else None
        if value is None:
            return match[0]
        content = b"<v>%s</v>" % repr(value).encode()
        return b"<%s%s>%s</%s>" % (tag, TYPE.sub(b"", attributes), content, tag)

    xml = EMPTY.sub(rb"\1\2", CELL.sub(cell, xml))
    return HOLLOW.sub(filled, xml) if new else xml


def _ironcalc(copy: Path) -> Values:
    import ironcalc

    try:
        model = ironcalc.load_from_xlsx(str(copy), "en", "UTC")
        model.evaluate()
    except Exception as error:  # IronCalc raises its own kind and, from Rust, PanicException
        raise EngineError(f"IronCalc cannot calculate the workbook: {error}") from None
    names = [sheet["name"] for sheet in model.get_worksheets_properties()]
    values: Values = {name: {} for name in names}
    for sheet, row, column in model.get_all_cells():
        values[names[sheet]][row, column] = model.get_cell_value(sheet, row, column)
    return values


def libreoffice() -> str | None:
    """Path of LibreOffice's command, if it is installed."""
    on_path = shutil.which("soffice") or shutil.which("libreoffice")
    return on_path or next((place for place in LIBREOFFICE_HOMES if Path(place).exists()), None)


def _libreoffice(copy: Path) -> Values:
    converted = convert(copy, copy.parent / "out", "xlsx:Calc MS Excel 2007 XML")
    book = open_workbook(converted, data_only=True)
    return {
        sheet.title: {
            (cell.row, cell.column): cell.value
            for row in sheet.iter_rows()
            for cell in row
            if cell.value is not None
        }
        for sheet in book.worksheets
    }


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
            done = subprocess.run(arguments, capture_output=True, text=True, timeout=TIMEOUT)
        except subprocess.TimeoutExpired:
            raise EngineError(f"LibreOffice took longer than {TIMEOUT} s") from None
    result = folder / f"{path.stem}.{kind.partition(':')[0]}"
    if not result.exists():
        words = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
        raise EngineError(f"LibreOffice cannot convert {path.name}: {words[-1]}")
    return result


ENGINES: dict[str, Callable[[Path], Values]] = {"ironcalc": _ironcalc, "libreoffice": _libreoffice}
