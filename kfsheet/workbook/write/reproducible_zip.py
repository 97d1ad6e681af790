"""One pass over the parts of a saved workbook: cells in, moments of time out.

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

EPOCH = (1980, 1, 1, 0, 0, 0)
MOMENT = re.compile(r"(<dcterms:(created|modified)[^>]*>)[^<]*(</dcterms:\2>)")
SHEET_DATA = re.compile(r"<sheetData ?/>|<sheetData>.*?</sheetData>", re.DOTALL)
DIMENSION = re.compile(r"<dimension [^>]*/>")
# Every program that saves a workbook writes its own name here.
PROGRAM = re.compile(rb"(<Application>)[^<]*(</Application>)")
BY_US = b"kfsheet"


def reproducible_zip(saved: bytes, cells: Mapping[str, str]) -> bytes:
    """A saved workbook without moments of time, and with cells.

    Parameters
    ----------
    saved : bytes
        What openpyxl saved.
    cells : mapping
        ``cells[part]`` is the element ``sheetData`` that replaces openpyxl's; ``part`` is the name
        inside the zip, ``xl/worksheets/sheet1.xml``.
    """
    result = BytesIO()
    with zipfile.ZipFile(BytesIO(saved)) as old, zipfile.ZipFile(result, "w") as new:
        for name in sorted(old.namelist()):
            content = old.read(name)
            if name in cells:
                content = _with_cells(content.decode(), cells[name]).encode()
            elif name == "docProps/core.xml":
                content = MOMENT.sub(r"\g<1>2000-01-01T00:00:00Z\3", content.decode()).encode()
            elif name == "docProps/app.xml":
                content = PROGRAM.sub(rb"\g<1>%s\2" % BY_US, content)
            # A zip holds the hour of each part and the system that made it: none of them here.
            info = zipfile.ZipInfo(name, EPOCH)
            info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 0
            new.writestr(info, content)
    return result.getvalue()


def _with_cells(xml: str, cells: str) -> str:
    """Cells in the place of openpyxl's, and no claim about how far they reach."""
    return SHEET_DATA.sub(lambda _: cells, DIMENSION.sub("", xml), count=1)


def untouched(path: Path) -> bool:
    """Whether a workbook is as it was built: no other program has saved it since."""
    try:
        with zipfile.ZipFile(path) as archive:
            program = PROGRAM.search(archive.read("docProps/app.xml"))
    except (OSError, KeyError, zipfile.BadZipFile, zlib.error):
        return False
    return bool(program) and program[0].split(b">")[1].startswith(BY_US)
