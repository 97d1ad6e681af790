"""Assignments for nbgrader, handed out and graded by nbgrader itself."""

import csv
import os
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

from kfsheet import load_exercise
from kfsheet.coursework.handout.assignment_notebook import assignment, write_assignment
from kfsheet.exercises import exercise_names

NBGRADER = str(Path(sys.executable).parent / "nbgrader")


@pytest.mark.parametrize("name", exercise_names())
def test_a_students_notebook_holds_no_solution(name):
    exercise = load_exercise(name)
    solved, blank = assignment(exercise, solved=True), assignment(exercise, solved=False)
    nbformat.validate(blank)
    text = nbformat.writes(blank)
    for word in ("SOLUTION", "HIDDEN"):
        assert word in nbformat.writes(solved)
        assert word not in text
    kinds = [c.metadata.get("nbgrader", {}) for c in blank.cells]
    assert sum(k.get("solution", False) for k in kinds) == len(exercise.questions)
    assert sum(k.get("points", 0) for k in kinds) == sum(q.points for q in exercise.questions)


@pytest.fixture(scope="module")
def scores(tmp_path_factory):
    """Scores by student of all exercises, from nbgrader's own gradebook."""
    course = tmp_path_factory.mktemp("course")
    home = str(Path(sys.executable).parent)  # nbgrader calls alembic by its name
    environment = {**os.environ, "HOME": str(course), "JUPYTER_CONFIG_DIR": str(course)}
    environment["PATH"] = os.pathsep.join([home, environment.get("PATH", "")])

    def nbgrader(*arguments):
        command = [NBGRADER, *arguments, f"--CourseDirectory.root={course}"]
        done = subprocess.run(command, cwd=course, capture_output=True, text=True, env=environment)
        assert done.returncode == 0, done.stderr[-2000:]

    found = {}
    for name in ("football",):
        exercise = load_exercise(name)
        write_assignment(exercise, course)
        shutil.copytree(course / "nbgrader" / "source", course / "source", dirs_exist_ok=True)
        nbgrader("generate_assignment", name)
        made = course / "release" / name / f"{name}.ipynb"
        ours = course / "nbgrader" / "release" / name / f"{name}.ipynb"
        papers = {"untouched": made, "ours": ours, "solution": course / "source" / name / made.name}
        for student, paper in papers.items():
            target = course / "submitted" / student / name / made.name
            target.parent.mkdir(parents=True)
            shutil.copy(paper, target)
        nbgrader("autograde", name)
    nbgrader("export", f"--to={course / 'grades.csv'}")
    with (course / "grades.csv").open() as file:
        for line in csv.DictReader(file):
            scores = (float(line["score"]), float(line["max_score"]))
            found[line["assignment"], line["student_id"]] = scores
    return found


def test_nbgrader_gives_the_untouched_0_and_the_solution_all(scores):
    total = sum(q.points for q in load_exercise("football").questions)
    assert scores["football", "untouched"] == (0, total)
    assert scores["football", "ours"] == (0, total)
    assert scores["football", "solution"] == (total, total)


def run(notebook):
    """Run the code cells of a notebook; how many of its tests fail."""
    names, failed = {}, 0
    for cell in notebook.cells:
        if cell.cell_type == "code":
            try:
                exec(cell.source, names)
            except (AssertionError, NotImplementedError):
                failed += 1
    return failed


@pytest.mark.parametrize("name", exercise_names())
def test_the_solution_passes_every_test_and_the_blank_none(name):
    exercise = load_exercise(name)
    assert run(assignment(exercise, solved=True)) == 0
    assert run(assignment(exercise, solved=False)) == len(exercise.questions)
