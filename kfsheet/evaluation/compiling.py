"""Machine code of kernels: made by Numba, kept on disk, found there by the next process.

A file is named by a digest of the source and of all that its machine code depends on. Nothing is
believed of the folder: what cannot be read is made anew, what cannot be written stays in memory,
and what nobody has used for a season is deleted.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from threading import Lock
from types import ModuleType
from typing import Any
from warnings import warn

from platformdirs import user_cache_dir

from kfsheet.errors import EngineError, KfsheetError
from kfsheet.files import write_file
from kfsheet.processes import command

HERE = Path(__file__).parent
SEASON = 90 * 24 * 3600  # seconds that a kernel is kept without being used
LOADING, COMPILING, WAITING = 500_000, 3_000_000, 30_000_000  # cells; Python does 4 in 1 us
MISSING = "Numba is missing where this should be compiled: install kfsheet[fast], or compiled=False"


@lru_cache
def can_compile() -> bool:
    """Whether Numba is installed."""
    return find_spec("numba") is not None


def pays(source: str, cells: int, before: int) -> bool:
    """Whether a run is for compiled code: so many cells, after so many by Python.

    Code that is on disk is used once Python has taken longer than loading it. New code is waited
    for only where Python would take longer than the compiler; else, after some time, a process of
    its own makes it while Python goes on.
    """
    if cells + before < LOADING or not can_compile():
        return False
    if is_ready(source) or cells >= WAITING:
        return True
    if before >= COMPILING:  # after a first run, which would only be slower for the company
        _BACKGROUND.compile(source)
    return False


def nothing_is_ready() -> bool:
    """Whether no kernel at all was compiled here, so that none need be printed to look for it."""
    return not can_compile() or next(cache_folder().glob("kernel_*.ready"), None) is None


def compiled_function(source: str) -> Callable:
    """The compiled function of a kernel's source; from disk if it was compiled before.

    Raises
    ------
    EngineError
        If Numba is not installed, or cannot compile it.
    """
    if not can_compile():
        raise EngineError(MISSING)
    try:
        with _ONE_AT_A_TIME:  # threads that ask for the same shall not all compile it
            return _compiled(source)
    except Exception as error:
        words = f"Numba cannot compile this model ({type(error).__name__}: {error})"
        raise EngineError(f"{words}; compiled=False does without") from error


_ONE_AT_A_TIME = Lock()


@lru_cache(maxsize=64)
def _compiled(source: str) -> Callable:
    try:
        return _from_disk(_file_of(source), source)
    except (OSError, KfsheetError):  # a disk that is full, a folder that is gone
        return _typed(_dispatcher(source, "<kernel>", cache=False))


# -- on disk -------------------------------------------------------------------------------


def cache_folder() -> Path:
    """Where compiled kernels are kept: KFSHEET_CACHE, or the user's cache directory."""
    return _folder(os.environ.get("KFSHEET_CACHE") or user_cache_dir("kfsheet"))


@lru_cache
def _folder(chosen: str) -> Path:
    """The folder chosen, or one for this process where that cannot be written."""
    with suppress(OSError, RuntimeError):  # where nobody has a home, that of "~" is not known
        return _writable(Path(chosen).expanduser() / "kernels")
    own = tempfile.mkdtemp(prefix="kfsheet-")
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    return _writable(Path(own) / "kernels")


def _writable(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        return folder.absolute()


def _file_of(source: str) -> Path:
    """File of a source, named by a digest of it and of all that its machine code depends on."""
    return cache_folder() / f"kernel_{_digest(source)}.py"


@lru_cache(maxsize=64)
def _digest(source: str) -> str:
    from importlib.metadata import version

    from llvmlite import binding  # far quicker to import than numba

    machine = f"{binding.get_host_cpu_name()} {binding.get_host_cpu_features().flatten()}"
    mathematics = (HERE / "compiled_functions.py").read_text(encoding="utf-8")
    parts = (source, mathematics, sys.version, version("numba"), machine)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]


def _marker(path: Path) -> Path:
    """A file beside a kernel that says: compiled, and last used when the file was touched."""
    return path.with_suffix(".ready")


def is_ready(source: str) -> bool:
    """Whether a kernel has been compiled on this machine before."""
    return _marker(_file_of(source)).exists()


def _from_disk(path: Path, source: str) -> Callable:
    """The function of a kernel, from its machine code if that is there and sound."""
    known = _holds(path, source)
    _write(path, source)
    function = _dispatcher(source, str(path), cache=True)
    try:
        _typed(function)
    except Exception:  # of a damaged pickle: anything
        if not known:
            raise
        _forget(path, function.stats.cache_path)
        _write(path, source)
        function = _typed(_dispatcher(source, str(path), cache=True))
    if function.stats.cache_misses:
        _tidy(path.parent)
    _marker(path).touch()
    return function


def compile_file(name: str) -> None:
    """Compile a source that is in the cache; what the process in the background does."""
    path = Path(name)
    _from_disk(path, path.read_bytes().decode())


def _holds(path: Path, source: str) -> bool:
    try:
        return path.read_bytes() == source.encode()
    except OSError:
        return False


def _write(path: Path, source: str) -> None:
    """Write the source, unless it is there: to Numba a newer file means another function."""
    try:
        if not _holds(path, source):
            write_file(path, source.encode())
    except KfsheetError:  # on Windows, another process that writes the same is in the way
        if not _holds(path, source):
            raise


def _forget(path: Path, machine_code: str | Path) -> None:
    """Delete all files of a kernel."""
    for file in (_marker(path), path, *Path(machine_code).glob(f"{path.stem}.*")):
        with suppress(OSError):
            file.unlink()


def _tidy(folder: Path) -> None:
    """Delete kernels that nobody has used for a season."""
    for path in folder.glob("kernel_*.py"):
        with suppress(OSError):
            used = _marker(path) if _marker(path).exists() else path
            if time.time() - used.stat().st_mtime > SEASON:
                _forget(path, folder / "__pycache__")


# -- compiling -----------------------------------------------------------------------------


def _dispatcher(source: str, filename: str, *, cache: bool) -> Any:
    """Numba's function of a source, not compiled yet."""
    import numba

    from kfsheet.evaluation.compiled_functions import OPTIONS

    module = ModuleType(Path(filename).stem)
    sys.modules[module.__name__] = module  # the cache looks the module up by its name
    exec(compile(source, filename, "exec"), vars(module))  # printed by us
    return numba.njit(module.kernel, cache=cache, **OPTIONS)


def _typed(function: Any) -> Any:
    """Compile, or load, for the arrays that a kernel gets; whoever sent them may lock them."""
    from numba import int64, types

    given = types.Array(types.float64, 2, "C", readonly=True)
    out, results = types.float64[:, :, ::1], types.float64[:, ::1]
    # Besides data: two numbers, the parameters, and the two arrays that it writes.
    series = function.py_func.__code__.co_argcount - 5
    function.compile((int64, int64, *[given] * (1 + series), out, results))
    function.disable_compile()  # arrays that may be written do as well; not once more for them
    return function


class _Background:
    """A process that compiles while this one goes on; one at a time, and ended with this one.

    Not a thread: the compiler is mostly Python, and would take half of the interpreter's time.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._tried: set[str] = set()
        self._process: subprocess.Popen | None = None

    def compile(self, source: str) -> None:
        """Start compiling, unless that was tried or something else is being compiled."""
        with self._lock:
            if self.busy() or source in self._tried or not sys.executable:
                return
            self._tried.add(source)
            path = _file_of(source)
            with suppress(OSError, KfsheetError):
                _write(path, source)
                self._start(path)

    def busy(self) -> bool:
        """Whether something is being compiled; tells of a compiler that has failed."""
        if self._process is None or (status := self._process.poll()) is None:
            return self._process is not None
        self._process = None
        if status:
            words = "the compiler failed, so Python goes on; compiled=True tells the reason"
            warn(words, RuntimeWarning, stacklevel=2)
        return False

    def _start(self, path: Path) -> None:
        self._process = subprocess.Popen(
            command("kfsheet.evaluation.compiling", "compile_file", str(path)),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # who interrupts a run does not mean the compiler
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        atexit.register(self.stop)

    def stop(self) -> None:
        """End the process; half-written machine code has another name than whole."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None


_BACKGROUND = _Background()
