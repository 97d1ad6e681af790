"""What is committed is what the sources make, and what README says is so."""

import re
import subprocess
import tomllib
from itertools import chain
from pathlib import Path

import pytest
from conftest import MACHINE_PATH, without_images

from kfsheet import load_exercise
from kfsheet.cli.commands import parser
from kfsheet.exercises import exercise_names
from kfsheet.workbook.write.write_workbook import workbook_bytes

ROOT = Path(__file__).parents[1]
REGISTRY = r"pypi\.org|files\.pythonhosted"
README = (ROOT / "README.md").read_text()


@pytest.mark.parametrize("name", exercise_names())
def test_the_committed_workbook_is_what_the_sources_build(name):
    committed = (ROOT / "workbooks" / f"{name}.xlsx").read_bytes()
    assert committed == workbook_bytes(load_exercise(name)), "run: make workbooks"


@pytest.mark.parametrize("name", exercise_names())
def test_every_exercise_stands_in_readme_with_its_files(name):
    exercise = load_exercise(name)
    for path in (f"workbooks/{name}.xlsx", exercise.notebook):
        assert path in README
        assert (ROOT / path).exists()


def test_no_workbook_is_left_of_an_exercise_that_is_gone():
    assert {p.stem for p in (ROOT / "workbooks").glob("*.xlsx")} == set(exercise_names())


def test_every_file_that_readme_names_exists():
    for path in re.findall(r"`((?:workbooks|notebooks|tests|tools)/[^`]+)`", README):
        assert (ROOT / path).exists(), path
    for path in re.findall(r"\]\(([^)]+)\)", README):
        assert (ROOT / path).exists(), path


def test_readme_names_every_command():
    commands = next(a for a in parser()._actions if a.dest == "command").choices
    for command in commands:
        assert f"kfsheet {command}" in README


def test_the_environment_holds_every_pin_of_the_project():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [*project["dependencies"], *chain(*project["optional-dependencies"].values())]
    lines = (ROOT / "environment.txt").read_text().splitlines()
    pins = {line.split(";")[0].strip().lower() for line in lines}
    assert {w.lower() for w in wanted} <= pins
    assert all("==" in line for line in lines if not line.startswith("#"))


def test_the_project_speaks_of_itself_alone():
    """No machine paths, no registry hosts, in any file that git knows."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout: which files belong to the project is not known")
    names = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    for name in names:
        if name.endswith((".py", ".md", ".toml", ".txt", ".csv", "Makefile", "run", ".ipynb")):
            text = without_images((ROOT / name).read_text())
            found = re.search(MACHINE_PATH + "|" + REGISTRY, text)
            assert not found, (name, found)


@pytest.mark.parametrize("part", ["home", "tmp", "Users", "anywhere"])
def test_a_machine_path_is_known_by_its_shape(part):
    assert re.search(MACHINE_PATH, f"open('/{part}/somebody/file.txt')")
    assert not re.search(MACHINE_PATH, f"https://example.org/{part}/file a/{part}/b x / {part} / y")


def test_no_line_of_python_is_longer_than_100():
    for path in [*ROOT.glob("kfsheet/**/*.py"), *ROOT.glob("tests/*.py"), *ROOT.glob("tools/*.py")]:
        assert max(map(len, path.read_text().splitlines()), default=0) <= 100, path
