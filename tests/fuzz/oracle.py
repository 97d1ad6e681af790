"""LibreOffice's values of many answers at once, in the student's own sheet and in changed ones."""

import math
import random
import subprocess
import tempfile
from pathlib import Path

import openpyxl
from openpyxl.utils import get_column_letter

from fuzz.papers import Paper
from fuzz.question import HELPER_SHEET, moved, qualified
from kfsheet.coursework.handout.handout_workbook import solution_of_run
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.errors import KfsheetError
from kfsheet.workbook.engines.libreoffice import libreoffice
from kfsheet.workbook.write.run import Run

FIRST = 500  # column of the first answer beside the tables
SAME, OTHER = 1e-9, 1e-6
"""Relative to a value or its column's root mean square: equal below, another value above."""


def runs(exercise, secret, student, count=3, seed=1):
    """The student's own run of the model, and ``count`` others."""
    own = own_numbers(exercise, secret, student)
    found = [Run.of(exercise.model, dict(own.data), dict(own.parameters))]
    dice = random.Random(seed)
    still = set()
    while len(found) <= count:
        other = own_numbers(exercise, secret, f"{student}/{len(found)}")
        data = {n: _with_gaps(dice, exercise.model.column(n), v) for n, v in other.data}
        parameters = dict(other.parameters)
        for name in set(parameters) - exercise.vary.keys() - still:
            trial = {**parameters, name: _moved(dice, parameters[name])}
            try:
                Run.of(exercise.model, data, trial)
            except KfsheetError:  # the number of rows in a window, say, is what it is
                still.add(name)
            else:
                parameters = trial
        found.append(Run.of(exercise.model, data, parameters))
    return found


def _moved(dice, value):
    """Another value nearby; 0 becomes a small number."""
    return float(f"{value * (1 + dice.uniform(-0.04, 0.04)):.4g}") if value else 0.01


def _with_gaps(dice, column, values):
    if not column.may_be_missing:
        return list(values)
    return [math.nan if dice.random() < 0.2 else v for v in values]


class Oracle:
    """Solved workbooks, one for each run, in which answers are tried beside the tables."""

    def __init__(self, exercise, worlds, names=()):
        names = tuple(names)
        self.papers = [
            Paper(solution_of_run(exercise, run), names).without_values() for run in worlds
        ]

    def values(self, answers):
        """Values of each answer in every run, row by row."""
        changes, places, free = {}, [], {}
        for answer in answers:
            question = answer.question
            column = free.get(question.sheet, FIRST)
            width = 1 + max(len(row.helpers) for row in answer.rows)
            free[question.sheet] = column + width
            letters = [get_column_letter(column + 1 + n) for n in range(width - 1)]
            far = free.get(HELPER_SHEET, FIRST)
            free[HELPER_SHEET] = far + width
            cells = cells_of(answer, column, letters, far)
            for sheet, place, content in (*cells, *given_above(question, column)):
                changes.setdefault(sheet, {})[place] = content
            places.append((question.sheet, column, question.rows))
        books = calculated([paper.written(changes) for paper in self.papers])
        return [
            [[value_of(book, sheet, row, column) for row in rows] for book in books]
            for sheet, column, rows in places
        ]


def cells_of(answer, column, letters, far):
    """Cells that hold an answer in a column, its helpers in others."""
    question = answer.question
    home, title = get_column_letter(column), f"'{HELPER_SHEET}'!"
    for line in answer.rows:
        names = {}
        for n, (elsewhere, _) in enumerate(line.helpers):
            there = f"{title}{get_column_letter(far + n)}"
            names[f"_{n}"] = there if elsewhere else letters[n]
        text = filled(moved(line.text, question, home), names)
        yield question.sheet, (line.row, column), text
        for n, (elsewhere, content) in enumerate(line.helpers):
            if isinstance(content, str):
                content = filled(moved(content, question, home), names)
                content = qualified(content, question.sheet) if elsewhere else content
            at = far + n if elsewhere else column_of(letters[n])
            yield HELPER_SHEET if elsewhere else question.sheet, (line.row, at), content


def given_above(question, column):
    """Cells that an answer's column holds without being asked."""
    for row in question.copied - {*question.rows}:
        place = question.sheet, row, question.column
        formula = question.course.formulas.get(place)
        content = f"={formula}" if formula else question.course.own_values.get(place)
        if content is not None:
            yield question.sheet, (row, column), content


def column_of(letters):
    return openpyxl.utils.column_index_from_string(letters)


def filled(text, names):
    for name, address in names.items():
        text = text.replace(f"{{{name}}}", address)
    return text


def calculated(contents):
    """What LibreOffice finds in workbooks, by sheet, row and column."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        folder = Path(folder)
        paths = [folder / f"{n}.xlsx" for n in range(len(contents))]
        for path, content in zip(paths, contents, strict=True):
            path.write_bytes(content)
        subprocess.run(
            [libreoffice(), f"-env:UserInstallation={(folder / 'profile').as_uri()}", "--headless",
             "--convert-to", "xlsx:Calc MS Excel 2007 XML", "--outdir", folder / "out", *paths],
            check=True, capture_output=True, timeout=1800,
        )  # fmt: skip
        return [openpyxl.load_workbook(folder / "out" / p.name, data_only=True) for p in paths]


def value_of(book, sheet, row, column):
    """A number, a truth value, a text, or "#" for any error."""
    value = book[sheet].cell(row, column).value
    if isinstance(value, str) and value.startswith(("#", "Err:")):
        return "#"
    if value is None:
        return ""
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def verdict(answer, found, wanted):
    """right, wrong, or unclear: what these values are worth; where and how they differ most."""
    worst, words = 0.0, ""
    for n, (world, key) in enumerate(zip(found, wanted, strict=True)):
        numbers = [abs(v) for v in key if isinstance(v, float)]
        scale = math.sqrt(sum(v * v for v in numbers) / len(numbers)) if numbers else 0.0
        for line, a, b in zip(answer.rows, world, key, strict=True):
            if (far := distance(a, b, scale)) > worst:
                place = f"run {n}, row {line.row}: {line.text} {line.helpers or ''}"
                worst, words = far, f"{place} shows {a!r}, the key {b!r}"
    return "right" if worst <= SAME else "wrong" if worst > OTHER else "unclear", words


def distance(a, b, scale):
    if isinstance(a, bool) or isinstance(b, bool):
        return 0.0 if a is b else 1e-8  # whether TRUE is 1 is nobody's question
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b) / (max(abs(b), scale) or 1.0)
    return 0.0 if a == b else math.inf
