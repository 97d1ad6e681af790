"""The hidden sheet of a handout: row by row, whether an answer looks right, and up to where.

Below stands the grid: a line for a step, or for a block of steps of a long table, and for each
answer what is kept of the right value (:mod:`kfsheet.coursework.handout.check_numbers`), in a block
the weighted sum of its cells, and 1 or 0. Below the grid of a long table the steps of the first
block that is not right are looked at one by one. Above it stands, in a line for each answer, what
follows: the last step that is right, the first that is not, and which other answer it waits for.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import isnan

from openpyxl.utils import get_column_letter

from kfsheet.coursework.handout import check_numbers, course_secret
from kfsheet.coursework.handout.answer_order import Need, needs
from kfsheet.coursework.handout.check_numbers import Steps
from kfsheet.model.exercise import Exercise, Question, asked_steps
from kfsheet.workbook.write.layout import FIRST_ROW, TOKEN_NAME, Layout, quote
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Sheet

HIDDEN = "kfsheet"
HEADS = "answer filled failed done block inside next to last asked reach who begin end".split()
FACTOR, WINDOW = "$B$1", "$C$1"
FIRST_LINE, FIRST_COLUMN, A_CHECK = 3, 3, 4


@dataclass(frozen=True)
class Answer:
    """One question: where its cells are, and the right values that are not written down."""

    question: Question
    sheet: str
    column: str
    first_row: int
    """Row of step 0."""

    step: str
    """What a row is; "" for a scalar."""

    asked: list[int]
    values: list[float]

    @property
    def name(self) -> str:
        """Of the column or scalar."""
        return self.question.name

    @property
    def place(self) -> str:
        """Exactly the cells that are to be filled in, without dollars."""
        runs = [[self.asked[0], self.asked[0]]]
        for before, now in pairwise(self.asked):
            if now > before + 1:
                runs.append([now, now])
            runs[-1][1] = now
        return ",".join(self.cells(Steps(*run)) for run in runs)

    def cells(self, steps: Steps) -> str:
        """The cells of some steps, as a formula on another sheet reads them."""
        first, last = (f"{self.column}{self.first_row + step}" for step in steps)
        return f"{quote(self.sheet)}!{first}" + (f":{last}" if last != first else "")


def answers(exercise: Exercise, layout: Layout, now: Run) -> list[Answer]:
    """Every question of an exercise, with the right values of one run."""
    found = []
    for question in exercise.questions:
        name, model = question.name, exercise.model
        asked = asked_steps(model, name)
        if name in layout.scalars:
            sheet, row, column = layout.scalars[name]
            step, values = "", [now.scalars[name]]
        else:
            (sheet, column), row = layout.home(name), FIRST_ROW
            step, values = model.step_of(model.column(name).section), now.columns[name]
        letter = get_column_letter(column)
        found.append(Answer(question, sheet, letter, row, step, asked, list(values)))
    return found


class LiveChecks:
    """Composes the sheet."""

    def __init__(
        self, exercise: Exercise, asked: list[Answer], secret: bytes, student: str
    ) -> None:
        self._exercise, self._answers, self._rows = exercise, asked, exercise.model.rows
        self._steps = check_numbers.checked_steps(self._rows)
        self._own = check_numbers.factor(secret, exercise.name, student)
        self._weights = check_numbers.weights(secret, exercise.name, self._rows)
        self._grid = FIRST_LINE + len(asked) + 2
        self._at_weights = FIRST_COLUMN + A_CHECK * len(asked)
        self._long = any(steps.first < steps.last for steps in self._steps)
        self._detail = self._grid + len(self._steps) + 1
        self.sheet = Sheet(HIDDEN)
        self.sheet.put(1, 1, course_secret.token(secret, exercise.name, student), "index")
        self.sheet.names[TOKEN_NAME] = (1, 1)
        for column, number in enumerate((self._own, check_numbers.WINDOW), 2):
            self.sheet.put(1, column, number, "index")
        self._put_grid()
        self._put_lines()

    def of(self, number: int, what: str) -> str:
        """The cell that says something about an answer, as another sheet reads it."""
        return f"{HIDDEN}!{self._line(number, what)}"

    def _line(self, number: int, what: str) -> str:
        return f"{get_column_letter(1 + HEADS.index(what))}{FIRST_LINE + number}"

    # -- the grid --------------------------------------------------------------------------

    def _put_grid(self) -> None:
        for row, steps in enumerate(self._steps, self._grid):
            self.sheet.put(row, 1, steps.first, "index")
            self.sheet.put(row, 2, steps.last, "index")
        if self._long:
            for step, weight in enumerate(self._weights):
                self.sheet.put(self._grid + step, self._at_weights, weight, "index")
        for number, answer in enumerate(self._answers):
            at = FIRST_COLUMN + A_CHECK * number
            self.sheet.put(self._grid - 1, at, answer.name, "index")
            asked, sizes = set(answer.asked), check_numbers.sizes(answer.values)
            for row, steps in enumerate(self._checked(answer), self._grid):
                those = [k for k in range(steps.first, steps.last + 1) if k in asked]
                if not those:  # given: there is nothing to be right or wrong
                    self.sheet.put(row, at + 2, 1, "index")
                elif len(those) == 1:
                    self._put_row(row, at, answer, those[0], sizes)
                else:
                    self._put_block(row, at, answer, Steps(those[0], those[-1]), sizes)
            if self._long and answer.step:
                self._put_detail(number, at, answer, sizes)

    def _checked(self, answer: Answer) -> list[Steps]:
        return self._steps if answer.step else self._steps[:1]

    def _put_row(self, row: int, at: int, answer: Answer, step: int, sizes: list[float]) -> None:
        cell, value = answer.cells(Steps(step, step)), answer.values[step]
        if isnan(value):
            test = f"=IF(ISTEXT({cell}),IF(LEN({cell})=0,1,0),0)"
        else:
            self.sheet.put(row, at, check_numbers.salt(value, sizes[step], self._own), "index")
            test = f"=IF(ISNUMBER({cell}),{self._passes(cell, row, at)},0)"
        self.sheet.put(row, at + 2, test, "formula")

    def _put_block(
        self, row: int, at: int, answer: Answer, steps: Steps, sizes: list[float]
    ) -> None:
        cells, these = answer.cells(steps), slice(steps.first, steps.last + 1)
        known = [
            (w * v, w * size)
            for w, v, size in zip(
                self._weights[these], answer.values[these], sizes[these], strict=True
            )
            if not isnan(v)
        ]
        total, size = sum(v for v, _ in known), sum(size for _, size in known) or 1.0
        self.sheet.put(row, at, check_numbers.salt(total, size, self._own), "index")
        letter = get_column_letter(self._at_weights)
        first, last = (f"${letter}${self._grid + step}" for step in steps)
        self.sheet.put(row, at + 1, f"=SUMPRODUCT({first}:{last},{cells})", "formula")
        summed = f"{get_column_letter(at + 1)}{row}"
        full = f"AND(COUNT({cells})={len(known)},COUNTA({cells})=ROWS({cells}),ISNUMBER({summed}))"
        self.sheet.put(row, at + 2, f"=IF({full},{self._passes(summed, row, at)},0)", "formula")

    def _put_detail(self, number: int, at: int, answer: Answer, sizes: list[float]) -> None:
        """Some steps one by one, from the first of the first block that is not right."""
        column = self._at_weights + 1 + number
        for step, (value, size) in enumerate(zip(answer.values, sizes, strict=True)):
            if not isnan(value):
                kept = check_numbers.salt(value, size, self._own)
                self.sheet.put(self._grid + step, column, kept, "index")
        letter = get_column_letter(column)
        all_kept = f"${letter}${self._grid}:${letter}${self._grid + self._rows - 1}"
        cells, flag = answer.cells(Steps(0, self._rows - 1)), at + 2
        for row in range(self._detail, self._detail + check_numbers.ROWS_A_BLOCK):
            place, kept = f"{get_column_letter(at + 1)}{row}", f"{get_column_letter(at)}{row}"
            nth = f"{self._line(number, 'block')}+{row - self._detail}"
            self.sheet.put(row, at + 1, f"=MIN({nth},{self._rows - 1})+1", "formula")
            text = f'=IF(ISNUMBER(INDEX({all_kept},{place})),INDEX({all_kept},{place}),"")'
            self.sheet.put(row, at, text, "formula")
            found, cell = f"INDEX({cells},{place})", f"{get_column_letter(at + 3)}{row}"
            # A formula that reads an empty cell would be 0.
            self.sheet.put(row, at + 3, f'=IF(ISBLANK({found}),"-",{found})', "formula")
            gap = f"IF(ISTEXT({cell}),IF(LEN({cell})=0,1,0),0)"
            value = f"IF(ISNUMBER({cell}),{self._passes(cell, row, at)},0)"
            self.sheet.put(row, flag, f"=IF(ISNUMBER({kept}),{value},{gap})", "formula")

    @staticmethod
    def _passes(cell: str, row: int, at: int) -> str:
        """1 or 0; see :func:`kfsheet.coursework.handout.check_numbers.looks_right`."""
        kept = f"{get_column_letter(at)}{row}"
        scaled = f"{cell}/2^INT({kept})"
        near = f"ABS(MOD({scaled}*{FACTOR}+{kept},1)-1/2)<{WINDOW}"
        return f"IF(ABS({scaled})<{check_numbers.LARGEST:.0f}/{FACTOR},IF({near},1,0),0)"

    # -- a line for each answer ------------------------------------------------------------

    def _put_lines(self) -> None:
        for column, word in enumerate(HEADS, 1):
            self.sheet.put(FIRST_LINE - 1, column, word, "index")
        needed = needs(self._exercise)
        for number, answer in enumerate(self._answers):
            self.sheet.put(FIRST_LINE - 1, self._limit_column(number), answer.name, "index")
            line = {
                "answer": answer.name,
                "filled": f"=COUNTA({answer.place})",
                "asked": answer.asked[0],
                **self._progress(number, answer),
                **self._words(number, answer),
            }
            for what, content in line.items():
                row, column = FIRST_LINE + number, 1 + HEADS.index(what)
                kind = "formula" if str(content).startswith("=") else "index"
                self.sheet.put(row, column, content, kind)
            self._put_limits(number, answer, needed[answer.name])

    def _limit_column(self, number: int) -> int:
        return len(HEADS) + 1 + number

    def _progress(self, number: int, answer: Answer) -> dict[str, str | int]:
        last_row = self._grid + len(self._checked(answer)) - 1
        flag = get_column_letter(FIRST_COLUMN + A_CHECK * number + 2)
        flags, first, last = (
            f"${letter}${self._grid}:${letter}${last_row}" for letter in (flag, "A", "B")
        )
        failed, done, block, inside, next_ = (
            self._line(number, what) for what in ("failed", "done", "block", "inside", "next")
        )
        detail = f"${flag}${self._detail}:${flag}${self._detail + check_numbers.ROWS_A_BLOCK - 1}"
        limits = self._limits(number, FIRST_LINE + number)
        return {
            "failed": f"=IFERROR(MATCH(0,{flags},0),ROWS({flags})+1)",
            "done": f"=IF({failed}>ROWS({flags}),1,0)",
            "block": f"=IF({done}=1,{self._rows},INDEX({first},{failed}))",
            "inside": f"=IFERROR(MATCH(0,{detail},0),0)" if self._long and answer.step else 1,
            "next": f"=IF({done}=1,{self._rows},{block}+MAX({inside}-1,0))",
            "to": f"=IF(AND({done}=0,{inside}=0),INDEX({last},{failed}),{next_})",
            "last": f"={next_}-1",
            "reach": f"=IF(COUNT({limits})=0,{self._rows},MIN({limits}))",
        }

    def _limits(self, number: int, row: int) -> str:
        first, last = (
            get_column_letter(self._limit_column(n)) for n in (0, len(self._answers) - 1)
        )
        return f"{first}{row}:{last}{row}"

    def _put_limits(self, number: int, answer: Answer, needed: dict[str, Need]) -> None:
        """Up to which step an answer can be right, by what it needs of each of the others."""
        for other, found in enumerate(self._answers):
            if need := needed.get(found.name):
                far = need.free if answer.step else -1
                if need.lag is not None:
                    far = f"MAX({far},{self._line(other, 'last')}+{need.lag})"
                text = f"=IF({self._line(other, 'done')}=1,{self._rows},{far})"
                self.sheet.put(FIRST_LINE + number, self._limit_column(other), text, "formula")

    def _words(self, number: int, answer: Answer) -> dict[str, str]:
        """The beginning and the end of the sentence about an answer that is not right yet."""
        filled, last, next_, to, reach, who = (
            self._line(number, what) for what in ("filled", "last", "next", "to", "reach", "who")
        )
        limits, names = (self._limits(number, n) for n in (FIRST_LINE + number, FIRST_LINE - 1))
        waits = f'"; waits for "&{who}'
        if not answer.step:
            begin, end = '="not yet"', f'=IF({to}>{reach},{waits},"")'
        else:
            begin = (
                f'=IF({last}<{self._line(number, "asked")},"not yet",'
                f'"right up to {answer.step} "&{last})'
            )
            differs = f'"; differs in {answer.step} "&{next_}&IF({next_}<{to}," to "&{to},"")'
            end = (
                f'=IF({filled}<{len(answer.asked)},"; partly filled",'
                f"IF({to}>{reach},{waits},{differs}))"
            )
        found = f'=IFERROR(INDEX({names},MATCH({reach},{limits},0)),"")'
        return {"who": found, "begin": begin, "end": end}


def feedback(checks: LiveChecks, number: int, right: str, empty: str) -> str:
    """Formula of the words about an answer."""
    filled, done, begin, end = (checks.of(number, w) for w in ("filled", "done", "begin", "end"))
    return f'=IF({filled}=0,"{empty}",IF({done}=1,"{right}",{begin}&{end}))'
