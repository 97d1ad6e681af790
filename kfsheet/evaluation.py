"""A recurrence as numbers: compile the generated source, run it, return a DataFrame."""

from __future__ import annotations

import linecache
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from math import isinf, nan
from typing import TYPE_CHECKING, Any

from kfsheet.errors import DataError
from kfsheet.parts import checked_values
from kfsheet.pythoncode import python_source

if TYPE_CHECKING:
    import pandas as pd

    from kfsheet.recurrence import Recurrence


def evaluate(
    model: Recurrence, /, data: Mapping[str, Sequence[float]] | None = None, **parameters: float
) -> pd.DataFrame:
    """Run a recurrence once.

    Parameters
    ----------
    model : Recurrence
        What to run.
    data : mapping, optional
        Other values of data columns, by name; NaN or None means "not observed".
    **parameters : float
        Other values of parameters, by name.

    Returns
    -------
    pandas.DataFrame
        One row per step, one column per name, the clock first. ``attrs`` holds ``units``,
        ``parameters`` and ``scalars`` (derived scalars and summaries), each by name.

    Raises
    ------
    DataError
        If a name is unknown, a value is not allowed, or a formula has no value in some row
        (a division by zero, the root of a negative number).

    Examples
    --------
    >>> from kfsheet.exercises.football import football
    >>> float(evaluate(football)["x_f"].iloc[0])
    23.4
    """
    import pandas as pd

    columns, scalars, values = run(model, data, parameters)
    frame = pd.DataFrame(columns, index=pd.RangeIndex(model.rows, name=model.step), dtype=float)
    frame.attrs = {"units": model.units(), "parameters": values, "scalars": scalars}
    return frame


def run(
    model: Recurrence,
    data: Mapping[str, Sequence[float]] | None = None,
    parameters: Mapping[str, float] | None = None,
) -> tuple[dict[str, list[float]], dict[str, float], dict[str, float]]:
    """Columns, scalars and parameter values of one run, without pandas; see :func:`evaluate`."""
    values = checked_parameters(model, parameters or {})
    series = _checked_data(model, data or {})
    function = _compiled(model, model.version)
    try:
        columns, scalars = function(**series, **values)
    except (ArithmeticError, ValueError, TypeError) as error:
        raise DataError(_explain(model, error)) from None
    for name, column in columns.items():
        for row, value in enumerate(column):
            if isinstance(value, complex) or isinf(value):
                raise DataError(f"{model.name}: {name} in row {row} is {value}, no finite number")
    scalars = {name: nan if isinf(value) else value for name, value in scalars.items()}
    return columns, scalars, values


def checked_parameters(model: Recurrence, given: Mapping[str, Any]) -> dict[str, float]:
    """Value of every parameter, those in ``given`` checked and put in."""
    if unknown := sorted(set(given) - set(model.parameters)):
        known = ", ".join(model.parameters)
        raise DataError(f"{model.name} has no parameter {unknown[0]}; it has {known}")
    return {name: p.checked(given.get(name, p.value)) for name, p in model.parameters.items()}


def _checked_data(model: Recurrence, given: Mapping[str, Any]) -> dict[str, list[float]]:
    series = {c.name: list(c.values) for c in model.all_columns() if c.is_data}
    if unknown := sorted(set(given) - set(series)):
        raise DataError(f"{model.name} has no data column {unknown[0]}; it has {', '.join(series)}")
    for name, values in given.items():
        series[name] = list(checked_values(name, values, model.table[name].may_be_missing))
        if len(series[name]) != model.rows:
            raise DataError(
                f"{name} has {len(series[name])} values; the table has {model.rows} rows"
            )
    return series


@lru_cache(maxsize=32)
def _compiled(model: Recurrence, version: int) -> Callable:
    """The generated function of one version of a model."""
    source = python_source(model)
    filename = f"<kfsheet {model.name} {id(model)} {version}>"
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    namespace: dict[str, Any] = {}
    exec(compile(source, filename, "exec"), namespace)  # source is printed by us, above
    return namespace[model.name]


def _explain(model: Recurrence, error: Exception) -> str:
    """Which formula failed, in which row, read from where the generated source stopped."""
    frames = [
        (frame, number)
        for frame, number in traceback.walk_tb(error.__traceback__)
        if frame.f_code.co_filename.startswith("<kfsheet")
    ]
    frame, number = next(f for f in frames if f[0].f_code.co_name == model.name)
    line = linecache.getline(frame.f_code.co_filename, number).strip()
    name, _, formula = line.partition(" = ")
    row = frame.f_locals.get("t")
    where = name.replace("[t]", f" in row {row} ({model.step} {row})")
    reason = "it grows beyond 1e308" if isinstance(error, OverflowError) else error
    if isinstance(error, TypeError):
        reason = "a root or power of a negative number"
    return f"{model.name}: {where} has no value: {reason}, in {formula}"
