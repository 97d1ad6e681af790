"""Copies of workbooks that an engine can take, without the stored values of formulas.

An engine is given the normal form of a workbook, so that no odd name of a part is its error, and
looks that nobody asks for are left out. Worksheets of 10 MB are changed by regular expressions that
look at tags: an XML parser needs a second for what is a question of a tenth.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable, Iterator
from io import BytesIO
from itertools import groupby
from math import isfinite
from pathlib import Path

from kfsheet.errors import EngineError
from kfsheet.workbook.engines.shared_formulas import share_formulas
from kfsheet.workbook.engines.spreadsheet_engine import Changes
from kfsheet.workbook.reading.archive import Container, refusing
from kfsheet.workbook.reading.normal_form import STYLES, WORKSHEET, normal_form
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
LETTERS = b"ABCDEFGHIJKLMNOPQRSTUVWXYZ"
STYLE = re.compile(rb'(<(?:\w+:)?c\b[^>]*?)\ss="[0-9]+"')
# openpyxl types an empty cell as a number, and IronCalc then reads a 0: a photo that is not there.
EMPTY = re.compile(rb'(<(?:\w+:)?c\s[^>]*?)\s+t="n"(\s*/>|></(?:\w+:)?c>)')
# IronCalc 0.9.1 cannot load the comments that openpyxl writes; no formula needs them.
COMMENTS = re.compile(rb'<Relationship\b[^>]*/(?:comments|vmlDrawing)"[^>]*/>')
DRAWING = re.compile(rb"<legacyDrawing\b[^>]*/>")
BROKEN = re.compile(rb"(<f\b[^>]*>)([^<(]*\([^<]*)</f>")
QUOTED = re.compile(rb"\"[^\"]*\"|'[^']*'")
DATA_END = re.compile(rb"</sheetData>|<sheetData\s*/>")


def strip_values(path: str | Path, copy: str | Path, changes: Changes | None = None) -> None:
    """Copy a workbook without the stored values of its formulas, and with ``changes`` put in.

    The copy has no number formats either, so that nobody takes a number for a date.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """
    with refusing(path):
        old = normal_form(Container.open(path))
        numbers = {old.worksheets[sheet]: cells for sheet, cells in (changes or {}).items()}

        def rewritten(name: str, xml: bytes) -> bytes:
            xml = BROKEN.sub(_not_closed, STYLE.sub(rb"\1", _without_values(xml)))
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
        return share_formulas(xml) if ours else STYLE.sub(rb"\1", _without_values(xml))

    with refusing(path):
        _copy(normal_form(Container.open(path)), copy, rewritten, looks=ours)


def _copy(
    old: Container,
    copy: str | Path,
    rewritten: Callable[[str, bytes], bytes],
    looks: bool = False,
) -> None:
    """Copy a workbook without comments and, unless they are wanted, ``looks``."""
    content = BytesIO()
    styles = None if looks else old.linked("styles")
    with zipfile.ZipFile(content, "w") as new:
        for name in old.names:
            # IronCalc panics where styles are not as Excel writes them: Gnumeric's are not.
            part = STYLES if name == styles else old.read(name)
            if WORKSHEET.fullmatch(name):
                part = DRAWING.sub(b"", rewritten(name, part))
                part = EMPTY.sub(rb"\1\2", part) if b't="n"' in part else part
            elif name.startswith("xl/worksheets/_rels/"):
                part = COMMENTS.sub(b"", part)
            new.writestr(name, part)
    try:
        Path(copy).write_bytes(content.getbuffer())
    except OSError as error:
        folder = Path(copy).parent
        words = f"a copy of the workbook cannot be written to {folder}: {error.strerror or error}"
        raise EngineError(f"{words}; make room there, or set TMPDIR") from None


def _not_closed(match: re.Match[bytes]) -> bytes:
    """An error in the place of a formula that LibreOffice would mend and Excel would refuse."""
    bare = QUOTED.sub(b"", match[2].replace(b"&quot;", b'"'))
    return match[0] if bare.count(b"(") == bare.count(b")") else match[1] + b"NA()</f>"


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
    new = {f"{get_column_letter(c)}{r}".encode(): v for (r, c), v in sorted(numbers.items())}

    def cell(match: re.Match[bytes]) -> bytes:
        tag, attributes = match.groups()
        address = ADDRESS.search(attributes)
        if not address or address[1] not in new:
            return match[0]
        value = new.pop(address[1])
        content = b"" if value is None else b"<v>%s</v>" % repr(value).encode()
        return b"<%s%s>%s</%s>" % (tag, TYPE.sub(b"", attributes), content, tag)

    xml = CELL.sub(cell, xml)
    more = b"".join(_rows({place: value for place, value in new.items() if value is not None}))
    if not more:
        return xml
    return DATA_END.sub(
        lambda end: (b"<sheetData>" if b"/>" in end[0] else b"") + more + b"</sheetData>", xml, 1
    )


def _rows(cells: dict[bytes, float]) -> Iterator[bytes]:
    """Rows of cells that were not in the file; the rows may be there already, with others."""
    for row, those in groupby(cells.items(), lambda item: item[0].lstrip(LETTERS)):
        inner = b"".join(b'<c r="%s"><v>%s</v></c>' % (a, repr(v).encode()) for a, v in those)
        yield b'<row r="%s">%s</row>' % (row, inner)
