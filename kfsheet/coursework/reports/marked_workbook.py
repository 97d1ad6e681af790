"""A copy of a student's workbook with marks in it, everything else left as it is.

The parts of the zip are copied; a worksheet "Marks" is added, at which the file opens. The words
above each answer give way to the mark, in green, yellow or red, as does the live feedback, which
may say something else. (Loading and saving by a library would take seconds for a long table and
lose what the library does not know.)
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path

from openpyxl.utils import get_column_letter

from kfsheet.coursework.handout.questions_sheet import FILLED_IN
from kfsheet.coursework.judging.judge import Mark
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.coursework.reports.marks_sheet import (
    COLOURS,
    PLAIN,
    colour_of,
    inline_cell,
    marks_sheet,
)
from kfsheet.errors import WorkbookError
from kfsheet.parsing.references import Address
from kfsheet.workbook.reading.archive import Container
from kfsheet.workbook.reading.normal_form import normal_form

PART, RELATION = "xl/worksheets/kfsheetMarks.xml", "rIdKfsheetMarks"
STYLES_PART = "xl/styles.xml"
SHEET_KIND = "http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet"
CONTENT = "application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"


def mark_workbook(
    path: Path,
    book: Book,
    addresses: CellAddresses,
    marks: Sequence[Mark],
    total: float | None = None,
    keys: Mapping[str, str] | None = None,
) -> bytes:
    """The workbook at ``path`` with marks beside the answers and on a sheet of their own.

    ``total`` takes the place of the sum of the marks, where a lecturer has given one; ``keys`` are
    right formulas by answer, to be shown.

    Raises
    ------
    WorkbookError
        If a part of the workbook is not where it should be.
    """
    result = BytesIO()
    old = normal_form(Container.open(path))
    numbers: dict[str, int | None] = dict.fromkeys((*COLOURS, PLAIN))
    changed = _with_marks_sheet(old, book)
    if old.find(STYLES_PART):  # a file without looks gets words only
        changed[STYLES_PART], numbers = _styles(_text(old, STYLES_PART))
    for part in book.parts.values():
        changed[part] = _not_selected(_text(old, part))
    for sheet, cells in _headings(addresses, marks).items():
        part = book.parts[sheet]
        changed[part] = _with_words(changed[part], cells, numbers)
    for sheet, cells in _feedback(book, marks, numbers).items():
        part = book.parts[sheet]
        changed[part] = _with_cells(changed[part], cells)
    with zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.names:
            content = changed.get(name)
            new.writestr(name, old.read(name) if content is None else content.encode())
        new.writestr(PART, marks_sheet(marks, numbers, total, keys))
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
    xml, first_fill = _more(xml, "fills", fills, len(COLOURS))
    formats = "".join(
        f'<xf numFmtId="0" fontId="0" fillId="{first_fill + n}" borderId="0" applyFill="1" '
        'applyAlignment="1"><alignment horizontal="left" vertical="top" wrapText="1"/></xf>'
        for n in range(len(COLOURS))
    )
    formats += '<xf numFmtId="0" fontId="0" fillId="0" borderId="0" applyAlignment="1">'
    formats += '<alignment horizontal="left" vertical="top" wrapText="1"/></xf>'
    xml, first = _more(xml, "cellXfs", formats, len(COLOURS) + 1)
    return xml, {name: first + n for n, name in enumerate((*COLOURS, PLAIN))}


def _more(xml: str, tag: str, items: str, more: int) -> tuple[str, int]:
    """Append items to a list, which need not be counted; the number of the first of them."""
    match = re.search(rf"<{tag}\b[^>]*>(.*?)</{tag}>", xml, re.DOTALL)
    if not match:
        raise WorkbookError(f"the workbook's styles have no list {tag}")
    count = len(re.findall(r"<(?:fill|xf)\b", match[1]))
    new = f'<{tag} count="{count + more}">{match[1]}{items}</{tag}>'
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
    return _opened_at(_before(xml, "</sheets>", new), len(numbers))


def _opened_at(xml: str, number: int) -> str:
    """The workbook, opened at a worksheet."""
    view = re.search(r"<workbookView\b[^>]*?(?=/?>)", xml)
    if not view:
        active = f'<bookViews><workbookView activeTab="{number}"/></bookViews>'
        return re.sub(r"<sheets\b", lambda found: active + found[0], xml, count=1)
    other = re.sub(r'\s(?:activeTab|firstSheet)="\d*"', "", view[0])
    return xml.replace(view[0], f'{other} activeTab="{number}"', 1)


def _not_selected(xml: str) -> str:
    """A worksheet that is not the one in front; two of them would be edited together."""
    head, mark, rest = xml.partition("<sheetData")
    return re.sub(r'\stabSelected="\w*"', "", head) + mark + rest


def _feedback(
    book: Book, marks: Sequence[Mark], numbers: dict[str, int]
) -> dict[str, dict[str, str]]:
    """Cells in the place of the live feedback, by sheet and place."""
    found: dict[str, dict[str, str]] = {}
    for sheet, cells in book.sheets.items():
        heads = [place for place, content in cells.items() if content == FILLED_IN]
        lines = {content: row for (row, column), content in cells.items() if column == 1}
        asked = [mark for mark in marks if mark.name in lines]
        if not heads or len(asked) < len(marks):
            continue
        row, letter = heads[0][0], get_column_letter(heads[0][1] + 1)
        there = {f"{letter}{row}": inline_cell(f"{letter}{row}", "your marks")}
        for mark in asked:
            place = f"{letter}{lines[mark.name]}"
            words = f"{mark.score:g} of {mark.points} points: {mark.status}"
            there[place] = inline_cell(place, words, numbers[colour_of(mark)])
        found[sheet] = there
    return found


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
    found = {}
    for place, mark in cells.items():
        words = f"{mark.score:g}/{mark.points}: {mark.status}. {mark.remark}".strip()
        found[place] = inline_cell(place, words, numbers[colour_of(mark)])
    return _with_cells(xml, found)


def _with_cells(xml: str, cells: dict[str, str]) -> str:
    """Cells in the place of others, whose look those take that have none."""
    for place, new in cells.items():

        def instead(old: re.Match[str], new: str = new) -> str:
            look = re.search(r'\ss="\d+"', old[1] or "")
            return new if ' s="' in new or not look else new.replace(" t=", look[0] + " t=", 1)

        pattern = rf'<c r="{place}"(\s[^>]*?)?(?:/>|>.*?</c>)'
        xml = re.sub(pattern, instead, xml, count=1, flags=re.DOTALL)
    return xml
