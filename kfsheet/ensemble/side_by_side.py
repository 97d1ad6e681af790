"""The kernel of many members, several of them side by side.

A processor adds eight numbers as fast as one. Where the formulas of a row are plain arithmetic, and
all members share their parameters, the innermost loop goes over a block of members, and the
compiler makes vector instructions of it. Each member's numbers are those that the kernel of
:mod:`kfsheet.evaluation.kernel` computes, to the last bit: the operations and their order are the
same.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from sympy import Expr

from kfsheet.evaluation.kernel import Kernel, KernelSource, kernel_of
from kfsheet.evaluation.kernel_printer import CHEAP

if TYPE_CHECKING:
    from kfsheet.model.quantities import Column
    from kfsheet.model.recurrence import Recurrence

WIDTH = 8
"""Members of a block: as many doubles as the widest vectors hold."""


@lru_cache(maxsize=64)
def kernel_for_many(
    model: Recurrence,
    version: int,
    columns: tuple[str, ...],
    scalars: tuple[str, ...] | None = None,
) -> Kernel:
    """The kernel for members that share their parameters: side by side where that is of use."""
    source = _Lanes(model, columns, scalars)
    kernel = source.kernel()
    return kernel if source.is_plain else kernel_of(model, version, columns, scalars)


class _Lanes(KernelSource):
    """Writes the kernel of a model for blocks of members.

    Whatever goes in or out of a row stands in one array, ``kfsheet_lanes[place, lane]``. Its shape
    is a constant, from which the compiler sees that no two places overlap.
    """

    def __init__(
        self, model: Recurrence, columns: tuple[str, ...], scalars: tuple[str, ...] | None
    ) -> None:
        super().__init__(model, columns, scalars)
        rows = [bool(self._rows_of(step)[-1]) for step in self.passes]
        self.is_plain = any(rows[:1]) and not any(rows[1:])
        """Whether the compiler can make vectors of a row: there is nothing to call or refuse."""

        self._places: dict[object, int] = {}
        self._data: set[tuple[str, int]] = set()  # read by the row that is being written

    def datum(self, name: str, back: int) -> str:
        self._data.add((name, back))
        return self._place("datum", name, back)

    def before(self, name: str, back: int) -> str:
        return self._place("before", name, back) if back else name

    def place(self, name: str) -> str:
        return self._place("out", name)

    def _place(self, *what: object) -> str:
        return f"kfsheet_lanes[{self._places.setdefault(what, len(self._places))}, kfsheet_lane]"

    def call(self, name: str, arguments: Sequence[Expr], text: str, in_branch: bool) -> str:
        found = super().call(name, arguments, text, in_branch)
        if self._in_rows and found == text and name not in CHEAP:
            self.is_plain = False
        return found

    def divide(self, factors: Sequence[Expr], text: str, in_branch: bool) -> None:
        if not self._in_rows or all(factor.is_Number for factor in factors):
            return
        if in_branch or not self.is_fixed(factors):
            self.is_plain = False
        else:  # refused before the first row if it is 0, so that no row has to ask
            self._once.setdefault(f"1/{text}", f"kfsheet_once_{len(self._once)}")

    # -- lines -------------------------------------------------------------------------------

    def _lines(self, data: tuple[str, ...], fixed: list[str], body: list[str]) -> list[str]:
        self._in_rows = False
        summaries = (s for step in self.passes for s in step.summaries if s.name in self.needed)
        member = [*self._member(data), *self._scalar_lines(summaries), *self._tail()]
        return [
            *self._definition(data),
            *(f"    {n} = kfsheet_ps[0, {k}]" for k, n in enumerate(self.model.parameters)),
            "    kfsheet_bad = 0.0  # NaN as soon as anything is not finite",
            *(line.removeprefix("    ") for line in fixed),
            "    kfsheet_fixed = kfsheet_bad",
            f"    kfsheet_lanes = empty(({len(self._places)}, {WIDTH}))",
            f"    for kfsheet_block in range(kfsheet_first, kfsheet_last, {WIDTH}):",
            f"        kfsheet_end = min(kfsheet_block + {WIDTH}, kfsheet_last)",
            *body,
            "        for kfsheet_k in range(kfsheet_block, kfsheet_end):",
            "            kfsheet_lane = kfsheet_k - kfsheet_block",
            *(f"    {line}" for line in member),
        ]

    def _member(self, data: tuple[str, ...]) -> list[str]:
        return [*super()._member(data), f"        kfsheet_bad = {self._place('bad')}"]

    def _body(self) -> Iterator[str]:
        for step in self.passes[:1]:
            yield from self._rows(self._rows_of(step))

    def _rows(self, rows: list[list[Column]]) -> Iterator[str]:
        """As in a kernel of one member; but the innermost loop goes over the block."""
        *starts, general = rows
        depth = self._depths(general)
        yield f"        for kfsheet_lane in range({WIDTH}):"
        yield f"            {self._place('bad')} = kfsheet_fixed"
        yield from self._unknown(depth, " " * 12)
        for row, columns in enumerate(starts):
            yield f"        t = {row}"
            yield from self._block(columns, row, depth, " " * 8)
        if len(starts) < self.model.rows:
            yield f"        for t in range({len(starts)}, rows):"
            yield from self._block(general, len(starts), depth, " " * 12)

    def _block(
        self, columns: Sequence[Column], row: int, depth: dict[str, int], indent: str
    ) -> Iterator[str]:
        """One row of a block: fetch its data, compute, bring away what is stored."""
        inner, bad = f"{indent}    ", self._place("bad")
        self._data.clear()
        computed = [*self._one_row(columns, row, depth, inner), *self._test(columns, row, inner)]
        yield f"{indent}for kfsheet_lane in range({WIDTH}):"
        yield f"{inner}kfsheet_k = min(kfsheet_block + kfsheet_lane, kfsheet_last - 1)"
        for name, back in sorted(self._data):
            every, now = f"kfsheet_all_{name}", f"t - {back}" if back else "t"
            member = f"min(kfsheet_k, {every}.shape[0] - 1)"
            yield f"{inner}{self.datum(name, back)} = {every}[{member}, {now}]"
        yield f"{indent}for kfsheet_lane in range({WIDTH}):"
        yield f"{inner}kfsheet_bad = {bad}"
        yield from computed
        yield f"{inner}{bad} = kfsheet_bad"
        yield f"{indent}for kfsheet_lane in range(kfsheet_end - kfsheet_block):"
        yield f"{inner}kfsheet_out = kfsheet_outs[kfsheet_block - kfsheet_first + kfsheet_lane]"
        for name in (c.name for c in columns if c.name in self.stored):
            yield f"{inner}kfsheet_out[{self.stored[name]}, t] = {self.place(name)}"
