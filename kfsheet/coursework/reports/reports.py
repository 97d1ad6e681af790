"""What a lecturer and the students see: tables for the learning platform, pages, marked files."""

from __future__ import annotations

import csv
import re
from collections import Counter, defaultdict
from collections.abc import Iterable
from html import escape
from io import StringIO
from itertools import cycle
from pathlib import Path
from textwrap import shorten

from kfsheet.coursework.judging.diagnosis import RIGHT
from kfsheet.coursework.judging.judge import CREDIT, Mark
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.roster import harmless
from kfsheet.coursework.reading.submission import read_submission
from kfsheet.coursework.reports.grading import STATUSES, Handed, Result
from kfsheet.coursework.reports.marked_workbook import colour_of, mark_workbook
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise

COLOURS = {
    1.0: ("#55A868",),
    0.5: ("#F2C14E", "#E9A23B", "#D9BF77", "#F7DC9C"),
    0.0: ("#C44E52", "#DD8A8C", "#A23B4A", "#8C8C8C", "#B0B0B0", "#6E6E6E", "#D0A0A0"),
}
"""Of a status, by the share of the points that it brings: green, yellow, red and grey."""
OF_NOBODY = "put it into a folder named by its student's id, and grade again"
STYLE = """<style>
body { font: 15px/1.5 sans-serif; max-width: 60em; margin: 2em auto; color: #222; }
table { border-collapse: collapse; } td, th { border: 1px solid #bbb; padding: .3em .6em;
text-align: left; vertical-align: top; } .full { background: #c6efce; }
.part { background: #ffeb9c; } .none { background: #ffc7ce; }
</style>"""


def write_reports(
    exercise: Exercise, results: list[Result], handed: list[Handed], out: str | Path
) -> list[Path]:
    """Write every report into ``out`` and return the files for the lecturer."""
    out = Path(out)
    for result in results:
        page = _student_page(exercise, result)
        write_file(out / "feedback" / f"{result.student.id}.html", page.encode())
        marked = out / "work" / f"{result.key}.xlsx"
        target = out / "feedback" / f"{result.student.id}.xlsx"
        target.unlink(missing_ok=True)
        if result.feedback and result.changed:
            write_file(target, _marked_anew(exercise, result))
        elif result.feedback and marked.is_file():
            write_file(target, marked.read_bytes())
    tables = {
        "grades.csv": _grades(exercise, results),
        "moodle.csv": _moodle(results),
        "canvas.csv": _canvas(exercise, results),
    }
    written = [write_file(out / name, text.encode()) for name, text in tables.items()]
    page = _class_page(exercise, results, handed)
    return [*written, write_file(out / "class.html", page.encode())]


def _marked_anew(exercise: Exercise, result: Result) -> bytes:
    """The student's workbook with the marks that a lecturer has changed."""
    book = read_submission(result.path)
    addresses = CellAddresses.find(book, exercise.model)
    return mark_workbook(result.path, book, addresses, result.marks, result.override)


def _table(head: Iterable[str], lines: Iterable[Iterable[object]]) -> str:
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    for line in lines:
        writer.writerow([harmless(v) if isinstance(v, str) else v for v in line])
    return text.getvalue()


def _points(value: float) -> float | int:
    return int(value) if float(value).is_integer() else round(value, 2)


def _percent(result: Result) -> float | int:
    return _points(round(100 * result.score / result.maximum, 1))


def _grades(exercise: Exercise, results: list[Result]) -> str:
    names = [question.name for question in exercise.questions]
    head = ["id", "name", "score", "max", "percent", *names, "status", "remark"]
    lines = []
    for r in results:
        scores = {m.name: _points(m.score) for m in r.marks}
        who = [r.student.id, r.student.name, _points(r.score), r.maximum, _percent(r)]
        lines.append([*who, *(scores.get(n, 0) for n in names), r.status, r.remark])
    return _table(head, lines)


def _moodle(results: list[Result]) -> str:
    head = ["ID number", "Full name", "Email address", "Grade", "Feedback"]
    return _table(
        head,
        (
            [r.student.id, r.student.name, r.student.email, _points(r.score), _words(r)]
            for r in results
        ),
    )


def _canvas(exercise: Exercise, results: list[Result]) -> str:
    head = ["Student", "ID", "SIS Login ID", "Section", exercise.title]
    return _table(
        head,
        (
            [r.student.name, "", r.student.email or r.student.id, "", _points(r.score)]
            for r in results
        ),
    )


def _words(result: Result) -> str:
    """Feedback in one cell."""
    lines = [result.status if not result.remark else f"{result.status}: {result.remark}"]
    lines += [
        f"{m.name} {_points(m.score)}/{m.points} {m.status}"
        + (f" ({m.remark})" if m.remark else "")
        for m in result.marks
    ]
    return "; ".join(lines)


def _page(title: str, body: str) -> str:
    head = f'<meta charset="utf-8"><title>{escape(title)}</title>{STYLE}'
    return f"<!doctype html><html><head>{head}</head><body>{body}</body></html>\n"


def _html_table(head: Iterable[str], rows: Iterable[tuple[str, Iterable[object]]]) -> str:
    top = "".join(f"<th>{escape(word)}</th>" for word in head)
    lines = "".join(
        f'<tr class="{kind}">' + "".join(f"<td>{escape(str(v))}</td>" for v in values) + "</tr>"
        for kind, values in rows
    )
    return f"<table><tr>{top}</tr>{lines}</table>"


def _student_page(exercise: Exercise, result: Result) -> str:
    body = f"<h1>{escape(exercise.title)}</h1><p>{escape(result.student.name)}: "
    body += f"<b>{_points(result.score)} of {result.maximum} points</b></p>"
    status = STATUSES.get(result.status, "")
    body += f"<p>{escape(result.status)}: {escape(status)}. {escape(result.remark)}</p>"
    rows = ((colour_of(m), (m.name, _points(m.score), m.points, m.status, m.remark))
            for m in result.marks)  # fmt: skip
    body += _html_table(("answer", "score", "points", "status", "remark"), rows)
    return _page(f"{exercise.title}: {result.student.name}", body)


# -- the class ---------------------------------------------------------------------------------


def _class_page(exercise: Exercise, results: list[Result], handed: list[Handed]) -> str:
    judged = [r for r in results if r.status == "graded"]
    body = f"<h1>{escape(exercise.title)}</h1>"
    counts = Counter(r.status for r in results)
    rows = [("", (s, n, STATUSES.get(s, ""))) for s, n in counts.most_common()]
    body += "<h2>Submissions</h2>" + _html_table(("status", "students", "meaning"), rows)
    body += "<h2>Distribution</h2>" + _distribution(results)
    body += "<h2>Questions</h2>" + _question_plot(exercise, judged)
    body += _mistakes(exercise, judged)
    body += "<h2>Most frequent mistakes</h2>" + _mistake_plot(judged)
    body += "<h2>Identical wrong answers</h2>" + _groups(judged)
    body += "<h2>Files that carry somebody else's token</h2>" + _foreign(results, handed)
    body += "<h2>Files that belong to nobody</h2>" + _lost(handed)
    return _page(f"{exercise.title}: the class", body)


def _mistakes(exercise: Exercise, judged: list[Result]) -> str:
    """The most frequent mistakes of each question."""
    rows = []
    for question in exercise.questions:
        marks = [m for r in judged for m in r.marks if m.name == question.name]
        wrong = Counter(_kind(m) for m in marks if m.status != RIGHT)
        right = sum(m.status == RIGHT for m in marks)
        words = "; ".join(f"{n} x {kind}" for kind, n in wrong.most_common(4))
        rows.append(("", (question.name, f"{right} of {len(marks)}", words)))
    return _html_table(("question", "right", "most frequent mistakes"), rows)


def _mistake_plot(judged: list[Result]) -> str:
    """How many students made each of the most frequent mistakes."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    marks = [m for r in judged for m in r.marks if m.status != RIGHT]
    counts = Counter(f"{m.name}: {_kind(m)}" for m in marks).most_common(12)
    if not counts:
        return "<p>none</p>"
    figure = Figure(figsize=(9, 0.6 + 0.4 * len(counts)), layout="constrained")
    axes = figure.subplots()
    words = [shorten(name, 70, placeholder=" ...") for name, _ in counts]
    axes.barh(range(len(counts)), [count for _, count in counts], color="#D55E00")
    axes.set_yticks(range(len(counts)), words, fontsize=8)
    axes.invert_yaxis()
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("students")
    return _drawn(figure)


def _kind(mark: Mark) -> str:
    """A mistake without the rows in which it stands."""
    words = re.sub(r"^.*?(?:not in|every row refers to) [^:;]*[:;] ", "", mark.remark)
    words = re.sub(r"as long as .* keeps? ", "as long as a parameter keeps ", words)
    return f"{mark.status}: {words}" if words else mark.status


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
    return _html_table(("question", "students", "who"), rows) if rows else "<p>none</p>"


def _foreign(results: list[Result], handed: list[Handed]) -> str:
    names = {r.student.id for r in results}
    rows = [
        ("", (h.path.name, h.owner.id if h.owner else "", h.assessment.student))
        for h in handed
        if h.assessment.student
        and (h.assessment.student not in names or (h.owner and h.owner.id != h.assessment.student))
    ]
    head = ("file", "came from", "token of")
    return _html_table(head, rows) if rows else "<p>none</p>"


def _lost(handed: list[Handed]) -> str:
    rows = [
        ("", (h.path.name, h.assessment.status, h.assessment.remark, OF_NOBODY))
        for h in handed
        if h.of_nobody
    ]
    return _html_table(("file", "status", "reason", "what to do"), rows) if rows else "<p>none</p>"


def _distribution(results: list[Result]) -> str:
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    figure = Figure(figsize=(7, 2.8), layout="constrained")
    axes = figure.subplots()
    judged = [r.score for r in results if r.status == "graded" or r.override is not None]
    axes.hist(judged, bins=20, range=(0, results[0].maximum), color="#0072B2")
    axes.set_xlabel("score (points) of those whose work was judged")
    axes.set_ylabel("students")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    return _drawn(figure)


def _question_plot(exercise: Exercise, judged: list[Result]) -> str:
    """Share of each status, question by question."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    names = [q.name for q in exercise.questions]
    counts = {n: Counter(m.status for r in judged for m in r.marks if m.name == n) for n in names}
    found = {s for c in counts.values() for s in c}
    statuses = sorted(found, key=lambda s: (-CREDIT.get(s, 0.0), s))
    figure = Figure(figsize=(9, 3.4), layout="constrained")
    axes = figure.subplots()
    bottom = [0] * len(names)
    shades = {credit: cycle(colours) for credit, colours in COLOURS.items()}
    for status in statuses:
        heights = [counts[name][status] for name in names]
        colour = next(shades[CREDIT.get(status, 0.0)])
        axes.bar(names, heights, bottom=bottom, label=status, color=colour, edgecolor="white")
        bottom = [b + h for b, h in zip(bottom, heights, strict=True)]
    axes.set_ylabel("students")
    axes.tick_params(axis="x", rotation=45)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    if statuses:
        axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return _drawn(figure)


def _drawn(figure: object) -> str:
    """A figure as SVG text, the same for the same data."""
    import matplotlib

    text = StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "kfsheet", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return text.getvalue().partition("<svg")[1] + text.getvalue().partition("<svg")[2]
