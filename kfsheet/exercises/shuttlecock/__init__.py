"""A shuttlecock seen by two cameras: small filters, and the point where it will fall.

``model`` is the recurrence, ``filters`` and ``forecasts`` write its columns, ``outliers`` spoils
its data, ``words`` and ``charts`` are what a reader sees beside the numbers. Numbers of equations
in the docstrings are those of Man, Zhao and Hu (2009).
"""

from kfsheet.exercises.shuttlecock.forecasts import FORECASTS
from kfsheet.exercises.shuttlecock.model import DATA, build_model, exercise, shuttlecock

__all__ = ["DATA", "FORECASTS", "build_model", "exercise", "shuttlecock"]
