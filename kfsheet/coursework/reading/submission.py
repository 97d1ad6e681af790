"""Reading what came back: a submission is hostile until read.

The parts of the zip are read in memory, within limits, by a parser that refuses document types;
nothing is unpacked, nothing is executed, no link is followed, no stored value is kept. (openpyxl
needs several times as long and reads what we must not believe; this reader keeps formulas, numbers
and texts only.)
"""

from __future__ import annotations

import hashlib
import posixpath
import re
import zipfile
import zlib
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError
from xml.parsers import expat

from defusedxml import DefusedXmlException, ElementTree

from kfsheet.coursework.reading.worksheet import (
    LONGEST_TEXT,
    MOST_CELLS,
    Budget,
    Content,
    SheetReader,
)
from kfsheet.errors import SubmissionError
from kfsheet.parsing.references import Cell
from kfsheet.workbook.reading.archive import CUSTOM, properties, relations

MEGABYTE = 2**20
LARGEST_FILE, LARGEST_PART, LARGEST_TOTAL = 30 * MEGABYTE, 100 * MEGABYTE, 200 * MEGABYTE
MOST_PARTS, MOST_SHEETS, MOST_NAMES = 500, 60, 5_000
HIGHEST_RATIO = 400  # XML of a workbook shrinks 5 to 30 times, a bomb a thousand times
OLE = bytes.fromhex("D0CF11E0A1B11AE1")
WORKBOOK = re.compile(r"xl/workbook\w*\.xml", re.IGNORECASE)
ENCRYPTED = "EncryptedPackage".encode("utf-16-le")


@dataclass
class Book:
    """What a submission says: cells by sheet, names, token; never a stored value."""

    digest: str
    sheets: dict[str, dict[Cell, Content]] = field(default_factory=dict)
    parts: dict[str, str] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    sheet_names: dict[tuple[str, str], str] = field(default_factory=dict)
    """Names that one worksheet has for itself, by worksheet and name."""

    properties: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def read_submission(path: str | Path) -> Book:
    """Read a workbook within limits.

    Parameters
    ----------
    path : path
        The file that was handed in, whatever it is called.

    Raises
    ------
    SubmissionError
        If it is no workbook, is damaged, encrypted, too large, holds macros or tricks; the error's
        ``status`` says which.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise SubmissionError("too large", f"the file exceeds {LARGEST_FILE // MEGABYTE} MB")
        content = path.read_bytes()
    except OSError as error:
        raise SubmissionError("unreadable", f"the file cannot be read: {error.strerror}") from None
    _check_kind(content)
    try:
        with zipfile.ZipFile(BytesIO(content)) as archive:
            return _read(archive, hashlib.sha256(content).hexdigest())
    except SubmissionError:
        raise
    except DefusedXmlException:
        raise SubmissionError("refused", "its XML declares a document type") from None
    # Whatever a damaged file makes of these libraries is the file's fault; MemoryError is not here.
    except (
        zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, EOFError, KeyError, ValueError,
        ParseError, expat.ExpatError, NotImplementedError, RuntimeError, RecursionError, OSError,
        OverflowError, AttributeError, IndexError, TypeError,
    ) as error:  # fmt: skip
        detail = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        raise SubmissionError("damaged", f"the workbook cannot be opened: {detail}") from None


def _check_kind(content: bytes) -> None:
    if not content:
        raise SubmissionError("empty file", "the file has 0 bytes; hand it in again")
    if content.startswith(OLE):
        if ENCRYPTED in content:
            raise SubmissionError("encrypted", "the file is encrypted; save it without a password")
        raise SubmissionError("wrong kind", "this is an old .xls file; save it as .xlsx")
    if not content.startswith(b"PK"):  # what a file holds counts, not what it is called
        raise SubmissionError("wrong kind", "this is no .xlsx file, whatever its name says")


def _read(archive: zipfile.ZipFile, digest: str) -> Book:
    _check_parts(archive)
    parts = _Parts(archive)
    book = Book(digest)
    if any("externallink" in name.lower() for name in parts.names):
        book.remarks.append("links to other files were not followed")
    start = parts.start()
    root, links = parts.tree(start), parts.links(start)
    strings = _strings(parts, links)
    budget = Budget(MOST_CELLS)
    for sheet in _all(root, "sheet"):
        target = links.get(_attribute(sheet, "id"), ("", ""))
        if target[1].endswith("/worksheet"):
            if len(book.sheets) >= MOST_SHEETS:
                raise SubmissionError("too large", f"more than {MOST_SHEETS} worksheets")
            name = sheet.get("name", "")
            book.parts[name] = target[0]
            book.sheets[name] = SheetReader(strings, budget).read(parts.read(target[0]))
    titles = [sheet.get("name", "") for sheet in _all(root, "sheet")]
    for name in _all(root, "definedName")[:MOST_NAMES]:
        key, local = name.get("name", "").lower(), name.get("localSheetId")
        if local is None:
            book.names[key] = name.text or ""
        elif local.isdecimal() and int(local) < len(titles):
            book.sheet_names[titles[int(local)], key] = name.text or ""
    book.properties = _properties(parts)
    return book


def _check_parts(archive: zipfile.ZipFile) -> None:
    items = archive.infolist()
    if len(items) > MOST_PARTS:
        raise SubmissionError("too large", f"the file holds {len(items)} parts")
    names = [item.filename for item in items]
    # Programs differ in which of two equal names they read: one may show what another judges.
    if len(set(names)) < len(names):
        raise SubmissionError("refused", "two parts of the file have the same name")
    for item in items:
        name = item.filename.replace("\\", "/")
        # Nothing is unpacked here; a lecturer's next program may do so.
        if name.startswith("/") or ".." in name.split("/"):
            raise SubmissionError("refused", "a part of the file is named to leave its folder")
        if item.flag_bits & 1:
            raise SubmissionError("encrypted", "the file is encrypted; save it without a password")
        if item.file_size > LARGEST_PART:
            raise SubmissionError("too large", f"{name} unpacks to more than the limit")
        if item.file_size > MEGABYTE and item.file_size > HIGHEST_RATIO * item.compress_size:
            raise SubmissionError("too large", f"{name} unpacks to {item.file_size} bytes: a bomb")
        if name.lower().endswith("vbaproject.bin"):
            raise SubmissionError("refused", "the file holds macros; save it as .xlsx")
    if sum(item.file_size for item in items) > LARGEST_TOTAL:
        raise SubmissionError("too large", "the file unpacks to more than the limit")
    if "content.xml" in names and "mimetype" in names:
        words = "this is an OpenDocument file; save it as .xlsx, Excel's format"
        raise SubmissionError("wrong kind", words)
    if not any(WORKBOOK.fullmatch(name.replace("\\", "/")) for name in names):
        words = "the file is a zip, but no Excel workbook; if it holds submissions, unpack it first"
        raise SubmissionError("wrong kind", words)


class _Parts:
    """Parts of the zip, read with a limit that a false size in the directory cannot lift."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        # Some programs write xl\\workbook.xml, or other capitals: OPC has it that these are equal.
        self._names = {_plain(name): name for name in archive.namelist()}
        self.names = set(self._names)

    def read(self, name: str) -> bytes:
        # The directory's size is the sender's word; only what comes out counts.
        with self._archive.open(self._names[_plain(name)]) as part:
            content = part.read(LARGEST_PART + 1)
        if len(content) > LARGEST_PART:
            raise SubmissionError("too large", f"{name} unpacks to more than the limit")
        return content

    def start(self) -> str:
        """The part that holds the workbook, xl/workbook.xml by habit only."""
        for target, kind in self.links("").values():
            part = target.removeprefix("/")
            if kind.endswith("/officeDocument") and _plain(part) in self.names:
                return part
        return "xl/workbook.xml"

    def tree(self, name: str) -> Element:
        return ElementTree.fromstring(self.read(name), forbid_dtd=True)

    def links(self, name: str) -> dict[str, tuple[str, str]]:
        """Target and type by relationship id; targets outside the file are left out."""
        folder, base = posixpath.split(name)
        part = posixpath.join(folder, "_rels", f"{base}.rels")
        return relations(self.tree(part), folder) if _plain(part) in self.names else {}


def _plain(name: str) -> str:
    return name.replace("\\", "/").lower()


def _all(root: Element, tag: str) -> list[Element]:
    return [e for e in root.iter() if e.tag.rpartition("}")[2] == tag]


def _attribute(element: Element, name: str) -> str:
    """An attribute by its local name, whatever its namespace is called."""
    found = (v for k, v in element.attrib.items() if k.rpartition("}")[2] == name and "}" in k)
    return next(found, "")


def _strings(parts: _Parts, links: dict[str, tuple[str, str]]) -> list[str]:
    for target, kind in links.values():
        if kind.endswith("/sharedStrings") and _plain(target) in parts.names:
            return [_text(item) for item in _all(parts.tree(target), "si")]
    return []


def _text(item: Element) -> str:
    texts = (e.text or "" for e in item.iter() if e.tag.rpartition("}")[2] == "t")
    return "".join(texts)[:LONGEST_TEXT]


def _properties(parts: _Parts) -> dict[str, str]:
    found = properties(parts.tree(CUSTOM)) if _plain(CUSTOM) in parts.names else {}
    return {name: text[:LONGEST_TEXT] for name, text in found.items()}
