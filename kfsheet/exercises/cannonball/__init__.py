"""A cannon-ball tracked by a radar that measures angle and range: an extended Kalman filter.

``model`` is the recurrence, ``words`` and ``charts`` are what a reader sees beside the numbers.
"""

from kfsheet.exercises.cannonball.model import (
    DATA,
    DYNAMICS,
    build_model,
    cannonball,
    exercise,
    extended_model,
    linear_model,
)

__all__ = [
    "DATA",
    "DYNAMICS",
    "build_model",
    "cannonball",
    "exercise",
    "extended_model",
    "linear_model",
]
