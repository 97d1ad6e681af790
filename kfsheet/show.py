"""The same model in another dress: Python, LaTeX, Excel formulas, or a table of numbers."""

from __future__ import annotations

from collections.abc import Callable

from openpyxl.utils import get_column_letter

from kfsheet.evaluation import evaluate
from kfsheet.excel.layout import FIRST_ROW, Layout
from kfsheet.expressions import Missing
from kfsheet.latex import latex_code, latex_name
from kfsheet.parts import Column
from kfsheet.pythoncode import python_source
from kfsheet.recurrence import Recurrence
from kfsheet.units import pretty_unit

WIDTH = 80


def as_python(model: Recurrence) -> str:
    """The generated Python module."""
    return python_source(model)


def as_latex(model: Recurrence) -> str:
    """Every definition as a line of an ``align*`` environment."""
    lines = [
        rf"  {latex_name(s.name)} &= {latex_code(s.expression)} \\"
        for s in (*model.derived_scalars.values(), *model.summaries.values())
    ]
    for column in model.all_columns():
        for row, rule in enumerate(column.rules):
            index = str(row) if row < len(column.start) else "t"
            lines.append(rf"  {latex_name(column.name, index)} &= {latex_code(rule)} \\")
    return "\n".join([r"\begin{align*}", *lines, r"\end{align*}"])


def as_excel(model: Recurrence) -> str:
    """Every formula of the workbook, for the start rows and the first row after them."""
    layout = Layout.standard(model)
    lines = ["Parameters"]
    for name, scalar in {**model.derived_scalars, **model.summaries}.items():
        sheet, row, column = layout.scalars[name]
        formula = layout.formula(scalar.expression, sheet)(row)
        lines.append(f"  {name:12} {get_column_letter(column)}{row:<5} {formula}")
    for section, columns in model.sections.items():
        lines += ["", section]
        clock = [model.clock] if model.clock else []
        for column in (*clock, *columns):
            lines += _column_lines(layout, section, column)
    return "\n".join(lines)


def _column_lines(layout: Layout, section: str, column: Column) -> list[str]:
    letter, name = get_column_letter(layout.columns[section][column.name]), column.name
    if column.is_data:
        return [f"  {name:12} {letter}{FIRST_ROW:<5} (data)"]
    lines = []
    for row, rule in enumerate(column.rules, FIRST_ROW):
        text = "(empty)" if rule is Missing else layout.formula(rule, section)(row)
        lines.append(f"  {name:12} {letter}{row:<5} {text}")
        name = ""
    return lines


def as_table(model: Recurrence) -> str:
    """Scalars, then the columns section by section, in lines of 80 characters."""
    frame = evaluate(model)
    units, scalars = frame.attrs["units"], {**frame.attrs["parameters"], **frame.attrs["scalars"]}
    lines = [
        f"{name:12} {value:<14.7g} {pretty_unit(units[name])}" for name, value in scalars.items()
    ]
    for section, columns in model.sections.items():
        names = [*(["time"] if model.clock else []), *(c.name for c in columns)]
        part = frame[names].rename(columns={n: f"{n} [{pretty_unit(units[n])}]" for n in names})
        text = part.to_string(line_width=WIDTH, float_format="%.5g", na_rep="")
        lines += ["", section, *(line.rstrip() for line in text.splitlines())]
    return "\n".join(lines)


DRESSES: dict[str, Callable[[Recurrence], str]] = {
    "python": as_python,
    "latex": as_latex,
    "excel": as_excel,
    "table": as_table,
}
