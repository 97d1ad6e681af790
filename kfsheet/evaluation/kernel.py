"""A recurrence as source for a compiler: the loop of the Python source, in scalars.

Only the columns that somebody wants are stored; all others are local variables, which a compiler
keeps in registers. :mod:`kfsheet.evaluation.compiling` makes machine code of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from sympy import Expr

from kfsheet.evaluation.kernel_printer import (
    CHEAP,
    PRELUDE,
    KernelPrinter,
    balanced,
    carried,
    unless_missing,
)
from kfsheet.model.expressions import Missing, column_references, lag
from kfsheet.model.schedule import Pass, needed
from kfsheet.model.validation import columns_read

if TYPE_CHECKING:
    from kfsheet.model.quantities import Column
    from kfsheet.model.recurrence import Recurrence


@dataclass(frozen=True)
class Kernel:
    """Source of a function ``kernel(first, last, parameters, *data, out, results)``.

    ``columns`` and ``scalars`` name what it stores, in order; ``parameters`` and ``data`` what it
    takes, in order.
    """

    source: str
    parameters: tuple[str, ...]
    data: tuple[str, ...]
    columns: tuple[str, ...]
    scalars: tuple[str, ...]


@lru_cache(maxsize=64)
def kernel_of(
    model: Recurrence,
    version: int,
    columns: tuple[str, ...] | None = None,
    scalars: tuple[str, ...] | None = None,
) -> Kernel:
    """The kernel of one version of a model that computes what is named, or everything."""
    columns = tuple(c.name for c in model.all_columns()) if columns is None else columns
    return KernelSource(model, columns, scalars).kernel()


class KernelSource:
    """Writes the kernel of a model, leaving out what nothing wanted needs.

    All scalars are wanted where none are named.
    """

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
        self._code = KernelPrinter(self).rule

    def kernel(self) -> Kernel:
        """The kernel, and what it takes and stores."""
        parameters = tuple(self.model.parameters)
        columns = self.model.table.values()
        data = tuple(c.name for c in columns if c.is_data and c.name in self.needed)
        derived = self.model.derived_scalars.values()
        fixed = self._scalar_lines(s for s in derived if s.name in self.needed)
        self._in_rows = True
        body = list(self._body())
        fixed += [f"        {name} = {text}" for text, name in self._once.items()]
        source = "\n".join([PRELUDE, *self._lines(data, fixed, body), ""])
        return Kernel(source, parameters, data, tuple(self.stored), self.scalars)

    def cell(self, name: str, back: int) -> str:
        """A column in this row or in one before."""
        row = f"t - {back}" if back else "t"
        if self.model.column(name).is_data:
            return self.datum(name, back)
        if self.level[name] < self.now:
            return f"kfsheet_out[{self.stored[name]}, {row}]"
        return self.before(name, back)

    def datum(self, name: str, back: int) -> str:
        """A datum of this row or of one before."""
        return f"{name}[{f't - {back}' if back else 't'}]"

    def before(self, name: str, back: int) -> str:
        """What a row before has handed on; of this row, its local variable."""
        return f"kfsheet_{back}_{name}" if back else name

    def place(self, name: str) -> str:
        """Where a column that is stored leaves its value of this row."""
        return f"kfsheet_out[{self.stored[name]}, t]"

    def call(self, name: str, arguments: Sequence[Expr], text: str, in_branch: bool) -> str:
        """A call, computed before the first row if it is costly and the same in every row."""
        # In a branch that is not taken it may have no value, so it stays there.
        if name in CHEAP or in_branch or not self.is_fixed(arguments):
            return text
        return self._once.setdefault(text, f"kfsheet_once_{len(self._once)}")

    def divide(self, factors: Sequence[Expr], text: str, in_branch: bool) -> None:
        """Told of every division: by which factors, as which text."""

    def is_fixed(self, expressions: Sequence[Expr]) -> bool:
        """Whether expressions in a row have the same value in every row."""
        fixed = {*self.model.parameters, *self.model.derived_scalars}
        names = {s.name for e in expressions for s in e.free_symbols}
        return self._in_rows and names <= fixed

    def whole(self, name: str) -> str:
        """A column as an array, for an aggregate."""
        return name if self.model.column(name).is_data else f"kfsheet_out[{self.stored[name]}]"

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

    # -- lines -------------------------------------------------------------------------------

    def _lines(self, data: tuple[str, ...], fixed: list[str], body: list[str]) -> list[str]:
        good = "        kfsheet_bad = kfsheet_fixed"
        return [*self._head(data, fixed), good, *self._member(data), *body, *self._tail()]

    def _head(self, data: tuple[str, ...], fixed: list[str]) -> list[str]:
        """What follows from the parameters, computed once where all members share them."""
        return [
            *self._definition(data),
            "    for kfsheet_k in range(kfsheet_first, kfsheet_last):",
            "        if kfsheet_k == kfsheet_first or kfsheet_ps.shape[0] > 1:",
            "            kfsheet_p = kfsheet_ps[min(kfsheet_k, kfsheet_ps.shape[0] - 1)]",
            "            kfsheet_bad = 0.0  # NaN as soon as anything is not finite",
            *(f"            {n} = kfsheet_p[{k}]" for k, n in enumerate(self.model.parameters)),
            *(f"    {line}" for line in fixed),
            "            kfsheet_fixed = kfsheet_bad",
        ]

    def _definition(self, data: tuple[str, ...]) -> list[str]:
        # Everything of ours begins with kfsheet_, which no name of a model does.
        names = "".join(f"kfsheet_all_{name}, " for name in data)
        return [
            "def kernel(kfsheet_first, kfsheet_last, kfsheet_ps, "
            f"{names}kfsheet_outs, kfsheet_rs):",
            "    rows = kfsheet_outs.shape[2]",
        ]

    def _member(self, data: tuple[str, ...]) -> list[str]:
        lines = ["        kfsheet_out = kfsheet_outs[kfsheet_k - kfsheet_first]"]
        for name in data:
            every = f"kfsheet_all_{name}"
            lines.append(f"        {name} = {every}[min(kfsheet_k, {every}.shape[0] - 1)]")
            if name in self.stored:
                lines.append(f"        kfsheet_out[{self.stored[name]}] = {name}")
        return lines

    def _scalar_lines(self, scalars: Iterator) -> list[str]:
        lines = []
        for s in scalars:
            lines.append(f"        {s.name} = float({self._code(s.expression)})")
            lines.append(f"        kfsheet_bad += {unless_missing(s.name)}")
        return lines

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
        depth = self._depths(general)
        yield from self._unknown(depth, " " * 8)
        for row, columns in enumerate(starts):
            yield f"        t = {row}"
            yield from self._one_row(columns, row, depth, " " * 8)
            yield from self._test(columns, row, " " * 8)
        loop = len(starts)
        if loop == self.model.rows:
            return
        yield f"        for t in range({loop}, rows):"
        yield from self._one_row(general, loop, depth, " " * 12)
        # What is infinite makes those infinite that carry it, up to the end of the table.
        # But not into a column that may be empty, where NaN is not told from a gap.
        whole = [c.expression for c in general if not c.expression.has(Missing)]
        seen_later = {name for expression in whole for name in carried(expression)}
        yield from self._test([c for c in general if c.name not in seen_later], loop, " " * 12)
        yield from self._test(general, loop, " " * 8)

    def _unknown(self, depth: dict[str, int], indent: str) -> Iterator[str]:
        """Before the first row nothing was handed on."""
        for name, deepest in depth.items():
            for back in range(1, deepest + 1):
                yield f"{indent}{self.before(name, back)} = nan"

    def _test(self, columns: Sequence[Column], row: int, indent: str) -> Iterator[str]:
        """Note what is not finite in a row; NaN is fine where the rule may give no value."""
        tests = [
            unless_missing(c.name) if c.definition(row).has(Missing) else f"({c.name} - {c.name})"
            for c in columns
        ]
        yield f"{indent}kfsheet_bad += {balanced(tests) if tests else 0.0}"

    def _one_row(
        self, columns: Sequence[Column], row: int, depth: dict[str, int], indent: str
    ) -> Iterator[str]:
        for column in columns:
            rule = column.definition(row)
            yield f"{indent}{column.name} = float({self._code(rule)})"
            if column.name in self.stored:
                yield f"{indent}{self.place(column.name)} = {column.name}"
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

    def _tail(self) -> list[str]:
        return [
            "        if kfsheet_bad != 0:",
            '            raise OverflowError("it grows beyond 1e308")',
            *self._results(),
        ]

    def _results(self) -> list[str]:
        return [
            f"        kfsheet_rs[kfsheet_k - kfsheet_first, {n}] = {name}"
            for n, name in enumerate(self.scalars)
        ]
