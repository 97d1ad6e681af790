"""The exercises, and how to find one: by name, or as the path of anybody's Python file.

Here belongs a folder for each exercise, with its model, words, charts, data and the methods that
only it uses. Nothing here may have a privilege over a lecturer's own file: what an exercise needs
of kfsheet is public. Begin with :mod:`kfsheet.exercises.football.model`, the smallest.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import sys
import traceback
from pathlib import Path

from kfsheet.errors import KfsheetError, ModelError
from kfsheet.model.exercise import Exercise


def exercise_names() -> list[str]:
    """Names of the exercises that come with kfsheet; a leading underscore marks a part of one."""
    names = (module.name for module in pkgutil.iter_modules(__path__) if module.ispkg)
    return sorted(name for name in names if not name.startswith("_"))


def load_exercise(spec: str) -> Exercise:
    """The exercise called ``spec``, or the one in the Python file at that path.

    A file defines the name ``exercise``, an :class:`~kfsheet.model.exercise.Exercise`; ours do the
    same.

    Raises
    ------
    ModelError
        If there is no such exercise or file, the file fails, or it defines no exercise.
    """
    if spec in exercise_names():
        return _exercise_in(importlib.import_module(f"{__name__}.{spec}"), spec)
    path = Path(spec)
    if path.suffix != ".py":
        names = ", ".join(exercise_names())
        raise ModelError(f"unknown exercise {spec!r}; there is {names}, or give a Python file")
    if not path.is_file():
        raise ModelError(f"{path} does not exist; give the path of a Python file")
    return _exercise_in(_run_file(path), str(path))


def _run_file(path: Path) -> object:
    name = f"kfsheet_exercise_{path.stem}"
    specification = importlib.util.spec_from_file_location(name, path.resolve())
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    try:
        specification.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # whatever a user's file raises is told in one line
        lines = [
            f
            for f in traceback.extract_tb(error.__traceback__)
            if f.filename == str(path.resolve())
        ]
        number = getattr(error, "lineno", None) or (lines[-1].lineno if lines else "?")
        kind = "" if isinstance(error, KfsheetError) else f"{type(error).__name__}: "
        raise ModelError(f"{path}, line {number}: {kind}{error}") from None
    return module


def _exercise_in(module: object, where: str) -> Exercise:
    exercise = getattr(module, "exercise", None)
    if not isinstance(exercise, Exercise):
        raise ModelError(f"{where} defines no exercise; end it with: exercise = Exercise(...)")
    return exercise
