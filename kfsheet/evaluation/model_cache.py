"""What runs of a model need to know about it, found once for each of its versions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from kfsheet.errors import ModelError
from kfsheet.evaluation.compiling import LOADING, pays
from kfsheet.evaluation.kernel import kernel_of
from kfsheet.evaluation.row_loop import Kernel
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.run_inputs import check_data_name, checked_array
from kfsheet.model.schedule import needed

if TYPE_CHECKING:
    import pandas as pd


@dataclass
class ModelCache:
    """What every run of one version of a model needs, found once."""

    rows: int
    default: dict[str, np.ndarray]
    units: dict[str, str]
    every: tuple[str, ...]
    frames: dict[tuple[str, ...], Any] = field(default_factory=dict)
    widths: dict[tuple[str, ...], int] = field(default_factory=dict)
    computed: Counter = field(default_factory=Counter)
    """Cells that Python could have computed meanwhile, for each choice of columns (and scalars)."""
    kernels: dict[tuple[str, ...], Kernel] = field(default_factory=dict)
    """Those whose machine code is there."""

    def wanted(self, model: Recurrence, columns: Sequence[str] | None) -> tuple[str, ...]:
        """Names of the columns to return, checked."""
        if columns is None:
            return self.every
        for name in columns:
            if name not in self.every:
                model.column(name)  # raises an error that names those that there are
        return tuple(columns)

    def arrays(self, model: Recurrence, given: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Data columns as arrays of shape (1, rows)."""
        series = dict(self.default)
        for name, values in given.items():
            check_data_name(name, series, model)
            series[name] = checked_array(model, name, values)[None, :]
        return series

    def kernel(
        self, model: Recurrence, wanted: tuple[str, ...], compiled: bool | None
    ) -> Kernel | None:
        """The kernel of a single run, if that is for compiled code."""
        if compiled is False:
            return None
        if wanted not in self.kernels:
            cells = self.cells(model, (*wanted, *model.derived_scalars))
            before = self.computed[wanted]
            if not compiled and before + cells < LOADING:
                self.computed[wanted] += cells
                return None
            scalars = None if wanted == self.every else tuple(model.derived_scalars)
            kernel = kernel_of(model, model.version, wanted, scalars)
            if not compiled and not pays(kernel.source, cells, before):
                self.computed[wanted] += cells
                return None
            self.kernels[wanted] = kernel
        return self.kernels[wanted]

    def cells(self, model: Recurrence, names: Sequence[str]) -> int:
        """How many cells a run has that computes what is named."""
        names = tuple(names)
        if names not in self.widths:
            self.widths[names] = len(needed(model, names).intersection(self.every))
        return self.rows * self.widths[names]

    def frame(
        self,
        model: Recurrence,
        wanted: tuple[str, ...],
        out: np.ndarray,
        values: dict[str, float],
        scalars: dict[str, float],
    ) -> pd.DataFrame:
        """Numbers as a DataFrame, names and units with them."""
        import pandas as pd

        if wanted not in self.frames:
            self.frames[wanted] = pd.Index(wanted), pd.RangeIndex(self.rows, name=model.step)
        columns, index = self.frames[wanted]
        frame = pd.DataFrame(out[: len(wanted)].T, index=index, columns=columns, copy=False)
        frame.attrs = {"units": self.units, "parameters": values, "scalars": scalars}
        return frame


_CACHES: WeakKeyDictionary[Recurrence, tuple[int, ModelCache]] = WeakKeyDictionary()


def cache_of(model: Recurrence) -> ModelCache:
    """What every run of a model needs; found anew when something was added to it."""
    if not isinstance(model, Recurrence):
        remedy = ": exercise.model" if hasattr(model, "model") else ""
        raise ModelError(f"a {type(model).__name__} cannot be run; give a Recurrence{remedy}")
    version, cache = _CACHES.get(model, (None, None))
    if version != model.version:
        model.validate()
        default = {c.name: np.array([c.values]) for c in model.all_columns() if c.is_data}
        every = tuple(c.name for c in model.all_columns())
        cache = ModelCache(model.rows, default, model.units(), every)
        _CACHES[model] = (model.version, cache)
    return cache


@lru_cache(maxsize=32)
def gaps_of(model: Recurrence, version: int) -> dict[str, np.ndarray]:
    """Where a value may be missing: a vector over the rows for every column where one may."""
    found = {}
    for column in model.all_columns():
        rows = np.full(model.rows, column.may_be_missing)
        for row in range(min(len(column.start), model.rows)):
            rows[row] = column.gap_possible(range(row, row + 1))
        if rows.any():
            found[column.name] = rows
    return found
