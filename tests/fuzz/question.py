"""What an author of random answers knows: the cells of a question, and those around them."""

import random
import re
from functools import cached_property

from openpyxl.utils import column_index_from_string, get_column_letter
from students import Paper as StudentsPaper

from fuzz.trees import read
from kfsheet.workbook.write.layout import FIRST_ROW

REFERENCE = re.compile(
    r"(?<![\w$.!'])((?:'[^']+'|[A-Za-z]\w*)!)?(\$?)([A-Z]{1,3})(\$?)(\d+)(?![\w(!])"
)
STRING = re.compile(r'("[^"]*")')
HELPER_SHEET = "Read me"


class Question:
    """A question: where its answer stands, and the key's formulas as trees."""

    def __init__(self, course, name):
        self.course, self.name = course, name
        cells = course.key_cells[name]
        self.sheet, self.column = cells[0][0], cells[0][2]
        self.rows = [cell[1] for cell in cells]
        self.letter = get_column_letter(self.column)
        self.keys = {cell[1]: read(cell[3]) for cell in cells}

    @cached_property
    def copied(self):
        """Rows of the column: those that are asked for, and those that are given above them."""
        return {*self.rows} if self.is_scalar else {*range(FIRST_ROW, max(self.rows) + 1)}

    @cached_property
    def steps(self):
        return [row - FIRST_ROW for row in self.rows]

    @property
    def is_scalar(self):
        return self.name in self.course.exercise.model.derived_scalars


class Line:
    """One row of an answer that is being written; equal dice for equal formulas."""

    def __init__(self, question, row, seed):
        self.question, self.course, self.row = question, question.course, row
        self.dice = random.Random(seed)
        self.helpers = []  # (on another sheet, tree or number)
        self.array = False
        self.touched = ""

    def helper(self, tree, elsewhere):
        """A reference to a new helper cell in this row."""
        self.helpers.append((elsewhere, tree))
        return ("raw", f"{{_{len(self.helpers) - 1}}}{self.row}")

    def formula_at(self, text):
        """The tree of the formula behind a reference or name, as seen from here, or None."""
        place = self.place(text)
        formula = place and self.course.formulas.get(place)
        if not formula or (place[0] == self.question.sheet and place[2] == self.question.column):
            return None
        if any(f"{title}!" in formula.replace("'", "") for title in self.course.exercise.frozen):
            return None  # a handout holds numbers there
        return read(qualified(formula, place[0]) if place[0] != self.question.sheet else formula)

    def place(self, text):
        """Sheet, row and column of a reference or a name of a scalar."""
        if text in self.course.scalars:
            return self.course.scalars[text]
        match = REFERENCE.fullmatch(text)
        if not match:
            return None
        sheet = match[1][:-1].strip("'") if match[1] else self.question.sheet
        return sheet, int(match[5]), column_index_from_string(match[3])

    def value_at(self, text):
        """The number in the student's own run, of a reference or a name; None for a gap."""
        place = self.place(text)
        return self.course.own_values.get(place) if place else None


def qualified(text, sheet):
    """A formula as it must read on another sheet."""
    title = f"'{sheet}'!" if re.search(r"\W", sheet) else f"{sheet}!"
    return in_code(text, lambda m: m[0] if m[1] or _ends_a_range(m) else title + m[0])


def _ends_a_range(match):
    """Whether a reference is the second corner of a range: it is on the sheet of the first."""
    return match.string[: match.start()].endswith(":")


def in_code(text, change):
    """A text with its references changed, its strings not."""
    return "".join(
        piece if piece.startswith('"') else REFERENCE.sub(change, piece)
        for piece in STRING.split(text)
    )


def moved(text, question, letter):
    """A formula of an answer for a copy of it in another column: own cells are the copy's."""
    own, sheet = question.letter, question.sheet

    def change(match):
        nonlocal sheet
        if not _ends_a_range(match):
            sheet = match[1][:-1].strip("'") if match[1] else question.sheet
        if sheet != question.sheet or match[3] != own or int(match[5]) not in question.copied:
            return match[0]
        return f"{match[1] or ''}{match[2]}{letter}{match[4]}{match[5]}"

    text = in_code(text, change)
    if question.is_scalar:  # its own name is its own cell, too
        place = f"${letter}${question.rows[0]}"
        text = re.sub(rf"(?<![\w.$!'\"]){question.name}(?![\w(!\"])", place, text)
    return text


def key_cells(exercise, student, handout):
    """Sheet, row, column and the key's formula of every answer, by question."""
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory() as folder:
        paper = StudentsPaper(exercise, student, handout).open(Path(folder) / "a.xlsx")
    return {
        q.name: [(c.parent.title, c.row, c.column, t[1:]) for c, t in paper.cells(q.name)]
        for q in exercise.questions
    }
