"""An exercise -> an .xlsx file of live formulas, with stored values, charts and a Check sheet.

The whole way down is :func:`workbook_bytes`.
"""

from __future__ import annotations

from pathlib import Path

from kfsheet.errors import WorkbookError
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise
from kfsheet.workbook.write.check_sheet import check_sheet
from kfsheet.workbook.write.exercise_sheets import (
    charts_sheet,
    parameters_sheet,
    readme_sheet,
    section_sheet,
)
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.openpyxl_workbook import WorkbookTemplate, assemble
from kfsheet.workbook.write.reproducible_zip import untouched
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import Sheet


def write_workbook(exercise: Exercise, path: str | Path, *, force: bool = False) -> Path:
    """Write the workbook of an exercise.

    Parameters
    ----------
    exercise : Exercise
        What to write.
    path : path
        File to write, ending in ``.xlsx``, or a folder, which gets ``NAME.xlsx``.

    force : bool
        Whether to replace a workbook that another program has saved: somebody's changes.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    WorkbookError
        If the file cannot be written, or holds somebody's changes; nothing half-written stays.
    PrintError
        If a formula has no equivalent in Excel 2010.
    """
    path = Path(path)
    target = path if path.suffix == ".xlsx" else path / f"{exercise.name}.xlsx"
    if target.is_file() and not force and not untouched(target):
        raise WorkbookError(
            f"{target} was changed since it was built; move it away to keep it, "
            "or replace it with: kfsheet build --force"
        )
    return write_file(target, workbook_bytes(exercise))


def workbook_bytes(exercise: Exercise, run: Run | None = None) -> bytes:
    """The workbook of an exercise, or of a run of it with other parameters and data.

    The same bytes for the same numbers.
    """
    run = run or Run.of(exercise.model)
    layout = Layout.standard(exercise.model)
    sheets = compose(exercise, layout, run, run)
    book = assemble(exercise, layout, sheets, run)
    return WorkbookTemplate(book, sheets).filled(sheets)


def compose(exercise: Exercise, layout: Layout, now: Run, built: Run) -> list[Sheet]:
    """Every worksheet, in order, for the run ``now`` of a workbook built from the run ``built``."""
    sections = [section_sheet(layout, section, now) for section in exercise.model.sections]
    return [
        readme_sheet(exercise, now, built),
        parameters_sheet(layout, now),
        *sections,
        charts_sheet(exercise, layout, now),
        check_sheet(layout, now, built),
    ]
