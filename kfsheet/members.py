"""Many runs of one recurrence: an ensemble, and statistics of it that need little memory.

Members are computed in groups, each by one task that returns sums, never rows; so memory does not
grow with their number. Groups are the same and are added in the same order whoever computes them:
threads of this process, other processes, or other machines through any ``concurrent.futures``
executor. The result is then the same to the last bit.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from kfsheet.ensemble import NEES, Draws, Study
from kfsheet.errors import DataError
from kfsheet.evaluation import (
    can_compile,
    check_data_name,
    checked_array,
    checked_parameters,
    facts_of,
    gaps_of,
)
from kfsheet.group import Found, Task, run_group
from kfsheet.kernel import compiled_function, kernel_of
from kfsheet.source import python_source

if TYPE_CHECKING:
    from kfsheet.recurrence import Recurrence

NUMBERS = 2**17  # of a group: as many as fit into the cache of a core
FEWEST, MOST = 16, 2048  # members of a group


def study(
    model: Recurrence,
    members: int,
    data: Mapping[str, Any] | Draws | None,
    columns: Sequence[str],
    scalars: Sequence[str] | None,
    quantiles: Sequence[float],
    nees: Mapping[str, NEES],
    executor: Executor | None,
    parameters: Mapping[str, Any],
) -> Study:
    """Run a recurrence for many members; :func:`kfsheet.evaluate` with ``members`` calls it.

    Parameters
    ----------
    model : Recurrence
        What to run.
    members : int
        How many runs, from 1 up.
    data : mapping or Draws
        Data columns: a vector for all members, an array (members, rows), or draws.
    columns : sequence of str
        Columns of which statistics over the members are wanted, step by step.
    scalars : sequence of str, optional
        Scalars of which statistics over the members are wanted; all by default.
    quantiles : sequence of float
        Quantiles of the scalars over the members, from 0 to 1. They need the scalars of all
        members at once, 8 bytes each; nothing else grows with the number of members.
    nees : mapping of str to NEES
        Further quantities, by a name of their own.
    executor : Executor, optional
        Who computes; threads on all cores by default. Processes need pickles of the arrays only.
    parameters : mapping
        Values, or arrays of length ``members``.

    Raises
    ------
    DataError
        For an unknown name, a shape that does not fit, a value that is not allowed, or a member
        whose computation has no value; the message names the member.
    """
    if not isinstance(members, int) or members < 1:
        raise DataError(f"members is {members!r}; give a whole number from 1 up")
    if any(not 0 <= q <= 1 for q in quantiles):
        raise DataError(f"quantiles are {quantiles!r}; each lies between 0 and 1")
    names = [*dict.fromkeys(columns)]
    for name in scalars or ():
        if name not in {**model.derived_scalars, **model.summaries}:
            raise DataError(f"{model.name} has no scalar {name}")
    kept = None if scalars is None else tuple(scalars)
    task = _first_task(model, members, data, names, kept, nees, parameters)
    task = replace(task, keep=len(quantiles) > 0)
    found = _computed(task, members, executor)
    return _study(model, members, [*names, *nees], task.kernel.scalars, found, quantiles)


def _first_task(
    model: Recurrence,
    members: int,
    data: Mapping[str, Any] | Draws | None,
    names: list[str],
    scalars: tuple[str, ...] | None,
    nees: Mapping[str, NEES],
    parameters: Mapping[str, Any],
) -> Task:
    """The task of all members, to be cut into groups."""
    facts = facts_of(model)
    facts.wanted(model, names)
    needed = list(names)
    for spec in nees.values():
        needed += [*spec.error_columns(), *spec.covariance_columns(model).values()]
    wanted = tuple(dict.fromkeys(needed))
    facts.wanted(model, wanted)
    kernel = kernel_of(model, model.version, wanted, scalars)
    place = {name: n for n, name in enumerate(kernel.columns)}
    draws = data if isinstance(data, Draws) else None
    series = dict(facts.default)
    for name in draws.columns if draws else ():
        check_data_name(name, series, model)
    for name, values in ({} if draws else data or {}).items():
        check_data_name(name, series, model)
        series[name] = _member_data(model, name, values, members)
    return Task(
        kernel,
        "" if can_compile() else python_source(model, [*kernel.columns, *kernel.scalars]),
        model.name,
        facts.rows,
        0,
        members,
        _member_parameters(model, parameters, members),
        series,
        draws,
        tuple(place[name] for name in names),
        tuple(
            (
                tuple(place[name] for name in spec.error_columns()),
                tuple((*at, place[n]) for at, n in spec.covariance_columns(model).items()),
            )
            for spec in nees.values()
        ),
        gaps=gaps_of(model, model.version),
    )


def _member_data(model: Recurrence, name: str, values: Any, members: int) -> np.ndarray:
    array = np.asarray(values)
    if array.ndim != 2:
        return checked_array(model, name, values)[None, :]
    if array.shape != (members, model.rows) or array.dtype.kind not in "fiu":
        raise DataError(
            f"{name} has the shape {array.shape}; give {members} x {model.rows} numbers "
            "(members x rows), or one row for all members"
        )
    array = np.ascontiguousarray(array, dtype=float)
    bad = ~np.isfinite(array)
    if model.table[name].may_be_missing:
        bad &= ~np.isnan(array)
    if bad.any():
        member, row = (int(k[0]) for k in np.nonzero(bad))
        raise DataError(f"{name}, member {member}, row {row} is {array[member, row]}, no number")
    return array


def _member_parameters(model: Recurrence, given: Mapping[str, Any], members: int) -> np.ndarray:
    """Parameter values of shape (1 or members, parameters)."""
    many = {n: np.asarray(v) for n, v in given.items() if np.ndim(v) == 1}
    one = checked_parameters(model, {n: v for n, v in given.items() if n not in many})
    table = np.tile(np.array([list(one.values())]), (members if many else 1, 1))
    for name, values in many.items():
        if name not in one or len(values) != members:
            raise DataError(
                f"parameter {name} has {len(values)} values for {members} members"
                if name in one
                else f"{model.name} has no parameter {name}; it has {', '.join(one)}"
            )
        checked = [
            model.parameters[name].checked(v, f" of member {k}") for k, v in enumerate(values)
        ]
        table[:, list(one).index(name)] = checked
    return table


# -- computing -----------------------------------------------------------------------------


def _computed(task: Task, members: int, executor: Executor | None) -> Found:
    if executor is not None:
        return _gathered(task, members, executor)
    workers = os.cpu_count() or 1
    if task.compiled:
        compiled_function(task.kernel.source)  # once, before the threads ask for it together
    pool = ThreadPoolExecutor(workers)
    try:
        return _gathered(task, members, pool)
    finally:
        pool.shutdown(cancel_futures=True)


def _gathered(task: Task, members: int, executor: Executor) -> Found:
    """What all groups say, in order, with few of them under way at a time."""
    waiting = iter(_groups(task, members))
    running = [executor.submit(run_group, t) for t in islice(waiting, 4 * (os.cpu_count() or 1))]
    whole: Found | None = None
    bar = _bar(members)
    try:
        while running:
            found = running.pop(0).result()
            running += [executor.submit(run_group, t) for t in islice(waiting, 1)]
            bar.update(found.members)
            if whole is None:
                whole = found
            else:
                whole.add(found)
    finally:
        bar.close()
        for future in running:
            future.cancel()
    assert whole is not None  # there is at least one member
    return whole


def _bar(members: int) -> Any:
    from tqdm import tqdm

    return tqdm(total=members, unit=" runs", leave=False, disable=not sys.stderr.isatty())


def _groups(task: Task, members: int) -> Iterator[Task]:
    size = NUMBERS // (task.rows * max(1, len(task.kernel.columns)))
    size = min(max(size, FEWEST), MOST)
    for first in range(0, members, size):
        last = min(first + size, members)

        def part(array: np.ndarray, first: int = first, last: int = last) -> np.ndarray:
            return array if len(array) == 1 else array[first:last]

        yield replace(
            task,
            first=first,
            last=last,
            parameters=part(task.parameters),
            data={name: part(array) for name, array in task.data.items()},
        )


# -- the result ----------------------------------------------------------------------------


def _study(
    model: Recurrence,
    members: int,
    names: list[str],
    scalars: tuple[str, ...],
    found: Found,
    quantiles: Sequence[float],
) -> Study:
    import pandas as pd

    rows = {
        name: pd.DataFrame(
            found.rows.statistics(k),
            index=pd.RangeIndex(model.rows, name=model.step),
        )
        for k, name in enumerate(names)
    }
    table = pd.DataFrame(found.scalars.statistics(), index=scalars)
    for q in quantiles:
        table[f"{q:.4g} quantile"] = np.nanquantile(np.concatenate(found.kept), q, axis=0)
    return Study(members, rows, table)
