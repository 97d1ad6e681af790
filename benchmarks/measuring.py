"""Times, as medians, and the lines of the table."""

import time
from collections.abc import Callable
from statistics import median
from typing import NamedTuple


class Line(NamedTuple):
    """What was measured: our time, a peer's (0 without one), and what was wanted or is to say."""

    what: str
    ours: float
    peer: float = 0.0
    note: str = ""


def seconds(work: Callable[[], object], repeats: int = 5, calls: int = 1) -> float:
    """Median time of a call, in seconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(calls):
            work()
        times.append((time.perf_counter() - start) / calls)
    return median(times)
