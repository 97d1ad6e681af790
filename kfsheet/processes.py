"""Processes: a function of kfsheet, run by another interpreter; programs that start others."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

PROGRAM = (
    "import sys; from importlib import import_module; sys.path.insert(0, sys.argv[1]); "
    "sys.exit(getattr(import_module(sys.argv[2]), sys.argv[3])(*sys.argv[4:]))"
)


def command(module: str, function: str, *arguments: str) -> list[str]:
    """The command that calls a function of ours with texts, and ends with what it returns.

    It runs this very copy of kfsheet, and no module that lies in the current folder.
    """
    home = str(Path(__file__).resolve().parents[1])
    return [sys.executable, "-P", "-c", PROGRAM, home, module, function, *arguments]


def answers() -> BinaryIO:
    """Standard output, for answers alone: what else is printed goes to standard error.

    A library in another language prints past Python's own ``sys.stdout``.
    """
    found = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return found


def completed(arguments: Sequence[str], seconds: float) -> subprocess.CompletedProcess[str]:
    """Run a program that starts others; none is left of them if it is late or interrupted.

    Raises
    ------
    subprocess.TimeoutExpired
        If it takes longer than ``seconds``.
    """
    pipe = subprocess.PIPE
    process = subprocess.Popen(
        arguments, stdout=pipe, stderr=pipe, text=True, start_new_session=True
    )
    try:
        out, err = process.communicate(timeout=seconds)
    except BaseException:
        kill(process)
        process.communicate()
        raise
    return subprocess.CompletedProcess(arguments, process.returncode, out, err)


def kill(process: subprocess.Popen) -> None:
    """Stop a process that began a session of its own, and all that it started."""
    if hasattr(os, "killpg") and process.returncode is None:  # until then its number is its own
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()
