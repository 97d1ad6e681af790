"""Formulas that we cannot calculate are judged by what a spreadsheet engine makes of them.

Every cell of the model but the answer's own gets the numbers of a world; an engine calculates the
workbook from nothing; and what it finds in the answer's cells must be what the key gives there. In
several worlds, so that no accident counts. Where an engine shows an error, another one is asked:
an engine's error is not a student's.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from kfsheet.coursework.judging.calculated_answers import Cells, filled, same
from kfsheet.coursework.judging.model_runs import ModelRuns, World
from kfsheet.coursework.judging.recalculation_process import calculated
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import Book
from kfsheet.errors import FormulaError, KfsheetError
from kfsheet.model.exercise import asked_steps
from kfsheet.parsing.calculator import Formula
from kfsheet.parsing.references import Address
from kfsheet.parsing.syntax import parse_formula
from kfsheet.workbook.engines.libreoffice import libreoffice
from kfsheet.workbook.engines.spreadsheet_engine import CellValue, Changes

WORLDS = {"ironcalc": 7, "libreoffice": 3}  # of those of all students; LibreOffice is slow
TOLERANCE = 1e-8  # rows that build upon each other pass their rounding on
SECONDS = 60.0  # of the engines' time for one workbook, all answers together
WORK = 2.0  # seconds of computing for one answer, beyond what its workbook takes without it
STARTS = {"ironcalc": 1.0, "libreoffice": 8.0}  # such seconds until an engine has begun
CELLS = {"ironcalc": 60_000, "libreoffice": 20_000}  # of the model, loaded or calculated in one


class Recalculation:
    """Asks engines about one workbook, as long as its time lasts."""

    def __init__(self, path: Path, book: Book, runs: ModelRuns) -> None:
        self._path, self._book, self._runs, self._left = path, book, runs, SECONDS
        self.late = False
        """Whether an answer was not judged because there was no time."""

    def __call__(self, addresses: CellAddresses, name: str) -> dict[int, bool]:
        """Whether a step of an answer has the key's value in every world, where one can tell."""
        cells = {step: addresses.of(name, step) for step in asked_steps(self._runs.model, name)}
        # What is no formula is no riddle: LibreOffice would mend what Excel refuses.
        cells = {step: cell for step, cell in cells.items() if self._may_be_read(cell)}
        found: dict[int, bool] = {}
        for engine in WORLDS if libreoffice() else ("ironcalc",):
            if open_steps := {step: cell for step, cell in cells.items() if step not in found}:
                found |= self._asked(engine, addresses, name, open_steps)
        return found

    def _may_be_read(self, cell: Address) -> bool:
        """Whether a formula can be read, by whoever knows its functions."""
        content = self._book.sheets.get(cell[0], {}).get(cell[1:])
        if not isinstance(content, Formula):  # one of an array's cells
            return True
        try:
            return bool(parse_formula(content.text))
        except FormulaError:
            return False

    def _asked(
        self, engine: str, addresses: CellAddresses, name: str, cells: dict[int, Address]
    ) -> dict[int, bool]:
        began = time.monotonic()
        worlds = self._runs.worlds[: WORLDS[engine]]
        wanted = [filled(world, addresses) for world in worlds]
        trials = [_changes(values, set(cells.values())) for values in wanted]
        try:
            work = _work(engine, wanted)
            values = calculated(self._path, trials, [*cells.values()], self._left, engine, work)
        except KfsheetError:
            self.late |= time.monotonic() - began >= self._left
            return {}
        finally:
            self._left = max(1.0, self._left - (time.monotonic() - began))
        pairs = zip(cells.items(), zip(*values, strict=True), strict=True)
        told = {
            step: _agree([_of(cell, key) for key in wanted], seen, worlds, name)
            for (step, cell), seen in pairs
        }
        return {step: right for step, right in told.items() if right is not None}


def _work(engine: str, wanted: Sequence[Cells]) -> float:
    """Seconds of computing that an engine may take: what it loads and calculates, and WORK."""
    cells = sum(len(cells) for cells in wanted[0].values()) if wanted else 0
    return STARTS[engine] + WORK + (1 + len(wanted)) * cells / CELLS[engine]


def _of(cell: Address, values: Cells) -> CellValue:
    return values[cell[0]][cell[1:]]


def _changes(values: Cells, but: set[Address]) -> Changes:
    """The numbers of a world for every cell of the model but some; texts are empty cells."""
    return {
        sheet: {
            place: value if type(value) is float else None
            for place, value in cells.items()
            if (sheet, *place) not in but
        }
        for sheet, cells in values.items()
    }


def _agree(
    wanted: Sequence[CellValue], found: Sequence[CellValue], worlds: Sequence[World], name: str
) -> bool | None:
    """Whether a cell has the key's value in every world; None if the engine does not know."""
    if any(isinstance(value, str) and value.startswith("#") for value in found):
        return None
    found = [float(v) if type(v) in (int, float) else "" if v is None else v for v in found]
    sizes = [world.sizes.get(name, 0.0) for world in worlds]
    return all(map(same, found, wanted, sizes, [TOLERANCE] * len(sizes)))
