"""A workbook as Excel would have saved it: what all other modules, and engines, are given.

Programs name parts as they like, prefix every element, leave out addresses that can be counted,
or save the strict variant of the format. All of that is one workbook. A container that is plain
already, as most are, is left as it is.
"""

from __future__ import annotations

import posixpath
import re
import zipfile
from io import BytesIO
from xml.etree.ElementTree import Element

from kfsheet.errors import UnreadableFileError
from kfsheet.workbook.reading.archive import (
    MAIN,
    START,
    Container,
    local_name,
    plain_name,
)

TYPES = "[Content_Types].xml"
WORKSHEET = re.compile(r"xl/worksheets/[^/\\%]+\.xml")
STRICT = b"purl.oclc.org/ooxml"
TRANSITIONAL = {  # the rest keeps its words
    b"spreadsheetml/main": b"spreadsheetml/2006/main",
    b"drawingml/": b"drawingml/2006/",
    b"officeDocument/extendedProperties": b"officeDocument/2006/extended-properties",
    b"officeDocument/customProperties": b"officeDocument/2006/custom-properties",
    b"officeDocument/relationships/extendedProperties":
        b"officeDocument/2006/relationships/extended-properties",
    b"officeDocument/relationships/customProperties":
        b"officeDocument/2006/relationships/custom-properties",
    b"officeDocument/": b"officeDocument/2006/",
}  # fmt: skip
STRICT_NAME = re.compile(
    rb"http://purl\.oclc\.org/ooxml/(%s)" % b"|".join(sorted(TRANSITIONAL, key=len, reverse=True))
)
HEAD = re.compile(
    rb'\s*(?:<\?xml(?:(?!encoding|\?>).)*(?:encoding=["\'](?i:utf-8|us-ascii)["\'][^>]*)?\?>)?'
    rb'\s*<(?:workbook|worksheet|sst|styleSheet)\b[^>]*\sxmlns="%s"' % re.escape(MAIN.encode()),
    re.DOTALL,
)
ODD = (b"<!", b't="d"')
# A cell or a row whose address is not found by a quick look.
UNPLACED = re.compile(rb'<c(?=[\s/>])(?! r="[A-Z])|<row(?=[\s/>])(?![^<>]* r="[1-9])')
CHOICE = b"AlternateContent"
PLACES = {  # where parts of these types lie by habit
    "styles": "xl/styles.xml",
    "sharedStrings": "xl/sharedStrings.xml",
    "theme": "xl/theme/theme1.xml",
}
STYLES = (
    f'<styleSheet xmlns="{MAIN}"><fonts count="1"><font><sz val="11"/><name val="Calibri"/></font>'
    '</fonts><fills count="2"><fill><patternFill patternType="none"/></fill><fill><patternFill '
    'patternType="gray125"/></fill></fills><borders count="1"><border><left/><right/><top/>'
    '<bottom/><diagonal/></border></borders><cellStyleXfs count="1"><xf numFmtId="0" '
    'fontId="0" fillId="0" '
    'borderId="0"/></cellStyleXfs><cellXfs count="1"><xf numFmtId="0" fontId="0" fillId="0" '
    'borderId="0" xfId="0"/></cellXfs><cellStyles count="1"><cellStyle name="Normal" xfId="0" '
    'builtinId="0"/></cellStyles></styleSheet>'
).encode()
"""Styles of a workbook that looks like nothing in particular."""


def normal_form(container: Container) -> Container:
    """The same workbook in plain parts with plain names; the container itself if it is plain.

    Raises
    ------
    UnreadableFileError
        If it is no workbook, or a part declares a document type.
    """
    names = _new_names(container)
    spreadsheet = {container.start, *container.worksheets.values()}
    spreadsheet |= set(filter(None, map(container.linked, ("sharedStrings", "styles"))))
    odd = {name for name in spreadsheet if not _is_plain(container.read(name))}
    strict = odd and any(STRICT in container.read(name) for name in odd)
    if not odd and all(old == new for old, new in names.items()) and _links_are_exact(container):
        return container
    return Container(_rewritten(container, names, odd, bool(strict)), container.limits)


def _new_names(container: Container) -> dict[str, str]:
    """Names of parts by those that they have now."""
    names = {name: name.replace("\\", "/") for name in container.names}
    if container.find(TYPES):
        names[container.find(TYPES)] = TYPES
    names[container.start] = START
    sheets = container.worksheets.values()
    if not all(map(WORKSHEET.fullmatch, sheets)):
        names |= {part: f"xl/worksheets/sheet{n}.xml" for n, part in enumerate(sheets, 1)}
    for kind, place in PLACES.items():
        if part := container.linked(kind):
            names[part] = place
    for part in [*names]:  # what a part leads to lies beside it
        if plain_name(part).endswith(".rels") and (source := _source(container, part)):
            folder, base = posixpath.split(names[source])
            names[part] = posixpath.join(folder, "_rels", f"{base}.rels")
        elif plain_name(part) == "_rels/.rels":
            names[part] = "_rels/.rels"
    if len(set(names.values())) < len(names):
        raise UnreadableFileError("refused", "two parts of the file want the same place")
    return names


def _source(container: Container, relations: str) -> str | None:
    """The part whose relations these are."""
    folder, base = posixpath.split(relations.replace("\\", "/"))
    name = base[: -len(".rels")]
    return container.find(posixpath.join(posixpath.dirname(folder), name)) if name else None


def _is_plain(xml: bytes) -> bool:
    if not HEAD.match(xml[:10_000]) or any(word in xml for word in ODD) or UNPLACED.search(xml):
        return False
    choice = xml.find(CHOICE)
    return (
        choice < 0 or xml.find(b"</sheetData>", 0, choice) >= 0
    )  # after the cells it is a drawing


def _links_are_exact(container: Container) -> bool:
    """Whether relations name parts letter by letter as they stand in the zip."""
    names = set(container.names)
    if container.find(TYPES) and b"<Types" not in container.read(TYPES):
        return False
    for relations in container.names:
        if relations.lower().endswith(".rels"):
            if b"<Relationships" not in container.read(relations):
                return False
            folder = posixpath.dirname(posixpath.dirname(relations))
            for item in container.tree(relations):
                there = item.get("Target", "")
                path = posixpath.normpath(f"{folder}/{there}").removeprefix("/")
                exact = there[1:] if there.startswith("/") else path
                odd = item.get("TargetMode") != "External" and exact not in names
                if odd and container.find(container.target(folder, item)):
                    return False
    return True


def _rewritten(
    container: Container, names: dict[str, str], odd: set[str], strict: bool
) -> bytes:  # fmt: skip
    from kfsheet.workbook.reading.plain_xml import plain_xml  # it takes long to import

    result = BytesIO()
    with zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED) as new:
        for old, name in names.items():
            content = container.read(old)
            if name.lower().endswith(".rels"):
                content = _relations(container, old, names)
            elif name == TYPES:
                content = _types(container, old, names)
            elif old in odd:
                content = plain_xml(content)
            if strict and name.lower().endswith((".xml", ".rels")):
                content = _transitional(content)
            new.writestr(name, content)
    return result.getvalue()


def _transitional(xml: bytes) -> bytes:
    """Names of the strict variant by those that every program knows."""
    words = rb"http://schemas.openxmlformats.org/"
    return STRICT_NAME.sub(lambda match: words + TRANSITIONAL[match[1]], xml)


def _relations(container: Container, part: str, names: dict[str, str]) -> bytes:
    folder = posixpath.dirname(posixpath.dirname(part.replace("\\", "/")))
    home = posixpath.dirname(posixpath.dirname(names[part]))
    root = container.tree(part)
    for item in root:
        there = names.get(container.target(folder, item))
        if there and item.get("TargetMode") != "External":
            item.set("Target", posixpath.relpath(there, home or "."))
    return _plain_tree(root)


def _types(container: Container, part: str, names: dict[str, str]) -> bytes:
    root = container.tree(part)
    for item in root:
        there = container.find(item.get("PartName", ""))
        if there:
            item.set("PartName", f"/{names[there]}")
    return _plain_tree(root)


def _plain_tree(root: Element) -> bytes:
    """A flat list of elements, as relations and types are, without prefixes."""
    from xml.sax.saxutils import quoteattr  # it takes long to import

    space = root.tag[1:].partition("}")[0]
    items = "".join(
        f"<{local_name(i.tag)} {' '.join(f'{k}={quoteattr(v)}' for k, v in i.attrib.items())}/>"
        for i in root
    )
    tag = local_name(root.tag)
    return f"<{tag} xmlns={quoteattr(space)}>{items}</{tag}>".encode()
