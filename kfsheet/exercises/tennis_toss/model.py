"""The slow toss, shot B: the same exercise as :mod:`kfsheet.exercises.tennis`, other photos."""

from kfsheet.exercises.tennis.model import build_model, exercise_of, read_toss

shot = read_toss()
tennis_toss = build_model(shot, name="tennis_toss")
exercise = exercise_of(tennis_toss, shot)
