"""``class.html``: what a lecturer sees of all submissions together."""

from __future__ import annotations

from collections import Counter, defaultdict
from html import escape

from kfsheet.coursework.judging.mistakes.diagnosis import RIGHT
from kfsheet.coursework.reading.submitted_files import readable
from kfsheet.coursework.reports.assessment import NOT_OWN
from kfsheet.coursework.reports.class_charts import (
    answers_by_status,
    distribution,
    frequent_mistakes,
    kind_of_mistake,
)
from kfsheet.coursework.reports.grading import STATUSES, Handed, Result
from kfsheet.coursework.reports.html_pages import page, table
from kfsheet.model.exercise import Exercise

OF_NOBODY = "put it into a folder named by its student's id, and grade again"


def class_page(exercise: Exercise, results: list[Result], handed: list[Handed]) -> str:
    """The whole page: counts, plots, mistakes, and files that need a look."""
    judged = [r for r in results if r.status == "graded"]
    body = f"<h1>{escape(exercise.title)}</h1>"
    counts = Counter(r.status for r in results)
    rows = [("", (s, n, STATUSES.get(s, ""))) for s, n in counts.most_common()]
    body += "<h2>Submissions</h2>" + table(("status", "students", "meaning"), rows)
    body += "<h2>Distribution</h2>" + distribution(results)
    body += "<h2>Questions</h2>" + answers_by_status(exercise, judged)
    body += _mistakes(exercise, judged)
    body += "<h2>Most frequent mistakes</h2>" + frequent_mistakes(judged)
    body += "<h2>Identical wrong answers</h2>" + _groups(judged)
    body += "<h2>Files that carry somebody else's token or numbers</h2>" + _foreign(results, handed)
    body += "<h2>Files that belong to nobody</h2>" + _lost(handed)
    return page(f"{exercise.title}: the class", body)


def _mistakes(exercise: Exercise, judged: list[Result]) -> str:
    """The most frequent mistakes of each question."""
    rows = []
    for question in exercise.questions:
        marks = [m for r in judged for m in r.marks if m.name == question.name]
        wrong = Counter(kind_of_mistake(m) for m in marks if m.status != RIGHT)
        right = sum(m.status == RIGHT for m in marks)
        words = "; ".join(f"{n} x {kind}" for kind, n in wrong.most_common(4))
        rows.append(("", (question.name, f"{right} of {len(marks)}", words)))
    return table(("question", "right", "most frequent mistakes"), rows)


def _groups(judged: list[Result]) -> str:
    """Students who share several wrong answers, answer by answer."""
    groups: dict[tuple[str, str], list[str]] = defaultdict(list)
    for result in judged:
        for mark in result.marks:
            if mark.fingerprint:
                groups[mark.name, mark.fingerprint].append(result.student.id)
    rows = [
        ("", (name, len(ids), ", ".join(ids)))
        for (name, _), ids in sorted(groups.items(), key=lambda item: -len(item[1]))
        if len(ids) > 1
    ]
    return table(("question", "students", "who"), rows) if rows else "<p>none</p>"


def _foreign(results: list[Result], handed: list[Handed]) -> str:
    names = {r.student.id for r in results}
    rows = [
        (
            "",
            (
                readable(h.path.name),
                h.owner.id if h.owner else "",
                h.assessment.student,
                _numbers_of(h),
            ),
        )
        for h in handed
        if h.assessment.student
        and (
            h.assessment.student not in names
            or (h.owner and h.owner.id != h.assessment.student)
            or h.assessment.status == NOT_OWN
        )
    ]
    head = ("file", "came from", "token of", "numbers of")
    return table(head, rows) if rows else "<p>none</p>"


def _numbers_of(file: Handed) -> str:
    """Whose numbers a file holds, where it is not a student's own."""
    return (file.numbers_of or "nobody") if file.assessment.status == NOT_OWN else ""


def _lost(handed: list[Handed]) -> str:
    rows = [
        ("", (readable(h.path.name), h.assessment.status, h.assessment.remark, OF_NOBODY))
        for h in handed
        if h.of_nobody
    ]
    return table(("file", "status", "reason", "what to do"), rows) if rows else "<p>none</p>"
