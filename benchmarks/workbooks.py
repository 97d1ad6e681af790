"""Writing, checking and recalculating workbooks."""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path

import openpyxl
from measuring import Line, in_turn, seconds

import kfsheet as kf
from kfsheet.exercises.cannonball import exercise as cannonball
from kfsheet.exercises.football import exercise as football
from kfsheet.workbook.engines.copies_for_engines import strip_values
from kfsheet.workbook.engines.libreoffice import convert, libreoffice
from kfsheet.workbook.engines.recalculate import recalculate
from kfsheet.workbook.write.write_workbook import workbook_bytes

HERE = Path(__file__).parent


def lines() -> Iterator[Line]:
    """The cannon-ball's workbook, a long one, and what other engines need."""
    content = workbook_bytes(cannonball)
    count = sum(v is not None for sheet in texts(content) for row in sheet for v in row)
    times = in_turn(lambda: workbook_bytes(cannonball), lambda: bare_strings(content))
    words = "0.77 (within 1.3); openpyxl in its write-only mode"
    yield Line(f"write the cannon-ball, {count:,} cells: openpyxl, bare strings", *times, words)
    yield from growth()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cannonball.xlsx"
        path.write_bytes(content)
        yield from checking(path)
        yield from engines(path)


def growth() -> Iterator[Line]:
    """A filter of two states in a table of 10,000 rows, and of 100,000."""
    (small, little), (large, memory) = written(10_000), written(100_000)
    words = f"{large / small:.1f} times 10,000 rows; at most {memory:.0f} MB (under 1,000), "
    words += f"{memory / little:.1f} times"
    yield Line("write 100,000 rows of 18 columns", large, 0, words)


def written(rows: int) -> tuple[float, float]:
    """Seconds and peak megabytes of writing a long table, in a process of its own."""
    program = [sys.executable, str(HERE / "long_table.py"), str(rows)]
    done = subprocess.run(program, capture_output=True, text=True, check=True)
    time, memory = map(float, done.stdout.split())
    return time, memory


def checking(path: Path) -> Iterator[Line]:
    """``kfsheet check``: calculated with two sets of inputs, every cell beside NumPy."""
    report = kf.check_workbook(path, cannonball)
    times = in_turn(lambda: kf.check_workbook(path, cannonball), lambda: by_ironcalc(path))
    words = "IronCalc alone loads it and calculates twice"
    yield Line(f"check its {report.cells:,} formulas: IronCalc", *times, words)
    program = [sys.executable, "-m", "kfsheet", "check", str(path)]

    def command() -> None:
        subprocess.run(program, capture_output=True, check=True)

    yield Line("the same as a command, start included", seconds(command), 0, "under 2 s")


def by_ironcalc(path: Path) -> object:
    """Load a file as it is and calculate it, twice."""
    import ironcalc

    model = ironcalc.load_from_xlsx(str(path), "en", "UTC")
    for _ in range(2):
        model.evaluate()
    return [model.get_cell_value(*cell) for cell in model.get_all_cells()]


def engines(path: Path) -> Iterator[Line]:
    """IronCalc beside other engines that recalculate the same files."""
    bare = path.parent / "bare.xlsx"
    strip_values(path, bare)
    if libreoffice():
        kind = "xlsx:Calc MS Excel 2007 XML"
        times = in_turn(
            lambda: recalculate(path),
            lambda: convert(bare, path.parent / "out", kind),
            repeats=3,
        )
        words = "opens, recalculates and saves in under 5 s"
        yield Line("recalculate it: LibreOffice", *times, words)
    if find_spec("formualizer"):
        times = in_turn(lambda: recalculate(path), lambda: by_formualizer(bare), repeats=3)
        yield Line("recalculate it: formualizer", *times)
    if find_spec("formulas"):
        small = path.parent / "football.xlsx"
        small.write_bytes(workbook_bytes(football))
        times = in_turn(lambda: recalculate(small), lambda: by_formulas(small), repeats=3)
        yield Line("recalculate the football, every formula: formulas", *times)


def by_formualizer(path: Path) -> object:
    """Load and evaluate with formualizer."""
    import formualizer

    return formualizer.load_workbook(str(path)).evaluate_all()


def by_formulas(path: Path) -> object:
    """Load and evaluate with formulas."""
    import formulas

    return formulas.ExcelModel().loads(str(path)).finish().calculate()


@cache
def texts(content: bytes) -> list[list[list[str | None]]]:
    """Cells of a workbook as strings that are no formulas."""
    book = openpyxl.load_workbook(BytesIO(content))
    return [
        [[None if v is None else str(v).lstrip("=") for v in row] for row in sheet.values]
        for sheet in book
    ]


def bare_strings(content: bytes) -> None:
    """Write the formulas of a workbook as plain strings: what openpyxl costs at least."""
    book = openpyxl.Workbook(write_only=True)
    for rows in texts(content):
        sheet = book.create_sheet()
        for row in rows:
            sheet.append(row)
    book.save(BytesIO())
