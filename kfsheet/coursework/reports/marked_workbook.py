"""A copy of a student's workbook with marks in it, everything else left as it is.

The parts of the zip are copied; a worksheet "Marks" is added, and the words above each answer give
way to the mark, in green, yellow or red. (Loading and saving by a library would take seconds for a
long table and lose what the library does not know.)
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from xml.sax.saxutils import escape

from openpyxl.utils import get_column_letter

from kfsheet.coursework.judging.judge import Mark
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import WorkbookError
from kfsheet.parsing.references import Address
from kfsheet.workbook.reading.archive import MAIN, Container
from kfsheet.workbook.reading.normal_form import normal_form

COLOURS = {"full": "FFC6EFCE", "part": "FFFFEB9C", "none": "FFFFC7CE"}
PART, RELATION = "xl/worksheets/kfsheetMarks.xml", "rIdKfsheetMarks"
STYLES_PART = "xl/styles.xml"
SHEET_KIND = "http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet"
CONTENT = "application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"
REMARK_WIDTH = 90  # characters
HEADS = ("answer", "points", "score", "status", "remark")


def colour_of(mark: Mark) -> str:
    """Full, part or none."""
    return "full" if mark.score == mark.points else "part" if mark.score else "none"


def mark_workbook(
    path: Path,
    book: Book,
    addresses: CellAddresses,
    marks: Sequence[Mark],
    total: float | None = None,
) -> bytes:
    """The workbook at ``path`` with marks beside the answers and on a sheet of their own.

    ``total`` takes the place of the sum of the marks, where a lecturer has given one.

    Raises
    ------
    WorkbookError
        If a part of the workbook is not where it should be.
    """
    result = BytesIO()
    old = normal_form(Container.open(path))
    numbers: dict[str, int | None] = dict.fromkeys(COLOURS)
    changed = _with_marks_sheet(old, book)
    if old.find(STYLES_PART):  # a file without looks gets words only
        changed[STYLES_PART], numbers = _styles(_text(old, STYLES_PART))
    for sheet, cells in _headings(addresses, marks).items():
        part = book.parts[sheet]
        changed[part] = _with_words(_text(old, part), cells, numbers)
    with zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.names:
            content = changed.get(name)
            new.writestr(name, old.read(name) if content is None else content.encode())
        new.writestr(PART, _sheet(marks, numbers, total))
    return result.getvalue()


def _text(container: Container, part: str) -> str:
    return container.read(part).decode("utf-8-sig")


def _with_marks_sheet(old: Container, book: Book) -> dict[str, str]:
    """The three parts that say of a new worksheet: that it is there, where, and what it is."""
    links, kinds = "xl/_rels/workbook.xml.rels", "[Content_Types].xml"
    link = f'<Relationship Id="{RELATION}" Type="{SHEET_KIND}" Target="/{PART}"/>'
    kind = f'<Override PartName="/{PART}" ContentType="{CONTENT}"/>'
    return {
        "xl/workbook.xml": _with_sheet(_text(old, "xl/workbook.xml"), book.sheets),
        links: _before(_text(old, links), "</Relationships>", link),
        kinds: _before(_text(old, kinds), "</Types>", kind),
    }


def _before(xml: str, end: str, more: str) -> str:
    if end not in xml:
        raise WorkbookError(f"a part of the workbook has no {end}")
    return xml.replace(end, more + end, 1)


def _styles(xml: str) -> tuple[str, dict[str, int]]:
    """Styles with three more fills and formats, and the numbers of those formats."""
    fills = "".join(
        f'<fill><patternFill patternType="solid"><fgColor rgb="{c}"/></patternFill></fill>'
        for c in COLOURS.values()
    )
    xml, first_fill = _more(xml, "fills", fills)
    formats = "".join(
        f'<xf numFmtId="0" fontId="0" fillId="{first_fill + n}" borderId="0" applyFill="1" '
        'applyAlignment="1"><alignment vertical="top" wrapText="1"/></xf>'
        for n in range(len(COLOURS))
    )
    xml, first = _more(xml, "cellXfs", formats)
    return xml, {name: first + n for n, name in enumerate(COLOURS)}


def _more(xml: str, tag: str, items: str) -> tuple[str, int]:
    """Append items to a list, which need not be counted; the number of the first of them."""
    match = re.search(rf"<{tag}\b[^>]*>(.*?)</{tag}>", xml, re.DOTALL)
    if not match:
        raise WorkbookError(f"the workbook's styles have no list {tag}")
    count = len(re.findall(r"<(?:fill|xf)\b", match[1]))
    new = f'<{tag} count="{count + len(COLOURS)}">{match[1]}{items}</{tag}>'
    return xml.replace(match[0], new, 1), count


def _with_sheet(xml: str, sheets: object) -> str:
    prefix = re.search(r"<sheet\b[^>]*\s(\w+):id=", xml)
    numbers = [int(n) for n in re.findall(r'sheetId="(\d+)"', xml)]
    if not prefix or not numbers:
        raise WorkbookError("the workbook lists no worksheets")
    name = "Marks"
    while name in sheets:
        name += "_"
    new = f'<sheet name="{name}" sheetId="{max(numbers) + 1}" {prefix[1]}:id="{RELATION}"/>'
    return _before(xml, "</sheets>", new)


def _headings(addresses: CellAddresses, marks: Sequence[Mark]) -> dict[str, dict[str, Mark]]:
    """The cell above each column of answers, or to the right of a scalar, by sheet."""
    found: dict[str, dict[str, Mark]] = {}
    for mark in marks:
        address = _heading(addresses, mark.name)
        if address:
            sheet, row, column = address
            found.setdefault(sheet, {})[f"{get_column_letter(column)}{row}"] = mark
    return found


def _heading(addresses: CellAddresses, name: str) -> Address | None:
    if name in addresses.columns:
        table, column = addresses.columns[name]
        return table.sheet, table.header + 2, column
    address = addresses.of(name)
    return address and (address[0], address[1], address[2] + 2)


def _with_words(xml: str, cells: dict[str, Mark], numbers: dict[str, int]) -> str:
    for place, mark in cells.items():
        words = f"{mark.score:g}/{mark.points}: {mark.status}. {mark.remark}".strip()
        new = _inline(place, words, numbers[colour_of(mark)])
        pattern = rf'<c r="{place}"(?:\s[^>]*?)?(?:/>|>.*?</c>)'
        xml = re.sub(pattern, lambda _, new=new: new, xml, count=1, flags=re.DOTALL)
    return xml


def _cell(place: str, content: str | float, style: int | None) -> str:
    if isinstance(content, str):
        return _inline(place, content, style)
    return f'<c r="{place}"{_look(style)}><v>{content!r}</v></c>'


def _look(style: int | None) -> str:
    return f' s="{style}"' if style is not None else ""


def _inline(place: str, words: str, style: int | None = None) -> str:
    text = escape("".join(c for c in words if c.isprintable()))
    content = f'<is><t xml:space="preserve">{text}</t></is>'
    return f'<c r="{place}"{_look(style)} t="inlineStr">{content}</c>'


def _sheet(marks: Sequence[Mark], numbers: dict[str, int], total: float | None) -> str:
    """The worksheet "Marks"."""
    lines = [(HEADS, None)]
    for m in marks:
        cells = (m.name, m.points, m.score, m.status, m.remark)
        lines.append((cells, numbers[colour_of(m)]))
    points, score = sum(m.points for m in marks), sum(m.score for m in marks)
    given = score if total is None else total
    lines.append((("total", points, given, "", ""), None))
    rows = "".join(
        f'<row r="{row}" ht="{15 * (1 + len(cells[-1]) // REMARK_WIDTH)}" customHeight="1">'
        + "".join(_cell(f"{'ABCDE'[n]}{row}", content, style) for n, content in enumerate(cells))
        + "</row>"
        for row, (cells, style) in enumerate(lines, 1)
    )
    columns = '<cols><col min="1" max="4" width="14"/>'
    columns += f'<col min="5" max="5" width="{REMARK_WIDTH}"/></cols>'
    fit = '<sheetPr><pageSetUpPr fitToPage="1"/></sheetPr>'
    print_as = '<pageSetup paperSize="9" orientation="landscape" fitToWidth="1" fitToHeight="0"/>'
    content = f"{fit}{columns}<sheetData>{rows}</sheetData>{print_as}"
    return f'<worksheet xmlns="{MAIN}">{content}</worksheet>'
