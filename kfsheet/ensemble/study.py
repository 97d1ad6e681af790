"""Many runs of one recurrence: an ensemble, and statistics of it that need little memory.

Members are computed in groups, each by one task that returns sums, never rows; so memory does not
grow with their number. Groups are the same and are added in the same order whoever computes them:
threads of this process, other processes, or other machines through any ``concurrent.futures``
executor. The result is then the same to the last bit.

There are two ways. NumPy computes all members of a group at once, with nothing to wait for; a
compiler makes the fastest code, but takes seconds first. They agree to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from kfsheet.ensemble.array_source import arrays_of
from kfsheet.ensemble.draws import Draws
from kfsheet.ensemble.executors import computed
from kfsheet.ensemble.groups import Group, GroupSums
from kfsheet.ensemble.nees import NEES
from kfsheet.ensemble.quantiles import Kept
from kfsheet.ensemble.study_inputs import (
    check_executor,
    checked_draws,
    checked_members,
    checked_names,
    checked_nees,
    checked_quantiles,
    checked_scalars,
    data_of_members,
    parameters_of_members,
)
from kfsheet.errors import EngineError
from kfsheet.evaluation.compiling import (
    COMPILING,
    LOADING,
    MISSING,
    can_compile,
    nothing_is_ready,
    pays,
)
from kfsheet.evaluation.kernel import kernel_of
from kfsheet.evaluation.model_cache import cache_of, gaps_of
from kfsheet.evaluation.python_source import python_source
from kfsheet.evaluation.row_loop import Kernel

if TYPE_CHECKING:
    import pandas as pd

    from kfsheet.model.recurrence import Recurrence

MOST = 4096  # members of a group
CACHED = 2**17  # numbers of a compiled group: as many as fit into the cache of a core
AT_ONCE = 2**23  # numbers of a group of arrays: with more members, NumPy's calls cost less
BATCH = 16  # compiled groups that a worker is handed at a time
ARRAYS = 10  # how many times as many cells NumPy computes in the time that Python takes


@dataclass
class Study:
    """What many runs say: statistics over the members.

    Attributes
    ----------
    members : int
        How many runs.
    rows : dict of str to DataFrame
        For each column asked for, and each NEES, the statistics of every step over the members:
        ``mean``, ``rms``, ``std`` (n - 1) and ``count``, members without a value left out.
    scalars : DataFrame
        For each scalar of the model ``mean``, ``rms``, ``std``, ``count`` and the quantiles asked.
    """

    members: int
    rows: dict[str, pd.DataFrame]
    scalars: pd.DataFrame

    def __repr__(self) -> str:
        columns = ", ".join(self.rows) or "none"
        scalars = ", ".join(map(str, self.scalars.index)) or "none"
        return f"<Study of {self.members} members: rows of {columns}; scalars {scalars}>"


def study(
    model: Recurrence,
    /,
    members: int,
    data: Mapping[str, Any] | Draws | None = None,
    *,
    columns: Sequence[str] = (),
    scalars: Sequence[str] | None = None,
    quantiles: Sequence[float] = (),
    nees: Mapping[str, NEES] | None = None,
    executor: Executor | None = None,
    compiled: bool | None = None,
    **parameters: Any,
) -> Study:
    """Run a recurrence for many members; what is kept is statistics over them.

    Parameters
    ----------
    model : Recurrence
        What to run.
    members : int
        How many runs, from 1 up.
    data : mapping or Draws
        Data columns: a vector for all members, an array (members, rows), or draws, which may
        hold further data.
    columns : sequence of str
        Columns of which statistics over the members are wanted, step by step.
    scalars : sequence of str, optional
        Scalars of which statistics over the members are wanted; all by default.
    quantiles : sequence of float
        Quantiles of the scalars over the members, from 0 to 1, exact. The scalars of all members
        are kept for them, beyond 8 MB in a temporary file: 8 bytes each, so ask with
        ``scalars`` for those that matter. Nothing else grows with the number of members.
    nees : mapping of str to NEES
        Further quantities, by names of their own.
    executor : Executor, optional
        Who computes; threads on all cores by default. It is handed functions of kfsheet and
        arrays, so processes and other machines need kfsheet, and Numba if this one has it.
    compiled : bool, optional
        As in :func:`kfsheet.evaluate`; all members are computed in the same way.
    **parameters : float or array
        Values for all members, or arrays of length ``members``, by name.

    Raises
    ------
    ModelError
        For columns that the model lacks.
    DataError
        For an unknown name, a shape that does not fit, a value that is not allowed, or a member
        whose computation has no value; the message names the member.
    EngineError
        If it shall be compiled and Numba is not installed.

    Examples
    --------
    The gain of the football is a b / (r + a^2 b), with a = 44.2 and b = 0.01; here r = 1 and 100.

    >>> from kfsheet.exercises.football.model import football
    >>> found = study(football, 2, scalars=["K_x"], r_i=[1, 100])
    >>> found.scalars["mean"].round(5).tolist()
    [0.01261]
    """
    cache_of(model)  # refuses what is no recurrence, or not complete
    members, levels = checked_members(members), checked_quantiles(quantiles)
    columns, scalars = checked_names("columns", columns or ()), checked_scalars(model, scalars)
    nees = checked_nees(model, nees or {})
    check_executor(executor)
    group = everyone(
        model, members, data, columns, scalars, nees, parameters, compiled,
        travels=executor is not None, keep=bool(levels),
    )  # fmt: skip
    with Kept(len(group.kernel.scalars)) as kept:
        found = computed(group, executor, kept)
        lines = kept.quantiles(levels)
    named = {
        f"{repr(q).removesuffix('.0')} quantile": x for q, x in zip(levels, lines, strict=True)
    }
    return _tables(model, [*columns, *nees], group.kernel.scalars, found, named)


def everyone(
    model: Recurrence,
    members: int,
    data: Mapping[str, Any] | Draws | None,
    columns: list[str],
    scalars: tuple[str, ...] | None,
    nees: Mapping[str, NEES],
    parameters: Mapping[str, Any],
    compiled: bool | None,
    *,
    travels: bool = False,
    keep: bool = False,
) -> Group:
    """All members as one group, which is then cut into parts."""
    shared, own = parameters_of_members(model, parameters, members)
    specs = [(spec.error_columns(model), spec.covariance_columns(model)) for spec in nees.values()]
    read = [name for errors, entries in specs for name in [*errors, *entries.values()]]
    wanted = tuple(dict.fromkeys(cache_of(model).wanted(model, [*columns, *read])))
    kernel, compiled = _kernel(model, wanted, scalars, members, compiled)
    python = partial(python_source, model, [*kernel.columns, *kernel.scalars])
    place = {name: n for n, name in enumerate(kernel.columns)}
    numbers = (CACHED if compiled else AT_ONCE) // (model.rows * max(1, len(kernel.columns)))
    return Group(
        name=model.name,
        rows=model.rows,
        first=0,
        last=members,
        size=min(max(numbers, 1), MOST),
        batch=BATCH if compiled else 1,
        kernel=kernel,
        compiled=compiled,
        python=partial(str, python()) if travels else python,  # the model stays at home
        parameters=shared,
        own_parameters=own,
        data=data_of_members(model, data, members),
        draws=checked_draws(model, data),
        statistics=len(columns),
        nees=tuple(
            (tuple(place[name] for name in errors), {at: place[n] for at, n in entries.items()})
            for errors, entries in specs
        ),
        keep=keep,
        gaps=gaps_of(model, model.version),
    )


def _kernel(
    model: Recurrence,
    columns: tuple[str, ...],
    scalars: tuple[str, ...] | None,
    members: int,
    compiled: bool | None,
) -> tuple[Kernel, bool]:
    """The kernel of a study, and whether it is for the compiler."""
    what = model, model.version, columns, scalars
    if compiled and not can_compile():
        raise EngineError(MISSING)
    if compiled:
        return kernel_of(*what), True
    if compiled is None:
        cache = cache_of(model)
        every = (*model.derived_scalars, *model.summaries)
        cells = cache.cells(model, (*columns, *(every if scalars is None else scalars)))
        cells, before = members * cells // ARRAYS, cache.computed[what[2:]]
        # Printing a kernel takes as long as a small study.
        least = COMPILING if nothing_is_ready() else LOADING
        if cells + before >= least and pays(kernel_of(*what).source, cells, before):
            return kernel_of(*what), True
        cache.computed[what[2:]] += cells
    return arrays_of(*what), False


def _tables(
    model: Recurrence,
    names: list[str],
    scalars: tuple[str, ...],
    found: GroupSums,
    quantiles: Mapping[str, np.ndarray],
) -> Study:
    import pandas as pd

    index = pd.RangeIndex(model.rows, name=model.step)
    tables = found.rows.statistics()
    rows = {
        name: pd.DataFrame({key: values[k] for key, values in tables.items()}, index=index)
        for k, name in enumerate(names)
    }
    table = pd.DataFrame({**found.scalars.statistics(), **quantiles}, index=list(scalars))
    return Study(found.members, rows, table)
