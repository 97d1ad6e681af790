"""IronCalc in a process of its own, which works while this one does something else.

That process loads a workbook once. Where the system can fork, every question is calculated by a
fork of it: questions that are asked together are calculated together, and none sees the numbers
that another put in. Little is imported here, so that it starts at once.

Questions and answers are files, of which only the numbers go through the pipes: nobody has to wait
until the other one listens.
"""

from __future__ import annotations

import gc
import marshal
import os
import shutil
import subprocess
import tempfile
import weakref
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property
from io import FileIO
from pathlib import Path
from select import select
from threading import Timer
from typing import Any, BinaryIO

from kfsheet.errors import EngineError, KfsheetError, WorkbookError
from kfsheet.excel.engine import Cells, IronCalc, Values, by_address
from kfsheet.excel.stripping import Changes
from kfsheet.processes import answers, command, kill

TIMEOUT = 300  # seconds that an answer may take
VALUES = "values"  # the kind of an answer that is none of the errors


class Apart:
    """A workbook in IronCalc, apart. What will be wanted can be asked for before it is wanted."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        folder = tempfile.mkdtemp(prefix="kfsheet-")  # ours, who live longer
        self._process = subprocess.Popen(
            command("kfsheet.excel.apart", "main", str(path), folder),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        weakref.finalize(self, _end, self._process, folder)
        self._desk = _Desk(Path(folder))
        self._asked: deque[Changes] = deque()
        self._answered = 0

    def ask(self, changes: Changes | None = None) -> None:
        """Begin to calculate, with numbers put in first."""
        plain = {  # marshal writes NumPy's numbers as bytes
            sheet: {cell: value if value is None else float(value) for cell, value in cells.items()}
            for sheet, cells in (changes or {}).items()
        }
        if plain not in self._asked:
            self._asked.append(plain)
            number = self._answered + len(self._asked)
            self._desk.put(f"question {number}", plain)
            with suppress(OSError):  # it has ended; the answer will say so
                _tell(self._process.stdin, number)

    def values(self, changes: Changes | None = None) -> Values:
        """Values of all cells that are not empty; what was asked for in vain is passed over."""
        self.ask(changes)
        while self._asked.popleft() != (changes or {}):
            self._next()
        kind, *found = self._desk.take(f"answer {self._next()}")
        if kind != VALUES:
            raise {"WorkbookError": WorkbookError}.get(kind, EngineError)(*found)
        cells, values = found
        return by_address(cells or self._cells, values)

    def _next(self) -> int:
        """Wait for an answer; its number."""
        limit = Timer(TIMEOUT, kill, [self._process])
        limit.start()
        number = self._process.stdout.readline()
        late = f", after {TIMEOUT} s" if limit.finished.is_set() else ""
        limit.cancel()
        if not number:
            raise EngineError(f"IronCalc ended while it calculated {self.path}{late}")
        self._answered = int(number)
        return self._answered

    @cached_property
    def _cells(self) -> Cells:
        return self._desk.take("cells")


class _Desk:
    """A folder in which one process puts what another one takes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def put(self, name: str, content: object) -> None:
        (self.folder / name).write_bytes(marshal.dumps(content))

    def take(self, name: str) -> Any:
        return marshal.loads((self.folder / name).read_bytes())


def _tell(pipe: BinaryIO, number: int) -> None:
    pipe.write(b"%d\n" % number)
    pipe.flush()


def _end(process: subprocess.Popen, folder: str) -> None:
    kill(process)
    process.communicate()
    shutil.rmtree(folder, ignore_errors=True)


# -- the other process ---------------------------------------------------------------------


def main(path: str, folder: str) -> None:
    """Answer what standard input asks, until it ends."""
    gc.disable()  # nothing here is circular, and a search would copy the memory that forks share
    # Without a buffer, in which a question could hide from select.
    source, pipe, desk = FileIO(0), answers(), _Desk(Path(folder))
    engine: IronCalc | None = None
    cells: Cells = {}
    forks: deque[_Fork] = deque()
    for number in _questions(source, forks, pipe):
        changes = desk.take(f"question {number}")
        try:
            if engine is None:
                engine = IronCalc(Path(path), folder)
                cells = engine.cells()
                desk.put("cells", cells)
        except KfsheetError as error:
            desk.put(f"answer {number}", (type(error).__name__, str(error)))
            _tell(pipe, number)
            continue
        if hasattr(os, "fork"):
            forks.append(_Fork(desk, number, engine, changes, cells))
        else:
            desk.put(f"answer {number}", _calculated(engine, changes, cells))
            _tell(pipe, number)


def _questions(source: FileIO, forks: deque[_Fork], pipe: BinaryIO) -> Iterator[int]:
    """Numbers of questions as they come; those of answers are told meanwhile, in their order."""
    while True:
        if forks and source not in select([source, forks[0].end], [], [])[0]:
            fork = forks.popleft()
            if not fork.is_well():
                return
            _tell(pipe, fork.number)
        elif line := source.readline():
            yield int(line)
        else:
            return


def _calculated(engine: IronCalc, changes: Changes, told: Cells) -> tuple:
    """An answer; of the cells only if they are others than those that are told."""
    try:
        cells, values = engine.calculated(changes)
    except KfsheetError as error:
        return type(error).__name__, str(error)
    return VALUES, None if cells is told else cells, values


class _Fork:
    """A fork of this process, which calculates one answer and ends."""

    def __init__(
        self, desk: _Desk, number: int, engine: IronCalc, changes: Changes, told: Cells
    ) -> None:
        self.number = number
        ours, theirs = os.pipe()
        self.end = FileIO(ours)
        """A pipe that is ready to be read once the fork has ended."""
        self._process = os.fork()
        if self._process:
            os.close(theirs)
            return
        try:
            desk.put(f"answer {number}", _calculated(engine, changes, told))
        except BaseException:
            os._exit(1)
        os._exit(0)

    def is_well(self) -> bool:
        """Whether it has answered; it has ended."""
        self.end.close()
        _, status = os.waitpid(self._process, 0)
        return status == 0
