"""Times, as medians, and the lines of the table."""

import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple


class Line(NamedTuple):
    """What was measured: our time, a peer's (0 without one), and what was wanted or is to say."""

    what: str
    ours: float
    peer: float = 0.0
    note: str = ""


def in_turn(
    *works: Callable[[], object], repeats: int = 5, calls: Sequence[int] = ()
) -> list[float]:
    """Median time of a call of each, in seconds; all of them are repeated one after the other.

    So a machine that is busy for a while slows all of them. ``calls`` says how often each is called
    in a repeat, once by default.
    """
    times: list[list[float]] = [[] for _ in works]
    for _ in range(repeats):
        for work, count, found in zip(works, calls or [1] * len(works), times, strict=True):
            start = time.perf_counter()
            for _ in range(count):
                work()
            found.append((time.perf_counter() - start) / count)
    return [median(found) for found in times]


def seconds(work: Callable[[], object], repeats: int = 5, calls: int = 1) -> float:
    """Median time of a call, in seconds."""
    return in_turn(work, repeats=repeats, calls=[calls])[0]


def peak() -> float:
    """Megabytes that this process has taken at most; 0 where the system does not tell."""
    status = Path("/proc/self/status")
    if status.exists():  # unlike getrusage, it knows nothing of the parent
        return int(re.search(r"VmHWM:\s+(\d+)", status.read_text())[1]) / 2**10
    if sys.platform == "win32":
        return 0.0
    import resource

    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most / (2**20 if sys.platform == "darwin" else 2**10)


def peak_memory(program: str, **environment: str) -> float:
    """Megabytes that a program takes at most, in a process of its own."""
    here = str(Path(__file__).parent)
    print_peak = "\nimport sys; sys.path.insert(0, sys.argv[1]); import measuring"
    print_peak += "; print(measuring.peak())"
    command = [sys.executable, "-c", program + print_peak, here]
    around = {**os.environ, **environment}
    done = subprocess.run(command, env=around, capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])
