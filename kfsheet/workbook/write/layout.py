"""Where everything stands in a workbook, and the formula of every cell as text.

Each section has its symbols in row 1, units in row 2, words in row 3, and row ``t`` of the
recurrence in row ``t + 4``. The step index is in the first column, the clock, if any, in the
second. Parameters, derived scalars and summaries are defined names, equal to their symbols.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import repeat

from openpyxl.utils import get_column_letter, quote_sheetname
from sympy import Basic, Expr, Indexed, IndexedBase, Symbol

from kfsheet.errors import PrintError
from kfsheet.model.expressions import Last, Missing, Observed, lag, t, walk
from kfsheet.model.recurrence import Recurrence
from kfsheet.parsing.references import Address
from kfsheet.printing.excel import HARD_LIMIT, excel_code

EXERCISE_NAME, EXERCISE_PROPERTY = "kfsheet_exercise", "kfsheet exercise"
"""The cell and the property of the file that hold the name of the exercise."""

TOKEN_NAME = "kfsheet_token"
"""A cell of every workbook that is handed out to a student."""

SYMBOL_ROW, UNIT_ROW, WORDS_ROW, FIRST_ROW = 1, 2, 3, 4
PARAMETER_ROW = 5

FIRST_CHART_ROW, ROWS_A_CHART = 4, 24
CHART_COLUMNS = (1, 11)  # in which a chart begins: two charts beside each other


@dataclass(frozen=True)
class Layout:
    """Column numbers by name for each worksheet, and cells of scalars.

    ``columns[sheet][name]`` counts from 1; the step index has the key ``"t"``, the clock the key
    ``"time"``; ``scalars[name]`` is an address.
    """

    model: Recurrence
    columns: dict[str, dict[str, int]]
    scalars: dict[str, Address]
    waiting: frozenset[str] = frozenset()
    """Columns and scalars that have no value yet; a formula that reads one is "" until it has."""
    _templates: dict[tuple[Expr, str], tuple[str, int]] = field(
        default_factory=dict, repr=False, compare=False
    )

    @classmethod
    def standard(cls, model: Recurrence, waiting: frozenset[str] = frozenset()) -> Layout:
        """The layout in which workbooks are written; ``waiting`` is that of a handout."""
        columns = {
            section: {
                name: n
                for n, name in enumerate(
                    ["t", *(c.name for c in (*model.clock_of(section), *those))], 1
                )
            }
            for section, those in model.sections.items()
        }
        scalars: dict[str, Address] = {}
        row = PARAMETER_ROW
        for name in model.parameters:
            scalars[name] = ("Parameters", row, 2)
            row += 1
        row += 3  # an empty one, the heading and the header of the next table
        for name in model.derived_scalars:
            scalars[name] = ("Parameters", row, 2)
            row += 1
        for n, name in enumerate(model.summaries):
            scalars[name] = ("Parameters", PARAMETER_ROW + n, 7)
        return cls(model, columns, scalars, waiting)

    @property
    def last_row(self) -> int:
        """Row of the last step."""
        return FIRST_ROW + self.model.rows - 1

    def home(self, name: str) -> tuple[str, int]:
        """Sheet and column number of a column of the recurrence."""
        return next((s, those[name]) for s, those in self.columns.items() if name in those)

    def range(self, name: str, sheet: str | None = None) -> str:
        """Absolute reference to all rows of a column, ``'Free run'!$C$4:$C$19``."""
        home, column = (sheet, self.columns[sheet][name]) if sheet else self.home(name)
        letter = get_column_letter(column)
        # With the sheet even on its own sheet: the same text then serves in every formula.
        return f"{quote(home)}!${letter}${FIRST_ROW}:${letter}${self.last_row}"

    def last(self, name: str, cell: str) -> str:
        """Value of ``cell``, the last of a column; a bare reference to an empty cell would be 0."""
        column = self.model.column(name)
        gap = column.is_data and column.may_be_missing
        return f'IF(ISNUMBER({cell}),{cell},"")' if gap else cell

    def formula(self, expression: Expr, sheet: str) -> Callable[[int], str]:
        """Formula of a row of ``sheet`` as a function of its row number, ``=`` included.

        The expression is printed once, when the first row is asked for; rows only fill in numbers,
        which keeps large sheets cheap.
        """

        def text(row: int) -> str:
            template, deepest = self._template(expression, sheet)
            return template.format(*(row - back for back in range(deepest + 1)))

        return text

    def _template(self, expression: Expr, sheet: str) -> tuple[str, int]:
        """A formula with a place for every row, and how far back it looks."""
        key = (expression, sheet)
        if key not in self._templates:
            names = _Names(self, sheet)
            code = excel_code(expression, names)
            # The last row has the longest numbers.
            if len(code.format(*repeat(self.last_row, names.depth + 1))) >= HARD_LIMIT:
                raise PrintError(f"a formula on {sheet} is longer than {HARD_LIMIT}: ={code}")
            guard = self._not_there_yet(expression, names) if self.waiting else ""
            template = f'=IF({guard},"",{code})' if guard else f"={code}"
            self._templates[key] = template, names.depth
        return self._templates[key]

    def _not_there_yet(self, expression: Expr, names: _Names) -> str:
        """Condition under which something that an expression reads has no value yet.

        What may be missing for good is not asked for: the expression knows what to do then.
        """
        asked = {cell for test in expression.atoms(Observed) for cell in test.args}
        cells, wholes = set(), set()
        for node in walk(expression):
            if isinstance(node, Indexed) and node not in asked:
                column = self.model.column(str(node.base.label))
                if column.name in self.waiting and not column.may_be_missing:
                    cells.add(names(node))
            elif isinstance(node, Symbol) and node.name in self.waiting:
                cells.add(node.name)
            elif isinstance(node, IndexedBase) and str(node.label) in self.waiting:
                wholes.add(str(node.label))
        tests = [f"COUNT({','.join(sorted(cells))})<{len(cells)}"] if cells else []
        for name in sorted(wholes):
            column = self.model.column(name)
            some = column.may_be_missing or any(rule.has(Missing) for rule in column.start)
            least = "2" if some else f"ROWS({self.range(name)})"
            tests.append(f"COUNT({self.range(name)})<{least}")
        return f"OR({','.join(tests)})" if len(tests) > 1 else "".join(tests)


class _Names:
    """Names of symbols in a formula on one sheet; remembers how far back it looks."""

    def __init__(self, layout: Layout, sheet: str) -> None:
        self.layout, self.sheet, self.depth = layout, sheet, 0

    def __call__(self, node: Basic) -> str | None:
        if node == t:
            # The column stays when a formula is copied to the right: a step is a step there too.
            return f"${get_column_letter(self.layout.columns[self.sheet]['t'])}{{0}}"
        if isinstance(node, Symbol):
            return node.name
        if isinstance(node, Indexed):
            back = int(lag(node))
            self.depth = max(self.depth, back)
            return self._place(str(node.base.label)) + f"{{{back}}}"
        if isinstance(node, Last):
            name = str(node.args[0].label)
            return self.layout.last(name, self._place(name) + str(self.layout.last_row))
        return self.layout.range(str(node.label)) if isinstance(node, IndexedBase) else None

    def _place(self, name: str) -> str:
        """Sheet and column letter; the own sheet is left out, as a person would."""
        if name in self.layout.columns.get(self.sheet, {}):
            return get_column_letter(self.layout.columns[self.sheet][name])
        sheet, column = self.layout.home(name)
        return f"{quote(sheet)}!{get_column_letter(column)}"


def chart_place(number: int) -> tuple[int, int]:
    """Row and column of the note above a chart."""
    return FIRST_CHART_ROW + ROWS_A_CHART * (number // 2), CHART_COLUMNS[number % 2]


def quote(sheet: str) -> str:
    """Sheet name as it stands before the ``!`` of a reference."""
    return sheet if sheet.isidentifier() else quote_sheetname(sheet)
