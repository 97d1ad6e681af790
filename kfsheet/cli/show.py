"""The same model in another dress: Python, LaTeX, Excel formulas, or a table of numbers."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

from openpyxl.utils import get_column_letter
from sympy import Integer

from kfsheet.errors import ModelError
from kfsheet.evaluation.evaluate import evaluate
from kfsheet.evaluation.python_source import python_source
from kfsheet.model.expressions import Missing, t
from kfsheet.model.quantities import Column
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.unit_text import pretty_unit
from kfsheet.printing.latex import latex_code, latex_name
from kfsheet.workbook.write.layout import FIRST_ROW, Layout

if TYPE_CHECKING:
    import pandas as pd

WIDTH = 80
END = 5  # rows at either end of a long table


def as_python(model: Recurrence) -> str:
    """The generated Python module, its long assignments broken between terms."""
    lines = python_source(model).splitlines()
    return "\n".join(part for line in lines for part in _broken(line))


def _broken(line: str) -> list[str]:
    """A long ``name = formula`` in parentheses, one term a line."""
    if len(line) < WIDTH or " = " not in line:
        return [line]
    left, formula = line.split(" = ", 1)
    indent = " " * (len(line) - len(line.lstrip()))
    cuts, depth = [0], 0
    for place, character in enumerate(formula):
        depth += (character in "([") - (character in ")]")
        if depth == 0 and formula.startswith((" + ", " - ", " if ", " else "), place):
            cuts.append(place)
    terms = [formula[a:b].strip() for a, b in itertools.pairwise([*cuts, None])]
    return [f"{left} = (", *(f"{indent}    {term}" for term in terms), f"{indent})"]


def as_latex(model: Recurrence) -> str:
    """Every definition as a line of an ``align*`` environment."""
    apart = _like_a_row(model)
    lines = [
        rf"  {latex_code(s.symbol, apart)} &= {latex_code(s.expression, apart)} \\"
        for s in (*model.derived_scalars.values(), *model.summaries.values())
    ]
    for column in model.all_columns():
        for row, rule in enumerate(column.rules):
            starts = row < len(column.start)
            index = str(row) if starts else "t"
            formula = latex_code(rule.xreplace({t: Integer(row)}) if starts else rule, apart)
            lines.append(rf"  {latex_name(column.name, index)} &= {formula} \\")
    return "\n".join([r"\begin{align*}", *lines, r"\end{align*}"])


def _like_a_row(model: Recurrence) -> set[str]:
    """Scalars that would look like a row of a column, as u_0 where there is a column u."""
    names = {*model.parameters, *model.derived_scalars, *model.summaries}
    columns = {column.name for column in model.all_columns()}
    parts = ((name, *name.rpartition("_")) for name in names)
    return {name for name, head, _, tail in parts if head in columns and tail.isdigit()}


def as_excel(model: Recurrence) -> str:
    """Every formula of the workbook, for the start rows and the first row after them."""
    layout = Layout.standard(model)
    lines, width = ["Parameters"], max(map(len, model.units()))
    for name, scalar in {**model.derived_scalars, **model.summaries}.items():
        sheet, row, column = layout.scalars[name]
        formula = layout.formula(scalar.expression, sheet)(row)
        lines.append(f"  {name:{width}} {get_column_letter(column) + str(row):7} {formula}")
    for section, columns in model.sections.items():
        lines += ["", section]
        for column in (*model.clock_of(section), *columns):
            letter = get_column_letter(layout.columns[section][column.name])
            rows = range(max(1, len(column.rules)))
            for row, text in zip(rows, _texts(layout, section, column, rows), strict=True):
                name, cell = "" if row else column.name, f"{letter}{row + FIRST_ROW}"
                lines.append(f"  {name:{width}} {cell:7} {text or '(empty)'}")
    return "\n".join(lines)


def _texts(layout: Layout, section: str, column: Column, rows: Iterable[int]) -> Iterator[str]:
    """What stands in some rows of a column: formulas, or what takes their place."""
    for row in rows:
        rule = column.definition(row)
        if column.is_data:
            yield "(data)"
        else:
            yield "" if rule is Missing else layout.formula(rule, section)(FIRST_ROW + row)


def formula_table(model: Recurrence, section: str, rows: int = 3) -> pd.DataFrame:
    """Formulas of the first rows of a worksheet: a line for each column, led by its letter.

    Raises
    ------
    ModelError
        If the recurrence has no such section.
    """
    import pandas as pd

    if section not in model.sections:
        raise ModelError(f"no section {section!r}; there is {', '.join(model.sections)}")
    layout = Layout.standard(model)
    table = {
        column.name: [
            get_column_letter(layout.columns[section][column.name]),
            *_texts(layout, section, column, range(rows)),
        ]
        for column in (*model.clock_of(section), *model.sections[section])
    }
    headers = ["column", *(f"row {FIRST_ROW + row}" for row in range(rows))]
    return pd.DataFrame.from_dict(table, orient="index", columns=headers)


def as_table(model: Recurrence) -> str:
    """Scalars, then both ends of the columns section by section, in lines of 80 characters."""
    frame = evaluate(model)
    units, scalars = frame.attrs["units"], {**frame.attrs["parameters"], **frame.attrs["scalars"]}
    lines = [
        f"{name:12} {value:<14.7g} {pretty_unit(units[name])}" for name, value in scalars.items()
    ]
    ends = frame
    if len(frame) > 4 * END:
        ends, n = frame.iloc[[*range(END), *range(-END, 0)]], len(frame)
        lines.insert(0, f"rows 0 to {END - 1} and {n - END} to {n - 1} of {n}; evaluate() has all")
    for section, columns in model.sections.items():
        names = [c.name for c in (*model.clock_of(section), *columns)]
        part = ends[names].rename(columns={n: f"{n} [{pretty_unit(units[n])}]" for n in names})
        text = part.to_string(line_width=WIDTH, float_format="%.5g", na_rep="")
        lines += ["", section, *(line.rstrip() for line in text.splitlines())]
    return "\n".join(lines)


DRESSES: dict[str, Callable[[Recurrence], str]] = {
    "python": as_python,
    "latex": as_latex,
    "excel": as_excel,
    "table": as_table,
}
