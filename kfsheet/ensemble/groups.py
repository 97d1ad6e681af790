"""Groups of members: what a worker is given, how it computes them, and the sums it hands back."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any

import numpy as np

from kfsheet.ensemble.array_source import array_function
from kfsheet.ensemble.draws import Draws
from kfsheet.ensemble.nees import normalised
from kfsheet.ensemble.statistics import Sums
from kfsheet.errors import DataError
from kfsheet.evaluation.compiling import compiled_function
from kfsheet.evaluation.row_loop import Kernel
from kfsheet.evaluation.undefined import without_value

FEW = 32  # members for which Python takes about as long as arrays


@dataclass(frozen=True)
class Group:
    """Members from ``first`` to before ``last``, and what they need: it travels without the model.

    All members of a study are one as well, which is cut into ``parts``.
    """

    name: str
    rows: int
    first: int
    last: int
    size: int
    """Members of a part: the results depend on it in the last bit."""

    batch: int
    """How many parts are added to each other before they are added to the rest."""

    kernel: Kernel
    compiled: bool
    """Whether the kernel is for the compiler; else it is an array source."""

    python: Callable[[], str]
    """Python source of the same, for members that may lack a value."""

    parameters: np.ndarray
    """Values that all members share."""

    own_parameters: dict[int, np.ndarray]
    """Values of the members, by number of the parameter."""

    data: dict[str, np.ndarray]
    draws: Draws | None
    statistics: int
    """How many of the kernel's columns, from the first, are wanted themselves."""

    nees: tuple[tuple[tuple[int, ...], dict[tuple[int, int], int]], ...]
    """For each NEES, which of the kernel's columns are the errors and their covariance."""

    keep: bool = False
    """Whether the scalars of all members are kept, for quantiles."""

    gaps: dict[str, np.ndarray] = field(default_factory=dict)
    """Where a value may be missing."""

    @property
    def members(self) -> int:
        """How many members."""
        return self.last - self.first

    def parts(self, size: int) -> Iterator[Group]:
        """``size`` members at a time."""
        for start in range(0, self.members, size):
            at = slice(start, min(start + size, self.members))
            yield replace(
                self,
                first=self.first + at.start,
                last=self.first + at.stop,
                own_parameters={n: values[at] for n, values in self.own_parameters.items()},
                data={n: a if len(a) == 1 else a[at] for n, a in self.data.items()},
            )


@dataclass
class GroupSums:
    """What members say: sums of rows and of scalars, and the scalars that are kept."""

    members: int
    rows: Sums
    scalars: Sums
    kept: list[np.ndarray]

    def add(self, other: GroupSums) -> None:
        """Add other members'."""
        self.members += other.members
        self.rows.add(other.rows)
        self.scalars.add(other.scalars)
        self.kept += other.kept


def in_batches(found: Iterator[GroupSums], size: int) -> Iterator[GroupSums]:
    """Every ``size`` groups as one, so that it makes no difference who adds them."""
    for batch in found:
        for other in islice(found, size - 1):
            batch.add(other)
        yield batch


def run_batch(group: Group) -> GroupSums:
    """Run a batch of groups: what a worker elsewhere executes."""
    return next(in_batches(map(run_group, group.parts(group.size)), group.batch))


def run_group(group: Group) -> GroupSums:
    """Run one group and keep what is asked for."""
    out, results = columns_and_scalars(group)
    rows = [Sums.of(out[:, : group.statistics])] if group.statistics else []
    rows += [Sums.of(_nees(group, out, *places)[:, None]) for places in group.nees]
    whole = Sums.together(rows) if rows else Sums.of(out[:, :0])
    return GroupSums(group.members, whole, Sums.of(results), [results] if group.keep else [])


def columns_and_scalars(group: Group) -> tuple[np.ndarray, np.ndarray]:
    """What the members of a group compute: (members, columns, rows) and (members, scalars)."""
    data = dict(group.data)
    if group.draws:
        drawn = group.draws.block(group.first, group.last, group.rows)
        data |= dict(zip(group.draws.columns, drawn, strict=True))
    return (_compiled if group.compiled else _by_arrays)(group, data)


def _compiled(group: Group, data: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    function = compiled_function(group.kernel.source)
    parameters = group.parameters[None, :]
    if group.own_parameters:
        parameters = np.tile(group.parameters, (group.members, 1))
        for place, values in group.own_parameters.items():
            parameters[:, place] = values
    series = [data[name] for name in group.kernel.data]
    out = np.empty((group.members, len(group.kernel.columns), group.rows))
    results = np.empty((group.members, len(group.kernel.scalars)))
    try:
        function(0, group.members, parameters, *series, out, results)
    except (ArithmeticError, ValueError):
        for k in range(group.members):  # which one was it?
            try:
                function(k, k + 1, parameters, *series, out[k:], results[k:])
            except (ArithmeticError, ValueError) as error:
                raise _failed(group, k, error) from None
        raise
    return out, results


def _by_arrays(group: Group, data: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    out = np.empty((len(group.kernel.columns), group.rows, group.members))
    results = np.empty((len(group.kernel.scalars), group.members))
    # Numbers of NumPy, as Python's own overflow without an error.
    parameters = [group.own_parameters.get(n, p) for n, p in enumerate(group.parameters)]
    # Row after row is read, so the members of a row lie beside each other.
    series = {n: a[0] if len(a) == 1 else np.ascontiguousarray(a.T) for n, a in data.items()}
    _fill(group, range(group.members), parameters, series, out, results)
    return out.transpose(2, 0, 1), results.T


def _fill(
    group: Group,
    members: range,
    parameters: list[Any],
    data: dict[str, np.ndarray],
    out: np.ndarray,
    results: np.ndarray,
) -> None:
    """Compute some members, and those that may lack a value by Python, which is certain."""
    at = slice(members.start, members.stop)
    numbers = [p[at] if np.ndim(p) else p for p in parameters]
    series = [a[:, at] if a.ndim > 1 else a for a in (data[n] for n in group.kernel.data)]
    try:
        with np.errstate(all="raise", under="ignore"):
            bad = array_function(group.kernel.source)(
                numbers, *series, out[..., at], results[..., at]
            )
    except (ArithmeticError, ValueError, TypeError):
        bad = np.nan
    if not np.isnan(bad).any():
        return
    if len(members) > FEW:  # most of them are fine, if there are many
        middle = members.start + len(members) // 2
        for half in (range(members.start, middle), range(middle, members.stop)):
            _fill(group, half, parameters, data, out, results)
        return
    function = _python_function(group)
    for k in members:
        values = [p[k] if np.ndim(p) else p for p in parameters]
        rows = {n: (a[:, k] if a.ndim > 1 else a).tolist() for n, a in data.items()}
        _by_python(group, k, function, values, rows, out[..., k], results[..., k])


def _python_function(group: Group) -> Callable[..., Any]:
    namespace: dict[str, Any] = {}
    exec(compile(group.python(), f"<kfsheet {group.name}>", "exec"), namespace)  # printed by us
    return namespace[group.name]


def _by_python(
    group: Group,
    k: int,
    function: Callable[..., Any],
    parameters: Sequence[float],
    data: dict[str, list[float]],
    out: np.ndarray,
    results: np.ndarray,
) -> None:
    """One member, number ``k`` of the group."""
    values = map(float, parameters)
    try:
        columns, scalars = function(
            **data, **dict(zip(group.kernel.parameters, values, strict=True))
        )
    except (ArithmeticError, ValueError, TypeError) as error:
        raise _failed(group, k, error) from None
    if reason := without_value(columns, scalars, group.gaps):
        raise _failed(group, k, reason)
    for place, name in enumerate(group.kernel.columns):
        out[place] = columns[name]
    results[:] = [scalars[name] for name in group.kernel.scalars]


def _failed(group: Group, k: int, reason: object) -> DataError:
    return DataError(
        f"{group.name}, member {group.first + k} has no value: {reason}; run it alone to see where"
    )


def _nees(
    group: Group, out: np.ndarray, errors: tuple[int, ...], entries: dict[tuple[int, int], int]
) -> np.ndarray:
    """E' P^-1 e of every member and row."""
    covariance = {place: out[:, column] for place, column in entries.items()}
    values, wrong = normalised([out[:, k] for k in errors], covariance)
    if wrong.any():
        member, row = (int(k[0]) for k in np.nonzero(wrong))
        raise DataError(
            f"{group.name}, member {group.first + member}: P in row {row} is no covariance, its "
            "determinant or that of a part is negative; NEES has no value"
        )
    return values
