"""Random rewritings of each key that keep its value are right; random changes of a value are not.

The oracle is the sheet: a workbook with all keys, in which one answer is changed and everything is
calculated anew, live, with the student's own numbers. The judge sees neither.
"""

import random
import re

import pytest
from students import ADA, SECRET, Paper

from kfsheet import load_exercise
from kfsheet.coursework.handout.handout_workbook import handout_bytes
from kfsheet.coursework.reading.submission import read_submission
from kfsheet.coursework.reports.assessment import assess
from kfsheet.parsing.calculator import Formula, SheetCalculator

ROUNDS = {"football": 30, "shuttlecock": 6, "tennis": 2}  # each changes every answer once
REFERENCE = re.compile(r"(?<![\w!$'.])([A-Z]{1,3})(\d+)(?![\w(!])")
WORD = re.compile(r"(?<![\w!$'.\"])([a-zA-Z_]\w*)(?![\w(!])")
SQUARE = re.compile(r"(?<![\w!$'.])([A-Za-z_]\w*)\^2(?!\w)")

FOR_ALL = [  # also where the value is an empty text
    "({k})", "IF(1=1,{k},0)", "CHOOSE(1,{k},0)", "IFERROR({k},1/0)", 'IF(ISTEXT({k}),"",{k})',
    'IF(ISNUMBER({k}),{k},"")', 'IF({k}="","",{k})', "IF(NOT(TRUE),0,{k})", "IFERROR(1/0,{k})",
    "INDEX(CHOOSE({{1,2}},{k},0),1)", "SWITCH(1,1,{k},0)", "IFS(FALSE,0,TRUE,{k})",
]  # fmt: skip
FOR_NUMBERS = [
    "0+{k}", "1*({k})", "--({k})", "SUM({k})", "AVERAGE({k},{k})", "3*({k})-2*({k})", "({k})*3/3",
    "MAX({k},{k})", "PRODUCT({k},1)", "SUMPRODUCT(({k})*1)", "IF(({k})<0,-ABS({k}),ABS({k}))",
    "SUM({k},7,-7)", "-(0-({k}))", "MEDIAN({k},{k},{k})",
    "SIGN({k})*ABS({k})", "SUM({{1,0}}*({k}))",
    "IF({k}>0,{k},IF({k}<=0,{k}))", "({k})/POWER(2,0)", "SUMIF(A4,A4,A4)*0+{k}",
]  # fmt: skip
WRONG = [
    "({k})*1.0001", "{k}+0.001", "ROUND({k},1)", "INT({k})", "-({k})", "2*({k})", "0*({k})",
    "IF(A{r}=7,0,{k})", "IF(A{r}=7,1/0,{k})", "ABS({k})", "SQRT({k})^2", "LN(EXP(99*({k})))/99",
    "({k})*A{r}/A{r}", "IFERROR({k},0)", "N({k})", "TEXT({k},\"0.000\")", "(1E16+{k})-1E16",
]  # fmt: skip


def rewritten(dice, text, numbers):
    """The same value in other words."""
    for _ in range(dice.choice([1, 1, 2])):
        kind = dice.random()
        if kind < 0.15:
            text = REFERENCE.sub(r"INDEX(\1\2,1)", text)
        elif kind < 0.3:
            text = SQUARE.sub(dice.choice([r"(\1*\1)", r"POWER(\1,2)", r"SUMSQ(\1)"]), text)
        else:
            forms = FOR_ALL + FOR_NUMBERS * 2 * numbers
            text = dice.choice(forms).format(k=text)
    return text


def damaged(dice, text, row, names):
    """Probably another value."""
    kind = dice.random()
    if kind < 0.4:
        return dice.choice(WRONG).format(k=text, r=row)
    if kind < 0.55:
        signs = list(re.finditer(r"(?<=[\w)])[-+*/](?=[\w(])", text))
        if signs:
            sign = dice.choice(signs)
            other = dice.choice("+-*/".replace(sign[0], ""))
            return text[: sign.start()] + other + text[sign.end() :]
    pattern = REFERENCE if kind < 0.8 else WORD
    found = [m for m in pattern.finditer(text) if pattern is REFERENCE or m[0] in names]
    if not found:
        return f"({text})*1.5"
    place = dice.choice(found)
    if pattern is WORD:
        new = dice.choice(sorted(names))
    else:
        new = f"{place[1]}{max(1, int(place[2]) + dice.choice([-2, -1, 1]))}"
    return text[: place.start()] + new + text[place.end() :]


class Sheets:
    """An exercise's solved handout, live."""

    def __init__(self, name, folder):
        self.exercise, self.path = load_exercise(name), folder / f"{name}.xlsx"
        self.handout = handout_bytes(self.exercise, ADA, SECRET)
        paper = self.paper().answer_all()
        self.keys = {
            q.name: [(c.parent.title, c.row, c.column, t[1:]) for c, t in paper.cells(q.name)]
            for q in self.exercise.questions
        }
        book = read_submission(paper.save())
        self.solved = SheetCalculator(book.sheets, book.names)

    def paper(self):
        return Paper(self.exercise, ADA, self.handout).open(self.path)

    def numbers(self, name):
        """Whether the key is a number whatever happens: in other runs gaps open elsewhere."""
        return not any('""' in cell[3] for cell in self.keys[name])

    def same(self, name, texts):
        """Whether the answer has the values of the key when the whole sheet is calculated."""
        changes = {
            cell[:3]: Formula(f"={text}", cell[1:3])
            for cell, text in zip(self.keys[name], texts, strict=True)
        }
        live = self.solved.with_changes(changes)
        return all(alike(live.value(c[:3]), self.solved.value(c[:3])) for c in self.keys[name])

    def marks(self, texts):
        """Marks by answer, of a workbook that is filled with these texts."""
        paper = self.paper()
        for name, cells in self.keys.items():
            for (sheet, row, column, _), text in zip(cells, texts[name], strict=True):
                paper.book[sheet].cell(row, column).value = f"={text}"
        found = assess(self.exercise.name, SECRET, paper.save())
        assert found.status == "graded", found.remark
        return {mark.name: mark for mark in found.marks}


def alike(a, b):
    if type(a) is float is type(b):
        return abs(a - b) <= 1e-9 * max(abs(b), 1e-6)
    return a == b


@pytest.fixture(scope="module", params=ROUNDS)
def sheets(request, tmp_path_factory):
    return Sheets(request.param, tmp_path_factory.mktemp("fuzz"))


def seeds(sheets):
    return range(ROUNDS[sheets.exercise.name])


def test_a_rewriting_that_keeps_the_value_is_right(sheets):
    lost = []
    for seed in seeds(sheets):
        texts = {}
        for name, cells in sheets.keys.items():
            numbers = sheets.numbers(name)
            texts[name] = [
                rewritten(random.Random(f"{seed}/{name}"), cell[3], numbers) for cell in cells
            ]
        marks = sheets.marks(texts)
        lost += [(texts[n][-1], m.status, m.remark) for n, m in marks.items() if m.score < m.points]
    assert not lost


def test_a_change_that_changes_a_value_is_not_right(sheets):
    earned, changed = [], 0
    names = {*sheets.exercise.model.parameters, *sheets.exercise.model.derived_scalars}
    for seed in seeds(sheets):
        texts = {
            name: [
                damaged(random.Random(f"{seed}/{name}"), c[3], c[1], names - {name}) for c in cells
            ]
            for name, cells in sheets.keys.items()
        }
        wrong = {name for name, forms in texts.items() if not sheets.same(name, forms)}
        marks = sheets.marks(texts)
        changed += len(wrong)
        earned += [(texts[n][-1], marks[n]) for n in wrong if marks[n].score == marks[n].points]
    assert not earned
    assert changed > 5 * len(seeds(sheets))  # most changes change something
