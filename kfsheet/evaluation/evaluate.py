"""A recurrence as numbers: run its generated source, return a DataFrame.

A model that is run once or twice runs as Python. One that is run often is compiled (with Numba,
where it is installed) by another process while Python goes on, and the machine code is kept on
disk; see :mod:`kfsheet.evaluation.compiling`. Both compute the same to rounding: of our exercises
the cannon-ball's columns differ, by less than 2e-12 of their root mean square, because where
Python's x**2 calls pow, which errs in the last bit now and then, a compiler multiplies; scalars are
summed otherwise. A computation that has no value is explained by Python's run.
"""

from __future__ import annotations

import linecache
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from kfsheet.errors import DataError
from kfsheet.evaluation.compiling import can_compile, compiled_function
from kfsheet.evaluation.kernel import Kernel
from kfsheet.evaluation.model_cache import ModelCache, cache_of, gaps_of
from kfsheet.evaluation.python_source import python_source
from kfsheet.evaluation.undefined import without_value
from kfsheet.model.run_inputs import checked_data, checked_parameters

if TYPE_CHECKING:
    import pandas as pd

    from kfsheet.model.recurrence import Recurrence


def evaluate(
    model: Recurrence,
    /,
    data: Mapping[str, Sequence[float]] | None = None,
    *,
    columns: Sequence[str] | None = None,
    compiled: bool | None = None,
    **parameters: Any,
) -> pd.DataFrame:
    """Run a recurrence once; :func:`kfsheet.study` runs it many times.

    Parameters
    ----------
    model : Recurrence
        What to run.
    data : mapping, optional
        Other values of data columns, by name; NaN or None means "not observed".
    columns : sequence of str, optional
        The columns that are wanted; all by default. A few are quick: nothing is computed that
        they do not need, and ``scalars`` holds the derived ones only.
    compiled : bool, optional
        True waits for the compiler, False never uses it; so each gives the same bits whenever it
        is called. By default a run is compiled when that pays: the last digits may then change
        between two runs.
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
        For an unknown name, a value that is not allowed, a column of the wrong length, or a
        computation without a value; the message names the formula and the row.
    EngineError
        If it shall be compiled and Numba is not installed.

    Examples
    --------
    >>> from kfsheet.exercises.football.model import football
    >>> evaluate(football, h=0, p=2)["z_a"].round(2).head(3).tolist()
    [0.11, 1.12, 1.83]
    """
    _check_one_run(data, columns, parameters)
    return _one_run(model, data or {}, columns, parameters, compiled)


MANY_RUNS = ("members", "scalars", "quantiles", "nees", "executor")


def _check_one_run(data: Any, columns: Any, parameters: Mapping[str, Any]) -> None:
    """Refuse what only a study takes, and what has the wrong form."""
    # No parameter of a model has one of these names: model/names.py keeps them.
    if asked := [name for name in MANY_RUNS if name in parameters]:
        raise DataError(
            f"evaluate runs once and takes no {asked[0]}; "
            "many runs are study(model, members, data, columns=...)"
        )
    if isinstance(columns, str):
        raise DataError(f"columns is the text {columns!r}; give a list: [{columns!r}]")
    if data is not None and not hasattr(data, "items"):
        kind = type(data).__name__
        remedy = "call study(model, members, data)" if kind == "Draws" else "give {name: values}"
        raise DataError(f"data is a {kind}; {remedy}")
    many = [n for n, v in parameters.items() if np.ndim(v) > 0]
    many += [n for n, v in (data or {}).items() if getattr(v, "ndim", 1) > 1]
    if many:
        raise DataError(f"{many[0]} has values for many runs; call study(model, members, ...)")


def _one_run(
    model: Recurrence,
    data: Mapping[str, Sequence[float]],
    columns: Sequence[str] | None,
    parameters: Mapping[str, float],
    compiled: bool | None,
) -> pd.DataFrame:
    cache = cache_of(model)
    wanted = cache.wanted(model, columns)
    values = checked_parameters(model, parameters)
    series = cache.arrays(model, data)
    kernel = cache.kernel(model, wanted, compiled)
    found = kernel and _run_compiled(kernel, series, values, cache)
    out, scalars = found or _run_python(model, data, parameters, wanted)
    if columns is not None:
        scalars = {name: scalars[name] for name in model.derived_scalars}
    return cache.frame(model, wanted, out, values, scalars)


def _run_compiled(
    kernel: Kernel, series: Mapping[str, np.ndarray], values: Mapping[str, float], cache: ModelCache
) -> tuple[np.ndarray, dict[str, float]] | None:
    """Columns and scalars by the compiled kernel; None where something has no value."""
    function = compiled_function(kernel.source)
    out = np.empty((1, len(kernel.columns), cache.rows))
    results = np.empty((1, len(kernel.scalars)))
    numbers = np.array([[values[name] for name in kernel.parameters]])
    try:
        function(0, 1, numbers, *(series[name] for name in kernel.data), out, results)
    except (ArithmeticError, ValueError):
        return None
    return out[0], dict(zip(kernel.scalars, results[0].tolist(), strict=True))


def _run_python(
    model: Recurrence,
    data: Mapping[str, Sequence[float]],
    parameters: Mapping[str, float],
    wanted: tuple[str, ...],
) -> tuple[np.ndarray, dict[str, float]]:
    only = None if wanted == cache_of(model).every else wanted
    found, scalars, _ = run(model, data, parameters, only)
    return np.array([found[name] for name in wanted], dtype=float), scalars


def warm_up(model: Recurrence, columns: Sequence[str] | None = None) -> None:
    """Compile a model now, rather than after some runs; does nothing without Numba.

    For many runs, ``study(model, 1, compiled=True, ...)`` does the same.

    Parameters
    ----------
    model : Recurrence
        What will be run often.
    columns : sequence of str, optional
        The columns that will be wanted, as in :func:`evaluate`.
    """
    evaluate(model, columns=columns, compiled=can_compile())


def run(
    model: Recurrence,
    data: Mapping[str, Sequence[float]] | None = None,
    parameters: Mapping[str, float] | None = None,
    wanted: tuple[str, ...] | None = None,
) -> tuple[dict[str, list[float]], dict[str, float], dict[str, float]]:
    """Columns, scalars and parameter values of one run by Python; see :func:`evaluate`."""
    values = checked_parameters(model, parameters or {})
    series = checked_data(model, data or {})
    function = _python_function(model, model.version, wanted)
    try:
        columns, scalars = function(**series, **values)
    except (ArithmeticError, ValueError, TypeError) as error:
        raise DataError(_explain(model, error)) from None
    if reason := without_value(columns, scalars, gaps_of(model, model.version)):
        raise DataError(f"{model.name}: {reason}")
    return columns, scalars, values


@lru_cache(maxsize=32)
def source_of(model: Recurrence, version: int, wanted: tuple[str, ...] | None = None) -> str:
    """The Python source of one version of a model."""
    return python_source(model, wanted)


@lru_cache(maxsize=32)
def _python_function(
    model: Recurrence, version: int, wanted: tuple[str, ...] | None = None
) -> Callable:
    """The generated function of one version of a model."""
    source = source_of(model, version, wanted)
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
