"""What a person sees in a terminal: progress, one line for an error, and the exit status."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from typing import Any

HOLDS, DOES_NOT_HOLD, WRONG_USE = 0, 1, 2


def progress(items: Iterable, verb: str, count: int, name: Callable[[Any], str] = str) -> Iterator:
    """Yield ``count`` items behind a progress bar on a terminal, each named in a line elsewhere."""
    if sys.stderr.isatty():
        from tqdm import tqdm

        yield from tqdm(items, desc=verb, total=count, leave=False)
        return
    for n, item in enumerate(items, 1):
        print(f"{verb} {n}/{count}: {name(item)}", file=sys.stderr)
        yield item


def complain(error: Exception) -> None:
    """One line on standard error."""
    words = " ".join(str(error).split())
    print(f"kfsheet: {words}", file=sys.stderr)
