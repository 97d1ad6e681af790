"""How fast kfsheet is beside its peers: one table of ratios, each measured in this one run.

    make bench

A figure is the median of several repeats, but for those that take many seconds. The sides of a
ratio take turns, so that a busy machine slows both. A peer that is not installed, or a missing C
compiler, leaves its lines out. The table is written to benchmarks/README.md.
"""

import os
import platform
import re
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from datetime import date
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import coursework
import many_runs
import one_run
import starting
from flights import c_compiler
from measuring import Line

import workbooks
from kfsheet.files import write_file

GROUPS = {
    "One run": one_run.lines,
    "Many runs": many_runs.lines,
    "Workbooks": workbooks.lines,
    "Coursework": coursework.lines,
    "Starting": starting.lines,
}
HEAD = "| what | kfsheet | peer | peer/kfsheet | target, or a note |\n|---|---|---|---|---|"


def main() -> None:
    """Measure, print and keep the table."""
    parts = [preface()]
    for title, lines in GROUPS.items():
        parts.append(f"\n## {title}\n\n{HEAD}\n")
        print(parts[-1], end="", flush=True)
        for line in lines():
            parts.append(row(line) + "\n")
            print(parts[-1], end="", flush=True)
    write_file(Path(__file__).parent / "README.md", "".join(parts).encode())


def row(line: Line) -> str:
    """A line of the table."""
    ratio = f"{line.peer / line.ours:.2f}" if line.peer else ""
    peer = time_of(line.peer) if line.peer else ""
    return f"| {line.what} | {time_of(line.ours)} | {peer} | {ratio} | {line.note} |"


def time_of(value: float) -> str:
    """A time for people."""
    return f"{value:.2f} s" if value >= 1 else f"{value * 1e3:.3g} ms"


def preface() -> str:
    """What the tables are, and where they were measured."""
    return (
        "# Benchmarks\n\n"
        "What `make bench` printed last: all lines in one run, medians of several repeats (growth, "
        "compiling\nand the class were measured once), both sides of a ratio in turn. After the "
        "colon stands the peer:\nwhere there is one, a ratio above 1 means that kfsheet is "
        "faster.\n"
        f"\nMeasured on {date.today().isoformat()}: {', '.join(machine())}.\n"
        f"Peers: {', '.join(peers())}.\n"
    )


def machine() -> Iterator[str]:
    """What it was measured on."""
    info = Path("/proc/cpuinfo")
    names = re.findall(r"model name\s*: (.*)", info.read_text()) if info.exists() else []
    yield names[0] if names else platform.processor() or platform.machine()
    yield f"{os.cpu_count()} cores"
    if hasattr(os, "sysconf") and "SC_PHYS_PAGES" in os.sysconf_names:
        size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        yield f"{size / 2**30:.0f} GB"
    yield f"{platform.system()}, Python {platform.python_version()}"
    if compiler := c_compiler():
        done = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=True)
        yield done.stdout.splitlines()[0]


def peers() -> Iterator[str]:
    """Versions of what stands beside kfsheet, and of Numba, which compiles it."""
    names = "numba numpy filterpy statsmodels pykalman simdkalman openpyxl ironcalc formualizer"
    for name in (*names.split(), "formulas"):
        with suppress(PackageNotFoundError):
            yield f"{name} {version(name)}"


if __name__ == "__main__":
    main()
