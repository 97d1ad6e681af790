"""The questions of an exercise as a notebook that nbgrader can hand out and grade.

Each question is a function of the quantities that its column reads. Its tests compare it with the
key in whole runs of the model; most of them are hidden from the students.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from sympy import Basic, Dummy, Expr, Indexed, Symbol

from kfsheet.coursework.judging.calculated_answers import Value
from kfsheet.coursework.judging.model_runs import ModelRuns, World
from kfsheet.errors import ModelError
from kfsheet.files import write_file
from kfsheet.model.exercise import Exercise, Question
from kfsheet.model.expressions import lag, t
from kfsheet.printing.python import python_code
from kfsheet.printing.sentence import words_of

POINTS_SHOWN, POINTS_HIDDEN = 1, 4
BEGIN, END = "### BEGIN SOLUTION", "### END SOLUTION"
HIDDEN = re.compile(r"### BEGIN HIDDEN TESTS.*?### END HIDDEN TESTS\n?", re.DOTALL)
SOLUTION = re.compile(rf"( *){BEGIN}.*?{END}", re.DOTALL)
START = (
    "from math import *\n\n"
    "from kfsheet.evaluation.numerics import observed, sign\n\n\n"
    "def close(found, wanted):\n"
    "    if isnan(wanted):\n"
    "        return isnan(found)\n"
    "    return isclose(found, wanted, rel_tol=1e-9, abs_tol=1e-12)"
)


def write_assignment(exercise: Exercise, out: str | Path) -> Path:
    """Write ``nbgrader/source`` and ``nbgrader/release`` below ``out``; the latter is returned.

    Raises
    ------
    ModelError
        If nbformat is not installed, or the exercise asks nothing.
    """
    try:
        import nbformat
    except ImportError:
        raise ModelError("notebooks need nbformat: pip install 'kfsheet[notebooks]'") from None
    for kind in ("source", "release"):
        made = assignment(exercise, solved=kind == "source")
        path = Path(out) / "nbgrader" / kind / exercise.name / f"{exercise.name}.ipynb"
        write_file(path, (nbformat.writes(made) + "\n").encode())
    return path


def assignment(exercise: Exercise, *, solved: bool) -> Any:
    """The notebook, with solutions and hidden tests or, for students, without."""
    from nbformat import v4

    if not exercise.questions:
        raise ModelError(f"{exercise.name} asks no questions; list them in Exercise(questions=...)")
    runs = ModelRuns(exercise)
    values = runs.base.scalars
    about = [words_of(sentence, values) for sentence in exercise.story(values)]
    cells = [
        v4.new_markdown_cell("\n\n".join([f"# {exercise.title}", *about])),
        v4.new_code_cell(START),
        *(cell for question in exercise.questions for cell in _cells(runs, question)),
    ]
    for number, cell in enumerate(cells, 1):
        cell.id = f"cell-{number:02d}"
        if not solved:
            cell.source = HIDDEN.sub("", SOLUTION.sub(_blank, cell.source)).rstrip()
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return v4.new_notebook(cells=cells, metadata={"kernelspec": kernel})


def _blank(match: re.Match[str]) -> str:
    return f"{match[1]}# YOUR CODE HERE\n{match[1]}raise NotImplementedError()"


def _cells(runs: ModelRuns, question: Question) -> Iterator[Any]:
    from nbformat import v4

    model, name = runs.model, question.name
    scalar = model.derived_scalars.get(name)
    item = scalar or model.column(name)
    key, names = _with_arguments(item.expression)
    words = f"**{name}** ({question.points}): {item.description}. {question.hint}"
    yield v4.new_markdown_cell(words)
    head = f"def {name}({', '.join(names.values())}):"
    body = f"    {BEGIN}\n    return {python_code(key)}\n    {END}"
    yield v4.new_code_cell(f"{head}\n{body}", metadata=_metadata(f"{name}-answer", solution=True))
    tests = list(_tests(runs, name, names))
    hidden = ["### BEGIN HIDDEN TESTS", *tests[POINTS_SHOWN:], "### END HIDDEN TESTS"]
    text = "\n".join([*tests[:POINTS_SHOWN], *hidden])
    yield v4.new_code_cell(text, metadata=_metadata(f"{name}-test", points=question.points))


def _metadata(grade_id: str, *, solution: bool = False, points: int = 0) -> dict[str, Any]:
    cell = {
        "grade": bool(points),
        "grade_id": grade_id,
        "locked": bool(points),
        "schema_version": 3,
        "solution": solution,
        "task": False,
    }
    return {"nbgrader": {**cell, "points": points} if points else cell}


def _with_arguments(key: Expr) -> tuple[Expr, dict[Basic, str]]:
    """The key as a function: cells become arguments, ``x_a[t - 1]`` is ``x_a_before``."""
    names: dict[Basic, str] = {}
    cells = sorted(key.atoms(Indexed), key=lambda c: (str(c.base.label), int(lag(c))))
    for cell in cells:
        names[cell] = str(cell.base.label) + ("", "_before", "_before2")[int(lag(cell))]
    # The row t may stand in the index of a cell, in the formula itself, or in both.
    stand_ins = {cell: Dummy(real=True) for cell in cells}
    beside = key.xreplace(stand_ins).free_symbols - set(stand_ins.values())
    for symbol in sorted(beside, key=str):
        names[symbol] = symbol.name
    return key.xreplace({node: Symbol(name, real=True) for node, name in names.items()}), names


def _tests(runs: ModelRuns, name: str, names: dict[Basic, str]) -> Iterator[str]:
    row, wanted = runs.model.rows // 2, POINTS_SHOWN + POINTS_HIDDEN
    points = ((world, step) for step in (row, row + 1, row - 1) for world in runs.worlds)
    for world, step in islice(points, wanted):
        given = ", ".join(_number(_at(world, node, step)) for node in names)
        yield f"assert close({name}({given}), {_number(world.cell(name, step))})"


def _at(world: World, node: Basic, row: int) -> Value:
    if node == t:
        return float(row)
    if node.is_Symbol:
        return world.cell(node.name)
    return world.cell(str(node.base.label), int(node.indices[0].subs(t, row)))


def _number(value: Value) -> str:
    """A value as source."""
    return repr(value) if isinstance(value, float) else "nan"
