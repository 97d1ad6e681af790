"""The commands of coursework: ``kfsheet handout | grade``."""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from kfsheet.cli.terminal import DOES_NOT_HOLD, HOLDS, complain, progress
from kfsheet.errors import DataError, UnwrittenError

if TYPE_CHECKING:
    from kfsheet.coursework.reports.assessment import Assessment
    from kfsheet.coursework.reports.grading import Handed, Result


def add_commands(commands: argparse._SubParsersAction, exercise: str) -> None:
    """Add the commands to those that there are; ``exercise`` says what an exercise is."""
    handout = commands.add_parser("handout", help="make every student's own assignment")
    grade = commands.add_parser("grade", help="grade what comes back")
    for command in (handout, grade):
        command.add_argument("exercise", metavar="EXERCISE", help=exercise)
    grade.add_argument("submissions", metavar="SUBMISSIONS", help="folder of what came back")
    for command in (handout, grade):
        command.add_argument(
            "--roster", required=True, metavar="FILE.csv", help="students: id,name[,email]"
        )
        command.add_argument(
            "--secret",
            metavar="FILE",
            help="the secret of the course (default: kfsheet.secret beside the roster)",
        )
        command.add_argument("--out", required=True, metavar="DIR", help="folder for the results")
        command.add_argument(
            "--jobs", type=_count, default=1, metavar="N", help="processes (default: 1)"
        )
    handout.add_argument(
        "--notebook", action="store_true", help="also write an assignment for nbgrader"
    )
    handout.add_argument(
        "--force", action="store_true", help="also replace handouts that would become others"
    )
    grade.add_argument(
        "--show-key", action="store_true", help="also write a right formula into the feedback"
    )
    handout.set_defaults(run=run_handout)
    grade.set_defaults(run=run_grade)


def _count(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 256:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number from 1 to 256")
    return int(text)


def _secret_path(arguments: argparse.Namespace) -> Path:
    return Path(arguments.secret or Path(arguments.roster).parent / "kfsheet.secret")


def _secret_of_handouts(arguments: argparse.Namespace) -> bytes:
    """The secret, which is made where nothing was handed out yet."""
    from kfsheet.coursework.handout.course_secret import read_secret
    from kfsheet.coursework.handout.handouts import holds_handouts

    path = _secret_path(arguments)
    if path.exists():
        return read_secret(path)
    if holds_handouts(arguments.out):
        raise DataError(
            f"{arguments.out} holds handouts, and there is no secret {path}; give theirs with "
            "--secret: a new one could not grade them (to begin anew, choose another --out)"
        )
    secret = read_secret(path, make=True)
    print(f"made the secret of the course: {path}; keep it, and to yourself")
    return secret


def run_handout(arguments: argparse.Namespace) -> int:
    """Write a workbook for every student, and its solution."""
    from kfsheet.coursework.handout.handouts import write_handouts
    from kfsheet.coursework.reading.roster import read_roster
    from kfsheet.exercises import load_exercise

    exercise = load_exercise(arguments.exercise)
    students = read_roster(arguments.roster)
    made = write_handouts(
        exercise,
        arguments.exercise,
        students,
        _secret_of_handouts(arguments),
        arguments.out,
        jobs=arguments.jobs,
        force=arguments.force,
    )
    for _ in progress(made, "handout", len(students), lambda path: path.parent.name):
        pass
    print(f"{len(students)} workbooks in {Path(arguments.out) / 'students'}")
    print(f"their solutions in {Path(arguments.out) / 'solutions'}; do not hand these out")
    if arguments.notebook:
        from kfsheet.coursework.handout.assignment_notebook import write_assignment

        print(write_assignment(exercise, arguments.out))
    return HOLDS


def run_grade(arguments: argparse.Namespace) -> int:
    """Grade a folder of submissions; a bad file is a status in the table, not an error."""
    try:
        return _grade(arguments)
    except UnwrittenError as error:  # a full disk is no wrong call
        complain(error)
        return DOES_NOT_HOLD


def _grade(arguments: argparse.Namespace) -> int:
    from kfsheet.coursework.handout.course_secret import read_secret
    from kfsheet.coursework.reading.results_folder import belongs_to, claim
    from kfsheet.coursework.reading.roster import read_roster
    from kfsheet.coursework.reading.submitted_files import passed_over, readable
    from kfsheet.coursework.reports.grading import grade, override
    from kfsheet.coursework.reports.overrides import read_overrides, with_all_marks
    from kfsheet.coursework.reports.report_files import write_reports
    from kfsheet.exercises import load_exercise

    exercise = load_exercise(arguments.exercise)
    students = read_roster(arguments.roster)
    out = Path(arguments.out)
    if not claim(out, "graded", exercise.name):
        other = belongs_to(out, "graded")
        raise DataError(f"{out} holds the results of {other}; give another --out")
    lines = read_overrides(out / "overrides.csv", exercise, {s.id for s in students})
    results, handed = grade(
        exercise,
        arguments.exercise,
        arguments.submissions,
        students,
        read_secret(_secret_path(arguments)),
        out,
        jobs=arguments.jobs,
        progress=lambda items, count: progress(items, "grade", count, _judged),
    )
    results = override([with_all_marks(r, exercise) for r in results], iter(lines))
    for path in write_reports(exercise, results, handed, out, show_key=arguments.show_key):
        print(path)
    _summarize(results, handed, out)
    if skipped := [readable(path.name) for path in passed_over(arguments.submissions, out)]:
        print(f"files passed over: {len(skipped)} ({', '.join(skipped[:5])})")
    return _whole(handed)


def _whole(handed: list[Handed]) -> int:
    """Exit status: whether all that was found could be judged, and kept."""
    from kfsheet.coursework.reports.assessment import NO_TOKEN, NOT_OWN

    found = [file.assessment for file in handed]
    if unwritten := sorted({a.unwritten for a in found if a.unwritten}):
        more = f" (and {len(unwritten) - 1} more files)" if len(unwritten) > 1 else ""
        raise UnwrittenError(f"{unwritten[0]}; then grade again{more}")
    ours = {a.status for a in found if a.student}
    if any(a.status == NO_TOKEN for a in found) and not ours:
        complain(DataError("no file carries a token of this course; is --secret the right file?"))
        return DOES_NOT_HOLD
    if ours == {NOT_OWN} and len(found) > 1:
        words = "no file holds its student's numbers; did the exercise change since the handout?"
        complain(DataError(words))
        return DOES_NOT_HOLD
    return HOLDS


def _summarize(results: list[Result], handed: list[Handed], out: Path) -> None:
    statuses = Counter(result.status for result in results)
    print("; ".join(f"{status}: {count}" for status, count in statuses.most_common()))
    if lost := sum(file.of_nobody for file in handed):
        print(f"files that belong to nobody: {lost}; see the end of {out / 'class.html'}")


def _judged(item: tuple[Path, Assessment]) -> str:
    """Whose file it was, or what it is called, and what came of it."""
    from kfsheet.coursework.reading.submitted_files import readable

    path, found = item
    return f"{found.student or readable(path.name)}, {found.status}"
