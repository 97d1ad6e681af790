"""Recalculate a workbook from nothing in a spreadsheet engine that is not ours.

A file that carries stored values invites an engine to believe them: LibreOffice does. So every
engine is given a copy whose formulas have no values, or is one that looks at no value.
"""

from __future__ import annotations

from pathlib import Path

from kfsheet.errors import EngineError
from kfsheet.workbook.engines.ironcalc import IronCalc
from kfsheet.workbook.engines.ironcalc_process import IronCalcProcess
from kfsheet.workbook.engines.spreadsheet_engine import Changes, Engine, Values

ENGINES = {"ironcalc": "IronCalc", "libreoffice": "LibreOffice", "own": "kfsheet's calculator"}
"""Names of engines, and what their makers call them."""


def recalculate(
    path: str | Path, engine: str = "ironcalc", changes: Changes | None = None
) -> Values:
    """Values of all cells of a workbook, computed from nothing by an independent engine.

    Parameters
    ----------
    path : path
        An ``.xlsx`` file; it is not changed.
    engine : {'ironcalc', 'libreoffice', 'own'}
        IronCalc comes with ``pip install "kfsheet[check]"``; LibreOffice must be installed; our
        own is always there.
    changes : dict, optional
        Numbers that replace the content of cells before the calculation.

    Returns
    -------
    dict
        ``values[sheet][row, column]`` of every cell that is not empty.

    Raises
    ------
    WorkbookError
        If the file is no workbook.
    EngineError
        If the engine is unknown, missing, fails or takes longer than five minutes.
    """
    return open_in(path, engine).values(changes)


def open_in(path: str | Path, engine: str = "ironcalc") -> Engine:
    """A workbook in an engine; see :func:`recalculate`. IronCalc reads the file once, here."""
    if engine not in ENGINES:
        raise EngineError(f"no engine {engine!r}; there is {', '.join(ENGINES)}")
    if engine == "libreoffice":
        # It reads what LibreOffice wrote with openpyxl, which takes long to import: a check in
        # IronCalc begins while that is imported.
        from kfsheet.workbook.engines.libreoffice import LibreOffice

        return LibreOffice(Path(path))
    if engine == "own":
        from kfsheet.workbook.engines.own import Own  # it reads with openpyxl's words, too

        return Own(Path(path))
    return IronCalc(Path(path))


def start_engine(path: str | Path, engine: str = "ironcalc") -> Engine:
    """An engine that is asked about a file as it stands; see :func:`recalculate`.

    IronCalc works in a process of its own meanwhile, LibreOffice once the values are wanted.
    """
    started = IronCalcProcess(path) if engine == "ironcalc" else open_in(path, engine)
    started.ask()
    return started
