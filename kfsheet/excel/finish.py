"""One pass over the parts of a saved workbook: stored values in, moments of time out.

openpyxl writes formulas without their values, numbers with 16 digits, and stamps files with the
hour. A previewer, pandas or a phone needs the values; some numbers need 17 digits; a build that is
to be compared byte by byte must not know the hour.
"""

from __future__ import annotations

import re
import zipfile
import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

from kfsheet.excel.cells import typed

EPOCH = (1980, 1, 1, 0, 0, 0)
FORMULA = re.compile(r'<c r="([A-Z]+\d+)"([^>]*)><f>(.*?)</f><v ?/?>(?:</v>)?</c>', re.DOTALL)
NUMBER = re.compile(r'(<c r="([A-Z]+\d+)"[^>]*><v>)([^<]*)</v>')
# An empty cell that is typed as a number is read as 0 by some programs.
EMPTY = re.compile(r'(<c r="[A-Z]+\d+"(?: s="\d+")?) t="n"(?: ?/>|></c>)')
MOMENT = re.compile(r"(<dcterms:(created|modified)[^>]*>)[^<]*(</dcterms:\2>)")
SHEET_DATA = re.compile(r"<sheetData ?/>|<sheetData>.*?</sheetData>", re.DOTALL)
DIMENSION = re.compile(r"<dimension [^>]*/>")
# Every program that saves a workbook writes its own name here.
PROGRAM = re.compile(rb"(<Application>)[^<]*(</Application>)")
BY_US = b"kfsheet"

Value = float | int | str | bool | None


def finish(
    saved: bytes,
    values: Mapping[str, Mapping[str, Value]] | None = None,
    *,
    sheets: Mapping[str, str] | None = None,
) -> bytes:
    """A saved workbook without moments of time, and with what openpyxl does not write.

    Parameters
    ----------
    saved : bytes
        What openpyxl saved.
    values : mapping, optional
        ``values[part][cell]`` is stored in formula cells, and in numbers; ``part`` is the name
        inside the zip, ``xl/worksheets/sheet1.xml``.
    sheets : mapping, optional
        ``sheets[part]`` is the element ``sheetData`` that replaces openpyxl's.
    """
    values, sheets = values or {}, sheets or {}
    result = BytesIO()
    with zipfile.ZipFile(BytesIO(saved)) as old, zipfile.ZipFile(result, "w") as new:
        for name in sorted(old.namelist()):
            content = old.read(name)
            if name in values:
                content = _with_values(content.decode(), values[name]).encode()
            elif name in sheets:
                content = _with_cells(content.decode(), sheets[name]).encode()
            elif name == "docProps/core.xml":
                content = MOMENT.sub(r"\g<1>2000-01-01T00:00:00Z\3", content.decode()).encode()
            elif name == "docProps/app.xml":
                content = PROGRAM.sub(rb"\g<1>%s\2" % BY_US, content)
            info = zipfile.ZipInfo(name, EPOCH)
            info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 0
            new.writestr(info, content)
    return result.getvalue()


def _with_cells(xml: str, cells: str) -> str:
    """Cells in the place of openpyxl's, and no claim about how far they reach."""
    return SHEET_DATA.sub(lambda _: cells, DIMENSION.sub("", xml), count=1)


def _with_values(xml: str, values: Mapping[str, Value]) -> str:
    def cell(match: re.Match) -> str:
        address, attributes, formula = match.groups()
        kind, text = typed(values[address])
        return f'<c r="{address}"{attributes}{kind}><f>{formula}</f><v>{text}</v></c>'

    def number(match: re.Match) -> str:
        head, address, text = match.groups()
        return f"{head}{values.get(address, text)!s}</v>"

    return EMPTY.sub(r"\1 />", FORMULA.sub(cell, NUMBER.sub(number, xml)))


def untouched(path: Path) -> bool:
    """Whether a workbook is as it was built: no other program has saved it since."""
    try:
        with zipfile.ZipFile(path) as archive:
            program = PROGRAM.search(archive.read("docProps/app.xml"))
    except (OSError, KeyError, zipfile.BadZipFile, zlib.error):
        return False
    return bool(program) and program[0].split(b">")[1].startswith(BY_US)
