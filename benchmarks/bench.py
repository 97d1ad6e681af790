"""How fast kfsheet is beside its peers: one table of ratios, each measured in this one run.

    make bench

Every figure is the median of several repeats; both sides of a ratio are measured in turn, so that
a busy machine slows both. A peer that is not installed, or a missing C compiler, leaves its lines
out. The table is written to benchmarks/README.md.
"""

import os
import platform
from pathlib import Path

import coursework
import many_runs
import one_run
import starting
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
HEAD = "| what | kfsheet | peer | peer/kfsheet | wanted, or to say |\n|---|---|---|---|---|"


def main() -> None:
    """Measure, print and keep the table."""
    parts = [preface()]
    for title, lines in GROUPS.items():
        parts.append(f"\n## {title}\n\n{HEAD}\n")
        print(parts[-1], flush=True)
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
        "What `make bench` printed last; every line was measured in one run, as a median of "
        "several repeats.\nAfter the colon stands the peer: where there is one, a ratio above 1 "
        "means that kfsheet is faster.\n"
        f"Machine: {platform.machine()}, {os.cpu_count()} cores, {platform.system()}, Python "
        f"{platform.python_version()}.\n"
    )


if __name__ == "__main__":
    main()
