"""What follows from an answer, row by row, and the parameters in its definition."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from math import inf

from sympy import Basic

from kfsheet.model.expressions import column_references, columns_read, lag, scalars
from kfsheet.model.quantities import Column, Scalar
from kfsheet.model.recurrence import Recurrence


@lru_cache(maxsize=1_000)
def delays(model: Recurrence, name: str) -> dict[str, float]:
    """What depends on a quantity, and after how many rows at the earliest.

    A value of column ``c`` in row ``k`` may depend on one of ``name`` in row ``n`` only if
    ``k - n >= delays[c]``. What follows from all rows, by way of a scalar, has -infinity.
    """
    items = [*model.derived_scalars.values(), *model.summaries.values(), *model.all_columns()]
    found: dict[str, float] = {name: 0.0 if name in model.table else -inf}
    # Shortest ways, found as Bellman and Ford do: no way is shorter than its lags, which are >= 0.
    changed = True
    while changed:
        changed = False
        for item in items:
            least = min((_delay(item, rule, found) for rule in item.rules), default=inf)
            if least < found.get(item.name, inf):
                found[item.name], changed = least, True
    return found


def _delay(item: Column | Scalar, rule: Basic, found: dict[str, float]) -> float:
    return min(_ways(item, rule, found), default=inf)


def _ways(item: Column | Scalar, rule: Basic, found: dict[str, float]) -> Iterator[float]:
    if any(symbol.name in found for symbol in scalars(rule)):
        yield -inf
    for cell in column_references(rule):
        if (before := found.get(str(cell.base.label))) is not None:
            yield before + int(lag(cell))
    if isinstance(item, Scalar) and found.keys() & columns_read(rule):
        yield -inf  # a sum over a column follows from every row of it


def _defined(model: Recurrence, name: str) -> Column | Scalar | None:
    scalars_too = {**model.derived_scalars, **model.summaries}
    return model.table.get(name) or scalars_too.get(name)


@lru_cache(maxsize=1_000)
def parameters_of(model: Recurrence, name: str) -> tuple[str, ...]:
    """Parameters that stand in the definition of a quantity, or in that of a scalar in it."""
    found: set[str] = set()
    waiting = [name]
    while waiting:
        item = _defined(model, waiting.pop())
        names = {symbol.name for rule in item.rules for symbol in scalars(rule)}
        waiting += names & model.derived_scalars.keys() - found
        found |= names
    return tuple(p for p in model.parameters if p in found)


def closed(following: Mapping[str, set[str]], names: Iterable[str]) -> set[str]:
    """Names, what follows them, what follows that, and so on."""
    found, waiting = set(names), list(names)
    while waiting:
        more = following.get(waiting.pop(), set()) - found
        found |= more
        waiting += more
    return found
