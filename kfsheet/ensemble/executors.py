"""Who computes the groups of a study, and in which order their results are added."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import closing
from itertools import islice
from typing import Any

from kfsheet.ensemble.groups import Group, GroupSums, in_batches, run_batch, run_group
from kfsheet.ensemble.quantiles import Kept
from kfsheet.evaluation.compiling import compiled_function, is_ready

WORTH_THREADS = 2**19  # rows of all members; below, threads cost more than they bring
UNKNOWN_WORKERS = 64  # assumed of an executor that does not say how many it has


def computed(group: Group, executor: Executor | None, kept: Kept) -> GroupSums:
    """What all members say; their scalars go to ``kept``.

    Results are added in the order of the members, a batch of groups at a time, whoever computes
    them: so the sum is the same to the last bit.
    """
    large = group.members * group.rows >= WORTH_THREADS or not group.compiled
    whole: GroupSums | None = None
    with closing(_batches(group, executor)) as batches, _bar(group.members, large) as bar:
        for batch in batches:
            bar.update(batch.members)
            for values in batch.kept:
                kept.add(values)
            batch.kept = []
            if whole is None:
                whole = batch
            else:
                whole.add(batch)
    assert whole is not None  # there is at least one member
    return whole


def _batches(group: Group, executor: Executor | None) -> Iterator[GroupSums]:
    if executor is not None:
        parts = group.parts(group.batch * group.size)
        yield from _in_order(executor, run_batch, parts, 4 * _workers(executor))
        return
    groups = group.parts(group.size)
    if group.compiled:  # once, before threads ask for it together
        source = group.kernel.source
        with _bar(group.members, not is_ready(source), "compiling"):
            compiled_function(source)
    small = group.members * group.rows < WORTH_THREADS
    if small or not group.compiled or cores() == 1:
        yield from in_batches(map(run_group, groups), group.batch)
        return
    pool = ThreadPoolExecutor(cores())
    try:
        with closing(_in_order(pool, run_group, groups, 4 * cores())) as found:
            yield from in_batches(found, group.batch)
    finally:
        pool.shutdown(cancel_futures=True)


def _in_order(
    executor: Executor,
    function: Callable[[Group], GroupSums],
    groups: Iterator[Group],
    under_way: int,
) -> Iterator[GroupSums]:
    """Results in the order of the groups, of which so many are under way at a time."""
    running = deque(executor.submit(function, group) for group in islice(groups, under_way))
    try:
        while running:
            found = running.popleft().result()
            running.extend(executor.submit(function, group) for group in islice(groups, 1))
            yield found
    finally:
        for future in running:
            future.cancel()


def cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _workers(executor: Any) -> int:
    """How many tasks an executor runs at a time, as far as it can be known."""
    if hasattr(executor, "_max_workers"):  # threads and processes of the standard library
        return executor._max_workers
    if hasattr(getattr(executor, "_client", None), "ncores"):  # of dask.distributed
        return sum(executor._client.ncores().values()) or 1
    return UNKNOWN_WORKERS


def _bar(members: int, shown: bool, words: str = "") -> Any:
    """A progress bar, on a terminal or in a notebook, that goes when it is done.

    It waits a second, and TQDM_DISABLE forbids it, as where notebooks are executed to be compared.
    """
    if not shown or os.environ.get("TQDM_DISABLE"):
        from tqdm import tqdm

        return tqdm(total=members, disable=True)
    from tqdm.auto import tqdm

    # None: not on what is no terminal; a notebook shows it all the same.
    return tqdm(total=members, desc=words, unit=" runs", leave=False, delay=1, disable=None)
