"""One workbook in the dresses that programs give it."""

import io
import re
import zipfile

MAIN = b"http://schemas.openxmlformats.org/spreadsheetml/2006/main"
PARTS = re.compile(r"xl/(workbook|sharedStrings|styles|worksheets/\w+)\.xml")


def parts_of(content):
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def zipped(parts):
    result = io.BytesIO()
    with zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED) as new:
        for name, content in parts.items():
            info = zipfile.ZipInfo(name)
            info.filename = name  # as it is, with backslashes
            new.writestr(info, content, zipfile.ZIP_DEFLATED)
    return result.getvalue()


def everywhere(old, new):
    """Another word in all parts, and in their names."""
    return lambda parts: {
        name.replace(old, new): content.replace(old.encode(), new.encode())
        for name, content in parts.items()
    }


def renamed(change):
    return lambda parts: {change(name): content for name, content in parts.items()}


def rewritten(change, which=PARTS):
    return lambda parts: {
        name: change(content) if which.fullmatch(name) else content
        for name, content in parts.items()
    }


def prefixed(xml):
    """<x:c> in the place of <c>, as the Open XML SDK writes it."""
    xml = re.sub(rb"<(/?)([A-Za-z]\w*)(?=[\s/>])", rb"<\1x:\2", xml)
    return xml.replace(b'xmlns="' + MAIN, b'xmlns:x="' + MAIN)


def strict(parts):
    words = [
        ("http://schemas.openxmlformats.org/spreadsheetml/2006/main", "spreadsheetml/main"),
        ("http://schemas.openxmlformats.org/officeDocument/2006/", "officeDocument/"),
        ("http://schemas.openxmlformats.org/drawingml/2006/", "drawingml/"),
    ]
    for old, new in words:
        parts = {
            n: c.replace(old.encode(), b"http://purl.oclc.org/ooxml/" + new.encode())
            for n, c in parts.items()
        }
    return parts


def without_addresses(xml):
    """Rows and cells that follow each other say no address, as some writers have it.

    Empty cells stand where an address would be left out.
    """

    def row(match):
        number, cells = match[2], re.split(rb"(?=<c[ >])", match[3])
        column, out = 0, [cells[0]]
        for cell in cells[1:]:
            letters = re.search(rb' r="([A-Z]+)', cell)[1]
            at = 0
            for letter in letters:
                at = 26 * at + letter - 64
            out += [b"<c/>"] * (at - column - 1) + [re.sub(rb' r="[A-Z]+\d+"', b"", cell, count=1)]
            column = at
        return b'<row%s r="%s"%s>%s</row>' % (match[1], number, b"", b"".join(out))

    return re.sub(rb'<row((?: (?!r=)[^>]*)?) r="(\d+)"[^>/]*>(.*?)</row>', row, xml, flags=re.S)


def in_utf16(xml):
    text = re.sub(r"^<\?xml[^>]*\?>", "", xml.decode())
    return ('<?xml version="1.0" encoding="UTF-16"?>' + text).encode("utf-16")


def with_comments(xml):
    return re.sub(rb"<f>([^<&]+)</f>", rb"<f><!-- it's <f> --><![CDATA[\1]]></f>", xml)


def quoted_otherwise(xml):
    """Attributes in single quotes, in another order."""
    return re.sub(rb'<c r="(\w+)"((?: s="\d+")?)', rb"<c\2 r='\1'", xml)


def moved(parts):
    """Another folder, and relations that name parts from the root of the file."""
    parts = everywhere("xl/worksheets/sheet", "xl/pages/page")(parts)
    rels = "xl/_rels/workbook.xml.rels"
    there = b'Target="%sxl/pages/page' % b"/"
    links = re.sub(rb'Target="/?(?:xl/)?worksheets/sheet', there, parts[rels])
    return {**parts, rels: links}


DRESSES = {
    "workbook2": everywhere("workbook.xml", "workbook2.xml"),
    "backslashes": renamed(lambda name: name.replace("/", "\\")),
    "capitals": renamed(str.upper),
    "content types": renamed(lambda name: name.replace("[C", "[c").replace("_T", "_t")),
    "percent": renamed(lambda name: name.replace("sheet", "%73heet")),
    "another folder": moved,
    "prefixes": rewritten(prefixed),
    "strict": strict,
    "no addresses": rewritten(without_addresses, re.compile(r"xl/worksheets/.*\.xml")),
    "UTF-16": rewritten(in_utf16),
    "comments": rewritten(with_comments),
    "single quotes": rewritten(quoted_otherwise),
    "all at once": lambda parts: renamed(lambda n: n.upper().replace("/", "\\"))(
        strict(rewritten(prefixed)(rewritten(without_addresses)(parts)))
    ),
}


def dressed(content, dress):
    """The bytes of a workbook as another program would have saved it."""
    return zipped(DRESSES[dress](parts_of(content)))
