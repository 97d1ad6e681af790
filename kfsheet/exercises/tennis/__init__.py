"""A tennis ball before two cameras: triangulation, an extended Kalman filter, and the impact.

``model`` is the recurrence, ``track`` and ``calculators`` write some of its worksheets, ``methods``
is the source's mathematics as a library, ``words`` and ``charts`` are what a reader sees beside the
numbers.
"""

from kfsheet.exercises.tennis.model import (
    build_model,
    exercise,
    exercise_of,
    flight_model,
    read_drive,
    read_toss,
    tennis,
)

__all__ = [
    "build_model",
    "exercise",
    "exercise_of",
    "flight_model",
    "read_drive",
    "read_toss",
    "tennis",
]
