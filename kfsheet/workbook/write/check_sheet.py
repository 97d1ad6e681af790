"""The worksheet "Check": live figures beside the same figures frozen when the file was built.

It answers, in whatever program opened the file, whether that program computes what kfsheet
computed. Once a user has changed a parameter or a photo, figures may differ for that reason, and
the verdict says so instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite, isnan, nan

from kfsheet.evaluation.numerics import last, mean, rms, total
from kfsheet.model.quantities import Column
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Sheet, stored_value
from kfsheet.workbook.write.styles import number_format

TOLERANCE = 1e-9
LIVE_OR_NOT = (
    "Live figures beside those frozen when the file was built. LibreOffice shows the values that "
    "are stored in a file until it is told to calculate: press Ctrl+Shift+F9."
)
TABLE_ROW = 11
KINDS = ("parameter", "data", "result")
PASS, FAIL, PARAMETERS, DATA = "PASS", "FAIL", "parameters changed", "data changed"


@dataclass(frozen=True)
class Probe:
    """One line: a figure as a formula, its value now and at build, and the scale of a difference.

    ``what`` is "parameter" and "data" for inputs, "result" for everything that is computed.
    """

    name: str
    what: str
    quantity: str
    formula: str
    now: float
    built: float
    scale: float

    @property
    def difference(self) -> float:
        """Relative difference, as the sheet computes it; NaN where one of the two is no number."""
        return abs(self.now - self.built) / self.scale


def probes(layout: Layout, now: Run, built: Run) -> list[Probe]:
    """Every line of the table: parameters, then data, then results."""
    lines = [p for p in _all_probes(layout, now, built) if isfinite(p.built)]
    # The formulas of the verdict count over one range for each kind.
    return sorted(lines, key=lambda p: KINDS.index(p.what))


def _all_probes(layout: Layout, now: Run, built: Run) -> Iterator[Probe]:
    model = layout.model
    for what, names in (
        ("parameter", model.parameters),
        ("result", {**model.derived_scalars, **model.summaries}),
    ):
        for name in names:
            value = built.scalars[name]
            yield Probe(name, what, VALUE, f"={name}", now.scalars[name], value, _scale(value))
    for column in model.table.values():
        yield from _column_probes(layout, column, now, built)


def _column_probes(layout: Layout, column: Column, now: Run, built: Run) -> Iterator[Probe]:
    name, cells = column.name, layout.range(column.name)
    sheet, _ = layout.home(name)
    what = "data" if column.is_data else "result"
    scale = _scale(built.figure(rms, name))
    steps = layout.range("t", sheet)
    bottom = f"{cells.split(':')[0].rsplit('$', 1)[0]}${layout.last_row}"
    mean_row = f"SUMPRODUCT({steps},{cells})/SUM({steps})"
    formulas = (
        f"=SQRT(SUMSQ({cells})/COUNT({cells}))",
        f"=AVERAGE({cells})",
        f"={mean_row}",
        f"={layout.last(name, bottom)}",
    )
    for (quantity, function), formula in zip(FIGURES.items(), formulas, strict=True):
        if function is _weighted and layout.model.rows == 1:
            continue  # the only weight is 0
        now_value, built_value = now.figure(function, name), built.figure(function, name)
        yield Probe(name, what, quantity, formula, now_value, built_value, scale)


def _weighted(values: list[float]) -> float:
    """Mean weighted by the step index; unlike the mean, it moves when two rows are swapped."""
    weights = range(len(values))
    return total([w * v for w, v in zip(weights, values, strict=True)]) / sum(weights)


VALUE = "value"
"""What the table calls the figure of a scalar."""
FIGURES = {
    "root mean square": rms,
    "mean": mean,
    "mean, weighted by step": _weighted,
    "last row": last,
}
"""Figures of a column, by what the table calls them."""


def _scale(value: float) -> float:
    return abs(value) if value and not isnan(value) else 1.0


def check_sheet(layout: Layout, now: Run, built: Run) -> Sheet:
    """Compose the worksheet."""
    sheet = Sheet("Check", widths={1: 22, 2: 12, 3: 26, 4: 22, 5: 22, 6: 16, 7: 14})
    sheet.freeze = f"A{TABLE_ROW + 1}"
    sheet.put(1, 1, "Does this program compute what kfsheet computed?", "title")
    sheet.put(2, 1, LIVE_OR_NOT)
    heads = ("name", "kind", "figure", "now", "at build", "scale", "difference")
    for n, word in enumerate(heads, 1):
        sheet.put(TABLE_ROW, n, word, "header", align="center")
    lines = probes(layout, now, built)
    for row, probe in enumerate(lines, TABLE_ROW + 1):
        _put_probe(sheet, row, probe)
    _put_verdict(sheet, lines)
    return sheet


def _put_probe(sheet: Sheet, row: int, probe: Probe) -> None:
    shape = number_format([probe.built])
    for n, word in enumerate((probe.name, probe.what, probe.quantity), 1):
        sheet.put(row, n, word, "index")
    now = stored_value(probe.now)
    sheet.put(row, 4, probe.formula, "formula", stored=now, format=shape, scale=probe.scale)
    sheet.put(row, 5, probe.built, "data", format=shape)
    sheet.put(row, 6, probe.scale, "data", format=shape)
    text = f"=ABS(D{row}-E{row})/F{row}"
    far = stored_value(probe.difference)
    sheet.put(row, 7, text, "formula", stored=far, format="0.0E+00", scale=1.0)


def _put_verdict(sheet: Sheet, lines: list[Probe]) -> None:
    cells, first = {}, TABLE_ROW + 1
    for kind in KINDS:
        last_row = first + sum(p.what == kind for p in lines) - 1
        cells[kind] = f"G{first}:G{last_row}" if last_row >= first else ""
        first = last_row + 1
    largest = _largest([p.difference for p in lines if p.what == "result"])
    changed = {
        # "not <=" and never ">": NaN, a figure that has become an error, is a change too.
        kind: sum(not p.difference <= TOLERANCE for p in lines if p.what == kind)
        for kind in KINDS
    }
    figures = [
        ("verdict", verdict_formula(), verdict(changed, largest)),
        ("largest relative difference", f"=MAX({cells['result']})", stored_value(largest)),
        ("tolerance", TOLERANCE, None),
        ("parameters changed", _beyond(cells["parameter"]), changed["parameter"]),
        ("data figures changed", _beyond(cells["data"]), changed["data"]),
    ]
    for row, (name, content, value) in enumerate(figures, 4):
        sheet.put(row, 1, name, "index")
        kind = "formula" if isinstance(content, str) else "data"
        shape = "0.0E+00" if row in (5, 6) else "0"
        sheet.put(row, 2, content, kind, stored=value, format=shape, scale=1.0)
    sheet.names["kfsheet_verdict"] = (4, 2)


def _largest(differences: list[float]) -> float:
    """As MAX has it: one that has no value leaves the whole without one."""
    return nan if any(map(isnan, differences)) else max(differences, default=0.0)


def verdict_formula() -> str:
    """Formula of the verdict, over the cells below it."""
    return (
        f'=IF(B7>0,"{PARAMETERS}",IF(B8>0,"{DATA}",'
        f'IF(ISNUMBER(B5),IF(B5<B6,"{PASS}","{FAIL}"),"{FAIL}")))'
    )


def verdict(changed: dict[str, int], largest: float) -> str:
    """What the verdict formula says."""
    if changed["parameter"]:
        return PARAMETERS
    if changed["data"]:
        return DATA
    return PASS if largest < TOLERANCE else FAIL


def _beyond(cells: str) -> str:
    """How many differences exceed the tolerance; one that is an error counts too."""
    return f'=ROWS({cells})-COUNTIF({cells},"<="&B6)' if cells else "=0"
