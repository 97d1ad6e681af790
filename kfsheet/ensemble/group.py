"""Groups of members: what a worker is given, what it computes, what it reports."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any

import numpy as np

from kfsheet.ensemble.draws import Draws
from kfsheet.ensemble.nees import normalised
from kfsheet.ensemble.statistics import Sums
from kfsheet.errors import DataError
from kfsheet.evaluation.compiling import compiled_function
from kfsheet.evaluation.kernel import Kernel
from kfsheet.evaluation.undefined import without_value

BATCH = 16  # groups that are added to each other before they are added to the rest


@dataclass(frozen=True)
class Task:
    """What some members need, free of the model so that it can travel."""

    kernel: Kernel
    python: str
    name: str
    rows: int
    first: int
    last: int
    size: int
    """Members of a group: the results of a group depend on it in the last bit."""

    parameters: np.ndarray
    """Values that all members share."""

    own_parameters: dict[int, np.ndarray]
    """Values of the members, by number of the parameter."""

    data: dict[str, np.ndarray]
    draws: Draws | None
    statistics: int
    """How many of the kernel's columns, from the first, are wanted themselves."""

    nees: tuple[tuple[tuple[int, ...], dict[tuple[int, int], int]], ...]

    keep: bool = False
    """Whether the scalars of all members are kept, for quantiles."""

    gaps: dict[str, np.ndarray] = field(default_factory=dict)
    """Where a value may be missing; for Python."""

    @property
    def compiled(self) -> bool:
        """Whether the kernel is compiled; else its Python source is there."""
        return not self.python

    def parts(self, size: int) -> Iterator[Task]:
        """The same task for ``size`` members at a time."""
        for start in range(0, self.last - self.first, size):
            at = slice(start, min(start + size, self.last - self.first))
            yield replace(
                self,
                first=self.first + at.start,
                last=self.first + at.stop,
                own_parameters={n: values[at] for n, values in self.own_parameters.items()},
                data={n: a if len(a) == 1 else a[at] for n, a in self.data.items()},
            )


@dataclass
class Found:
    """What members say: sums of rows and of scalars, and the scalars that are kept."""

    members: int
    rows: Sums
    scalars: Sums
    kept: list[np.ndarray]

    def add(self, other: Found) -> None:
        """Add other members'."""
        self.members += other.members
        self.rows.add(other.rows)
        self.scalars.add(other.scalars)
        self.kept += other.kept


def in_batches(found: Iterator[Found]) -> Iterator[Found]:
    """Every BATCH groups as one, so that it makes no difference who adds them."""
    for batch in found:
        for other in islice(found, BATCH - 1):
            batch.add(other)
        yield batch


def run_batch(task: Task) -> Found:
    """Run up to BATCH groups: what a worker elsewhere executes."""
    return next(in_batches(map(run_group, task.parts(task.size))))


def run_group(task: Task) -> Found:
    """Run one group and keep what is asked for."""
    number = task.last - task.first
    data = dict(task.data)
    if task.draws:
        drawn = task.draws.block(task.first, task.last, task.rows)
        data |= dict(zip(task.draws.columns, drawn, strict=True))
    parameters = task.parameters[None, :]
    if task.own_parameters:
        parameters = np.tile(task.parameters, (number, 1))
        for place, values in task.own_parameters.items():
            parameters[:, place] = values
    out = np.empty((number, len(task.kernel.columns), task.rows))
    results = np.empty((number, len(task.kernel.scalars)))
    run = _run_compiled if task.compiled else _run_python
    run(task, parameters, data, out, results)
    rows = [Sums.of(out[:, : task.statistics])] if task.statistics else []
    rows += [Sums.of(_nees(task, out, *places)[:, None]) for places in task.nees]
    whole = Sums.together(rows) if rows else Sums.of(out[:, :0])
    return Found(number, whole, Sums.of(results), [results] if task.keep else [])


def _run_compiled(
    task: Task,
    parameters: np.ndarray,
    data: dict[str, np.ndarray],
    out: np.ndarray,
    results: np.ndarray,
) -> None:
    function = compiled_function(task.kernel.source)
    series = [data[name] for name in task.kernel.data]
    try:
        function(0, len(out), parameters, *series, out, results)
    except (ArithmeticError, ValueError):
        for k in range(len(out)):  # which one was it?
            try:
                function(k, k + 1, parameters, *series, out[k:], results[k:])
            except (ArithmeticError, ValueError) as error:
                raise _failed(task, k, error) from None
        raise


def _failed(task: Task, k: int, reason: object) -> DataError:
    return DataError(
        f"{task.name}, member {task.first + k} has no value: {reason}; run it alone to see where"
    )


def _run_python(
    task: Task,
    parameters: np.ndarray,
    data: dict[str, np.ndarray],
    out: np.ndarray,
    results: np.ndarray,
) -> None:
    """The same without a compiler."""
    namespace: dict[str, Any] = {}
    exec(compile(task.python, f"<kfsheet {task.name}>", "exec"), namespace)  # printed by us
    for k in range(len(out)):
        values = parameters[min(k, len(parameters) - 1)].tolist()
        series = {name: rows[min(k, len(rows) - 1)].tolist() for name, rows in data.items()}
        try:
            columns, scalars = namespace[task.name](
                **series, **dict(zip(task.kernel.parameters, values, strict=True))
            )
        except (ArithmeticError, ValueError, TypeError) as error:
            raise _failed(task, k, error) from None
        if reason := without_value(columns, scalars, task.gaps):
            raise _failed(task, k, reason)
        if task.kernel.columns:
            out[k] = [columns[name] for name in task.kernel.columns]
        results[k] = [scalars[name] for name in task.kernel.scalars]


def _nees(
    task: Task, out: np.ndarray, errors: tuple[int, ...], entries: dict[tuple[int, int], int]
) -> np.ndarray:
    """E' P^-1 e of every member and row."""
    covariance = {place: out[:, column] for place, column in entries.items()}
    values, wrong = normalised([out[:, k] for k in errors], covariance)
    if wrong.any():
        member, row = (int(k[0]) for k in np.nonzero(wrong))
        raise DataError(
            f"{task.name}, member {task.first + member}: P in row {row} is no covariance, its "
            "determinant or that of a part is negative; NEES has no value"
        )
    return values
