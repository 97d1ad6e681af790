"""The zip of an .xlsx file: its worksheets by title, and what leads from one part to another."""

from __future__ import annotations

import posixpath
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

from defusedxml import ElementTree

from kfsheet.errors import WorkbookError

MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
CUSTOM = "docProps/custom.xml"
LINKS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"


@contextmanager
def refusing(path: str | Path, *others: type[Exception]) -> Iterator[None]:
    """What a file that is no workbook raises, in one line; ``others`` are what a reader adds."""
    broken = (zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, EOFError, KeyError, ParseError)
    try:
        yield
    except OSError as error:
        raise WorkbookError(f"{path} cannot be read: {error.strerror or error}") from None
    except (*broken, *others) as error:
        detail = (str(error).splitlines() or [type(error).__name__])[0]
        raise WorkbookError(f"{path} is not a workbook (.xlsx): {detail}") from None


def worksheet_parts(archive: zipfile.ZipFile) -> dict[str, str]:
    """Name inside the zip of every worksheet, by title."""
    links = relations(ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels")), "xl")
    sheets = ElementTree.fromstring(archive.read("xl/workbook.xml")).iter(f"{{{MAIN}}}sheet")
    return {sheet.get("name"): links[sheet.get(f"{{{LINKS}}}id")][0] for sheet in sheets}


def properties(root: Element) -> dict[str, str]:
    """A file's own properties by name, from docProps/custom.xml; programs keep them, unseen."""
    found = (item for item in root.iter() if item.tag.rpartition("}")[2] == "property")
    return {item.get("name", ""): "".join(item.itertext()) for item in found}


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
