"""Tables for the learning platform: ``grades.csv``, ``moodle.csv`` and ``canvas.csv``."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from io import StringIO

from kfsheet.coursework.reading.roster import harmless
from kfsheet.coursework.reports.grading import Result
from kfsheet.model.exercise import Exercise


def gradebooks(exercise: Exercise, results: list[Result]) -> dict[str, str]:
    """Text of each table by the name of its file."""
    return {
        # Excel takes a file for UTF-8 only behind a byte-order mark; platforms choke on one.
        "grades.csv": "\ufeff" + _grades(exercise, results),
        "moodle.csv": _moodle(results),
        "canvas.csv": _canvas(exercise, results),
    }


def _table(head: Iterable[str], lines: Iterable[Iterable[object]]) -> str:
    text = StringIO()
    # Every text in quotes: a semicolon in it splits no cell where lists are separated by those.
    writer = csv.writer(text, lineterminator="\n", quoting=csv.QUOTE_NONNUMERIC)
    writer.writerow(head)
    for line in lines:
        # A remark may quote a student: no cell of a lecturer's table may become a formula.
        writer.writerow([harmless(v) if isinstance(v, str) else v for v in line])
    return text.getvalue()


def points_shown(value: float) -> float | int:
    """Points without idle zeros."""
    return int(value) if float(value).is_integer() else round(value, 2)


def _percent(result: Result) -> float | int:
    return points_shown(round(100 * result.score / result.maximum, 1))


def _grades(exercise: Exercise, results: list[Result]) -> str:
    names = [question.name for question in exercise.questions]
    head = ["id", "name", "score", "max", "percent", *names, "status", "remark"]
    lines = []
    for r in results:
        scores = {m.name: points_shown(m.score) for m in r.marks}
        who = [r.student.id, r.student.name, points_shown(r.score), r.maximum, _percent(r)]
        remark = "; ".join(filter(None, (r.remark, r.note)))
        lines.append([*who, *(scores.get(n, 0) for n in names), r.status, remark])
    return _table(head, lines)


def _moodle(results: list[Result]) -> str:
    head = ["ID number", "Full name", "Email address", "Grade", "Feedback"]
    return _table(
        head,
        (
            [r.student.id, r.student.name, r.student.email, points_shown(r.score), _words(r)]
            for r in results
        ),
    )


def _canvas(exercise: Exercise, results: list[Result]) -> str:
    head = ["Student", "ID", "SIS Login ID", "Section", exercise.title]
    return _table(
        head,
        ([r.student.name, "", r.student.login, "", points_shown(r.score)] for r in results),
    )


def _words(result: Result) -> str:
    """Feedback in one cell."""
    lines = [result.status if not result.remark else f"{result.status}: {result.remark}"]
    lines += [
        f"{m.name} {points_shown(m.score)}/{m.points} {m.status}"
        + (f" ({m.remark})" if m.remark else "")
        for m in result.marks
    ]
    return "; ".join(lines)
