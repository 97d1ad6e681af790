"""Workbooks with other cells, written in milliseconds: parts of a zip, changed as text."""

import re
import zipfile
from io import BytesIO
from xml.sax.saxutils import escape, unescape

from calculator_oracle import written
from openpyxl.utils import column_index_from_string, get_column_letter

ROW = re.compile(r'<row r="(\d+)"([^>]*?)(?:/>|>(.*?)</row>)', re.DOTALL)
CELL = re.compile(r'<c r="([A-Z]+)\d+"((?:[^>"]|"[^"]*")*?)(?:/>|>(.*?)</c>)', re.DOTALL)
SHEET = re.compile(r'<sheet name="([^"]*)"[^>]*r:id="(\w+)"')
LINK = re.compile(r"<Relationship\b[^>]*>")
STORED = re.compile(r"(</f>|<f [^>]*/>)<v>[^<]*</v>")
TYPE = re.compile(r' t="\w+"(?=[^>]*><f[ >/])')


class Paper:
    """A workbook whose cells are changed again and again."""

    def __init__(self, content, names=()):
        with zipfile.ZipFile(BytesIO(content)) as archive:
            self.parts = {name: archive.read(name) for name in archive.namelist()}
        book = self.parts["xl/workbook.xml"].decode()
        links = self.parts["xl/_rels/workbook.xml.rels"].decode()
        targets = {_attribute(x, "Id"): _attribute(x, "Target") for x in LINK.findall(links)}
        self.sheets = {
            unescape(title): "xl/" + targets[link].removeprefix("/").removeprefix("xl/")
            for title, link in SHEET.findall(book)
        }
        more = "".join(f'<definedName name="{n}">{escape(ref)}</definedName>' for n, ref in names)
        book = book.replace("</definedNames>", f"{more}</definedNames>")
        self.parts["xl/workbook.xml"] = book.encode()

    def without_values(self):
        """The same, so that every program calculates it from nothing."""
        for part in self.sheets.values():
            xml = TYPE.sub("", STORED.sub(r"\1", self.parts[part].decode()))
            self.parts[part] = xml.encode()
        return self

    def written(self, changes):
        """The workbook's bytes with other cells: by sheet, then (row, column)."""
        parts = dict(self.parts)
        for title, cells in changes.items():
            part = self.sheets[title]
            parts[part] = _with_cells(parts[part].decode(), cells).encode()
        out = BytesIO()
        with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for name, content in parts.items():
                archive.writestr(name, content)
        return out.getvalue()


def _attribute(tag, name):
    return re.search(rf'\b{name}="([^"]*)"', tag)[1]


def _with_cells(xml, changes):
    rows = {}
    for (row, column), content in changes.items():
        rows.setdefault(row, {})[column] = content
    start = xml.index("<sheetData>") + len("<sheetData>")
    end = xml.index("</sheetData>")
    found = {int(m[1]): (m[2], m[3] or "") for m in ROW.finditer(xml, start, end)}
    pieces = []
    for row in sorted({*found, *rows}):
        attributes, inside = found.get(row, ("", ""))
        if row in rows:
            inside = _row(row, inside, rows[row])
        pieces.append(f'<row r="{row}"{attributes}>{inside}</row>')
    return xml[:start] + "".join(pieces) + xml[end:]


def _row(row, inside, changes):
    cells = {}
    for match in CELL.finditer(inside):
        column = column_index_from_string(match[1])
        cells[column] = match[0]
        if column in changes:
            style = re.search(r' s="\d+"', match[2])
            cells[column] = _cell(row, column, changes[column], style[0] if style else "")
    for column, content in changes.items():
        if column not in cells:
            cells[column] = _cell(row, column, content, "")
    return "".join(cells[column] for column in sorted(cells))


def _cell(row, column, content, style):
    start = f'<c r="{get_column_letter(column)}{row}"{style}'
    if content is None:
        return f"{start}/>"
    if isinstance(content, float | int):
        return f"{start}><v>{content!r}</v></c>"
    if content.startswith("{="):
        place = f"{get_column_letter(column)}{row}"
        text = escape(written(content[2:-1]))
        return f'{start}><f t="array" ref="{place}">{text}</f></c>'
    if content.startswith("="):
        return f"{start}><f>{escape(written(content[1:]))}</f></c>"
    return f'{start} t="inlineStr"><is><t>{escape(content)}</t></is></c>'
