"""The handouts of a class: which files are written, by how many processes, and over what.

One handout is made in :mod:`kfsheet.coursework.handout.handout_workbook`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from kfsheet.coursework.handout import course_secret
from kfsheet.coursework.handout.handout_workbook import handout_of_run, own_run, solution_of_run
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.coursework.reading.results_folder import belongs_to, claim
from kfsheet.coursework.reading.roster import Student
from kfsheet.coursework.worker_pool import Failed, Pool
from kfsheet.errors import DataError, ModelError, WorkbookError
from kfsheet.exercises import load_exercise
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise


def write_handouts(
    exercise: Exercise,
    spec: str,
    students: list[Student],
    secret: bytes,
    out: str | Path,
    *,
    jobs: int = 1,
    force: bool = False,
) -> Iterator[Path]:
    """Write every student's workbook and its solution.

    Parameters
    ----------
    exercise, spec : Exercise, str
        It must list questions; and the name or file by which a worker process finds it.
    students : list of Student
        Who gets one.
    secret : bytes
        See :mod:`kfsheet.coursework.handout.course_secret`.
    out : path
        Folder; ``students/ID/EXERCISE.xlsx`` and ``solutions/ID/EXERCISE.xlsx`` are written there.
    jobs : int
        Processes.
    force : bool
        Also replace a handout that is there and would become another one.

    Yields
    ------
    Path
        Each student's workbook, once both files are written.

    Raises
    ------
    ModelError
        If the exercise asks nothing.
    DataError
        If the handouts in the folder were made with another secret.
    WorkbookError
        If a file cannot be written, or would replace another handout without ``force``.
    """
    if not exercise.questions:
        raise ModelError(f"{exercise.name} asks no questions; list them in Exercise(questions=...)")
    if not claim(out, "secret", course_secret.fingerprint(secret)):
        raise DataError(
            f"{out} holds handouts made with another secret; give that --secret, or another --out"
        )
    if jobs == 1:
        for student in students:
            yield _write_both(exercise, student, secret, Path(out), force)
        return
    tasks = [(spec, student, secret, Path(out), force) for student in students]
    for (_, student, *_), written in Pool(_write_in_process, jobs).run(tasks):
        if isinstance(written, Failed):
            raise WorkbookError(f"the workbook of {student.id} was not written: {written.reason}")
        yield written


def holds_handouts(out: str | Path) -> bool:
    """Whether a folder holds handouts, or says of what secret they were made."""
    return bool(belongs_to(out, "secret")) or any(Path(out).glob("students/*/*.xlsx"))


def _write_in_process(spec: str, *task: Any) -> Path:
    return _write_both(load_exercise(spec), *task)


def _write_both(
    exercise: Exercise, student: Student, secret: bytes, out: Path, force: bool
) -> Path:
    path = out / "students" / student.id / f"{exercise.name}.xlsx"
    now = own_run(exercise, own_numbers(exercise, secret, student.id))
    content = handout_of_run(exercise, now, student, secret)
    # A handout that is out must not silently become another one: its answers would be judged by it.
    if path.exists() and not force and path.read_bytes() != content:
        raise WorkbookError(
            f"{path} is there and would become another workbook; if it was not handed out yet, "
            "replace it with: kfsheet handout --force"
        )
    solution = out / "solutions" / student.id / f"{exercise.name}.xlsx"
    write_file(solution, solution_of_run(exercise, now))
    return write_file(path, content)
