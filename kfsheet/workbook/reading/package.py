"""The parts of an .xlsx file as they are: sheets, names, formula cells.

Worksheets of 10 MB are read by regular expressions that look at tags: an XML parser needs a second
for what is a question of a tenth.
"""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

from openpyxl.utils import column_index_from_string, coordinate_to_tuple
from openpyxl.workbook.defined_name import DefinedName

from kfsheet.parsing.references import Address
from kfsheet.workbook.reading.archive import Container, elements, refusing
from kfsheet.workbook.reading.normal_form import normal_form

# It begins with letters that are searched for quickly; only a cell has such an attribute.
FORMULA_CELL = re.compile(rb'r="([A-Z]+)([1-9][0-9]*)"[^<>]*>\s*<(?:\w+:)?f\b')


class Package:
    """Worksheets by title, defined names, properties, and which cells hold formulas.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        with refusing(path):
            self.container = normal_form(Container.open(path))
            self.properties = self.container.properties
            self._sheets = {
                title: self.container.read(part)
                for title, part in self.container.worksheets.items()
            }
            self._names = {
                name.get("name", "").lower(): name.text or ""
                for name in elements(self.container.workbook, "definedName")
            }

    @property
    def titles(self) -> list[str]:
        """Titles of the worksheets, in order."""
        return list(self._sheets)

    def formulas(self, title: str) -> dict[int, set[int]]:
        """Rows of the cells of a worksheet that hold formulas, by column."""
        by_letters: defaultdict[bytes, list[bytes]] = defaultdict(list)
        for letters, row in FORMULA_CELL.findall(self._sheets[title]):
            by_letters[letters].append(row)
        return {
            column_index_from_string(letters.decode()): set(map(int, rows))
            for letters, rows in by_letters.items()
        }

    def named(self, name: str) -> Address | None:
        """The one cell that a defined name stands for, if there is such a cell."""
        text = self._names.get(name.lower())
        places = list(DefinedName(name, attr_text=text).destinations) if text else []
        if len(places) != 1 or places[0][0] not in self._sheets:
            return None
        try:
            return (places[0][0], *coordinate_to_tuple(places[0][1].replace("$", "")))
        except ValueError:
            return None
