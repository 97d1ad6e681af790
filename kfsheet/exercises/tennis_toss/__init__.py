"""The slow toss, shot B: the exercise of :mod:`kfsheet.exercises.tennis`, other photos."""

from kfsheet.exercises.tennis_toss.model import exercise, tennis_toss

__all__ = ["exercise", "tennis_toss"]
