"""Processes that judge one file at a time, within limits of memory and time.

A file that crashes its process, or takes too long, costs that process only: another one takes its
place and goes on with the next file.
"""

from __future__ import annotations

import multiprocessing
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from kfsheet.errors import EngineError

MEMORY = 3 * 2**30  # bytes of address space; libraries alone reserve a good part of it
SECONDS = 120.0
BATCH = 25  # files that a worker of an executor judges before it reports
READY = "ready"


@dataclass
class _Worker:
    process: multiprocessing.process.BaseProcess
    pipe: Connection
    task: Any = None
    ready: bool = False
    deadline: float = float("inf")


@dataclass(frozen=True)
class Failed:
    """A task whose process ended or was stopped."""

    reason: str


def _serve(pipe: Connection, function: Callable[..., Any], memory: int) -> None:
    _limit(memory)  # before the first file is opened
    pipe.send(READY)
    while (arguments := pipe.recv()) is not None:
        try:
            pipe.send(function(*arguments))
        except Exception as error:  # a defect of ours must not stop the others
            pipe.send(Failed(f"{type(error).__name__}: {error}"))


def _limit(memory: int) -> None:
    if sys.platform != "linux":
        return  # the limit of time has to do
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def run_on(
    executor: Executor,
    function: Callable[..., Any],
    tasks: Sequence[tuple],
    *,
    seconds: float = SECONDS,
) -> Iterator[tuple[tuple, Any]]:
    """Pairs of task and result from any executor, on this machine or on others.

    Each of its workers judges files in a process of its own, so that the limits hold there too;
    dask's workers may start one if they run with ``distributed.worker.daemon: False``.

    Raises
    ------
    EngineError
        If the executor's workers may not start processes.
    """
    batches = [tasks[n : n + BATCH] for n in range(0, len(tasks), BATCH)]
    running = {executor.submit(_batch, function, batch, seconds): batch for batch in batches}
    try:
        for future in as_completed(running):
            error = future.exception()
            if isinstance(error, EngineError):
                raise error  # it is no fault of a file
            failed = Failed(f"{type(error).__name__}: {error}")
            yield from future.result() if error is None else [(t, failed) for t in running[future]]
    finally:
        for future in running:
            future.cancel()


def _batch(function: Callable[..., Any], tasks: Sequence[tuple], seconds: float) -> list[tuple]:
    if multiprocessing.current_process().daemon:
        raise EngineError(
            "the executor's workers may not start processes, in which files are judged; "
            "dask's may with the setting distributed.worker.daemon: False"
        )
    return list(Pool(function, 1, seconds=seconds).run(tasks))


class Pool:
    """Runs ``function(*task)`` for many tasks in ``jobs`` processes."""

    def __init__(
        self,
        function: Callable[..., Any],
        jobs: int,
        *,
        seconds: float = SECONDS,
        memory: int = MEMORY,
    ) -> None:
        self._function, self._seconds, self._memory = function, seconds, memory
        # Not forked: a fork shares the memory, and the locks, of whatever runs beside it.
        self._context = multiprocessing.get_context("spawn")
        self._jobs = jobs
        self._workers: list[_Worker] = []

    def run(self, tasks: Iterable[tuple]) -> Iterator[tuple[tuple, Any]]:
        """Pairs of task and result, as they are ready; :class:`Failed` for a task that failed."""
        waiting = list(reversed(list(tasks)))
        try:
            self._workers = [self._start() for _ in range(min(self._jobs, len(waiting)))]
            while waiting or any(w.task is not None for w in self._workers):
                for worker in self._workers:
                    if worker.task is None and waiting:
                        self._give(worker, waiting.pop())
                yield from self._collect()
        finally:
            self._stop()

    def _start(self) -> _Worker:
        ours, theirs = self._context.Pipe()
        arguments = (theirs, self._function, self._memory)
        process = self._context.Process(target=_serve, args=arguments, daemon=True)
        process.start()
        theirs.close()
        return _Worker(process, ours)

    def _give(self, worker: _Worker, task: tuple) -> None:
        worker.task = task
        if worker.ready:
            worker.deadline = time.monotonic() + self._seconds
        worker.pipe.send(task)

    def _collect(self) -> Iterator[tuple[tuple, Any]]:
        busy = [w for w in self._workers if w.task is not None]
        left = min(w.deadline for w in busy) - time.monotonic()
        timeout = max(0.0, min(left, self._seconds))
        ready = wait([w.pipe for w in busy], timeout=timeout)
        for worker in busy:
            if worker.pipe in ready:
                task, found = worker.task, self._received(worker)
                if found == READY:  # its time begins now, not while it starts
                    worker.ready, worker.deadline = True, time.monotonic() + self._seconds
                else:
                    yield task, found
            elif time.monotonic() >= worker.deadline:
                task = worker.task
                self._replace(worker)
                yield task, Failed("timed out")

    def _received(self, worker: _Worker) -> Any:
        try:
            result = worker.pipe.recv()
        except (EOFError, OSError):
            self._replace(worker)
            return Failed("crashed")
        if result != READY:
            worker.task = None
        return result

    def _replace(self, worker: _Worker) -> None:
        worker.process.kill()
        worker.process.join()
        worker.pipe.close()
        self._workers[self._workers.index(worker)] = self._start()

    def _stop(self) -> None:
        for worker in self._workers:
            worker.process.kill()
            worker.process.join()
            worker.pipe.close()
