"""Chart specifications -> native scatter charts of a workbook."""

from __future__ import annotations

from openpyxl.chart import Reference, ScatterChart
from openpyxl.chart import Series as NativeSeries
from openpyxl.chart.legend import LegendEntry
from openpyxl.chart.shapes import GraphicalProperties
from openpyxl.chart.text import RichText, Text
from openpyxl.chart.title import Title
from openpyxl.drawing.line import LineProperties
from openpyxl.drawing.text import (
    CharacterProperties,
    Paragraph,
    ParagraphProperties,
    RegularTextRun,
)
from openpyxl.utils import get_column_letter
from openpyxl.workbook import Workbook

from kfsheet.model.chart import LOOKS, Chart, Look, Series
from kfsheet.model.exercise import Exercise
from kfsheet.workbook.write.exercise_sheets import chart_range
from kfsheet.workbook.write.layout import (
    CHART_COLUMNS,
    FIRST_CHART_ROW,
    FIRST_ROW,
    ROWS_A_CHART,
    Layout,
    chart_place,
)

WIDTH, HEIGHT = 17.0, 11.0  # cm
COLUMN_WIDTH, ROW_HEIGHT = 9.0, 15.0  # said, since programs differ in what they take for granted
POINT = 12_700  # English metric units
ANY = -1  # index of a series, which openpyxl fills in and then leaves its order alone


def draw(book: Workbook, exercise: Exercise, layout: Layout) -> None:
    """Add every chart of the exercise to the sheet "Charts", each under its note."""
    sheet = book["Charts"]
    for column in range(1, 2 * CHART_COLUMNS[1] - 1):
        sheet.column_dimensions[get_column_letter(column)].width = COLUMN_WIDTH
    sheet.sheet_format.defaultRowHeight, sheet.sheet_format.customHeight = ROW_HEIGHT, True
    sheet.page_setup.fitToHeight = 1
    pairs = -(-len(exercise.charts) // 2)
    if pairs * HEIGHT > 2 * WIDTH:
        sheet.page_setup.orientation = "portrait"
    rows = FIRST_CHART_ROW + ROWS_A_CHART * pairs
    sheet.print_area = f"A1:{get_column_letter(2 * CHART_COLUMNS[1] - 2)}{rows}"
    for n, chart in enumerate(exercise.charts):
        row, column = chart_place(n)
        anchor = f"{get_column_letter(column)}{row + 1}"
        sheet.add_chart(_native(book, exercise, layout, chart), anchor)


def _native(book: Workbook, exercise: Exercise, layout: Layout, chart: Chart) -> ScatterChart:
    native = ScatterChart(scatterStyle="lineMarker")
    native.title, native.style = _title(chart.title, 12), 2
    native.width, native.height = WIDTH, HEIGHT
    native.legend.position = "b"
    for axis, label in ((native.x_axis, chart.x_label), (native.y_axis, chart.y_label)):
        axis.title, axis.delete, axis.number_format = _title(label, 9), False, "General"
        axis.majorGridlines.spPr = _line(Look("D9D9D9", width=0.75))
        axis.tickLblPos = "low"
    if chart.y_limits:
        native.y_axis.scaling.min, native.y_axis.scaling.max = chart.y_limits
    if chart.origin_top_left:
        native.y_axis.scaling.orientation = "maxMin"
        native.x_axis.tickLblPos = "nextTo"
    for n, series in enumerate(chart.series):
        native.series.append(_series(book, exercise, layout, series, chart.where))
        native.series[-1].order, native.series[-1].idx = n, ANY
    if any(series.role == "cloud" for series in chart.series):
        # The last is on top: in Excel by its order, in LibreOffice where it comes first in the
        # file. A legend's entries are counted in either way, so here none can be hidden.
        native.series.reverse()
    else:
        _hide_from_legend(native, [n for n, s in enumerate(chart.series) if not s.label])
    return native


def _title(text: str, points: int) -> Title:
    """A title in a size that leaves room for the chart."""
    font = CharacterProperties(sz=100 * points, b=points > 10)
    run = RegularTextRun(rPr=font, t=text)
    paragraph = Paragraph(pPr=ParagraphProperties(defRPr=font), r=[run])
    return Title(tx=Text(rich=RichText(p=[paragraph])), overlay=False)


def _hide_from_legend(native: ScatterChart, indices: list[int]) -> None:
    native.legend.legendEntry = [LegendEntry(idx=n, delete=True) for n in indices]


def _series(
    book: Workbook, exercise: Exercise, layout: Layout, series: Series, where: str
) -> NativeSeries:
    x, y = (
        _reference(book, layout, chart_range(exercise, layout, name, where))
        for name in (series.x, series.y)
    )
    native = NativeSeries(y, x, title=series.label or series.y)
    look = LOOKS[series.role]
    native.graphicalProperties = _line(look)
    native.marker.symbol = look.marker or "none"
    if look.marker:
        native.marker.size = look.size
        native.marker.graphicalProperties = GraphicalProperties(solidFill=look.colour)
        edge = native.marker.graphicalProperties.line
        if series.role == "cloud":
            edge.noFill = True  # it would double the size of a small dot
        else:
            edge.solidFill = look.colour
    native.smooth = False
    return native


def _line(look: Look) -> GraphicalProperties:
    line = LineProperties(w=round(look.width * POINT))
    if look.line:
        line.solidFill = look.colour
        line.dashStyle = {"dash": "dash"}.get(look.line)
    else:
        line.noFill = True
    return GraphicalProperties(ln=line)


def _reference(book: Workbook, layout: Layout, place: tuple[str, int]) -> Reference:
    sheet, column = place
    return Reference(
        book[sheet], min_col=column, min_row=FIRST_ROW, max_row=layout.last_row, max_col=column
    )
