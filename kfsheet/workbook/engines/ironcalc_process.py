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
import signal
import subprocess
import tempfile
import weakref
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cached_property, partial
from io import FileIO
from itertools import count
from pathlib import Path
from select import select
from threading import Timer
from typing import BinaryIO

from kfsheet.errors import EngineError, KfsheetError, MissingEngineError, WorkbookError
from kfsheet.processes import answers, command, kill
from kfsheet.workbook.engines.ironcalc import Cells, IronCalc, by_address
from kfsheet.workbook.engines.spreadsheet_engine import TIMEOUT, Changes, Values

VALUES = "values"  # the kind of an answer that is none of the errors
ERRORS = {error.__name__: error for error in (WorkbookError, MissingEngineError)}


class IronCalcProcess:
    """A workbook in IronCalc, apart. What will be wanted can be asked for before it is wanted.

    It is for one thread.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        folder = tempfile.mkdtemp(prefix="kfsheet-")  # ours, who live longer
        self._process = subprocess.Popen(
            command("kfsheet.workbook.engines.ironcalc_process", "main", str(path), folder),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # so that its forks can be stopped with it
        )
        weakref.finalize(self, _end, self._process, folder)
        self._shared = _SharedFolder(Path(folder))
        self._numbers = count(1)
        self._asked: dict[bytes, int] = {}
        """Numbers of the questions that are not yet answered, by what they ask."""
        self._answered = 0

    def ask(self, changes: Changes | None = None) -> None:
        """Begin to calculate, with numbers put in first."""
        self._ask(changes)

    def _ask(self, changes: Changes | None) -> int:
        """The number of a question, asked if it is not yet."""
        question = _question(changes)
        if question not in self._asked:
            number = next(self._numbers)
            self._shared.put(f"question {number}", question)
            self._asked[question] = number
            with suppress(OSError):  # it has ended; the answer will say so
                _send(self._process.stdin, number)
        return self._asked[question]

    def values(self, changes: Changes | None = None) -> Values:
        """Values of all cells that are not empty; what was asked for in vain is passed over."""
        number = self._ask(changes)
        # Answers come in the order of the questions: an earlier one that nobody wants comes first.
        while self._answered < number:
            self._answered = self._next()
        self._asked = {question: n for question, n in self._asked.items() if n > number}
        kind, *found = marshal.loads(self._shared.take(f"answer {number}"))
        if kind != VALUES:
            raise ERRORS.get(kind, EngineError)(*found)
        cells, values = found
        return by_address(cells or self._cells, values)

    def _next(self) -> int:
        """Wait for an answer; its number."""
        limit = Timer(TIMEOUT, kill, [self._process])
        limit.daemon = True  # the interpreter would wait for it when it is interrupted
        limit.start()
        try:
            number = self._process.stdout.readline()
        finally:
            late = f", after {TIMEOUT} s" if limit.finished.is_set() else ""
            limit.cancel()
        if not number:
            kill(self._process)  # its forks, if it has died without them
            raise EngineError(f"IronCalc ended while it calculated {self.path}{late}")
        return int(number)

    @cached_property
    def _cells(self) -> Cells:
        return marshal.loads(self._shared.take("cells"))


def _question(changes: Changes | None) -> bytes:
    """What is asked, the same for the same numbers; marshal writes NumPy's as bytes."""
    plain = {
        sheet: {cell: value if value is None else float(value) for cell, value in cells.items()}
        for sheet, cells in (changes or {}).items()
    }
    return marshal.dumps(plain, 2)  # later versions write shared objects as they happen to be


class _SharedFolder:
    """A folder in which one process puts what another one takes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def put(self, name: str, content: bytes) -> None:
        (self.folder / name).write_bytes(content)

    def take(self, name: str) -> bytes:
        return (self.folder / name).read_bytes()


def _send(pipe: BinaryIO, number: int) -> None:
    pipe.write(b"%d\n" % number)
    pipe.flush()


def _end(process: subprocess.Popen, folder: str) -> None:
    kill(process)
    process.communicate()
    shutil.rmtree(folder, ignore_errors=True)


# -- the other process ---------------------------------------------------------------------


def main(path: str, folder: str) -> None:
    """Answer what standard input asks, until it ends; then the folder is of use to nobody."""
    gc.disable()  # nothing here is circular, and a search would copy the memory that forks share
    server = _Server(Path(path), _SharedFolder(Path(folder)))
    try:
        server.serve()
    finally:
        server.end()  # but whoever asked may still look into the folder
        shutil.rmtree(folder, ignore_errors=True)


class _Server:
    """A workbook that is loaded when it is first asked about, and the forks that calculate it."""

    def __init__(self, path: Path, shared: _SharedFolder) -> None:
        self._path, self._shared = path, shared
        # Without a buffer, in which a question could hide from select.
        self._source, self._pipe = FileIO(0), answers()
        self._engine: IronCalc | None = None
        self._cells: Cells = {}
        self._forks: deque[_Fork] = deque()

    def serve(self) -> None:
        """Answer questions until there are no more, or a fork has died."""
        for number in self._questions():
            changes = marshal.loads(self._shared.take(f"question {number}"))
            try:
                self._load()
            except KfsheetError as error:
                self._refuse(number, error)
                _send(self._pipe, number)
                continue
            if not self._fork(number, changes):
                while self._forks:
                    self._forward()
                self._answer(number, changes)
                _send(self._pipe, number)

    def _fork(self, number: int, changes: Changes) -> bool:
        """Whether a fork calculates it: there are none on Windows, or no more of them."""
        if not hasattr(os, "fork"):
            return False
        with suppress(OSError):
            self._forks.append(_Fork(number, partial(self._answer, number, changes), self._pipe))
            return True
        return False

    def end(self) -> None:
        """Stop the forks that still calculate, answer no more, and wait until nobody can ask."""
        for fork in self._forks:
            fork.kill()
        with suppress(OSError):
            self._pipe.close()
        while self._source.read(2**16):
            pass

    def _questions(self) -> Iterator[int]:
        """Numbers of questions as they come; those of answers are told meanwhile, in order."""
        with suppress(EOFError):
            while True:
                ends = [fork.end for fork in self._forks]
                if ends and self._source not in select([self._source, ends[0]], [], [])[0]:
                    self._forward()
                elif line := self._source.readline():
                    yield int(line)
                else:
                    return

    def _forward(self) -> None:
        """Say that the first of the forks has answered, once it has."""
        fork = self._forks.popleft()
        fork.wait()
        _send(self._pipe, fork.number)

    def _load(self) -> None:
        if self._engine is None:
            self._engine = IronCalc(self._path, str(self._shared.folder))
            self._cells = self._engine.cells()
            self._shared.put("cells", marshal.dumps(self._cells))

    def _answer(self, number: int, changes: Changes) -> None:
        """Calculate; of the cells only those are told that are others than at first."""
        try:
            cells, values = self._engine.calculated(changes)
        except KfsheetError as error:
            self._refuse(number, error)
        else:
            self._put(number, (VALUES, None if cells is self._cells else cells, values))

    def _refuse(self, number: int, error: KfsheetError) -> None:
        self._put(number, (type(error).__name__, str(error)))

    def _put(self, number: int, answer: tuple) -> None:
        self._shared.put(f"answer {number}", marshal.dumps(answer))


class _Fork:
    """A fork of this process, which does one piece of work and ends."""

    def __init__(self, number: int, work: Callable[[], None], pipe: BinaryIO) -> None:
        """``pipe`` is what the fork shall not keep open."""
        self.number = number
        ours, theirs = os.pipe()
        self.end = FileIO(ours)
        """A pipe that is ready to be read once the fork has ended."""
        try:
            self._process = os.fork()
        except OSError:
            self.end.close()
            os.close(theirs)
            raise
        if self._process:
            os.close(theirs)
            return
        try:
            os.close(pipe.fileno())
            work()
        except BaseException:
            os._exit(1)  # never return into the copy of the server's loop that a fork is
        os._exit(0)

    def wait(self) -> None:
        """Wait until it has ended; EOFError if its work is not done."""
        self.end.close()
        _, status = os.waitpid(self._process, 0)
        if status:
            raise EOFError

    def kill(self) -> None:
        """End it now."""
        os.kill(self._process, signal.SIGKILL)
        os.waitpid(self._process, 0)
