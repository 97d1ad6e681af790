r"""The zip of an .xlsx file, opened with suspicion: its parts by name, and what leads to them.

Parts are read in memory, within limits, by parsers that refuse document types; nothing is unpacked,
nothing is executed, no link is followed. Names are compared by the rules of the format, under which
capitals do not matter, a backslash is a slash, and ``%20`` is a space.
"""

from __future__ import annotations

import posixpath
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote
from xml.etree.ElementTree import Element, ParseError
from xml.parsers import expat

from defusedxml import DefusedXmlException, ElementTree

from kfsheet.errors import KfsheetError, UnreadableFileError, WorkbookError

MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
START = "xl/workbook.xml"  # where it lies by habit only
MEGABYTE = 2**20
HIGHEST_RATIO = 400  # XML of a workbook shrinks 5 to 30 times, a bomb a thousand times
OLE = bytes.fromhex("D0CF11E0A1B11AE1")
ENCRYPTED = "EncryptedPackage".encode("utf-16-le")
# Whatever a damaged file makes of these libraries is the file's fault; MemoryError is not here.
ACCIDENTS = (
    zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, EOFError, KeyError, ValueError,
    ParseError, expat.ExpatError, NotImplementedError, RuntimeError, RecursionError, OSError,
    OverflowError, AttributeError, IndexError, TypeError,
)  # fmt: skip


class Limits(NamedTuple):
    """Bytes of a file, of one part, of all parts when unpacked; how many parts."""

    file: int
    part: int
    total: int
    parts: int


SUBMISSION = Limits(30 * MEGABYTE, 100 * MEGABYTE, 200 * MEGABYTE, 500)
OWN = Limits(*(10 * limit for limit in SUBMISSION))


class Link(NamedTuple):
    """Where a relation leads, a name as it stands in the zip if it is there, and its type."""

    part: str
    kind: str


@contextmanager
def readable() -> Iterator[None]:
    """Errors with a status, whatever a damaged file makes of the libraries that read it."""
    try:
        yield
    except KfsheetError:
        raise
    except DefusedXmlException:
        raise UnreadableFileError("refused", "its XML declares a document type") from None
    except ACCIDENTS as error:
        detail = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        words = f"the workbook cannot be opened: {detail}"
        raise UnreadableFileError("damaged", words) from None


@contextmanager
def refusing(path: str | Path) -> Iterator[None]:
    """What a file that is no workbook raises, in one line."""
    try:
        with readable():
            yield
    except UnreadableFileError as error:
        if error.status == "unreadable":
            raise WorkbookError(f"{path} cannot be read: {error.remark}") from None
        raise WorkbookError(f"{path} is not a workbook (.xlsx): {error.remark}") from None


def plain_name(name: str) -> str:
    """The name of a part as it is compared with others."""
    return unquote(name.replace("\\", "/")).removeprefix("/").lower()


def local_name(tag: str) -> str:
    """The name of an element, whatever its namespace."""
    return tag.rpartition("}")[2]


def elements(root: Element, tag: str) -> list[Element]:
    """All elements of a local name."""
    return [e for e in root.iter() if local_name(e.tag) == tag]


class Container:
    """The parts of a workbook.

    Parameters
    ----------
    content : bytes
        The file.
    limits : Limits, optional
        How large it may be.

    Raises
    ------
    UnreadableFileError
        If it is no zip of a workbook, is encrypted, too large or holds tricks; see ``status``.
    """

    def __init__(self, content: bytes, limits: Limits = OWN) -> None:
        _check_kind(content)
        self.content, self.limits = content, limits
        self._archive = zipfile.ZipFile(BytesIO(content))
        self._check_parts(self._archive.infolist())
        self._names = {plain_name(name): name for name in self._archive.namelist()}
        self._read: dict[str, bytes] = {}

    @classmethod
    def open(cls, path: str | Path, limits: Limits = OWN) -> Container:
        """The parts of the file at a path."""
        try:
            if Path(path).stat().st_size > limits.file:
                words = f"the file exceeds {limits.file // MEGABYTE} MB"
                raise UnreadableFileError("too large", words)
            content = Path(path).read_bytes()
        except OSError as error:
            words = error.strerror or str(error)
            raise UnreadableFileError("unreadable", words) from None
        return cls(content, limits)

    @property
    def names(self) -> list[str]:
        """Names of all parts as they stand in the zip."""
        return self._archive.namelist()

    def find(self, name: str) -> str | None:
        """The name of a part as it stands in the zip."""
        return self._names.get(plain_name(name))

    def read(self, name: str) -> bytes:
        """The content of a part."""
        key = plain_name(name)
        if key not in self._read:
            self._read[key] = self._unpacked(self._names[key])
        return self._read[key]

    def _unpacked(self, name: str) -> bytes:
        # The directory's size is the sender's word; only what comes out counts.
        with self._archive.open(name) as part:
            content = part.read(self.limits.part + 1)
        if len(content) > self.limits.part:
            raise UnreadableFileError("too large", f"{name} unpacks to more than the limit")
        if b"<!DOCTYPE" in content[:MEGABYTE] and plain_name(name).endswith((".xml", ".rels")):
            raise UnreadableFileError("refused", "its XML declares a document type")
        return content

    def tree(self, name: str) -> Element:
        """The elements of a part."""
        return ElementTree.fromstring(self.read(name), forbid_dtd=True)

    @cached_property
    def start(self) -> str:
        """The part that holds the workbook."""
        links = [link.part for link in self.links("").values() if _leads_to(link, "officeDocument")]
        found = next(filter(None, map(self.find, [*links, START])), None)
        if found is None or not plain_name(found).endswith(".xml"):
            words = "the file is a zip, but no Excel workbook (.xlsx)"
            raise UnreadableFileError(
                "wrong kind", f"{words}; if it holds submissions, unpack it first"
            )
        return found

    @cached_property
    def workbook(self) -> Element:
        """The elements of the part with which it starts."""
        root = self.tree(self.start)
        if local_name(root.tag) != "workbook":
            raise UnreadableFileError("wrong kind", "the file holds no Excel workbook; save it so")
        return root

    @cached_property
    def worksheets(self) -> dict[str, str]:
        """Names of the parts of all worksheets, by title."""
        links, found = self.links(self.start), {}
        for sheet in elements(self.workbook, "sheet"):
            link = links.get(_prefixed(sheet, "id"))
            if link and _leads_to(link, "worksheet"):
                found[sheet.get("name", "")] = self._names[plain_name(link.part)]
        return found

    def linked(self, kind: str) -> str | None:
        """The part of a kind, such as ``sharedStrings``, to which the workbook leads."""
        links = self.links(self.start).values()
        return next((self.find(link.part) for link in links if _leads_to(link, kind)), None)

    def links(self, name: str) -> dict[str, Link]:
        """Where a part leads, by id; targets outside the file are left out."""
        folder, base = posixpath.split(name.replace("\\", "/"))
        relations = self.find(posixpath.join(folder, "_rels", f"{base}.rels"))
        if relations is None:
            return {}
        return {
            item.get("Id", ""): Link(self.target(folder, item), item.get("Type", ""))
            for item in self.tree(relations)
            if item.get("TargetMode") != "External"
        }

    def target(self, folder: str, item: Element) -> str:
        """The part to which a relation of a part in ``folder`` leads."""
        there = item.get("Target", "").replace("\\", "/")
        path = there[1:] if there.startswith("/") else posixpath.normpath(f"{folder}/{there}")
        return self.find(path) or path.removeprefix("/")

    @cached_property
    def properties(self) -> dict[str, str]:
        """The file's own properties by name; programs keep them, unseen."""
        links = [k.part for k in self.links("").values() if _leads_to(k, "custom-properties")]
        part = next(filter(None, map(self.find, [*links, "docProps/custom.xml"])), None)
        found = elements(self.tree(part), "property") if part else []
        return {item.get("name", ""): "".join(item.itertext()).strip() for item in found}

    def _check_parts(self, items: list[zipfile.ZipInfo]) -> None:
        if len(items) > self.limits.parts:
            raise UnreadableFileError("too large", f"the file holds {len(items)} parts")
        plain = [plain_name(item.filename) for item in items]
        # Programs differ in which of two equal names they read: one may show what another judges.
        if len(set(plain)) < len(plain):
            raise UnreadableFileError("refused", "two parts of the file have the same name")
        for item, name in zip(items, plain, strict=True):
            # Nothing is unpacked here; a lecturer's next program may do so.
            if item.filename.startswith(("/", "\\")) or ".." in name.split("/"):
                words = "a part of the file is named to leave its folder"
                raise UnreadableFileError("refused", words)
            if item.flag_bits & 1:
                words = "the file is encrypted; save it without a password"
                raise UnreadableFileError("encrypted", words)
            if item.file_size > self.limits.part:
                raise UnreadableFileError("too large", f"{name} unpacks to more than the limit")
            bomb = item.file_size > HIGHEST_RATIO * item.compress_size
            if bomb and item.file_size > MEGABYTE:
                words = f"{name} unpacks to {item.file_size} bytes: a bomb"
                raise UnreadableFileError("too large", words)
        if sum(item.file_size for item in items) > self.limits.total:
            raise UnreadableFileError("too large", "the file unpacks to more than the limit")
        if "content.xml" in plain and "mimetype" in plain:
            words = "this is an OpenDocument file; save it as .xlsx, Excel's format"
            raise UnreadableFileError("wrong kind", words)


def _check_kind(content: bytes) -> None:
    if not content:
        raise UnreadableFileError("empty file", "the file has 0 bytes; hand it in again")
    if content.startswith(OLE):
        if ENCRYPTED in content:
            words = "the file is encrypted; save it without a password"
            raise UnreadableFileError("encrypted", words)
        raise UnreadableFileError("wrong kind", "this is an old .xls file; save it as .xlsx")
    if not content.startswith(b"PK"):  # what a file holds counts, not what it is called
        words = "this is no .xlsx file, whatever its name says"
        raise UnreadableFileError("wrong kind", words)


def _leads_to(link: Link, kind: str) -> bool:
    return link.kind.lower().endswith(f"/{kind.lower()}")


def _prefixed(element: Element, name: str) -> str:
    """An attribute by its local name, whatever its namespace is called."""
    found = (v for k, v in element.attrib.items() if local_name(k) == name and "}" in k)
    return next(found, "")
