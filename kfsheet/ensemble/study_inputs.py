"""What a study is given, checked: every refusal names the culprit and the remedy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from kfsheet.ensemble.draws import Draws, check_mapping, is_whole
from kfsheet.ensemble.nees import NEES
from kfsheet.errors import DataError
from kfsheet.evaluation.model_cache import cache_of
from kfsheet.model.run_inputs import check_data_name, checked_array, checked_parameters

if TYPE_CHECKING:
    from kfsheet.model.quantities import Parameter
    from kfsheet.model.recurrence import Recurrence


def checked_members(members: Any) -> int:
    """How many runs, from 1 up."""
    if not is_whole(members) or members < 1:
        raise DataError(f"members is {members!r}; give a whole number from 1 up")
    return int(members)


def checked_names(what: str, names: Any) -> list[str]:
    """Names, each once."""
    if isinstance(names, str):
        raise DataError(f"{what} is the text {names!r}; give a list: [{names!r}]")
    if not isinstance(names, Iterable):
        raise DataError(f"{what} is {names!r}; give a list of names")
    return list(dict.fromkeys(names))


def checked_scalars(model: Recurrence, names: Sequence[str] | None) -> tuple[str, ...] | None:
    """Names of scalars that the model has; None for all."""
    if names is None:
        return None
    known = {**model.derived_scalars, **model.summaries}
    for name in (checked := checked_names("scalars", names)):
        if name not in known:
            has = f"it has {', '.join(known)}" if known else "it has none"
            raise DataError(f"{model.name} has no scalar {name}; {has}")
    return tuple(checked)


def checked_quantiles(quantiles: Any) -> list[float]:
    """Numbers from 0 to 1, each once."""
    try:
        levels = [float(q) for q in quantiles if not isinstance(q, str)]
    except (TypeError, ValueError):
        levels = None
    if levels is None or isinstance(quantiles, str) or len(levels) < len(quantiles):
        raise DataError(f"quantiles is {quantiles!r}; give a list of numbers: [0.05, 0.95]")
    if not all(0 <= q <= 1 for q in levels):
        raise DataError(f"quantiles are {levels}; each lies between 0 and 1")
    return list(dict.fromkeys(levels))


def checked_nees(model: Recurrence, nees: Any) -> dict[str, NEES]:
    """Specifications by names that no column has."""
    for name, spec in check_mapping("nees", nees).items():
        if not isinstance(spec, NEES):
            raise DataError(f"nees[{name!r}] is {spec!r}; give NEES(states)")
        if name in cache_of(model).every:
            raise DataError(f"nees[{name!r}]: {model.name} has a column of that name; take another")
    return dict(nees)


def check_executor(executor: Any) -> None:
    """Refuse what cannot compute for us."""
    if executor is not None and not hasattr(executor, "submit"):
        raise DataError(f"executor is {executor!r}; give one of concurrent.futures, or its like")


def checked_draws(model: Recurrence, data: Any) -> Draws | None:
    """The draws without the data that came with them; None if nothing is drawn."""
    if not isinstance(data, Draws):
        return None
    for name in data.columns:
        check_data_name(name, cache_of(model).default, model)
    return Draws(*data.columns, seed=data.seed)


def data_of_members(model: Recurrence, data: Any, members: int) -> dict[str, np.ndarray]:
    """Data columns as arrays of shape (1 or members, rows), without what is drawn."""
    given = data.data if isinstance(data, Draws) else check_mapping("data", data or {})
    series = dict(cache_of(model).default)
    for name, values in given.items():
        check_data_name(name, series, model)
        series[name] = _values_of_members(model, name, values, members)
    return series


def _values_of_members(model: Recurrence, name: str, values: Any, members: int) -> np.ndarray:
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


def parameters_of_members(
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
        own[list(one).index(name)] = _parameter_of_members(model.parameters[name], values)
    return np.array([*one.values()], dtype=float), own


def _parameter_of_members(parameter: Parameter, values: Any) -> np.ndarray:
    """Values of a parameter for the members, checked quickly if they are plain numbers."""
    array = np.asarray(values)
    if array.dtype.kind in "fiu":
        array = array.astype(float)
        low = {"positive": np.nextafter(0, 1), "nonnegative": 0}.get(parameter.sign, -np.inf)
        if np.isfinite(array).all() and (array >= low).all():
            return array
    return np.array([parameter.checked(v, f" of member {k}") for k, v in enumerate(values)])
