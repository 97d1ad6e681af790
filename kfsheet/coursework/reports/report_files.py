"""Files for a lecturer and the students: tables, pages, marked workbooks."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import Any

from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.coursework.reading.submission import read_submission
from kfsheet.coursework.reports.assessment import GRADED
from kfsheet.coursework.reports.class_page import class_page
from kfsheet.coursework.reports.gradebooks import gradebooks, points_shown
from kfsheet.coursework.reports.grading import STATUSES, Handed, Result
from kfsheet.coursework.reports.html_pages import page, table
from kfsheet.coursework.reports.marked_workbook import mark_workbook
from kfsheet.coursework.reports.marks_sheet import WHY, colour_of
from kfsheet.coursework.reports.right_formulas import right_formulas
from kfsheet.errors import UnwrittenError
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise


def write_reports(
    exercise: Exercise,
    results: list[Result],
    handed: list[Handed],
    out: str | Path,
    *,
    show_key: bool = False,
) -> list[Path]:
    """Write every report into ``out`` and return the files for the lecturer.

    With ``show_key`` the students' files hold a right formula beside each answer.

    Raises
    ------
    UnwrittenError
        If some could not be written, naming them; all others are there.
    """
    out, unwritten = Path(out), []
    texts = gradebooks(exercise, results) | {"class.html": class_page(exercise, results, handed)}
    written = [_try(unwritten, _write_text, out / name, text) for name, text in texts.items()]
    for result in results:
        _try(unwritten, _write_feedback, exercise, result, out, show_key)
    if unwritten:
        more = f" (and {len(unwritten) - 1} more files)" if len(unwritten) > 1 else ""
        raise UnwrittenError(f"{unwritten[0]}; then grade again{more}")
    return written


def _try(unwritten: list[UnwrittenError], write: Callable, *what: Any) -> Any:
    """Write a report; one that cannot be written keeps no other from it."""
    try:
        return write(*what)
    except UnwrittenError as error:
        unwritten.append(error)


def _write_text(path: Path, text: str) -> Path:
    # What no program can have written, half a character, is shown as a code and stops nothing.
    return write_file(path, text.encode(errors="backslashreplace"))


def _write_feedback(exercise: Exercise, result: Result, out: Path, show_key: bool) -> None:
    """A student's page, and the marked workbook if one could be made."""
    folder, name = out / "feedback", result.student.id
    target = folder / f"{name}.xlsx"
    target.unlink(missing_ok=True)  # of an earlier run, when another file counted
    marked = out / "work" / f"{result.key}.xlsx"
    anew = result.feedback and (show_key or result.changed)
    book, keys = None, {}
    if result.marks and (show_key or anew):
        book = read_submission(result.path)
        addresses = CellAddresses.find(book, exercise.model)
        keys = right_formulas(book, addresses, result.marks) if show_key else {}
    _write_text(folder / f"{name}.html", _student_page(exercise, result, keys))
    if book and anew:
        total = result.override
        write_file(target, mark_workbook(result.path, book, addresses, result.marks, total, keys))
    elif result.feedback and marked.is_file():
        write_file(target, marked.read_bytes())


def _student_page(exercise: Exercise, result: Result, keys: dict[str, str]) -> str:
    body = f"<h1>{escape(exercise.title)}</h1><p>{escape(result.student.name)}: "
    body += f"<b>{points_shown(result.score)} of {result.maximum} points</b></p>"
    status = STATUSES.get(result.status, "")
    body += f"<p>{escape(result.status)}: {escape(status)}. {escape(result.remark)}</p>"
    heads = ["answer", "score", "points", "status", "remark", "first differs", "your formula"]
    rows = [
        (
            colour_of(m),
            [m.name, points_shown(m.score), m.points, m.status, m.remark, m.differs, m.formula]
            + [keys.get(m.name, "")] * bool(keys),
        )
        for m in result.marks
    ]
    body += table(heads + ["a right formula"] * bool(keys), rows)
    body += f"<p>{escape(WHY)}</p>" if result.status == GRADED else ""
    return page(f"{exercise.title}: {result.student.name}", body)
