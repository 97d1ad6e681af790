"""Many runs of one recurrence: an ensemble, and statistics of it that need little memory.

Members are computed in groups, each by one task that returns sums, never rows; so memory does not
grow with their number. Groups are the same and are added in the same order whoever computes them:
threads of this process, other processes, or other machines through any ``concurrent.futures``
executor. The result is then the same to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from kfsheet.ensemble.draws import Draws, check_mapping, is_whole
from kfsheet.ensemble.executors import computed
from kfsheet.ensemble.group import Found, Task
from kfsheet.ensemble.nees import NEES
from kfsheet.ensemble.quantiles import Kept
from kfsheet.ensemble.side_by_side import kernel_for_many
from kfsheet.errors import DataError
from kfsheet.evaluation.kernel import Kernel, kernel_of
from kfsheet.evaluation.model_cache import cache_of, gaps_of
from kfsheet.evaluation.python_source import python_source
from kfsheet.model.run_inputs import check_data_name, checked_array, checked_parameters

if TYPE_CHECKING:
    import pandas as pd

    from kfsheet.model.quantities import Parameter
    from kfsheet.model.recurrence import Recurrence

NUMBERS = 2**17  # of a group: as many as fit into the cache of a core
MOST = 2048  # members of a group


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
    """
    members = _check_members(members)
    columns, levels = _check_names("columns", columns or ()), _check_quantiles(quantiles)
    nees = _check_nees(model, nees or {})
    if executor is not None and not hasattr(executor, "submit"):
        raise DataError(f"executor is {executor!r}; give one of concurrent.futures, or its like")
    given = data.data if isinstance(data, Draws) else check_mapping("data", data or {})
    scalars = _check_scalars(model, scalars)
    shared, own = _parameters(model, parameters, members)
    kernel, places = _kernel(model, columns, scalars, nees, kernel_of if own else kernel_for_many)
    by_compiler = cache_of(model).study_is_compiled(kernel, members, compiled)
    task = Task(
        kernel,
        "" if by_compiler else python_source(model, [*kernel.columns, *kernel.scalars]),
        model.name,
        model.rows,
        0,
        members,
        min(max(NUMBERS // (model.rows * max(1, len(kernel.columns))), 1), MOST),
        shared,
        own,
        _data(model, given, members),
        _drawn(model, data) if isinstance(data, Draws) else None,
        len(columns),
        places,
        keep=len(levels) > 0,
        gaps=gaps_of(model, model.version),
    )
    with Kept(len(kernel.scalars)) as kept:
        found = computed(task, executor, kept)
        lines = kept.quantiles(levels)
    named = {
        f"{repr(q).removesuffix('.0')} quantile": x for q, x in zip(levels, lines, strict=True)
    }
    return _study(model, [*columns, *nees], kernel.scalars, found, named)


# -- what is asked for -----------------------------------------------------------------------


def _check_members(members: Any) -> int:
    if not is_whole(members) or members < 1:
        raise DataError(f"members is {members!r}; give a whole number from 1 up")
    return int(members)


def _check_names(what: str, names: Any) -> list[str]:
    if isinstance(names, str):
        raise DataError(f"{what} is the text {names!r}; give a list: [{names!r}]")
    return list(dict.fromkeys(names))


def _check_scalars(model: Recurrence, names: Sequence[str] | None) -> tuple[str, ...] | None:
    if names is None:
        return None
    known = {**model.derived_scalars, **model.summaries}
    for name in (checked := _check_names("scalars", names)):
        if name not in known:
            has = f"it has {', '.join(known)}" if known else "it has none"
            raise DataError(f"{model.name} has no scalar {name}; {has}")
    return tuple(checked)


def _check_quantiles(quantiles: Any) -> list[float]:
    try:
        levels = [float(q) for q in quantiles if not isinstance(q, str)]
    except (TypeError, ValueError):
        levels = None
    if levels is None or isinstance(quantiles, str) or len(levels) < len(quantiles):
        raise DataError(f"quantiles is {quantiles!r}; give a list of numbers: [0.05, 0.95]")
    if not all(0 <= q <= 1 for q in levels):
        raise DataError(f"quantiles are {levels}; each lies between 0 and 1")
    return list(dict.fromkeys(levels))


def _check_nees(model: Recurrence, nees: Any) -> dict[str, NEES]:
    for name, spec in check_mapping("nees", nees).items():
        if not isinstance(spec, NEES):
            raise DataError(f"nees[{name!r}] is {spec!r}; give NEES(states)")
        if name in cache_of(model).every:
            raise DataError(f"nees[{name!r}]: {model.name} has a column of that name; take another")
    return dict(nees)


# -- what is computed ------------------------------------------------------------------------


def _kernel(
    model: Recurrence,
    columns: list[str],
    scalars: tuple[str, ...] | None,
    nees: Mapping[str, NEES],
    printed: Callable[..., Kernel],
) -> tuple[Kernel, tuple[tuple[tuple[int, ...], dict[tuple[int, int], int]], ...]]:
    """The kernel, and for each NEES where it stores the errors and their covariance."""
    specs = [(spec.error_columns(model), spec.covariance_columns(model)) for spec in nees.values()]
    needed = [*columns, *(name for e, P in specs for name in [*e, *P.values()])]
    wanted = tuple(dict.fromkeys(cache_of(model).wanted(model, needed)))
    kernel = printed(model, model.version, wanted, scalars)
    place = {name: n for n, name in enumerate(kernel.columns)}
    return kernel, tuple(
        (tuple(place[name] for name in e), {at: place[name] for at, name in P.items()})
        for e, P in specs
    )


def _drawn(model: Recurrence, draws: Draws) -> Draws:
    """The draws without the data that came with them."""
    for name in draws.columns:
        check_data_name(name, cache_of(model).default, model)
    return Draws(*draws.columns, seed=draws.seed)


def _data(model: Recurrence, given: Mapping[str, Any], members: int) -> dict[str, np.ndarray]:
    """Data columns as arrays of shape (1 or members, rows)."""
    series = dict(cache_of(model).default)
    for name, values in given.items():
        check_data_name(name, series, model)
        series[name] = _member_data(model, name, values, members)
    return series


def _member_data(model: Recurrence, name: str, values: Any, members: int) -> np.ndarray:
    array = np.asarray(values)
    if array.ndim < 2:
        return checked_array(model, name, values)[None, :]
    if array.shape != (members, model.rows) or array.dtype.kind not in "fiu":
        raise DataError(
            f"{name} has the shape {array.shape}; give {members} x {model.rows} numbers "
            "(members x rows), or one row for all members"
        )
    array = np.ascontiguousarray(array, dtype=float)
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(array.sum()):
            return array
    bad = ~np.isfinite(array)
    if model.table[name].may_be_missing:
        bad &= ~np.isnan(array)
    if bad.any():
        member, row = (int(k[0]) for k in np.nonzero(bad))
        raise DataError(f"{name}, member {member}, row {row} is {array[member, row]}, no number")
    return array


def _parameters(
    model: Recurrence, given: Mapping[str, Any], members: int
) -> tuple[np.ndarray, dict[int, np.ndarray]]:
    """Values for all members, and those of each, by number of the parameter."""
    many = {name: values for name, values in given.items() if np.ndim(values) > 0}
    one = checked_parameters(model, {n: v for n, v in given.items() if n not in many})
    own = {}
    for name, values in many.items():
        if name not in one:
            raise DataError(f"{model.name} has no parameter {name}; it has {', '.join(one)}")
        if np.shape(values) != (members,):
            size = " x ".join(map(str, np.shape(values)))
            raise DataError(f"parameter {name} has {size} values for {members} members")
        own[list(one).index(name)] = _member_values(model.parameters[name], values)
    return np.array([*one.values()], dtype=float), own


def _member_values(parameter: Parameter, values: Any) -> np.ndarray:
    """Values of a parameter for the members, checked quickly if they are plain numbers."""
    array = np.asarray(values)
    if array.dtype.kind in "fiu":
        array = array.astype(float)
        low = {"positive": np.nextafter(0, 1), "nonnegative": 0}.get(parameter.sign, -np.inf)
        if np.isfinite(array).all() and (array >= low).all():
            return array
    return np.array([parameter.checked(v, f" of member {k}") for k, v in enumerate(values)])


# -- the result ------------------------------------------------------------------------------


def _study(
    model: Recurrence,
    names: list[str],
    scalars: tuple[str, ...],
    found: Found,
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
