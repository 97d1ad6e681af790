"""Processes of our own: a function of kfsheet, run by another interpreter."""

from __future__ import annotations

import sys
from pathlib import Path

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
