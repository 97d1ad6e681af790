"""What a workbook says: cells by sheet, names, properties; never a stored value.

openpyxl needs several times as long, opens fewer files, and reads what we must not believe.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from kfsheet.errors import UnreadableFileError
from kfsheet.parsing.calculator import Content
from kfsheet.parsing.references import Cell
from kfsheet.workbook.reading.archive import Container, elements, local_name
from kfsheet.workbook.reading.normal_form import normal_form
from kfsheet.workbook.reading.sheet_cells import LONGEST_TEXT, Budget, SheetReader


@dataclass
class Book:
    """What a workbook says: cells by sheet, names, properties."""

    digest: str
    sheets: dict[str, dict[Cell, Content]] = field(default_factory=dict)
    parts: dict[str, str] = field(default_factory=dict)
    """Names of the worksheets' parts in the workbook's normal form."""

    names: dict[str, str] = field(default_factory=dict)
    sheet_names: dict[tuple[str, str], str] = field(default_factory=dict)
    """Names that one worksheet has for itself, by worksheet and name."""

    properties: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def read_book(
    container: Container,
    digest: str = "",
    *,
    cells: float = math.inf,
    sheets: float = math.inf,
    names: float = math.inf,
) -> Book:
    """Read a workbook.

    Parameters
    ----------
    container : Container
        Its parts; they are brought into their normal form.
    digest : str, optional
        What the book is told apart by.
    cells, sheets, names : int, optional
        How many of them there may be; names beyond are left out.

    Raises
    ------
    UnreadableFileError
        If it is no workbook, is damaged, too large or holds tricks.
    """
    container = normal_form(container)
    book = Book(digest, parts=container.worksheets)
    if len(book.parts) > sheets:
        raise UnreadableFileError("too large", f"more than {sheets} worksheets")
    strings, budget = _strings(container), Budget(cells)
    for title, part in book.parts.items():
        book.sheets[title] = SheetReader(strings, budget).read(container.read(part))
    for sheet, name, text in defined_names(container):
        if len(book.names) + len(book.sheet_names) >= names:
            break
        if sheet is None:
            book.names[name.lower()] = text
        else:
            book.sheet_names[sheet, name.lower()] = text
    found = container.properties.items()
    book.properties = {name: text[:LONGEST_TEXT] for name, text in found}
    return book


def defined_names(container: Container) -> Iterator[tuple[str | None, str, str]]:
    """Sheet that has it for itself (or None), name, and what it stands for."""
    # A number counts chart sheets, too.
    titles = [sheet.get("name", "") for sheet in elements(container.workbook, "sheet")]
    for name in elements(container.workbook, "definedName"):
        local = name.get("localSheetId")
        if local is None:
            yield None, name.get("name", ""), name.text or ""
        elif local.isdecimal() and int(local) < len(titles):
            yield titles[int(local)], name.get("name", ""), name.text or ""


def _strings(container: Container) -> list[str]:
    part = container.linked("sharedStrings")
    if part is None:
        return []
    return ["".join(_texts(item))[:LONGEST_TEXT] for item in elements(container.tree(part), "si")]


def _texts(item: object) -> Iterator[str]:
    """The pieces of a text, without how it is pronounced."""
    for piece in item:
        if local_name(piece.tag) == "t":
            yield piece.text or ""
        elif local_name(piece.tag) == "r":
            yield from _texts(piece)
