"""An exercise in which answers are tried: its handout, its solved workbooks, one student."""

import random
import re
import tempfile
from functools import cached_property
from pathlib import Path

import openpyxl
from openpyxl.utils import get_column_letter
from students import ADA, SECRET

from fuzz.mutations import mutated
from fuzz.oracle import Oracle, cells_of, runs, verdict
from fuzz.papers import Paper
from fuzz.question import Line, Question, key_cells
from fuzz.rewritings import rewritten
from fuzz.trees import text_of
from kfsheet import load_exercise
from kfsheet.coursework.handout.handout_workbook import handout_of_run, solution_of_run
from kfsheet.coursework.reports.assessment import assess
from kfsheet.workbook.write.layout import FIRST_ROW, Layout

HELPERS_AT = 600  # column of the first helper in a student's file; each question has room for 5


class Answer:
    """An answer to a question, row by row."""

    def __init__(self, question, rows, kind):
        self.question, self.rows, self.kind = question, rows, kind
        self.seen = ""

    def __str__(self):
        line = self.rows[-1]
        helpers = "".join(f"; _{n}: {c}" for n, (_, c) in enumerate(line.helpers))
        return f"{self.question.name} row {line.row} {line.text}{helpers}"


class Course:
    """One exercise; what it knows of cells it has from the solved workbook."""

    def __init__(self, spec):
        self.spec, self.exercise = spec, load_exercise(spec)
        self.worlds = runs(self.exercise, SECRET, ADA.id)
        handout = handout_of_run(self.exercise, self.worlds[0], ADA, SECRET)
        self.key_cells = key_cells(self.exercise, ADA, handout)
        self.layout = Layout.standard(self.exercise.model)
        self.scalars = {n: a for n, a in self.layout.scalars.items() if n in self._named}
        self._read_solution()
        self.handout = Paper(handout, self.names)
        self.questions = {q.name: Question(self, q.name) for q in self.exercise.questions}

    @cached_property
    def _named(self):
        return {*self.exercise.model.parameters, *self.exercise.model.derived_scalars}

    def _read_solution(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "solved.xlsx"
            path.write_bytes(solution_of_run(self.exercise, self.worlds[0]))
            formulas, values = (openpyxl.load_workbook(path, data_only=d) for d in (False, True))
        self.formulas, self.own_values = {}, {}
        for sheet in formulas:
            for cells in sheet.iter_rows():
                for cell in cells:
                    if isinstance(cell.value, str) and cell.value.startswith("="):
                        self.formulas[sheet.title, cell.row, cell.column] = cell.value[1:]
        for sheet in values:
            for cells in sheet.iter_rows():
                for cell in cells:
                    value = cell.value
                    if isinstance(value, int) and not isinstance(value, bool):
                        value = float(value)
                    self.own_values[sheet.title, cell.row, cell.column] = value
        answers = {(c[0], c[2]) for cells in self.key_cells.values() for c in cells}
        self.given, self.column_names = set(), {}
        for column in self.exercise.model.table:
            sheet, number = self.layout.home(column)
            if (sheet, number) not in answers:
                name = re.sub(r"\W", "", f"all_{column}")
                self.column_names[sheet, number] = name
                rows = range(self.exercise.model.rows)
                self.given |= {(sheet, FIRST_ROW + k, number) for k in rows}

    def may_be_empty(self, place):
        """Whether a place is that of a datum which some run does without, or of no cell at all."""
        return place in self.gaps or (place is not None and place not in self.own_values)

    @cached_property
    def gaps(self):
        columns = self.exercise.model.table.values()
        homes = [self.layout.home(c.name) for c in columns if c.is_data and c.may_be_missing]
        rows = range(FIRST_ROW, FIRST_ROW + self.exercise.model.rows)
        return {(sheet, row, number) for sheet, number in homes for row in rows}

    @property
    def names(self):
        """Names of whole columns, as a student may define them."""
        for (sheet, number), name in self.column_names.items():
            letter = get_column_letter(number)
            yield name, f"'{sheet}'!${letter}:${letter}"

    @cached_property
    def parameter_rows(self):
        rows = [self.layout.scalars[n][1] for n in self.exercise.model.parameters]
        return min(rows), max(rows)

    @cached_property
    def free_names(self):
        return sorted(self._named & self.scalars.keys())

    @cached_property
    def has_time(self):
        return "dt" in self.exercise.model.parameters and "time" in self.exercise.model.table

    @cached_property
    def wanted(self):
        """The key's values by question and run."""
        return {
            name: [self._key_values(question, run) for run in self.worlds]
            for name, question in self.questions.items()
        }

    @property
    def key_values(self):
        return {name: worlds[0] for name, worlds in self.wanted.items()}

    def _key_values(self, question, run):
        if question.is_scalar:
            return [float(run.scalars[question.name])]
        values = [float(run.columns[question.name][step]) for step in question.steps]
        return [v if v == v else "" for v in values]

    @cached_property
    def oracle(self):
        return Oracle(self.exercise, self.worlds, self.names)

    # -- answers ---------------------------------------------------------------------------

    def answer(self, name, seed, kind):
        """A random answer to a question: rewritten, or mutated."""
        question = self.questions[name]
        dice = random.Random(f"{self.exercise.name}/{name}/{kind}/{seed}")
        times, after = dice.choice([1, 1, 2, 2, 3, 4]), dice.choice([0, 0, 0, 1, 2])
        some = dice.random() < 0.25 and not question.is_scalar
        bad = {row for row in question.rows if not some or dice.random() < 0.3}
        bad |= {dice.choice(question.rows)}
        rows = []
        for row in question.rows:
            line = Line(question, row, f"{name}/{kind}/{seed}")
            tree = question.keys[row]
            if kind == "rewritten":
                tree = rewritten(line, tree, times)
            elif row in bad:
                tree = rewritten(line, mutated(line, tree), after)
            write(line, tree)
            rows.append(line)
        return Answer(question, rows, kind)

    def written(self, name, form, key=None):
        """An answer by hand: a formula with {r}, {p}, {q} for this row and those before."""
        question = self.questions[name]
        rows = []
        for n, row in enumerate(question.rows):
            line = Line(question, row, "")
            text = form[min(n, len(form) - 1)] if isinstance(form, list | tuple) else form
            if text is None:
                write(line, question.keys[row])
            else:
                line.text = text.format(r=row, p=row - 1, q=row - 2, n=row + 1)
            rows.append(line)
        return Answer(question, rows, "by hand")

    def verdicts(self, answers):
        """right, wrong or unclear for each answer, as LibreOffice has it."""
        found = self.oracle.values(answers)
        told = []
        for answer, values in zip(answers, found, strict=True):
            status, answer.seen = verdict(answer, values, self.wanted[answer.question.name])
            told.append(status)
        return told

    # -- marks -----------------------------------------------------------------------------

    def marks(self, answers, path):
        """Marks of one answer to each of some questions; the others hold the key."""
        changes = {}
        by_name = {answer.question.name: answer for answer in answers}
        for n, (name, question) in enumerate(self.questions.items()):
            answer = by_name.get(name) or self.written(name, None)
            first = HELPERS_AT + 5 * n
            letters = [get_column_letter(first + k) for k in range(5)]
            for sheet, place, content in cells_of(answer, question.column, letters, first):
                changes.setdefault(sheet, {})[place] = content
        path.write_bytes(self.handout.written(changes))
        found = assess(self.spec, SECRET, path)
        if found.status != "graded":
            return dict.fromkeys(self.questions, found)
        return {mark.name: mark for mark in found.marks}


def write(line, tree):
    """Trees to text: the answer and its helpers."""
    text = f"={text_of(tree)}"
    line.text = f"{{{text}}}" if line.array else text
    line.helpers = [(elsewhere, _content(part)) for elsewhere, part in line.helpers]


def _content(tree):
    return tree[1] if tree[0] == "number" else f"={text_of(tree)}"
