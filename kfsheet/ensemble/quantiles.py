"""Exact quantiles of more numbers than memory should hold.

Sketches of a distribution are small but err; and a quantile of a study should not depend on who
computed it. So the numbers are kept: in memory while they are few, then in a temporary file, read
in blocks as often as it takes to find the values in question.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from tempfile import SpooledTemporaryFile
from types import TracebackType

import numpy as np

IN_MEMORY = 2**23  # bytes
AT_ONCE = 2**20  # numbers that are sorted together
SPLITS = 2**14


class Kept:
    """Vectors of one length, in the order in which they came; a context that ends with its file."""

    def __init__(self, width: int) -> None:
        self.width, self.count = width, 0
        self._file = SpooledTemporaryFile(max_size=IN_MEMORY)  # noqa: SIM115 - closed in __exit__

    def __enter__(self) -> Kept:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._file.close()

    def add(self, values: np.ndarray) -> None:
        """Keep the rows of an array of shape (any, width)."""
        self._file.write(np.ascontiguousarray(values, dtype=float).tobytes())
        self.count += len(values)

    def column(self, k: int) -> Iterator[np.ndarray]:
        """Element k of all vectors, in blocks."""
        self._file.seek(0)
        size = max(1, AT_ONCE // self.width) * self.width * 8
        while block := self._file.read(size):
            # A copy: a view would keep the whole block in memory as long as it lives.
            yield np.frombuffer(block).reshape(-1, self.width)[:, k].copy()

    def quantiles(self, levels: Sequence[float]) -> np.ndarray:
        """Quantiles by linear interpolation, missing values left out: shape (levels, width)."""
        found = [self._quantiles(k, np.asarray(levels, dtype=float)) for k in range(self.width)]
        return np.array(found).reshape(self.width, len(levels)).T

    def _quantiles(self, k: int, levels: np.ndarray) -> np.ndarray:
        number = sum(np.count_nonzero(~np.isnan(block)) for block in self.column(k))
        if number == 0:
            return np.full(len(levels), np.nan)
        if self.count <= AT_ONCE:
            return np.nanquantile(np.concatenate([*self.column(k)]), levels)
        place = levels * (number - 1)
        below = np.floor(place).astype(int)
        above = np.minimum(below + 1, number - 1)
        value = order_statistics(lambda: self.column(k), [*below, *above])
        low, high = (np.array([value[n] for n in ranks]) for ranks in (below, above))
        return low + (high - low) * (place - below)


def order_statistics(blocks: Callable[[], Iterable[np.ndarray]], ranks: Iterable[int]) -> dict:
    """Values at some ranks, from 0, of numbers that are read in blocks; NaN have no rank.

    A sample splits the numbers into intervals, the first reading counts those in each, the second
    collects the few intervals that matter.
    """
    wanted = np.unique(np.fromiter(ranks, dtype=np.int64))
    splits = _splits(blocks)
    counts = np.zeros(2 * len(splits) + 1, dtype=np.int64)
    for block in blocks():
        counts += np.bincount(_interval(splits, block), minlength=len(counts))
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    home = np.searchsorted(np.cumsum(counts), wanted, side="right")
    between = np.zeros(len(counts), dtype=bool)
    between[home[home % 2 == 0]] = True  # an odd one is a value of the sample itself
    parts = []
    for block in blocks():
        place = _interval(splits, block)
        parts.append(block[~np.isnan(block)][between[place]])
    collected = np.sort(np.concatenate(parts))
    before = np.concatenate([[0], np.cumsum(np.where(between, counts, 0))[:-1]])
    return {
        int(rank): splits[at // 2] if at % 2 else collected[before[at] + rank - first[at]]
        for rank, at in zip(wanted, home, strict=True)
    }


def _splits(blocks: Callable[[], Iterable[np.ndarray]]) -> np.ndarray:
    sample = [block[:: max(1, len(block) * 8 // SPLITS)].copy() for block in blocks()]
    values = np.unique(np.concatenate(sample))
    values = values[~np.isnan(values)]
    return values[:: max(1, len(values) // SPLITS)]


def _interval(splits: np.ndarray, block: np.ndarray) -> np.ndarray:
    """2 i for a number between splits i - 1 and i, 2 i + 1 for one that equals split i."""
    block = block[~np.isnan(block)]
    return np.searchsorted(splits, block) + np.searchsorted(splits, block, side="right")
