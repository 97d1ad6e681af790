"""One worksheet, element by element: formulas, numbers and texts; never a stored value."""

from __future__ import annotations

import re
from math import isfinite
from xml.parsers import expat

from openpyxl.utils import column_index_from_string, range_boundaries

from kfsheet.errors import UnreadableFileError
from kfsheet.parsing.calculator import Content, Formula
from kfsheet.parsing.references import Cell
from kfsheet.printing.excel_names import LAST_COLUMN, LAST_ROW

LONGEST_TEXT = 40_000  # characters in a cell; Excel's limit is 32,767
PLACE = re.compile(r"([A-Z]{1,3})([1-9]\d{0,6})")
TABLE = "=TABLE()"  # Excel's name for what a data table holds; no formula is written there


class Budget:
    """How many cells may still come."""

    def __init__(self, cells: float) -> None:
        self.cells = self._most = cells

    def spend(self) -> None:
        """One cell; UnreadableFileError where none may come."""
        self.cells -= 1
        if self.cells < 0:
            words = f"the file has more than {self._most} cells"
            raise UnreadableFileError("too large", words)


class SheetReader:
    """One worksheet in its plain form, element by element."""

    def __init__(self, strings: list[str], budget: Budget) -> None:
        self._strings, self._budget = strings, budget
        self.cells: dict[Cell, Content] = {}
        self._shared: dict[str, Formula] = {}
        self._waiting: dict[Cell, str] = {}
        """Cells whose shared formula has not come yet, and its number."""
        self._at: Cell = (0, 0)
        self._type, self._formula, self._words = "", None, []
        self._value, self._listening, self._deaf = "", False, False
        self._attributes: dict[str, str] = {}

    def read(self, xml: bytes) -> dict[Cell, Content]:
        """Its cells."""
        # Element by element: a tree of a whole sheet takes many times its memory.
        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = self._start, self._end
        parser.CharacterDataHandler = self._hear
        parser.StartDoctypeDeclHandler = self._refuse
        parser.buffer_text = True
        parser.Parse(xml, True)
        for place, number in self._waiting.items():
            if number in self._shared:
                self.cells[place] = self._shared[number]
        return self.cells

    @staticmethod
    def _refuse(*_: object) -> None:
        raise UnreadableFileError("refused", "its XML declares a document type")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if tag == "v" or tag == "t":
            self._words, self._listening = [], not self._deaf
        elif tag == "c":
            self._budget.spend()
            self._at = _place(attributes["r"])
            self._type = attributes.get("t", "n")
            self._formula, self._value = None, ""
        elif tag == "f":
            self._attributes, self._words, self._listening = attributes, [], True
        elif tag == "rPh":  # how a Japanese text is pronounced
            self._deaf = True

    def _hear(self, words: str) -> None:
        if self._listening:
            self._words.append(words)

    def _end(self, tag: str) -> None:
        if tag == "f":
            self._formula, self._listening = self._read_formula("".join(self._words)), False
        elif tag in ("v", "t") and self._listening:
            self._value += "".join(self._words)
            self._listening = False
        elif tag == "rPh":
            self._deaf = False
        elif tag == "c":
            self._close()

    def _read_formula(self, text: str) -> Formula | None:
        kind = self._attributes.get("t", "normal")
        # Excel writes a filled-down formula once, in its first cell; the others have its number.
        if kind == "shared":
            number = self._attributes.get("si", "")
            if text:
                self._shared[number] = Formula(f"={text}", self._at)
            elif number not in self._shared:
                self._waiting[self._at] = number
            return self._shared.get(number)
        if kind == "dataTable":
            return Formula(TABLE, self._at, self._area())
        if not text:
            return None
        return Formula(f"={text}", self._at, self._area() if kind == "array" else None)

    def _area(self) -> tuple[int, int, int, int]:
        """The cells that an array formula fills, its own one at least."""
        try:
            left, top, right, bottom = range_boundaries(self._attributes.get("ref", ""))
        except (ValueError, TypeError):
            return (*self._at, *self._at)
        return (top, left, bottom, right) if (top, left) == self._at else (*self._at, *self._at)

    def _close(self) -> None:
        content: Content | None = self._formula
        if content is None and self._value:
            content = self._typed(self._value[:LONGEST_TEXT])
        if content is not None:
            self.cells[self._at] = content

    def _typed(self, value: str) -> Content:
        if self._type == "n":
            number = float(value)
            return number if isfinite(number) else Formula("=#NUM!", self._at)
        if self._type == "s":
            return self._strings[int(value)]
        if self._type == "e":  # an error that was typed is one to whoever refers to it
            return Formula(f"={value}", self._at)
        return value in ("1", "true") if self._type == "b" else value


def _place(text: str) -> Cell:
    match = PLACE.fullmatch(text)
    place = match and (int(match[2]), column_index_from_string(match[1]))
    if not place or place[0] > LAST_ROW or place[1] > LAST_COLUMN:
        raise UnreadableFileError("damaged", f"the workbook has a cell {text[:20]!r}")
    return place
