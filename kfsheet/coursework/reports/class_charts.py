"""Plots of the class as SVG: scores, answers by status, the most frequent mistakes."""

from __future__ import annotations

import re
from collections import Counter
from io import StringIO
from itertools import cycle
from textwrap import shorten

import matplotlib
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from kfsheet.coursework.judging.judge import CREDIT, Mark
from kfsheet.coursework.judging.mistakes.diagnosis import RIGHT
from kfsheet.coursework.reports.grading import Result
from kfsheet.model.exercise import Exercise

COLOURS = {
    1.0: ("#55A868",),
    0.5: ("#F2C14E", "#E9A23B", "#D9BF77", "#F7DC9C"),
    0.0: ("#C44E52", "#DD8A8C", "#A23B4A", "#8C8C8C", "#B0B0B0", "#6E6E6E", "#D0A0A0"),
}
"""Of a status, by the share of the points that it brings: green, yellow, red and grey."""


def distribution(results: list[Result]) -> str:
    """How many students have how many points."""
    figure = Figure(figsize=(7, 2.8), layout="constrained")
    axes = figure.subplots()
    judged = [r.score for r in results if r.status == "graded" or r.override is not None]
    axes.hist(judged, bins=20, range=(0, results[0].maximum), color="#0072B2")
    axes.set_xlabel("score (points) of those whose work was judged")
    axes.set_ylabel("students")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    return _drawn(figure)


def answers_by_status(exercise: Exercise, judged: list[Result]) -> str:
    """Share of each status, question by question."""
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


def frequent_mistakes(judged: list[Result]) -> str:
    """How many students made each of the most frequent mistakes."""
    marks = [m for r in judged for m in r.marks if m.status != RIGHT]
    counts = Counter(f"{m.name}: {kind_of_mistake(m)}" for m in marks).most_common(12)
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


def kind_of_mistake(mark: Mark) -> str:
    """A mistake without the rows in which it stands."""
    words = re.sub(r"^.*?(?:not in|every row refers to) [^:;]*[:;] ", "", mark.remark)
    words = re.sub(r"as long as .* keeps? ", "as long as a parameter keeps ", words)
    return f"{mark.status}: {words}" if words else mark.status


def _drawn(figure: Figure) -> str:
    """A figure as SVG text, the same for the same data."""
    text = StringIO()
    # Without date, random ids and outlines of letters, equal marks make equal pages.
    with matplotlib.rc_context({"svg.hashsalt": "kfsheet", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return text.getvalue().partition("<svg")[1] + text.getvalue().partition("<svg")[2]
