"""The parts of an .xlsx file as they are: sheets, names, formula cells; copies without values.

Worksheets of 10 MB are read by regular expressions that look at tags, whatever their prefix: an
XML parser needs a second for what is a question of a tenth.
"""

from __future__ import annotations

import posixpath
import re
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

from defusedxml import ElementTree
from openpyxl.utils import column_index_from_string, coordinate_to_tuple, get_column_letter
from openpyxl.workbook.defined_name import DefinedName

from kfsheet.errors import WorkbookError
from kfsheet.excel.references import Address

Changes = dict[str, dict[tuple[int, int], float | None]]
"""Numbers to put into cells before calculating, by sheet and (row, column); None empties one."""

PREFIX = re.compile(rb"<(\w+:)?worksheet\b")
# A value after a formula, or after the empty element of one that is shared. Both patterns begin
# with letters that are searched for quickly.
STORED = tuple(end + rb"\s*<%(p)bv\b[^>]*>[^<]*</%(p)bv>" for end in (b"</%(p)bf>", b"/>"))
EMPTIED = (b"</%(p)bf><%(p)bv></%(p)bv>", b"/><%(p)bv></%(p)bv>")
TYPED = re.compile(rb'\st="[A-Za-z]+"(?=[^<>]*>\s*<(?:\w+:)?f\b)')
FORMULA_CELL = re.compile(rb'<(?:\w+:)?c\b[^>]*?\br="([A-Z]+)([1-9][0-9]*)"[^>]*>\s*<(?:\w+:)?f\b')
CELL = re.compile(rb"<((?:\w+:)?c)((?:\s[^>]*)?)(?:/>|(?<!/)>.*?</\1>)", re.DOTALL)
TYPE = re.compile(rb'\s+t="[^"]*"')
ADDRESS = re.compile(rb'\sr="([A-Z]+\d+)"')
# openpyxl types an empty cell as a number, and IronCalc then reads a 0: a photo that is not there.
EMPTY = re.compile(rb'(<(?:\w+:)?c\s[^>]*?)\s+t="n"(\s*/>|></(?:\w+:)?c>)')
MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
LINKS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
# IronCalc 0.9.1 cannot load the comments that openpyxl writes; no formula needs them.
COMMENTS = re.compile(rb'<Relationship\b[^>]*/(?:comments|vmlDrawing)"[^>]*/>')
DRAWING = re.compile(rb"<legacyDrawing\b[^>]*/>")
WORKSHEET = re.compile(r"xl/worksheets/[^/]+\.xml")


@contextmanager
def _refusing(path: str | Path) -> Iterator[None]:
    """What a file that is no workbook raises, in one line."""
    try:
        yield
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


class Package:
    """Worksheets by title, defined names, and which cells hold formulas.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        with _refusing(path), zipfile.ZipFile(path) as archive:
            book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
            self._sheets = {t: archive.read(part) for t, part in _parts(archive).items()}
        self._names = {
            name.get("name", ""): name.text or "" for name in book.iter(f"{{{MAIN}}}definedName")
        }

    @property
    def titles(self) -> list[str]:
        """Titles of the worksheets, in order."""
        return list(self._sheets)

    def formulas(self, title: str) -> dict[int, set[int]]:
        """Rows of the cells of a worksheet that hold formulas, by column."""
        by_letters: dict[bytes, set[int]] = {}
        for letters, row in FORMULA_CELL.findall(self._sheets[title]):
            by_letters.setdefault(letters, set()).add(int(row))
        return {column_index_from_string(k.decode()): rows for k, rows in by_letters.items()}

    def named(self, name: str) -> Address | None:
        """The one cell that a defined name stands for, if there is such a cell."""
        if not self._names.get(name):
            return None
        places = list(DefinedName(name, attr_text=self._names[name]).destinations)
        if len(places) != 1 or places[0][0] not in self._sheets:
            return None
        try:
            return (places[0][0], *coordinate_to_tuple(places[0][1].replace("$", "")))
        except ValueError:
            return None


def strip_values(path: str | Path, copy: str | Path, changes: Changes | None = None) -> None:
    """Copy a workbook without the stored values of its formulas, and with ``changes`` put in.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """
    with _refusing(path), zipfile.ZipFile(path) as old, zipfile.ZipFile(copy, "w") as new:
        parts = _parts(old) if changes else {}
        numbers = {parts[sheet]: cells for sheet, cells in (changes or {}).items()}
        for item in old.infolist():
            content = old.read(item)
            if WORKSHEET.fullmatch(item.filename):
                content = DRAWING.sub(b"", _stripped(content))
                if item.filename in numbers:
                    content = _with_numbers(content, numbers[item.filename])
            elif item.filename.startswith("xl/worksheets/_rels/"):
                content = COMMENTS.sub(b"", content)
            new.writestr(item.filename, content)


def _parts(archive: zipfile.ZipFile) -> dict[str, str]:
    """Name inside the zip of every worksheet, by title."""
    links = relations(ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels")), "xl")
    sheets = ElementTree.fromstring(archive.read("xl/workbook.xml")).iter(f"{{{MAIN}}}sheet")
    return {sheet.get("name"): links[sheet.get(f"{{{LINKS}}}id")][0] for sheet in sheets}


def relations(root: Element, folder: str) -> dict[str, tuple[str, str]]:
    """Part and type by id, from the relations of a part that lies in ``folder``.

    Targets outside the file are left out.
    """
    return {
        item.get("Id", ""): (_inside(folder, item.get("Target", "")), item.get("Type", ""))
        for item in root
        if item.get("TargetMode") != "External"
    }


def _inside(folder: str, target: str) -> str:
    return target[1:] if target.startswith("/") else posixpath.normpath(f"{folder}/{target}")


def _stripped(xml: bytes) -> bytes:
    found = PREFIX.search(xml)
    prefix = {b"p": (found and found[1]) or b""}
    # An empty value, not none at all: IronCalc reports a formula that lacks the element.
    for stored, emptied in zip(STORED, EMPTIED, strict=True):
        xml = re.sub(stored % prefix, emptied % prefix, xml)
    xml = TYPED.sub(b"", xml)
    return EMPTY.sub(rb"\1\2", xml) if b't="n"' in xml else xml


def _with_numbers(xml: bytes, numbers: dict[tuple[int, int], float | None]) -> bytes:
    new = {f"{get_column_letter(c)}{r}".encode(): v for (r, c), v in numbers.items()}

    def cell(match: re.Match[bytes]) -> bytes:
        tag, attributes = match.groups()
        address = ADDRESS.search(attributes)
        if not address or address[1] not in new:
            return match[0]
        value = new[address[1]]
        content = b"" if value is None else b"<v>%s</v>" % repr(value).encode()
        return b"<%s%s>%s</%s>" % (tag, TYPE.sub(b"", attributes), content, tag)

    return CELL.sub(cell, xml)
