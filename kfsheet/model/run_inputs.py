"""Parameters and data that are given for a run, checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from kfsheet.errors import DataError
from kfsheet.model.quantities import checked_values

if TYPE_CHECKING:
    from kfsheet.model.recurrence import Recurrence


def checked_parameters(model: Recurrence, given: Mapping[str, Any]) -> dict[str, float]:
    """Value of every parameter, those in ``given`` checked and put in."""
    values = model.defaults()
    for name, value in given.items():
        if name not in values:
            known = ", ".join(values)
            raise DataError(f"{model.name} has no parameter {name}; it has {known}")
        values[name] = model.parameters[name].checked(value)
    return values


def check_data_name(name: str, known: Mapping[str, Any], model: Recurrence) -> None:
    """Refuse a data column that the model does not have."""
    if name not in known:
        raise DataError(f"{model.name} has no data column {name}; it has {', '.join(known)}")


def checked_array(model: Recurrence, name: str, values: Any) -> np.ndarray:
    """Values of a data column as an array, quickly if they are plain numbers."""
    optional = model.table[name].may_be_missing
    array = values if isinstance(values, np.ndarray) else np.asarray(values)
    if array.ndim == 1 and array.dtype.kind in "fiu":
        array = array.astype(float)
        # Plain numbers are looked at as a whole; where one is odd, one by one below, to name it.
        fine = np.isfinite(array) | (np.isnan(array) if optional else False)
        if fine.all() and len(array) == model.rows:
            return array
    return np.array(_checked_column(model, name, values))


def checked_data(model: Recurrence, given: Mapping[str, Any]) -> dict[str, list[float]]:
    """Values of all data columns, those in ``given`` checked and put in."""
    series = {c.name: list(c.values) for c in model.all_columns() if c.is_data}
    for name, values in given.items():
        check_data_name(name, series, model)
        series[name] = _checked_column(model, name, values)
    return series


def _checked_column(model: Recurrence, name: str, values: Any) -> list[float]:
    column = list(checked_values(name, values, model.table[name].may_be_missing))
    if len(column) != model.rows:
        raise DataError(f"{name} has {len(column)} values; the table has {model.rows} rows")
    return column
