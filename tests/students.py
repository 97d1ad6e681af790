"""What students do to a workbook, as functions: each takes the handout and leaves a submission.

The fixtures are named as behaviours. They work on any exercise: formulas are taken from its own
solution, and changed as text, so that the grader's own algebra has no hand in them.
"""

import re

import openpyxl
from openpyxl.utils import column_index_from_string, get_column_letter

from kfsheet.coursework.handout.handout_workbook import handout_bytes, own_run
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.reading.roster import Student
from kfsheet.model.exercise import asked_steps
from kfsheet.model.expressions import Missing
from kfsheet.workbook.write.layout import FIRST_ROW, Layout

SECRET = b"the secret of the tests, 32 byte"
ADA = Student("s001", "Ada Lovelace", "ada@example.org")


class Paper:
    """A handout in which a student writes."""

    def __init__(self, exercise, student=ADA, handout=None):
        self.exercise, self.student = exercise, student
        self.model, self.layout = exercise.model, Layout.standard(exercise.model)
        self._handout = handout or handout_bytes(exercise, student, SECRET)

    def open(self, path):
        path.write_bytes(self._handout)
        self.book = openpyxl.load_workbook(path)
        self.path = path
        return self

    def save(self):
        self.book.save(self.path)
        return self.path

    @property
    def own(self):
        return own_numbers(self.exercise, SECRET, self.student.id)

    def cells(self, name):
        """Cells of an answer with the key's formulas, in order of the steps."""
        if name in self.layout.scalars:
            sheet, row, column = self.layout.scalars[name]
            text = self.layout.formula(self.model.derived_scalars[name].expression, sheet)(row)
            return [(self.book[sheet].cell(row, column), text)]
        sheet, number = self.layout.home(name)
        column, found = self.model.column(name), []
        texts = [r is not Missing and self.layout.formula(r, sheet) for r in column.rules]
        for step in asked_steps(self.model, name):
            text = texts[min(step, len(column.start))](FIRST_ROW + step)
            found.append((self.book[sheet].cell(FIRST_ROW + step, number), text))
        return found

    def answer(self, name, change=lambda text, _: text):
        """Write an answer, every formula changed by ``change(text, place in the list)``."""
        for n, (cell, text) in enumerate(self.cells(name)):
            cell.value = change(text, n)

    def answer_all(self, *but):
        for question in self.exercise.questions:
            if question.name not in but:
                self.answer(question.name)
        return self

    def values(self, name):
        run = own_run(self.exercise, self.own)
        if name in run.scalars:
            return [run.scalars[name]]
        return [run.columns[name][step] for step in asked_steps(self.model, name)]

    def column_of_its_own(self, name):
        """Sheet and letter of a free column to the right of an answer."""
        sheet = self.cells(name)[0][0].parent
        return sheet, get_column_letter(sheet.max_column + 2)


def negated(text, _=0):
    return f"=-({text[1:]})"


def rearranged(text, _=0):
    """Algebraically equal, in other words."""
    inside = re.sub(r"([A-Za-z_]+\d*|\$?[A-Z]+\$?\d+)\^2\b", r"POWER(\1,2)", text[1:])
    return f"=IF(1>0,(3*({inside})+({inside}))/4,0)" if '""' not in text else f"={inside}"


def helper_columns(paper, name):
    """The formula stands in a helper column; the answer only points there."""
    sheet, letter = paper.column_of_its_own(name)
    for cell, text in paper.cells(name):
        sheet[f"{letter}{cell.row}"] = text
        cell.value = f"={letter}{cell.row}"


def values_pasted(paper, name):
    for (cell, _), value in zip(paper.cells(name), paper.values(name), strict=True):
        cell.value = None if value != value else value


def parameter_in(paper, name):
    """A parameter that the general formula of an answer reads."""
    text = paper.cells(name)[-1][1]
    words = re.findall(r"(?<![\w!'])[a-zA-Z]\w*(?![\w(!])", text)
    return next(word for word in words if word in paper.model.parameters)


def hard_coded(paper, name):
    parameter = parameter_in(paper, name)
    value = dict(paper.own.parameters)[parameter]
    pattern = rf"(?<![\w!'$]){parameter}(?![\w(!])"
    paper.answer(name, lambda text, _: re.sub(pattern, f"({value!r})", text))


def first_relative(text):
    """A reference to a cell of the tables, not a fixed one."""
    return re.search(r"(?<![\w$'!])([A-Z]{1,2})(\d+)(?![\w(])", text)


def absolute_slip(paper, name):
    """The first row's reference was fixed with dollars, then filled down."""
    general = [c for c in paper.cells(name) if first_relative(c[1])]
    match = first_relative(general[0][1])
    fixed = f"${match[1]}${match[2]}"
    for cell, text in paper.cells(name):
        here = first_relative(text)
        cell.value = text[: here.start()] + fixed + text[here.end() :] if here else text


def broken_fill_down(paper, name, last=3):
    """The last rows point to one fixed cell."""
    cells = paper.cells(name)
    for n, (cell, text) in enumerate(cells):
        here = first_relative(text)
        broken = n >= len(cells) - last
        fixed = broken and f"${here[1]}${cells[0][0].row}"
        cell.value = text[: here.start()] + fixed + text[here.end() :] if broken else text


def inserted(book, sections, rows=2, columns=1):
    """Rows above and a column before the table of each section; references follow, as in Excel."""
    titles = {name: sheet for name in sections for sheet in (name, f"'{name}'")}
    pattern = re.compile(
        r"(?<![\w$.!'])((?:'[^']+'|\w+)!)?(\$?)([A-Z]{1,2})(\$?)(\d+)(?![\w(!])"
        r"(?::(\$?)([A-Z]{1,2})(\$?)(\d+))?"
    )

    def corner(column_fixed, letters, row_fixed, row):
        number = column_index_from_string(letters) + columns
        return f"{column_fixed}{get_column_letter(number)}{row_fixed}{int(row) + rows}"

    def moved(text, own):
        def reference(match):
            sheet = match[1][:-1].strip("'") if match[1] else own
            if sheet not in titles:
                return match[0]
            last = f":{corner(*match.groups()[5:])}" if match[7] else ""
            return f"{match[1] or ''}{corner(*match.groups()[1:5])}{last}"

        return pattern.sub(reference, text)

    for sheet in book:
        moves = sheet.title in titles
        cells = {(c.row, c.column): c.value for line in sheet.iter_rows() for c in line}
        for place, value in cells.items():
            if moves:
                sheet.cell(*place).value = None
            elif isinstance(value, str) and value.startswith("="):
                sheet.cell(*place).value = moved(value, sheet.title)
        for (row, column), value in cells.items():
            if moves and value is not None:
                formula = isinstance(value, str) and value.startswith("=")
                new = moved(value, sheet.title) if formula else value
                sheet.cell(row + rows, column + columns).value = new


def renamed(book, old, new):
    """A worksheet under another name and in another place; every reference follows."""
    for sheet in book:
        for line in sheet.iter_rows():
            for cell in line:
                if isinstance(cell.value, str) and cell.value.startswith("="):
                    for written in (f"'{old}'!", f"{old}!"):
                        cell.value = cell.value.replace(written, f"'{new}'!")
    for defined in book.defined_names.values():
        defined.attr_text = defined.attr_text.replace(f"'{old}'!", f"'{new}'!")
    book[old].title = new
    book.move_sheet(new, 3)
