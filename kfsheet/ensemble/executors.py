"""Who computes the groups of a study, and in which order their results are added."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import closing
from itertools import islice
from typing import Any

from kfsheet.ensemble.group import BATCH, Found, Task, in_batches, run_batch, run_group
from kfsheet.ensemble.quantiles import Kept
from kfsheet.evaluation.compiling import compiled_function, is_ready

WORTH_THREADS = 2**19  # rows of all members; below, threads cost more than they bring
UNKNOWN_WORKERS = 64  # assumed of an executor that does not say how many it has


def computed(task: Task, executor: Executor | None, kept: Kept) -> Found:
    """What all members say; their scalars go to ``kept``.

    Results are added in the order of the members, a batch of groups at a time, whoever computes
    them: so the sum is the same to the last bit.
    """
    members = task.last - task.first
    large = members * task.rows >= WORTH_THREADS or not task.compiled
    whole: Found | None = None
    with closing(_batches(task, executor)) as batches, _bar(members, large) as bar:
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


def _batches(task: Task, executor: Executor | None) -> Iterator[Found]:
    if executor is not None:
        parts = task.parts(BATCH * task.size)
        yield from _in_order(executor, run_batch, parts, 4 * _workers(executor))
        return
    groups = task.parts(task.size)
    if task.compiled:  # once, before threads ask for it together
        source = task.kernel.source
        with _bar(task.last - task.first, not is_ready(source), "compiling"):
            compiled_function(source)
    small = (task.last - task.first) * task.rows < WORTH_THREADS
    if small or not task.compiled or cores() == 1:
        yield from in_batches(map(run_group, groups))
        return
    pool = ThreadPoolExecutor(cores())
    try:
        with closing(_in_order(pool, run_group, groups, 4 * cores())) as found:
            yield from in_batches(found)
    finally:
        pool.shutdown(cancel_futures=True)


def _in_order(
    executor: Executor, function: Callable[[Task], Found], tasks: Iterator[Task], under_way: int
) -> Iterator[Found]:
    """Results in the order of the tasks, of which so many are under way at a time."""
    running = deque(executor.submit(function, task) for task in islice(tasks, under_way))
    try:
        while running:
            found = running.popleft().result()
            running.extend(executor.submit(function, task) for task in islice(tasks, 1))
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
