"""A folder of submissions -> one result for every student on the roster."""

from __future__ import annotations

import hashlib
import json
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from kfsheet import __version__
from kfsheet.coursework.handout import course_secret
from kfsheet.coursework.judging.judge import Mark
from kfsheet.coursework.reading.roster import Student
from kfsheet.coursework.reading.submitted_files import owner, readable, submitted_files
from kfsheet.coursework.reports.assessment import (
    GRADED,
    NO_TOKEN,
    NOT_OWN,
    OTHER,
    Assessment,
    assess,
)
from kfsheet.coursework.reports.origin import holder
from kfsheet.coursework.worker_pool import SECONDS, Failed, Pool, run_on
from kfsheet.errors import UnwrittenError
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise

MISSING, FOREIGN = "no submission", "somebody else's file"
TIMED_OUT, CRASHED = "timed out", "crashed"
STATUSES = {
    GRADED: "the answers were judged; see the marks",
    "untouched": "the workbook came back with no answer filled in",
    MISSING: "nothing came back",
    FOREIGN: "the file was handed out to another student; it does not count",
    NO_TOKEN: "the file was not handed out to anybody, or its token was removed",
    OTHER: "the file belongs to another exercise",
    NOT_OWN: "the file holds other numbers than those handed out to this student; it does not "
    "count",
    "empty file": "the file has 0 bytes",
    "wrong kind": "the file is no .xlsx workbook, whatever its name says",
    "damaged": "the workbook cannot be opened",
    "encrypted": "the workbook has a password",
    "too large": "the file, or what it unpacks to, exceeds the limits",
    "refused": "the file holds macros or tricks",
    "unreadable": "the file could not be read from the disk",
    TIMED_OUT: "judging took longer than a submission may; look at it by hand",
    CRASHED: "reading the file ended its process; look at it by hand",
}
"""Every status of a submission, and what it means."""


@dataclass
class Result:
    """What one student gets."""

    student: Student
    maximum: int
    status: str = MISSING
    remark: str = ""
    marks: list[Mark] = field(default_factory=list)
    path: Path | None = None
    key: str = ""
    feedback: bool = False
    override: float | None = None
    changed: bool = False
    """Whether a lecturer has changed a mark."""

    note: str = ""
    """For the lecturer only."""

    @property
    def score(self) -> float:
        """Points, a lecturer's own total included."""
        return sum(m.score for m in self.marks) if self.override is None else self.override


@dataclass(frozen=True)
class Handed:
    """One file: where it lay, whose folder or name it carried, what it is worth."""

    path: Path
    owner: Student | None
    key: str
    assessment: Assessment
    numbers_of: str = ""
    """Whose numbers the file holds, if not those of whose token it carries."""

    @property
    def of_nobody(self) -> bool:
        """Whether neither a token nor the path says whose the file is."""
        return not self.assessment.student and self.owner is None


def grade(
    exercise: Exercise,
    spec: str,
    submissions: str | Path,
    students: Sequence[Student],
    secret: bytes,
    out: str | Path,
    *,
    jobs: int = 1,
    seconds: float = SECONDS,
    executor: Executor | None = None,
    progress: Callable[[Iterable, int], Iterable] = lambda items, _: items,
) -> tuple[list[Result], list[Handed]]:
    """Judge every file once, and say what every student gets.

    Parameters
    ----------
    exercise, spec : Exercise, str
        The exercise, and the name or file by which a worker process finds it.
    submissions : path
        Folder of what came back; whose a file is comes from its token.
    students : sequence of Student
        The roster.
    secret : bytes
        That of the handout.
    out : path
        Results of each file are kept in ``work/`` there, so that a second run goes on where the
        first one stopped.
    jobs : int
        Processes.
    seconds : float
        What one file may take.
    executor : Executor, optional
        Anything with the interface of :mod:`concurrent.futures` that judges in the place of
        ``jobs`` processes; its workers must see the same files, and be allowed to start processes.
    progress : function, optional
        Wraps files as they are finished, pairs of path and assessment; called with them and their
        number.

    Returns
    -------
    tuple
        A result for each student, in the order of the roster, and every file.
    """
    folder, out = Path(submissions), Path(out)
    files = submitted_files(folder, out)
    version = _fingerprint(exercise)
    keys = {path: _key(path, version, secret) for path in files}

    def run(tasks: list[tuple]) -> Iterator[tuple[tuple, Any]]:
        if executor is not None:
            return run_on(executor, assess, tasks, seconds=seconds)
        return Pool(assess, jobs, seconds=seconds).run(tasks)

    judged = _judged(keys, spec, secret, out / "work", run, progress)
    by_id = {student.id: student for student in students}
    origin = _origins(exercise, secret, students, judged)
    handed = []
    for path in files:
        found = judged[keys[path]]
        whose = owner(path, folder, students, by_id.get(found.student))
        handed.append(Handed(path, whose, keys[path], found, origin.get(keys[path], "")))
    maximum = sum(question.points for question in exercise.questions)
    return [_result(student, handed, maximum) for student in students], handed


def _origins(
    exercise: Exercise, secret: bytes, students: Sequence[Student], judged: dict[str, Assessment]
) -> dict[str, str]:
    """Who was given the numbers of files that are not their students' own."""
    strange = {key: found for key, found in judged.items() if found.status == NOT_OWN}
    return {
        key: holder(found.numbers, exercise, secret, students) for key, found in strange.items()
    }


def _key(path: Path, version: str, secret: bytes) -> str:
    """Names a result: by what the file holds, not by where it lies."""
    content = hashlib.sha256()
    try:
        with path.open("rb") as file:
            for block in iter(lambda: file.read(2**20), b""):
                content.update(block)
    except OSError:
        content.update(os.fsencode(path))
    parts = ("key", version, __version__, content.hexdigest())
    return course_secret.digest(secret, *parts).hex()[:32]


def _fingerprint(exercise: Exercise) -> str:
    """Changes with the exercise: a corrected key must not leave old marks standing."""
    model = exercise.model
    rules = [(c.name, c.unit, str(c.rules)) for c in model.all_columns()]
    scalars = [str(s) for s in (*model.parameters.values(), *model.derived_scalars.values())]
    asked = (exercise.questions, exercise.vary, exercise.noise, exercise.frozen, exercise.veiled)
    return f"{exercise.name}{rules}{scalars}{asked}"


def _judged(
    keys: dict[Path, str],
    spec: str,
    secret: bytes,
    work: Path,
    run: Callable[[list[tuple]], Iterator[tuple[tuple, Any]]],
    progress: Callable[[Iterable, int], Iterable],
) -> dict[str, Assessment]:
    known = {key: found for key in keys.values() if (found := _kept(work, key))}
    new = {key: path for path, key in keys.items() if key not in known}
    tasks = [(spec, secret, path, work / f"{key}.xlsx") for key, path in new.items()]
    names = {path: key for key, path in new.items()}  # equal files are judged once
    judged = ((path, _assessment(found)) for (_, _, path, _), found in run(tasks))
    for path, found in progress(judged, len(tasks)):
        known[names[path]] = found
        if found.final:  # else the machine was busy, and the next run tries again
            _keep(found, work / f"{names[path]}.json")
    return known


def _keep(found: Assessment, path: Path) -> None:
    try:
        write_file(path, json.dumps(found.as_dict()).encode())
    except UnwrittenError as error:  # it is judged again in the next run
        found.unwritten = str(error)


def _kept(work: Path, key: str) -> Assessment | None:
    """The result of an earlier run; one that was damaged, or lost its copy, is made anew."""
    try:
        found = Assessment.from_dict(json.loads((work / f"{key}.json").read_text()))
    except (OSError, ValueError, TypeError, KeyError):
        return None
    return found if (work / f"{key}.xlsx").is_file() or not found.feedback else None


def _assessment(found: Assessment | Failed) -> Assessment:
    if isinstance(found, Assessment):
        return found
    status = TIMED_OUT if found.reason == "timed out" else CRASHED
    return Assessment(status, f"{STATUSES[status]} ({found.reason})", final=False)


def _result(student: Student, handed: list[Handed], maximum: int) -> Result:
    """The newest file with the student's token and answers, or else the newest; and the others."""
    own = [h for h in handed if h.assessment.student == student.id and h.owner in (None, student)]
    files = own + [h for h in handed if h.owner == student and h not in own]
    if not files:
        return Result(student, maximum, remark=_elsewhere(student, handed))
    answered = [h for h in own if h.assessment.status == GRADED]
    chosen = max(answered or files, key=lambda h: (h.path.stat().st_mtime, str(h.path)))
    found, others = chosen.assessment, _others(student, chosen, files)
    if found.student not in ("", student.id):
        words = "the file carries the token of another student; it was not graded for this one"
        remark = "; ".join([words, *others])
        return Result(student, maximum, FOREIGN, remark, path=chosen.path, key=chosen.key)
    remark = "; ".join([found.remark, *others] if found.remark else others)
    return Result(
        student, maximum, found.status, remark, found.marks, chosen.path, chosen.key,
        found.feedback, note=_note(chosen),
    )  # fmt: skip


def _note(chosen: Handed) -> str:
    if chosen.assessment.status != NOT_OWN:
        return ""
    return f"the numbers are those of {chosen.numbers_of or 'nobody on the roster'}"


def _others(student: Student, chosen: Handed, files: list[Handed]) -> list[str]:
    """Words about a student's files that do not count: what they are, and their scores."""
    if len(files) == 1:
        return []
    scores = {h.assessment.score for h in files if h.assessment.status == GRADED}
    named = Counter(h.path.name for h in files)

    def name(file: Handed) -> str:
        parts = file.path.parts[-2 if named[file.path.name] > 1 else -1 :]
        return "/".join(map(readable, parts))

    def shown(file: Handed) -> str:
        found = file.assessment
        status = FOREIGN if found.student not in ("", student.id) else found.status
        return f"{name(file)}: {status}" + f", {found.score:g} points" * (status == GRADED)

    answers = " with answers" if chosen.assessment.status == GRADED else ""
    others = ", ".join(f"({shown(file)})" for file in files if file is not chosen)
    return [
        f"{len(files)} files came back{' with different scores' if len(scores) > 1 else ''}; "
        f"the newest{answers} counts ({name(chosen)}), not {others}"
    ]


def _elsewhere(student: Student, handed: list[Handed]) -> str:
    others = {h.owner.id for h in handed if h.assessment.student == student.id and h.owner}
    return f"this student's file came back from {', '.join(sorted(others))}" if others else ""


def override(results: list[Result], lines: Iterator[dict[str, Any]]) -> list[Result]:
    """Put a lecturer's own marks in: by id and question, or the total where that is empty."""
    by_id = {result.student.id: result for result in results}
    for line in lines:
        result = by_id[line["id"]]
        remark = line.get("remark") or "changed by the lecturer"
        result.changed = True
        if not line["question"]:
            result.override, result.remark = line["score"], remark
            continue
        words = f"{line['question']}: {remark}"
        result.remark = f"{result.remark}; {words}" if result.remark else words
        result.marks = [
            replace(m, score=line["score"], remark=remark) if m.name == line["question"] else m
            for m in result.marks
        ]
    return results
