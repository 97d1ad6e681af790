"""The worksheet "Marks" of a marked workbook, as XML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.sax.saxutils import escape

from openpyxl.utils import get_column_letter

from kfsheet.coursework.judging.judge import Mark

MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
COLOURS = {"full": "FFC6EFCE", "part": "FFFFEB9C", "none": "FFFFC7CE"}
PLAIN = "plain"
WIDTHS = (14, 8, 8, 14, 60, 20, 50, 50)
HEADS = ("answer", "points", "score", "status", "remark", "first differs", "your formula")
KEY_HEAD = "a right formula"
LONGEST = 400  # characters of a formula that are shown
WHY = (
    "The feedback in the workbook saw values, with your own numbers. A mark is for the formula: it "
    "must also hold when parameters and measurements change, and was tried with right values in "
    "the place of your other answers. So a typed number earns nothing even if it looked right, and "
    "a right formula all of its points even if what it reads was wrong."
)


def colour_of(mark: Mark) -> str:
    """Full, part or none."""
    return "full" if mark.score == mark.points else "part" if mark.score else "none"


def _cell(place: str, content: str | float, style: int | None) -> str:
    if isinstance(content, str):
        return inline_cell(place, content, style)
    return f'<c r="{place}"{_look(style)}><v>{content!r}</v></c>'


def _look(style: int | None) -> str:
    return f' s="{style}"' if style is not None else ""


def inline_cell(place: str, words: str, style: int | None = None) -> str:
    """A cell that holds a text, as XML."""
    text = escape("".join(c for c in words if c.isprintable()))
    if not text:
        return f'<c r="{place}"{_look(style)}/>'
    content = f'<is><t xml:space="preserve">{text}</t></is>'
    return f'<c r="{place}"{_look(style)} t="inlineStr">{content}</c>'


def marks_sheet(
    marks: Sequence[Mark],
    numbers: dict[str, int],
    total: float | None,
    keys: Mapping[str, str] | None,
) -> str:
    """The worksheet "Marks" as XML; ``numbers`` are those of the formats by colour."""
    lines: list[tuple[tuple, int | None]] = [(HEADS + (KEY_HEAD,) * bool(keys), None)]
    for m in marks:
        cells = (m.name, m.points, m.score, m.status, m.remark, m.differs, m.formula[:LONGEST])
        cells += (keys.get(m.name, ""),) if keys else ()
        lines.append((cells, numbers[colour_of(m)]))
    points, score = sum(m.points for m in marks), sum(m.score for m in marks)
    lines.append((("total", points, score if total is None else total), None))
    rows = "".join(_line(row, *line) for row, line in enumerate(lines, 1))
    below = len(lines) + 2
    why = inline_cell(f"A{below}", WHY, numbers[PLAIN])
    rows += f'<row r="{below}" ht="48" customHeight="1">{why}</row>'
    width = len(lines[0][0])
    columns = "".join(
        f'<col min="{n}" max="{n}" width="{size}" customWidth="1"/>'
        for n, size in enumerate(WIDTHS[:width], 1)
    )
    merged = f"A{below}:{get_column_letter(width)}{below}"
    content = (
        '<sheetPr><pageSetUpPr fitToPage="1"/></sheetPr>'
        '<sheetViews><sheetView tabSelected="1" workbookViewId="0"/></sheetViews>'
        f"<cols>{columns}</cols><sheetData>{rows}</sheetData>"
        f'<mergeCells count="1"><mergeCell ref="{merged}"/></mergeCells>'
        '<pageSetup paperSize="9" orientation="landscape" fitToWidth="1" fitToHeight="0"/>'
    )
    return f'<worksheet xmlns="{MAIN}">{content}</worksheet>'


def _line(row: int, cells: tuple, style: int | None) -> str:
    """A row as high as its longest text, wrapped, takes."""
    lines = max(1 + len(str(text)) // size for text, size in zip(cells, WIDTHS, strict=False))
    inside = "".join(
        _cell(f"{get_column_letter(n)}{row}", content, style) for n, content in enumerate(cells, 1)
    )
    return f'<row r="{row}" ht="{15 * lines}" customHeight="1">{inside}</row>'
