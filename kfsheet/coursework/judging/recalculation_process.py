"""A spreadsheet engine in a process of its own: a formula may take it for ever, or all memory.

What it may compute is limited by the system, in seconds of computing: a machine that has much else
to do judges as one that has not. The process calls :func:`main`. It is sent what to calculate as a
pickle, which comes from us, and answers in JSON, since what it read comes from somebody else.
"""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from math import ceil
from pathlib import Path

from kfsheet.errors import EngineError, KfsheetError
from kfsheet.parsing.references import Address
from kfsheet.processes import answers, command
from kfsheet.workbook.engines.recalculate import open_in
from kfsheet.workbook.engines.spreadsheet_engine import CellValue, Changes


def calculated(
    path: Path,
    trials: Sequence[Changes],
    cells: Sequence[Address],
    seconds: float,
    engine: str = "ironcalc",
    work: float = 60.0,
) -> list[list[CellValue]]:
    """Values of some cells of a workbook, once for each set of numbers put in first.

    Raises
    ------
    EngineError
        If the engine fails, takes longer than ``seconds``, or computes for longer than ``work``
        seconds, loading the file included, where the system can limit that.
    """
    asked = pickle.dumps((str(path), list(trials), list(cells), engine, work))
    program = command("kfsheet.coursework.judging.recalculation_process", "main")
    try:
        done = subprocess.run(program, input=asked, capture_output=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        raise EngineError(f"calculating took longer than {seconds:.0f} s") from None
    if done.returncode:
        raise EngineError("the engine could not calculate the workbook")
    return json.loads(done.stdout)


def main() -> int:
    """Calculate what standard input asks for."""
    asked = pickle.loads(sys.stdin.buffer.read())  # from calculated() above
    path, trials, cells, name, work = asked
    pipe = answers()
    _limit(work)
    try:
        engine = open_in(path, name)
        several = getattr(engine, "values_of_all", None)  # LibreOffice takes long to start
        found = several(trials) if several else [engine.values(changes) for changes in trials]
    except KfsheetError:
        return 1
    wanted = [[v.get(c[0], {}).get(c[1:]) for c in cells] for v in found]
    with pipe:
        pipe.write(json.dumps(wanted).encode())
    return 0


def _limit(work: float) -> None:
    """End this process, and each that it starts, once it has computed for so many seconds."""
    with suppress(ImportError, ValueError, OSError):  # not on Windows
        import resource

        used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        _, most = resource.getrlimit(resource.RLIMIT_CPU)
        limit = ceil(used + work)
        resource.setrlimit(resource.RLIMIT_CPU, (limit if most < 0 else min(limit, most), most))
