"""A recurrence as NumPy source in which every cell is an array over the members of a group.

A number that all members share stays a number. Nothing has to be compiled, and a row costs hardly
more for two hundred members than for one.

What has no value is not looked for: the source runs while NumPy raises an error for an overflow, a
division by zero and whatever is undefined, and Python is then asked, member by member. So the
source may raise too many errors (in what a branch does not take), but never too few.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from sympy import Expr

from kfsheet.ensemble import array_functions
from kfsheet.ensemble.array_printer import ArrayPrinter
from kfsheet.evaluation.row_loop import Kernel, RowLoop
from kfsheet.model.expressions import Missing
from kfsheet.model.expressions import scalars as scalars_in

if TYPE_CHECKING:
    from kfsheet.model.quantities import Column, Scalar
    from kfsheet.model.recurrence import Recurrence


@lru_cache(maxsize=64)
def arrays_of(
    model: Recurrence, version: int, columns: tuple[str, ...], scalars: tuple[str, ...] | None
) -> Kernel:
    """The array source of one version of a model, and what it takes and stores.

    Its function is ``kernel(parameters, *data, out, results)``. Parameters are numbers or arrays
    over the members, data arrays (rows,) or (rows, members); it fills ``out`` (columns, rows,
    members) and ``results`` (scalars, members). It returns NaN for a member that lacks a value
    where none may be missing, 0 for the others.
    """
    return ArraySource(model, columns, scalars).kernel()


@lru_cache(maxsize=64)
def array_function(source: str) -> Callable[..., Any]:
    """The function of an array source; to be called while NumPy raises floating-point errors."""
    namespace = dict(vars(array_functions))
    exec(compile(source, "<arrays>", "exec"), namespace)  # printed by us
    return namespace["kernel"]


class ArraySource(RowLoop):
    """Writes a kernel that computes all members of a group at once."""

    def __init__(
        self, model: Recurrence, columns: tuple[str, ...], scalars: tuple[str, ...] | None
    ) -> None:
        super().__init__(model, columns, scalars)
        self._printer = ArrayPrinter(self.cell, self.whole, self._called, self.keep)
        self._kept: dict[str, str] = {}  # of this row, by text
        self._waiting: list[str] = []  # lines that the next formula needs

    def whole(self, name: str) -> str:
        """A column as an array (rows, members), for an aggregate."""
        # That of a datum which all members share is (rows, 1).
        is_data = self.model.column(name).is_data
        return f"{name}.reshape(rows, -1)" if is_data else super().whole(name)

    def keep(self, text: str) -> str:
        """A name for what a row computes once, whichever formulas ask for it."""
        if text.isidentifier():
            return text
        if text not in self._kept:
            self._kept[text] = f"kfsheet_{len(self._kept)}"
            self._waiting.append(f"{self._kept[text]} = {text}")
        return self._kept[text]

    def _called(self, name: str, arguments: Sequence[Expr], text: str, in_branch: bool) -> str:
        return self.keep(self.call(name, arguments, text, in_branch))

    # -- lines -------------------------------------------------------------------------------

    def _lines(self, data: tuple[str, ...], fixed: list[str], body: list[str]) -> list[str]:
        given = "".join(f"{name}, " for name in data)
        stored = [name for name in data if name in self.stored]
        return [
            f"def kernel(kfsheet_p, {given}kfsheet_out, kfsheet_rs):",
            "    rows = kfsheet_out.shape[1]",
            "    kfsheet_bad = 0.0",
            *(f"    {n} = kfsheet_p[{k}]" for k, n in enumerate(self.model.parameters)),
            *fixed,
            *(f"    kfsheet_out[{self.stored[n]}] = {self.whole(n)}" for n in stored),
            *body,
            *(f"    kfsheet_rs[{n}] = {name}" for n, name in enumerate(self.scalars)),
            "    return kfsheet_bad",
        ]

    def _scalar_lines(self, scalars: Iterable[Scalar]) -> Iterator[str]:
        self._kept.clear()
        for s in scalars:
            yield from self._formula(s.name, s.expression, self.indent)

    def _one_row(self, *what: Any, **how: Any) -> Iterator[str]:
        self._kept.clear()
        yield from super()._one_row(*what, **how)

    def _formula(self, name: str, rule: Expr, indent: str) -> Iterator[str]:
        text = self._printer.value(rule)
        yield from (indent + line for line in self._waiting)
        self._waiting.clear()
        yield f"{indent}{name} = {text}"

    def _tests(self, columns: Sequence[Column], row: int, in_loop: bool) -> str:
        """Left to find is what NaN passes into: a summary of nothing, which no model guards."""
        summaries = set(self.model.summaries)
        rules = {c.name: c.definition(row) for c in columns}
        unsure = [
            name
            for name, rule in rules.items()
            if not rule.has(Missing) and summaries & {s.name for s in scalars_in(rule)}
        ]
        return f"0*({' + '.join(unsure)})" if unsure else ""
