"""What is committed is what the sources make, and what README says is so."""

import re
import subprocess
import tomllib
from itertools import chain
from pathlib import Path

import pytest
import yaml
from conftest import MACHINE_PATH, without_images
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import kfsheet
from kfsheet import load_exercise
from kfsheet.cli.commands import parser
from kfsheet.exercises import exercise_names
from kfsheet.workbook.write.write_workbook import workbook_bytes

ROOT = Path(__file__).parents[1]
REGISTRY = r"pypi\.org|files\.pythonhosted"
WRITTEN = (
    *(".py", ".pyi", ".md", ".toml", ".txt", ".csv", ".yml", ".yaml", ".cff", ".ipynb"),
    *("Makefile", "run"),
)
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


PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CODE_OF_CONDUCT.md"]
PAGES += [ROOT / "SECURITY.md", ROOT / "benchmarks" / "README.md", *ROOT.glob("docs/*.md")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_to_a_file_leads_to_one(page):
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text()):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_readme_links_to_every_workbook_and_notebook():
    files = [*ROOT.glob("workbooks/*.xlsx"), *ROOT.glob("notebooks/*.ipynb")]
    links = set(re.findall(r"\]\(([^)]+)\)", README))
    assert {path.relative_to(ROOT).as_posix() for path in files} <= links


def test_readme_names_every_command():
    commands = next(a for a in parser()._actions if a.dest == "command").choices
    for command in commands:
        assert f"kfsheet {command}" in README


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]


def locked():
    """Package -> the versions that environment.txt pins, one or one for each Python."""
    versions = {}
    for line in (ROOT / "environment.txt").read_text().splitlines():
        if not line.startswith("#"):
            requirement = Requirement(line)
            (pin,) = requirement.specifier
            assert pin.operator == "==", line
            versions.setdefault(canonicalize_name(requirement.name), []).append(pin.version)
    return versions


def test_the_environment_holds_every_dependency_in_the_range_that_the_project_allows():
    for wanted in map(Requirement, [*PROJECT["dependencies"], *chain(*EXTRAS.values())]):
        if wanted.name != "kfsheet":
            versions = locked()[canonicalize_name(wanted.name)]
            assert all(wanted.specifier.contains(v, prereleases=True) for v in versions), wanted


def test_a_range_has_a_lower_bound_and_no_upper():
    """An upper bound is for the next major that is known to break; no such is known."""
    for wanted in map(Requirement, [*PROJECT["dependencies"], *chain(*EXTRAS.values())]):
        if wanted.name != "kfsheet":
            assert [s.operator for s in wanted.specifier] == [">="], wanted


def test_the_extra_all_is_every_extra_that_a_user_may_want():
    (everything,) = map(Requirement, EXTRAS["all"])
    assert everything.extras == set(EXTRAS) - {"all", "tests"}


def test_pre_commit_formats_as_the_environment_does():
    settings = (ROOT / ".pre-commit-config.yaml").read_text()
    assert re.findall(r"rev: v(\S+)", settings) == locked()["ruff"]


def test_the_citation_names_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == kfsheet.__version__
    # What the format 1.2.0 requires.
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert citation["authors"] == [{"name": "The kfsheet authors"}]


def test_the_changelog_begins_with_this_version():
    headings = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert headings[0] == kfsheet.__version__
    assert len(set(headings)) == len(headings)


def test_the_project_speaks_of_itself_alone():
    """No machine paths, no registry hosts, in any file that git knows."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout: which files belong to the project is not known")
    names = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    for name in names:
        if name.endswith(
            (
                ".py",
                ".md",
                ".toml",
                ".txt",
                ".csv",
                ".yml",
                ".yaml",
                ".cff",
                ".pyi",
                "Makefile",
                "run",
                ".ipynb",
            )
        ):
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
