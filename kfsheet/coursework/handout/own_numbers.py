"""Every student's own numbers: parameters within ranges, data drawn anew."""

from __future__ import annotations

from math import floor, isnan, log10

from numpy.random import RandomState

from kfsheet.coursework.handout import course_secret
from kfsheet.coursework.judging.model_runs import OwnNumbers
from kfsheet.errors import DataError, ModelError
from kfsheet.evaluation.evaluate import run
from kfsheet.model.exercise import Exercise

ATTEMPTS = 20
FIGURES = 3  # of a varied parameter


def own_numbers(exercise: Exercise, secret: bytes, student: str) -> OwnNumbers:
    """Parameters and data of one student; the same for the same secret, exercise and student.

    Raises
    ------
    ModelError
        If the model has no values for what is drawn, twenty times: its ranges are too wide.
    """
    for attempt in range(ATTEMPTS):
        dice = RandomState(course_secret.seed(secret, exercise.name, student, str(attempt)))
        parameters, data = _drawn(exercise, dice)
        # Ranges that are each sensible may have no value together, say a root of less than 0.
        try:
            run(exercise.model, data, parameters)
        except DataError as error:
            problem = error
            continue
        return _own(exercise, parameters, data)
    raise ModelError(f"{exercise.name}: narrow the ranges in vary; {problem}")


def _drawn(
    exercise: Exercise, dice: RandomState
) -> tuple[dict[str, float], dict[str, list[float]]]:
    parameters = exercise.model.defaults()
    for name, (low, high) in exercise.vary.items():
        parameters[name] = _rounded(dice.uniform(low, high), low, high)
    rows = exercise.model.rows
    data = {name: [round(v, 6) for v in dice.normal(size=rows)] for name in exercise.noise}
    if exercise.draw:
        data |= {name: list(v) for name, v in exercise.draw(dice, parameters).items()}
    return parameters, data


def _rounded(value: float, low: float, high: float) -> float:
    """To three figures, as a person would type it, but within the range."""
    digits = FIGURES - 1 - floor(log10(abs(value))) if value else 0
    short = round(value, digits)
    return short if low <= short <= high else value


def _own(
    exercise: Exercise, parameters: dict[str, float], data: dict[str, list[float]]
) -> OwnNumbers:
    columns = {c.name: c.values for c in exercise.model.table.values() if c.is_data}
    for name, values in data.items():
        columns[name] = tuple(float("nan") if v is None or isnan(v) else float(v) for v in values)
    return OwnNumbers(tuple(parameters.items()), tuple(columns.items()))
