"""How cells look: one small table, so that every workbook speaks the same language of colours."""

from __future__ import annotations

from functools import cached_property
from math import floor, log10, sqrt

import numpy as np
from openpyxl import Workbook
from openpyxl.cell import Cell
from openpyxl.styles import Alignment, Border, Font, PatternFill, Protection, Side
from openpyxl.worksheet.worksheet import Worksheet

DARK, LINE = "1F3864", "BFBFBF"
KINDS = {
    # kind: (background, text colour, bold, size)
    "title": (None, DARK, True, 16),
    "heading": (None, DARK, True, 12),
    "text": (None, "000000", False, 11),
    "note": (None, "000000", False, 11),
    "header": (DARK, "FFFFFF", True, 11),
    "unit": ("D9E2F3", "404040", False, 10),
    "words": ("D9E2F3", "404040", False, 9),
    "meaning": ("D9E2F3", "404040", False, 11),
    "parameter": ("FFF2CC", "1F3FBF", True, 11),
    "data": ("E2EFDA", "000000", False, 11),
    "formula": ("FFFFFF", "000000", False, 11),
    "index": ("F2F2F2", "595959", False, 11),
    "answer": ("FCE4D6", "000000", False, 11),
    "veiled": ("FFFFFF", "000000", False, 11),  # a formula that a locked sheet does not show
    "sample": ("FCE4D6", "000000", False, 11),  # an answer in a legend: it stays locked
}
LEGEND = {
    "parameter": "a parameter: change it and watch what happens",
    "data": "a measurement or another given number; an empty observation was not made",
    "formula": "a formula: it follows from the cells before it",
}
BOXED = set(KINDS) - {"title", "heading", "text", "note"}


class Styles:
    """Shared style arrays of one workbook: styling a cell costs a look-up, not a new object."""

    def __init__(self, book: Workbook) -> None:
        self.book = book
        self._known: dict[tuple[str, str, str], object] = {}
        self._numbers: dict[tuple[str, str, str], int] = {}

    @cached_property
    def _scratch(self) -> Worksheet:
        return self.book.create_sheet("scratch")

    def number(self, kind: str, number_format: str, align: str) -> int:
        """The number by which the file knows a style."""
        key = (kind, number_format, align)
        if key not in self._numbers:
            self._numbers[key] = self.book._cell_styles.add(self._style(*key))
        return self._numbers[key]

    def _style(self, *key: str) -> object:
        if key not in self._known:
            self._known[key] = self._array(*key)
        return self._known[key]

    def _array(self, kind: str, number_format: str, align: str) -> object:
        background, colour, bold, size = KINDS[kind]
        # openpyxl makes the array of a style only through a cell.
        model = Cell(self._scratch, row=1, column=1)
        model.font = Font(name="Calibri", size=size, bold=bold, color="FF" + colour)
        if background:
            model.fill = PatternFill("solid", start_color="FF" + background)
        if kind in BOXED:
            model.border = Border(*[Side("thin", color="FF" + LINE)] * 4)
        wrap = align == "wrap"
        horizontal = {"wrap": None, "": None}.get(align, align)
        indent = 1 if kind == "text" and wrap else 0
        model.alignment = Alignment(
            horizontal=horizontal or ("left" if indent else None),
            vertical="top",
            wrap_text=wrap,
            indent=indent,
        )
        model.protection = Protection(locked=kind != "answer", hidden=kind == "veiled")
        if number_format:
            model.number_format = number_format
        return model._style

    def close(self) -> None:
        """Remove what was needed to make styles."""
        if "_scratch" in vars(self):
            self.book.remove(self._scratch)


def number_format(values: list[float]) -> str:
    """Four figures at the column's root mean square, or more; scientific where that is tiny."""
    numbers = np.array(values, dtype=float)
    numbers = numbers[np.isfinite(numbers)]
    size = sqrt(np.square(numbers).mean()) if len(numbers) else 0
    if size == 0:
        return "0.000"
    if size < 1e6 and (numbers == np.round(numbers)).all():
        return "General"  # counts and switches; a fraction would still show
    magnitude = floor(log10(size))
    if not -4 <= magnitude <= 6:
        return "0.000E+00"
    return "0." + "0" * max(1, 3 - magnitude)
