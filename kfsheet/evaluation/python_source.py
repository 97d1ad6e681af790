"""A recurrence as Python source that reads like the loop a student would write."""

from __future__ import annotations

import inspect
import math
import re
import textwrap
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

from kfsheet.evaluation import numerics
from kfsheet.model.schedule import Pass, needed, same_row
from kfsheet.printing.python import python_code, python_value

if TYPE_CHECKING:
    from kfsheet.model.quantities import Column, Scalar
    from kfsheet.model.recurrence import Recurrence


def python_source(model: Recurrence, wanted: Collection[str] | None = None) -> str:
    """A module with one function that computes every column and scalar of ``model``.

    The function takes the data columns as lists and the parameters by keyword; it returns two
    dictionaries, columns by name and scalars by name. The module needs the standard library only.
    With ``wanted``, names of columns, it computes those, what they need, and derived scalars.
    """
    derived = list(model.derived_scalars.values())
    columns, summaries = model.all_columns(), list(model.summaries.values())
    if wanted is not None:
        known = needed(model, [*wanted, *model.derived_scalars])
        columns = [c for c in columns if c.is_data or c.name in known]
        summaries = [s for s in summaries if s.name in known]
    body = [*_head(model), *_scalar_lines(derived), *_table_lines(model, columns)]
    kept = {item.name for item in (*columns, *summaries)}
    for step in model.passes():
        rows = tuple(tuple(c for c in row if c.name in kept) for row in step.rows)
        after = tuple(s for s in step.summaries if s.name in kept)
        body += [*_row_lines(Pass(rows, after)), *_scalar_lines(after)]
    body += _return_lines(columns, [*derived, *summaries])
    text = "\n".join(body)
    return f"{_prelude(text)}\n\n\n{text}\n"


def _head(model: Recurrence) -> list[str]:
    data = [c.name for c in model.all_columns() if c.is_data]
    lines = [f"def {model.name}(", f"    {', '.join(data)}," if data else ""]
    lines += ["    *,"] if model.parameters else []
    for p in model.parameters.values():
        lines.append(
            f"    {p.name}={p.value!r},  # {p.unit + ': ' if p.unit else ''}{p.description}"
        )
    return [*filter(None, lines), "):", f'    """{model.title}."""']


def _scalar_lines(scalars: Iterable[Scalar]) -> list[str]:
    return [f"    {s.name} = {python_code(s.expression)}" for s in scalars]


def _table_lines(model: Recurrence, columns: list[Column]) -> list[str]:
    data = next((c.name for c in columns if c.is_data), None)
    formulas = [c.name for c in columns if not c.is_data]
    rows = ["", f"    rows = {f'len({data})' if data else model.rows}"]
    if not formulas:
        return rows
    return [
        *rows,
        *_wrapped(", ".join(formulas) + ","),
        f"    ) = ([nan] * rows for _ in range({len(formulas)}))",
    ]


def _wrapped(text: str) -> list[str]:
    return ["    (", *textwrap.wrap(text, 88, initial_indent=" " * 8, subsequent_indent=" " * 8)]


def _row_lines(step: Pass) -> list[str]:
    """The start rows one by one, then the loop; a start row that fits into the loop goes there."""
    general = step.rows[-1]
    if not general:
        return []
    alone = len(step.rows) - 1
    while alone > 1 and _fits(general, step.rows[alone - 1], alone - 1):
        alone -= 1
    lines = []
    for row in range(alone):
        lines += ["", f"    t = {row}"]
        lines += [f"    {c.name}[t] = {python_value(c.definition(row))}" for c in step.rows[row]]
    lines += ["", f"    for t in range({f'{alone}, ' if alone else ''}rows):"]
    return lines + [line for c in general for line in _loop_lines(c, alone)]


def _loop_lines(column: Column, first: int) -> list[str]:
    """A column inside the loop, which begins with row ``first``."""
    lines, word = [], "if"
    for row in range(first, len(column.start)):
        lines.append(f"        {word} t == {row}:")
        lines.append(f"            {column.name}[t] = {python_value(column.start[row])}")
        word = "elif"
    general = f"{column.name}[t] = {python_value(column.expression)}"
    return [*lines, "        else:", f"    {' ' * 8}{general}"] if lines else [f"        {general}"]


def _fits(general: tuple[Column, ...], columns: tuple[Column, ...], row: int) -> bool:
    """Whether the order of the loop is good for a start row too."""
    seen = {c.name for c in general} - {c.name for c in columns}
    for column in general:
        if same_row(column.definition(row)) & {c.name for c in general} - seen:
            return False
        seen.add(column.name)
    return True


def _return_lines(columns: list[Column], scalars: list[Scalar]) -> list[str]:
    """Every column and scalar by name."""
    lines = [""]
    for name, items in (("columns", columns), ("scalars", scalars)):
        keys = [item.name for item in items]
        _, *rest = _wrapped(", ".join(f"{key}={key}" for key in keys))
        lines += [f"    {name} = dict(", *rest, "    )"]
    return [*lines, "    return columns, scalars"]


def _prelude(text: str) -> str:
    """Imports and copies of the helpers that ``text`` uses, and that those use in turn."""
    helpers = {n: f for n, f in vars(numerics).items() if inspect.isfunction(f)}
    own = {n: inspect.getsource(f).strip() for n, f in helpers.items()}
    used: list[str] = []
    while fresh := [n for n in own if n not in used and _calls(n, text + _join(own, used))]:
        used += fresh
    source = text + _join(own, used)
    constants = [n for n in ("nan", "pi") if re.search(rf"\b{n}\b", source)]
    names = [n for n, f in vars(math).items() if callable(f) and _calls(n, source)] + constants
    imports = f"from math import {', '.join(sorted(names))}" if names else ""
    return "\n\n\n".join(filter(None, [imports, _join(own, [n for n in own if n in used])]))


def _join(sources: dict[str, str], names: list[str]) -> str:
    return "\n\n\n".join(sources[n] for n in names)


def _calls(name: str, text: str) -> bool:
    return re.search(rf"(?<!def )\b{name}\(", text) is not None
