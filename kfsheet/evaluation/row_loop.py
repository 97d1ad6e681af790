"""The loop over the rows of a recurrence as source: what is computed, in which order, and kept.

Only the columns that somebody wants are stored; all others are local variables, and those of the
row before have names of their own. A subclass says in which language, and what is tested.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sympy import Expr

from kfsheet.model.expressions import column_references, columns_read, lag
from kfsheet.model.schedule import Pass, needed

if TYPE_CHECKING:
    from kfsheet.model.quantities import Column, Scalar
    from kfsheet.model.recurrence import Recurrence

CHEAP = ("**", "fabs", "observed", "sign")
"""Calls, and the power of a whole number, that are plain arithmetic to a processor."""


@dataclass(frozen=True)
class Kernel:
    """Source of a function ``kernel`` that fills arrays with columns and scalars.

    ``columns`` and ``scalars`` name what it stores, in order; ``parameters`` and ``data`` what it
    takes, in order.
    """

    source: str
    parameters: tuple[str, ...]
    data: tuple[str, ...]
    columns: tuple[str, ...]
    scalars: tuple[str, ...]


class RowLoop:
    """Writes the kernel of a model, leaving out what nothing wanted needs.

    All scalars are wanted where none are named. Everything of ours begins with kfsheet_, which no
    name of a model does.
    """

    prelude = ""
    indent = " " * 4
    """Before what is computed for one member, or for one group."""

    def __init__(
        self, model: Recurrence, columns: tuple[str, ...], scalars: tuple[str, ...] | None
    ) -> None:
        every = (*model.derived_scalars, *model.summaries)
        self.model, self.columns = model, columns
        self.scalars = every if scalars is None else scalars
        self.passes = model.passes()
        self.level = {c.name: n for n, p in enumerate(self.passes) for c in p.rows[-1]}
        self.needed = needed(model, (*columns, *self.scalars))
        self.stored = self._stored()
        self.now = 0
        self._once: dict[str, str] = {}
        self._in_rows = False

    def kernel(self) -> Kernel:
        """The kernel, and what it takes and stores."""
        parameters = tuple(self.model.parameters)
        columns = self.model.table.values()
        data = tuple(c.name for c in columns if c.is_data and c.name in self.needed)
        derived = self.model.derived_scalars.values()
        fixed = [*self._scalar_lines(s for s in derived if s.name in self.needed)]
        self._in_rows = True
        body = [*self._body()]
        fixed += [f"{self.indent}{name} = {text}" for text, name in self._once.items()]
        source = "\n".join([self.prelude, *self._lines(data, fixed, body), ""])
        return Kernel(source, parameters, data, tuple(self.stored), self.scalars)

    def _stored(self) -> dict[str, int]:
        """Row of ``out`` for every column that is wanted, aggregated or read by a later pass."""
        formulas = [c for c in self.model.all_columns() if not c.is_data and c.name in self.needed]
        kept = {name for name in self.columns if name in self.level}
        for summary in self.model.summaries.values():
            if summary.name in self.needed:
                kept |= columns_read(summary.expression)
        for column in formulas:
            later = {n for rule in column.rules for n in columns_read(rule)}
            kept |= {n for n in later if self.level.get(n, 99) < self.level[column.name]}
        extra = [c.name for c in formulas if c.name in kept and c.name not in self.columns]
        return {name: n for n, name in enumerate([*self.columns, *extra])}

    # -- what a printer asks -----------------------------------------------------------------

    def cell(self, name: str, back: int) -> str:
        """A column in this row or in one before."""
        row = f"t - {back}" if back else "t"
        if self.model.column(name).is_data:
            return f"{name}[{row}]"
        if self.level[name] < self.now:
            return f"kfsheet_out[{self.stored[name]}, {row}]"
        return self.before(name, back)

    def before(self, name: str, back: int) -> str:
        """What a row before has handed on; of this row, its local variable."""
        return f"kfsheet_{back}_{name}" if back else name

    def whole(self, name: str) -> str:
        """A column as an array, for an aggregate."""
        return name if self.model.column(name).is_data else f"kfsheet_out[{self.stored[name]}]"

    def call(self, name: str, arguments: Sequence[Expr], text: str, in_branch: bool) -> str:
        """A call, computed before the first row if it is costly and the same in every row."""
        # In a branch that is not taken it may have no value, so it stays there.
        if name in CHEAP or in_branch or not self._is_fixed(arguments):
            return text
        return self._once.setdefault(text, f"kfsheet_once_{len(self._once)}")

    def _is_fixed(self, expressions: Sequence[Expr]) -> bool:
        fixed = {*self.model.parameters, *self.model.derived_scalars}
        names = {s.name for e in expressions for s in e.free_symbols}
        return self._in_rows and names <= fixed

    # -- lines -------------------------------------------------------------------------------

    def _lines(self, data: tuple[str, ...], fixed: list[str], body: list[str]) -> list[str]:
        """The function: what is computed once, and what in every row."""
        raise NotImplementedError

    def _scalar_lines(self, scalars: Iterable[Scalar]) -> Iterator[str]:
        raise NotImplementedError

    def _formula(self, name: str, rule: Expr, indent: str) -> Iterator[str]:
        """The value of a cell."""
        raise NotImplementedError

    def _tests(self, columns: Sequence[Column], row: int, in_loop: bool) -> str:
        """What is added to kfsheet_bad after a row: NaN where a value is none; or nothing, ''."""
        raise NotImplementedError

    def _body(self) -> Iterator[str]:
        for number, step in enumerate(self.passes):
            self.now = number
            yield from self._rows(self._rows_of(step))
            yield from self._scalar_lines(s for s in step.summaries if s.name in self.needed)

    def _rows_of(self, step: Pass) -> list[list[Column]]:
        """The columns that are needed, row by row."""
        return [[c for c in row if c.name in self.needed] for row in step.rows]

    def _rows(self, rows: list[list[Column]]) -> Iterator[str]:
        """The start rows one by one, then the loop; lags are shifted at the end of each row."""
        *starts, general = rows
        if not general:
            return
        depth, first = self._depths(general), len(starts)
        for name, deepest in depth.items():  # before the first row nothing was handed on
            for back in range(1, deepest + 1):
                yield f"{self.indent}{self.before(name, back)} = nan"
        for row, columns in enumerate(starts):
            yield f"{self.indent}t = {row}"
            yield from self._one_row(columns, row, depth, self.indent)
        if first < self.model.rows:
            yield f"{self.indent}for t in range({first}, rows):"
            yield from self._one_row(general, first, depth, f"{self.indent}    ", in_loop=True)

    def _one_row(
        self,
        columns: Sequence[Column],
        row: int,
        depth: dict[str, int],
        indent: str,
        in_loop: bool = False,
    ) -> Iterator[str]:
        for column in columns:
            yield from self._formula(column.name, column.definition(row), indent)
            if column.name in self.stored:
                place = f"kfsheet_out[{self.stored[column.name]}, t]"
                yield f"{indent}{place} = {column.name}"
        if tests := self._tests(columns, row, in_loop):
            yield f"{indent}kfsheet_bad = kfsheet_bad + {tests}"
        for name, deepest in depth.items():
            for back in range(deepest, 0, -1):
                yield f"{indent}{self.before(name, back)} = {self.before(name, back - 1)}"

    def _depths(self, columns: Sequence[Column]) -> dict[str, int]:
        """How far back each column of this pass is read."""
        depth: dict[str, int] = {}
        for column in columns:
            for rule in column.rules:
                for cell in sorted(column_references(rule), key=str):
                    name, back = str(cell.base.label), int(lag(cell))
                    same_pass = self.level.get(name) == self.now
                    if back and same_pass and not self.model.column(name).is_data:
                        depth[name] = max(depth.get(name, 0), back)
        return depth
