"""One worksheet of a submission, element by element: formulas, numbers and texts, nothing else."""

from __future__ import annotations

import re
from xml.parsers import expat

from openpyxl.utils import column_index_from_string, range_boundaries

from kfsheet.errors import SubmissionError
from kfsheet.parsing.calculator import Content, Formula
from kfsheet.parsing.references import Cell
from kfsheet.printing.excel_names import LAST_COLUMN, LAST_ROW

MOST_CELLS = 400_000  # of a submission
LONGEST_TEXT = 40_000  # characters in a cell; Excel's limit is 32,767
PLACE = re.compile(r"([A-Z]{1,3})([1-9]\d{0,6})")


class Budget:
    """How many cells may still come."""

    def __init__(self, cells: int) -> None:
        self.cells = cells

    def spend(self) -> None:
        """One cell; SubmissionError where none may come."""
        self.cells -= 1
        if self.cells < 0:
            raise SubmissionError("too large", f"the file has more than {MOST_CELLS} cells")


class SheetReader:
    """One worksheet, element by element."""

    def __init__(self, strings: list[str], budget: Budget) -> None:
        self._strings, self._budget = strings, budget
        self.cells: dict[Cell, Content] = {}
        self._shared: dict[str, Formula] = {}
        self._at: Cell = (0, 0)
        self._type, self._formula, self._words = "", None, None
        self._value, self._listening = "", False
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
        return self.cells

    @staticmethod
    def _refuse(*_: object) -> None:
        raise SubmissionError("refused", "its XML declares a document type")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        tag = tag.rpartition(":")[2] if ":" in tag else tag
        if tag == "v" or tag == "t":
            self._words, self._listening = [], True
        elif tag == "row":
            row = int(attributes["r"]) if "r" in attributes else self._at[0] + 1
            self._at = (row, 0)
        elif tag == "c":
            self._budget.spend()
            self._at = self._place(attributes.get("r"))
            self._type = attributes.get("t", "n")
            self._formula, self._value = None, ""
        elif tag == "f":
            self._attributes, self._words, self._listening = attributes, [], True

    def _place(self, text: str | None) -> Cell:
        if text is None:
            return self._at[0], self._at[1] + 1
        match = PLACE.fullmatch(text)
        place = match and (int(match[2]), column_index_from_string(match[1]))
        if not place or place[0] > LAST_ROW or place[1] > LAST_COLUMN:
            raise SubmissionError("damaged", f"the workbook has a cell {text[:20]!r}")
        return place

    def _hear(self, words: str) -> None:
        if self._listening:
            self._words.append(words)

    def _end(self, tag: str) -> None:
        tag = tag.rpartition(":")[2] if ":" in tag else tag
        if tag == "f":
            self._formula, self._listening = self._read_formula("".join(self._words)), False
        elif tag in ("v", "t") and self._listening:
            self._value += "".join(self._words)
            self._listening = False
        elif tag == "c":
            self._close()

    def _read_formula(self, text: str) -> Formula | None:
        kind = self._attributes.get("t", "normal")
        # Excel writes a filled-down formula once, in its first cell; the others have its number.
        if kind == "shared":
            number = self._attributes.get("si", "")
            if text:
                self._shared[number] = Formula(f"={text}", self._at)
            return self._shared.get(number)
        if not text:
            return None
        array = kind in ("array", "dataTable")
        return Formula(f"={text}", self._at, self._area() if array else None)

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
            return float(value)
        if self._type == "s":
            return self._strings[int(value)]
        return value == "1" if self._type == "b" else value
