"""One group of members: what a worker is given, what it computes, what it reports."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kfsheet.ensemble import Draws
from kfsheet.errors import DataError
from kfsheet.evaluation import without_value
from kfsheet.kernel import Kernel, compiled_function
from kfsheet.streaming import Sums


@dataclass(frozen=True)
class Task:
    """What one group needs, free of the model so that it can travel."""

    kernel: Kernel
    python: str
    name: str
    rows: int
    first: int
    last: int
    parameters: np.ndarray
    data: dict[str, np.ndarray]
    draws: Draws | None
    statistics: tuple[int, ...]
    nees: tuple[tuple[tuple[int, ...], tuple[tuple[int, int, int], ...]], ...]

    keep: bool = False
    """Whether the scalars of all members are kept, for quantiles."""

    gaps: dict[str, np.ndarray] = field(default_factory=dict)
    """Where a value may be missing; for Python."""

    @property
    def compiled(self) -> bool:
        """Whether the kernel is compiled; else its Python source is there."""
        return not self.python


@dataclass
class Found:
    """What groups of members say: sums of rows and of scalars, and the scalars that are kept."""

    members: int
    rows: Sums
    scalars: Sums
    kept: list[np.ndarray]

    def add(self, other: Found) -> None:
        """Add another group's."""
        self.members += other.members
        self.rows.add(other.rows)
        self.scalars.add(other.scalars)
        self.kept += other.kept


def run_group(task: Task) -> Found:
    """Run one group and keep what is asked for; this is what an executor executes."""
    number = task.last - task.first
    data = dict(task.data)
    if task.draws:
        drawn = [task.draws.of(member, task.rows) for member in range(task.first, task.last)]
        for k, name in enumerate(task.draws.columns):
            data[name] = np.ascontiguousarray([member[k] for member in drawn])
    out = np.empty((number, len(task.kernel.columns), task.rows))
    results = np.empty((number, len(task.kernel.scalars)))
    run = _run_compiled if task.compiled else _run_python
    run(task, data, out, results)
    nees = [_nees(out[:, list(e)], out, at) for e, at in task.nees]
    values = np.concatenate([out[:, list(task.statistics)], *(n[:, None] for n in nees)], axis=1)
    return Found(number, Sums.of(values), Sums.of(results), [results] if task.keep else [])


def _run_compiled(
    task: Task, data: dict[str, np.ndarray], out: np.ndarray, results: np.ndarray
) -> None:
    function = compiled_function(task.kernel.source)
    series = [data[name] for name in task.kernel.data]
    try:
        function(0, len(out), task.parameters, *series, out, results)
    except (ArithmeticError, ValueError) as error:
        raise DataError(_which(task, data, out, results, error)) from None


def _which(
    task: Task,
    data: dict[str, np.ndarray],
    out: np.ndarray,
    results: np.ndarray,
    error: Exception,
) -> str:
    """Which member it was: run one at a time."""
    function = compiled_function(task.kernel.source)
    series = [data[name] for name in task.kernel.data]
    for k in range(len(out)):
        try:
            function(k, k + 1, task.parameters, *series, out[k : k + 1], results[k : k + 1])
        except (ArithmeticError, ValueError):
            return (
                f"{task.name}, member {task.first + k} has no value: {error}; "
                "run it alone to see where"
            )
    return f"{task.name}: {error}"


def _run_python(
    task: Task, data: dict[str, np.ndarray], out: np.ndarray, results: np.ndarray
) -> None:
    """The same without a compiler."""
    namespace: dict[str, Any] = {}
    exec(compile(task.python, f"<kfsheet {task.name}>", "exec"), namespace)  # printed by us
    for k in range(len(out)):
        values = task.parameters[min(k, len(task.parameters) - 1)].tolist()
        series = {name: rows[min(k, len(rows) - 1)].tolist() for name, rows in data.items()}
        try:
            columns, scalars = namespace[task.name](
                **series, **dict(zip(task.kernel.parameters, values, strict=True))
            )
        except (ArithmeticError, ValueError, TypeError) as error:
            raise DataError(
                f"{task.name}, member {task.first + k} has no value: {error}; "
                "run it alone to see where"
            ) from None
        if reason := without_value(columns, scalars, task.gaps):
            raise DataError(
                f"{task.name}, member {task.first + k} has no value: {reason}; "
                "run it alone to see where"
            )
        out[k] = [columns[name] for name in task.kernel.columns]
        results[k] = [scalars[name] for name in task.kernel.scalars]


def _nees(
    errors: np.ndarray, out: np.ndarray, entries: tuple[tuple[int, int, int], ...]
) -> np.ndarray:
    """E' P^-1 e of every member and row, NaN where an error is missing."""
    number, n, rows = errors.shape
    P = np.zeros((number, rows, n, n))
    for i, j, place in entries:
        P[:, :, i, j] = P[:, :, j, i] = out[:, place]
    e = errors.transpose(0, 2, 1)
    there = ~np.isnan(e).any(axis=-1)
    P[~there] = np.eye(n)
    solved = np.linalg.solve(P, np.where(there[..., None], e, 0.0)[..., None])[..., 0]
    return np.where(there, (e * solved).sum(axis=-1), np.nan)
