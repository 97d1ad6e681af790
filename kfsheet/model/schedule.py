"""In which order the cells of a recurrence can be computed.

Columns are computed row by row. A column that reads a summary (the mean of a whole column) has to
wait for a pass of its own. Within a row, columns are sorted so that each comes after those it
reads in the same row.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol

from sympy import Basic

from kfsheet.errors import ModelError
from kfsheet.model.expressions import REMEMBERED, column_references, columns_read, lag, scalars
from kfsheet.model.quantities import Column, Scalar


class Definitions(Protocol):
    """What an order is found for: named definitions, of columns and of scalars."""

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Scalars that are there from the start."""

    @property
    def derived_scalars(self) -> Mapping[str, Scalar]:
        """Formulas of parameters."""

    @property
    def summaries(self) -> Mapping[str, Scalar]:
        """Formulas of whole columns."""

    def all_columns(self) -> list[Column]:
        """Every column, the clock first."""

    def column(self, name: str) -> Column:
        """A column by its name."""


@dataclass(frozen=True)
class Pass:
    """One run through all rows: ``rows[k]`` is the order in row k, the last one in all others."""

    rows: tuple[tuple[Column, ...], ...]
    summaries: tuple[Scalar, ...]


def schedule(model: Definitions) -> list[Pass]:
    """Passes in order; raises ModelError for a circular definition, naming the circle."""
    level = _levels(model)
    formulas = [c for c in model.all_columns() if not c.is_data and c.expression is not None]
    passes = []
    for number in range(max(level.values(), default=0) + 1):
        columns = [c for c in formulas if level[c.name] == number]
        starts = max((len(c.start) for c in columns), default=0)
        rows = tuple(tuple(_in_order(columns, row)) for row in range(starts + 1))
        after = tuple(s for s in model.summaries.values() if level[s.name] == number + 1)
        passes.append(Pass(rows, after))
    return [p for p in passes if p.rows[0] or p.summaries]


def refuse_circle(model: Definitions, new: Column) -> None:
    """Raise ModelError if a column that was just defined closes a circle.

    It must wait for itself, in its own row or through a summary of a whole column; the order of all
    columns, which takes long, is found only to say which circle it is.
    """
    # A summary waits for a whole column, so it closes a circle whatever the lag.
    reads = needed(model, [new.name]) & set(model.summaries)
    if new.name in needed(model, reads) or _waits_for_itself(model, new.name):
        schedule(model)


def _waits_for_itself(model: Definitions, name: str) -> bool:
    """Whether a column needs itself in the same row."""
    seen: set[str] = set()
    todo = [name]
    while todo:
        rules = model.column(todo.pop()).rules
        waits_for = {other for rule in rules for other in same_row(rule)}
        if name in waits_for:
            return True
        todo += waits_for - seen
        seen |= waits_for
    return False


def _levels(model: Definitions) -> dict[str, int]:
    """Pass in which a column is computed; a summary stands one level above its columns."""
    columns, summaries = model.all_columns(), model.summaries
    level = {item.name: 0 for item in (*columns, *summaries.values())}
    # Raise levels until nothing moves. Without a circle that takes at most one round for each name
    # (as Bellman and Ford find longest paths); a circle raises itself for ever.
    for _ in range(len(level) + 1):
        before = dict(level)
        for column in columns:
            level[column.name] = max(map(_level_of(level), column.rules), default=0)
        for summary in summaries.values():
            below = [level[name] + 1 for name in columns_read(summary.expression)]
            level[summary.name] = max([*below, _level_of(level)(summary.expression)])
        if level == before:
            return level
    names = ", ".join(name for name in level if level[name] > len(summaries))
    raise ModelError(f"circular definition through a summary: {names}")


def _level_of(level: dict[str, int]):
    def of(expression: Basic) -> int:
        names = columns_read(expression) | {s.name for s in scalars(expression)}
        return max((level.get(name, 0) for name in names), default=0)

    return of


def _in_order(columns: Iterable[Column], row: int) -> list[Column]:
    waiting = {c.name: (c, same_row(c.definition(row))) for c in columns}
    ordered: list[Column] = []
    while waiting:
        ready = next(
            (name for name, (_, reads) in waiting.items() if not reads & set(waiting)), None
        )
        if ready is None:
            reads = {name: reads & set(waiting) for name, (_, reads) in waiting.items()}
            circle = " -> ".join(_circle(reads))
            raise ModelError(f"circular definition within a row: {circle}")
        ordered.append(waiting.pop(ready)[0])
    return ordered


def _circle(reads: dict[str, set[str]]) -> list[str]:
    """Follow what each column waits for until a name comes back; every one waits for another."""
    path = [next(iter(reads))]
    while True:
        # Any that it waits for will do; the smallest name makes the message the same every time.
        following = min(reads[path[-1]])
        if following in path:
            return [*path[path.index(following) :], following]
        path.append(following)


@lru_cache(maxsize=REMEMBERED)
def same_row(expression: Basic) -> frozenset[str]:
    """Names of the columns that an expression reads in its own row."""
    return frozenset(str(c.base.label) for c in column_references(expression) if lag(c) == 0)


def needed(model: Definitions, names: Iterable[str]) -> set[str]:
    """Everything that must be computed for some columns and scalars, themselves included."""
    formulas = {**model.derived_scalars, **model.summaries}
    found: set[str] = set()
    todo = list(names)
    while todo:
        name = todo.pop()
        if name in found or name in model.parameters:
            continue
        found.add(name)
        item = formulas.get(name) or model.column(name)
        for rule in item.rules:
            todo += columns_read(rule) | {s.name for s in scalars(rule)} & set(formulas)
    return found
