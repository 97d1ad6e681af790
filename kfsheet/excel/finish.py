"""One pass over the parts of a saved workbook: stored values in, moments of time out.

openpyxl writes formulas without their values and stamps files with the hour. A previewer, pandas
or a phone needs the values; a build that is to be compared byte by byte must not know the hour.
"""

from __future__ import annotations

import os
import re
import tempfile
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from xml.sax.saxutils import escape

from kfsheet.errors import WorkbookError

EPOCH = (1980, 1, 1, 0, 0, 0)
FORMULA = re.compile(r'<c r="([A-Z]+\d+)"([^>]*)><f>(.*?)</f><v ?/?>(?:</v>)?</c>', re.DOTALL)
# An empty cell that is typed as a number is read as 0 by some programs.
EMPTY = re.compile(r'(<c r="[A-Z]+\d+"(?: s="\d+")?) t="n"( ?/>)')
MOMENT = re.compile(r"(<dcterms:(created|modified)[^>]*>)[^<]*(</dcterms:\2>)")

Value = float | int | str | bool | None


def finish(saved: bytes, values: Mapping[str, Mapping[str, Value]]) -> bytes:
    """A saved workbook with ``values[part][cell]`` stored in its formula cells.

    ``part`` is the name inside the zip, ``xl/worksheets/sheet1.xml``.
    """
    result = BytesIO()
    with zipfile.ZipFile(BytesIO(saved)) as old, zipfile.ZipFile(result, "w") as new:
        for name in sorted(old.namelist()):
            content = old.read(name)
            if name in values:
                content = _with_values(content.decode(), values[name]).encode()
            elif name == "docProps/core.xml":
                content = MOMENT.sub(r"\g<1>2000-01-01T00:00:00Z\3", content.decode()).encode()
            info = zipfile.ZipInfo(name, EPOCH)
            info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 0
            new.writestr(info, content)
    return result.getvalue()


def _with_values(xml: str, values: Mapping[str, Value]) -> str:
    def cell(match: re.Match) -> str:
        address, attributes, formula = match.groups()
        kind, text = _typed(values[address])
        return f'<c r="{address}"{attributes}{kind}><f>{formula}</f><v>{text}</v></c>'

    return EMPTY.sub(r"\1\2", FORMULA.sub(cell, xml))


def _typed(value: Value) -> tuple[str, str]:
    """Type attribute and text of a stored value."""
    if isinstance(value, bool):
        return ' t="b"', str(int(value))
    if isinstance(value, str):
        return (' t="e"' if value.startswith("#") else ' t="str"'), escape(value)
    return "", repr(value)


def write_file(path: str | Path, content: bytes) -> Path:
    """Write a file whole or not at all: to a temporary neighbour, then renamed.

    Raises
    ------
    WorkbookError
        If the folder cannot be made or written, naming it.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise _unwritable(path, error) from None
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as error:
        Path(temporary).unlink(missing_ok=True)
        raise _unwritable(path, error) from None
    return path


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _unwritable(path: Path, error: OSError) -> WorkbookError:
    return WorkbookError(
        f"{path} cannot be written ({error.strerror}); choose another folder, "
        "or close the file if a program holds it open"
    )
