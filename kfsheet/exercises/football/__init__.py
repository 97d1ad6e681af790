"""A football kick filmed by one camera: the smallest Kalman filter that teaches something.

``model`` is the recurrence, ``words`` and ``charts`` are what a reader sees beside the numbers.
"""

from kfsheet.exercises.football.kick import draw_kick
from kfsheet.exercises.football.model import DATA, build_model, exercise, football

__all__ = ["DATA", "build_model", "draw_kick", "exercise", "football"]
