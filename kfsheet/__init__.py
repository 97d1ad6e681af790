"""kfsheet: a Kalman filter derived once, evaluated, written as a workbook, checked and taught.

``t`` is the row of a recurrence, a SymPy symbol: ``x[t - 1]`` is the cell above ``x[t]``.
The public names are imported when they are first used, so that ``import kfsheet`` is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

_HOMES = {
    "kfsheet.estimation.algebra": "analysis correlated_covariance diagonal_analysis discrete_noise "
    "gain_limits sequential_gain transition_matrix transition_matrix_laplace",
    "kfsheet.model.chart": "Chart Series",
    "kfsheet.ensemble.draws": "Draws NEES Study",
    "kfsheet.errors": "DataError EngineError KfsheetError ModelError PrintError WorkbookError",
    "kfsheet.evaluation.evaluate": "evaluate warm_up",
    "kfsheet.workbook.check.check_workbook": "check_workbook",
    "kfsheet.printing.excel": "excel_code",
    "kfsheet.workbook.engines.recalculate": "recalculate",
    "kfsheet.workbook.write.write_workbook": "write_workbook",
    "kfsheet.model.exercise": "Exercise Question",
    "kfsheet.exercises": "exercise_names load_exercise",
    "kfsheet.model.expressions": "Count Largest Last Mean Missing Observed RMS Smallest Std Sum "
    "SumProduct t when_observed",
    "kfsheet.estimation.least_squares": "least_squares newton_step normal_equations",
    "kfsheet.estimation.kalman": "Intermediate Observation State StateSpace add_filter",
    "kfsheet.printing.latex": "latex_code",
    "kfsheet.evaluation.plots": "draw",
    "kfsheet.printing.python": "python_code",
    "kfsheet.model.recurrence": "Recurrence",
    "kfsheet.cli.show": "formula_table",
    "kfsheet.evaluation.python_source": "python_source",
    "kfsheet.model.tables": "read_table",
}
_HOME = {name: home for home, names in _HOMES.items() for name in names.split()}
__all__ = sorted([*_HOME, "__version__"])


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'kfsheet' has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value  # the next use does not come here
    return value


def __dir__() -> list[str]:
    return __all__
