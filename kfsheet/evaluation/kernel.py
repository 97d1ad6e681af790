"""A recurrence as source for a compiler: the loop of the Python source, in scalars.

A compiler keeps local variables in registers. :mod:`kfsheet.evaluation.compiling` makes machine
code of what is written here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from sympy import Expr

from kfsheet.evaluation.kernel_printer import (
    PRELUDE,
    KernelPrinter,
    balanced,
    carried,
    unless_missing,
)
from kfsheet.evaluation.row_loop import Kernel, RowLoop
from kfsheet.model.expressions import Missing

if TYPE_CHECKING:
    from kfsheet.model.quantities import Column, Scalar
    from kfsheet.model.recurrence import Recurrence


@lru_cache(maxsize=64)
def kernel_of(
    model: Recurrence,
    version: int,
    columns: tuple[str, ...] | None = None,
    scalars: tuple[str, ...] | None = None,
) -> Kernel:
    """The kernel of one version of a model that computes what is named, or everything.

    Its function is ``kernel(first, last, parameters, *data, out, results)``: for members from
    ``first`` to before ``last`` it fills ``out`` (members, columns, rows) and ``results`` (members,
    scalars), and raises an error if one has no value.
    """
    columns = tuple(c.name for c in model.all_columns()) if columns is None else columns
    return KernelSource(model, columns, scalars).kernel()


class KernelSource(RowLoop):
    """Writes a kernel that computes one member after the other."""

    prelude = PRELUDE
    indent = " " * 8

    def __init__(
        self, model: Recurrence, columns: tuple[str, ...], scalars: tuple[str, ...] | None
    ) -> None:
        super().__init__(model, columns, scalars)
        self._code = KernelPrinter(self).rule

    def _lines(self, data: tuple[str, ...], fixed: list[str], body: list[str]) -> list[str]:
        names = "".join(f"kfsheet_all_{name}, " for name in data)
        return [
            "def kernel(kfsheet_first, kfsheet_last, kfsheet_ps, "
            f"{names}kfsheet_outs, kfsheet_rs):",
            "    rows = kfsheet_outs.shape[2]",
            "    for kfsheet_k in range(kfsheet_first, kfsheet_last):",
            # What follows from the parameters is computed once where all members share them.
            "        if kfsheet_k == kfsheet_first or kfsheet_ps.shape[0] > 1:",
            "            kfsheet_p = kfsheet_ps[min(kfsheet_k, kfsheet_ps.shape[0] - 1)]",
            "            kfsheet_bad = 0.0  # NaN as soon as anything is not finite",
            *(f"            {n} = kfsheet_p[{k}]" for k, n in enumerate(self.model.parameters)),
            *(f"    {line}" for line in fixed),
            "            kfsheet_fixed = kfsheet_bad",
            "        kfsheet_bad = kfsheet_fixed",
            "        kfsheet_out = kfsheet_outs[kfsheet_k - kfsheet_first]",
            *self._data_lines(data),
            *body,
            "        if kfsheet_bad != 0:",
            '            raise OverflowError("it grows beyond 1e308")',
            *(
                f"        kfsheet_rs[kfsheet_k - kfsheet_first, {n}] = {name}"
                for n, name in enumerate(self.scalars)
            ),
        ]

    def _data_lines(self, data: tuple[str, ...]) -> Iterator[str]:
        for name in data:
            every = f"kfsheet_all_{name}"
            yield f"        {name} = {every}[min(kfsheet_k, {every}.shape[0] - 1)]"
            if name in self.stored:
                yield f"        kfsheet_out[{self.stored[name]}] = {name}"

    def _scalar_lines(self, scalars: Iterable[Scalar]) -> Iterator[str]:
        for s in scalars:
            yield f"        {s.name} = float({self._code(s.expression)})"
            yield f"        kfsheet_bad += {unless_missing(s.name)}"

    def _formula(self, name: str, rule: Expr, indent: str) -> Iterator[str]:
        yield f"{indent}{name} = float({self._code(rule)})"

    def _rows(self, rows: list[list[Column]]) -> Iterator[str]:
        yield from super()._rows(rows)
        *starts, general = rows
        if general and len(starts) < self.model.rows:
            yield f"        kfsheet_bad += {self._finite(general, len(starts))}"

    def _tests(self, columns: Sequence[Column], row: int, in_loop: bool) -> str:
        if in_loop:
            # What is infinite makes those infinite that carry it, up to the end of the table.
            # But not into a column that may be empty, where NaN is not told from a gap.
            whole = [c.expression for c in columns if not c.expression.has(Missing)]
            seen_later = {name for expression in whole for name in carried(expression)}
            columns = [c for c in columns if c.name not in seen_later]
        return self._finite(columns, row)

    def _finite(self, columns: Sequence[Column], row: int) -> str:
        """0, or NaN if one is not finite; NaN is fine where the rule may give no value."""
        tests = [
            unless_missing(c.name) if c.definition(row).has(Missing) else f"({c.name} - {c.name})"
            for c in columns
        ]
        return balanced(tests) if tests else ""
