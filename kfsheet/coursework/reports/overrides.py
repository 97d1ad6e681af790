"""``overrides.csv``: a lecturer's own marks, which no run of the program replaces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kfsheet.coursework.judging.judge import Mark
from kfsheet.coursework.reading.roster import records, visible
from kfsheet.coursework.reports.grading import Result
from kfsheet.errors import DataError
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise
from kfsheet.model.quantities import as_number

HEAD = "id,question,score,remark\n"


def read_overrides(path: Path, exercise: Exercise, ids: set[str]) -> list[dict[str, Any]]:
    """The lines of the file, which is made, empty, where there is none.

    Raises
    ------
    DataError
        If a line names nobody on the roster or no question, or its score is no number.
    """
    if not path.exists():
        write_file(path, HEAD.encode())
        return []
    content = path.read_bytes()
    return [
        _checked(line, f"{path}, line {number}", exercise, ids)
        for number, line in records(content, str(path), HEAD.strip().split(",")[:3])
    ]


def _checked(line: dict[str, str], where: str, exercise: Exercise, ids: set[str]) -> dict[str, Any]:
    values = {key: visible(line.get(key) or "") for key in ("id", "question", "score", "remark")}
    if values["id"] not in ids:
        raise DataError(f"{where}: {values['id']!r} is not on the roster")
    if values["question"] not in {"", *(q.name for q in exercise.questions)}:
        raise DataError(f"{where}: {exercise.name} has no question {values['question']!r}")
    try:
        score = float(values["score"].replace(",", "."))
    except ValueError:
        raise DataError(f"{where}: the score {values['score']!r} is no number") from None
    most = sum(q.points for q in exercise.questions if values["question"] in ("", q.name))
    if not 0 <= score <= most:
        raise DataError(f"{where}: the score {score:g} lies outside 0 to {most}")
    return {**values, "score": as_number(score, f"{where}: score")}


def with_all_marks(result: Result, exercise: Exercise) -> Result:
    """A result with a line for each question, so that each can be overridden."""
    known = {mark.name for mark in result.marks}
    result.marks += [
        Mark(q.name, q.points, 0.0, "not judged", "")
        for q in exercise.questions
        if q.name not in known
    ]
    return result
