"""Copies of workbooks that an engine can take, without the stored values of formulas.

Worksheets of 10 MB are changed by regular expressions that look at tags, whatever their prefix: an
XML parser needs a second for what is a question of a tenth.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from io import BytesIO
from math import isfinite
from pathlib import Path

from kfsheet.errors import EngineError
from kfsheet.workbook.engines.shared_formulas import share_formulas
from kfsheet.workbook.engines.spreadsheet_engine import Changes
from kfsheet.workbook.reading.archive import refusing, worksheet_parts
from kfsheet.workbook.write.reproducible_zip import untouched

PREFIX = re.compile(rb"<(\w+:)?worksheet\b")
# A value after a formula, or after the empty element of one that is shared. Both patterns begin
# with letters that are searched for quickly.
STORED = tuple(end + rb"\s*<%(p)bv\b[^>]*>[^<]*</%(p)bv>" for end in (b"</%(p)bf>", b"/>"))
EMPTIED = (b"</%(p)bf><%(p)bv></%(p)bv>", b"/><%(p)bv></%(p)bv>")
TYPED = re.compile(rb'\st="[A-Za-z]+"(?=[^<>]*>\s*<(?:\w+:)?f\b)')
KINDS = [b't="%s"' % kind for kind in (b"str", b"n", b"b", b"e", b"s", b"d")]
CELL = re.compile(rb"<((?:\w+:)?c)((?:\s[^>]*)?)(?:/>|(?<!/)>.*?</\1>)", re.DOTALL)
TYPE = re.compile(rb'\s+t="[^"]*"')
ADDRESS = re.compile(rb'\sr="([A-Z]+\d+)"')
STYLE = re.compile(rb'(<(?:\w+:)?c\b[^>]*?)\ss="[0-9]+"')
# openpyxl types an empty cell as a number, and IronCalc then reads a 0: a photo that is not there.
EMPTY = re.compile(rb'(<(?:\w+:)?c\s[^>]*?)\s+t="n"(\s*/>|></(?:\w+:)?c>)')
# IronCalc 0.9.1 cannot load the comments that openpyxl writes; no formula needs them.
COMMENTS = re.compile(rb'<Relationship\b[^>]*/(?:comments|vmlDrawing)"[^>]*/>')
DRAWING = re.compile(rb"<legacyDrawing\b[^>]*/>")
WORKSHEET = re.compile(r"xl/worksheets/[^/]+\.xml")


def strip_values(path: str | Path, copy: str | Path, changes: Changes | None = None) -> None:
    """Copy a workbook without the stored values of its formulas, and with ``changes`` put in.

    The copy has no number formats either, so that nobody takes a number for a date.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """
    with refusing(path), zipfile.ZipFile(path) as old:
        parts = worksheet_parts(old) if changes else {}
        numbers = {parts[sheet]: cells for sheet, cells in (changes or {}).items()}

        def rewritten(name: str, xml: bytes) -> bytes:
            xml = STYLE.sub(rb"\1", _without_values(xml))
            return _with_numbers(xml, numbers[name]) if name in numbers else xml

        _copy(old, copy, rewritten)


def copy_for_ironcalc(path: str | Path, copy: str | Path) -> None:
    """Copy a workbook so that IronCalc can load it, and soon.

    IronCalc computes every formula whatever value is stored with it. Formulas of a file that is as
    we built it are shared; of others the values go, since they may be what IronCalc does not know.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """
    ours = untouched(Path(path))

    def rewritten(_: str, xml: bytes) -> bytes:
        return share_formulas(xml) if ours else _without_values(xml)

    with refusing(path), zipfile.ZipFile(path) as old:
        _copy(old, copy, rewritten)


def _copy(old: zipfile.ZipFile, copy: str | Path, rewritten: Callable[[str, bytes], bytes]) -> None:
    """Copy a workbook without comments, its worksheets rewritten."""
    content = BytesIO()
    with zipfile.ZipFile(content, "w") as new:
        for item in old.infolist():
            part = old.read(item)
            if WORKSHEET.fullmatch(item.filename):
                part = DRAWING.sub(b"", rewritten(item.filename, part))
                part = EMPTY.sub(rb"\1\2", part) if b't="n"' in part else part
            elif item.filename.startswith("xl/worksheets/_rels/"):
                part = COMMENTS.sub(b"", part)
            new.writestr(item.filename, part)
    try:
        Path(copy).write_bytes(content.getbuffer())
    except OSError as error:
        folder = Path(copy).parent
        words = f"a copy of the workbook cannot be written to {folder}: {error.strerror or error}"
        raise EngineError(f"{words}; make room there, or set TMPDIR") from None


def _without_values(xml: bytes) -> bytes:
    found = PREFIX.search(xml)
    prefix = {b"p": (found and found[1]) or b""}
    # An empty value, not none at all: IronCalc reports a formula that lacks the element.
    for stored, emptied, needed in zip(STORED, EMPTIED, (b"", b"shared"), strict=True):
        if needed in xml:
            xml = re.sub(stored % prefix, emptied % prefix, xml)
    return TYPED.sub(b"", xml) if any(kind in xml for kind in KINDS) else xml


def _with_numbers(xml: bytes, numbers: dict[tuple[int, int], float | None]) -> bytes:
    from openpyxl.utils import get_column_letter  # costly, and IronCalc takes no numbers this way

    if odd := [v for v in numbers.values() if v is not None and not isfinite(v)]:
        raise EngineError(f"a cell cannot hold the number {odd[0]}")
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
