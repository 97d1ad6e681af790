"""Which answers an answer needs, and how far it can be right while those are right so far."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

from sympy import Expr, Indexed

from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import columns_read, lag, scalars, walk
from kfsheet.model.recurrence import Recurrence

LOOKED_AT = 2  # steps after the starts; what a formula needs there it needs everywhere
Node = tuple[str, int]


class Need(NamedTuple):
    """An answer needs another one from step ``free`` + 1 on, in the step ``lag`` before.

    A ``lag`` of None asks for all of it.
    """

    free: int
    lag: int | None


def needs(exercise: Exercise) -> dict[str, dict[str, Need]]:
    """What each answer needs of the others, be it through columns that are given."""
    asked = tuple(question.name for question in exercise.questions)
    return _needs(exercise.model, asked, exercise.frozen)


@lru_cache(maxsize=16)
def _needs(
    model: Recurrence, asked: tuple[str, ...], frozen: tuple[str, ...]
) -> dict[str, dict[str, Need]]:
    return {name: _of_one(model, name, {*asked} - {name}, frozen) for name in asked}


def _of_one(
    model: Recurrence, name: str, others: set[str], frozen: tuple[str, ...]
) -> dict[str, Need]:
    last = min(model.rows - 1, model.start_rows + LOOKED_AT) if name in model.table else 0
    found: dict[str, Need] = {}
    for step in range(last + 1):
        for other, there in _read(model, name, step, others, frozen).items():
            far = step - there if other in model.table and there <= step else None
            before = found.get(other, Need(step - 1, far))
            least = None if None in (far, before.lag) else min(far, before.lag)
            found[other] = Need(before.free, least)
    return found


def _read(
    model: Recurrence, name: str, step: int, others: set[str], frozen: tuple[str, ...]
) -> dict[str, int]:
    """The last step that is needed of each answer; what they need is their own affair."""
    found: dict[str, int] = {}
    seen, waiting = set(), [(name, step)]
    while waiting:
        for node in _reads(model, *waiting.pop(), frozen):
            if node[0] in others:
                found[node[0]] = max(node[1], found.get(node[0], 0))
            elif node not in seen:
                seen.add(node)
                waiting.append(node)
    return found


def _reads(model: Recurrence, name: str, step: int, frozen: tuple[str, ...]) -> Iterator[Node]:
    scalar = model.derived_scalars.get(name) or model.summaries.get(name)
    if scalar is None:
        if name in model.parameters:
            return
        column = model.column(name)
        if column.is_data or column.section in frozen:
            return
    rule = scalar.expression if scalar else column.definition(step)
    rows, wholes, names = _parts(rule)
    yield from ((other, step - back) for other, back in rows if back <= step)
    yield from ((other, model.rows - 1) for other in wholes)
    yield from ((other, 0) for other in names if other not in model.parameters)


@lru_cache(maxsize=4_096)
def _parts(rule: Expr) -> tuple[tuple[Node, ...], tuple[str, ...], tuple[str, ...]]:
    """Columns read row by row with how far back, columns read as a whole, scalars."""
    nodes = list(walk(rule))
    rows = {(str(n.base.label), int(lag(n))) for n in nodes if isinstance(n, Indexed)}
    wholes = columns_read(rule) - {name for name, _ in rows}
    return tuple(rows), tuple(wholes), tuple(s.name for s in scalars(rule) if s.name != "t")
