"""The command line: ``kfsheet build | check | show | handout | grade``."""

from __future__ import annotations

import argparse
import json
import os
import sys
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from kfsheet import __version__
from kfsheet.cli.coursework_commands import add_commands
from kfsheet.cli.terminal import DOES_NOT_HOLD, HOLDS, WRONG_USE, complain, progress
from kfsheet.errors import KfsheetError, ModelError, WorkbookError

if TYPE_CHECKING:
    from kfsheet.model.exercise import Exercise
    from kfsheet.workbook.check.report import Report

MOST_LINES = 20
ENGINE_NAMES = ("ironcalc", "libreoffice", "own")  # said again: --help imports no engines


class Parser(argparse.ArgumentParser):
    """Tells a wrong call in one line."""

    def error(self, message: str) -> NoReturn:
        """Print one line and leave with status 2."""
        self.exit(WRONG_USE, f"{self.prog}: {message}; see {self.prog} --help\n")


def parser() -> Parser:
    """The arguments of every command."""
    top = Parser(
        prog="kfsheet",
        description="Kalman filters derived once, and written as workbooks of live formulas.",
    )
    top.add_argument("--version", action="version", version=f"kfsheet {__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    exercise = "name of an exercise, or the path of a Python file that defines one"

    build = commands.add_parser("build", help="write workbooks")
    build.add_argument(
        "exercises", nargs="*", metavar="EXERCISE", help=f"{exercise} (default: all)"
    )
    build.add_argument(
        "--out", default="workbooks", metavar="DIR", help="folder (default: workbooks)"
    )
    build.add_argument(
        "--force", action="store_true", help="also replace a workbook that was changed"
    )
    build.set_defaults(run=run_build)

    check = commands.add_parser(
        "check", help="recalculate workbooks from nothing and compare them with NumPy"
    )
    check.add_argument("workbooks", nargs="+", metavar="WORKBOOK", help="an .xlsx file")
    check.add_argument(
        "--engine",
        choices=ENGINE_NAMES,
        default="ironcalc",
        help="who recalculates (default: ironcalc, which is built in)",
    )
    check.add_argument(
        "--exercise",
        metavar="FILE.py",
        help="the file that defines the exercise, for workbooks of your own",
    )
    check.add_argument(
        "--format", choices=["text", "json"], default="text", help="lines, or one JSON list"
    )
    check.set_defaults(run=run_check)

    show = commands.add_parser("show", help="print a model in another dress")
    show.add_argument("exercise", metavar="EXERCISE", help=exercise)
    show.add_argument(
        "--as",
        dest="dress",
        choices=["python", "latex", "excel", "table"],
        default="table",
        help="Python source, LaTeX, Excel formulas, or a table of numbers (default)",
    )
    show.set_defaults(run=run_show)
    add_commands(commands, exercise)
    return top


def run_build(arguments: argparse.Namespace) -> int:
    """Write workbooks."""
    from kfsheet.exercises import exercise_names, load_exercise
    from kfsheet.workbook.write.write_workbook import write_workbook

    specs = dict.fromkeys(arguments.exercises or exercise_names())
    exercises = [load_exercise(spec) for spec in specs]
    if Path(arguments.out).suffix == ".xlsx":
        raise WorkbookError(f"--out {arguments.out} is a file name; give a folder")
    written = []
    for exercise in progress(exercises, "build", len(exercises), lambda e: e.name):
        written.append(write_workbook(exercise, Path(arguments.out), force=arguments.force))
    for spec, exercise in zip(specs, exercises, strict=True):
        if spec not in exercise_names():  # ours keep the misprints of their sources, on switches
            _warn_of_units(exercise)
    for path in written:
        print(path)
    return HOLDS


def _warn_of_units(exercise: Exercise) -> None:
    for problem in exercise.model.check_units():
        print(f"kfsheet: warning: {exercise.name}, units of {problem}", file=sys.stderr)


def run_check(arguments: argparse.Namespace) -> int:
    """Check workbooks; one that cannot be checked does not keep the others from it."""
    status, found = HOLDS, []
    for path in progress(arguments.workbooks, "check", len(arguments.workbooks)):
        try:
            report = _check_one(Path(path), arguments)
        except KfsheetError as error:
            complain(error)
            status = WRONG_USE
            continue
        status = max(status, HOLDS if report.holds else DOES_NOT_HOLD)
        found.append(report.as_dict())
        if arguments.format == "text":
            _print_report(report)
    if arguments.format == "json":
        print(json.dumps(found, indent=1))
    return status


def _check_one(path: Path, arguments: argparse.Namespace) -> Report:
    from kfsheet.workbook.engines.recalculate import start_engine

    # It loads and calculates the workbook while SymPy is imported, which takes as long.
    started = start_engine(path, arguments.engine)
    from kfsheet.exercises import exercise_names, load_exercise
    from kfsheet.workbook.check.check_workbook import check_workbook

    def ours(name: str) -> Exercise:
        if name in exercise_names():
            return load_exercise(name)
        raise ModelError(
            f"{path} was built from {name!r}, which is not one of ours; "
            f"name its file: kfsheet check {path} --exercise {name}.py"
        )

    exercise = load_exercise(arguments.exercise) if arguments.exercise else ours
    return check_workbook(path, exercise, arguments.engine, started=started)


def _print_report(report: Report) -> None:
    lines = [f"{report.instead}; another one calculates"] if report.instead else []
    lines += [f"changed: {change}" for change in report.changed] + report.lines()[:MOST_LINES]
    if (more := len(report.lines()) - MOST_LINES) > 0:
        lines.append(f"... and {more} more lines like these")
    for line in (*lines, report.verdict):
        print(f"{report.path}: {line}")


def run_show(arguments: argparse.Namespace) -> int:
    """Print a model."""
    from kfsheet.cli.show import DRESSES
    from kfsheet.exercises import load_exercise

    print(DRESSES[arguments.dress](load_exercise(arguments.exercise).model))
    return HOLDS


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return the exit status: 0, 1 "it does not hold", 2 wrong use."""
    for stream in (sys.stdout, sys.stderr):  # a name may hold what the terminal cannot show
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        chosen = parser().parse_args(arguments)
        return chosen.run(chosen)
    except KfsheetError as error:
        complain(error)
    except KeyboardInterrupt:
        complain(RuntimeError("interrupted; nothing half-written was left"))
    except BrokenPipeError:
        # The reader of our output has gone, as `head` does; nothing is left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return HOLDS
    except Exception as error:  # a defect of ours: one line, and the traceback on request
        if os.environ.get("KFSHEET_DEBUG"):
            raise
        complain(RuntimeError(f"{type(error).__name__}: {error}; set KFSHEET_DEBUG=1 for more"))
    return WRONG_USE
