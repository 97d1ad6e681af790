"""docs/architecture.md says where things are; each thing that it names is there."""

import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
NAMES = sorted(set(re.findall(r"`(kfsheet(?:\.\w+)+)`", PAGE)))
PATHS = sorted(set(re.findall(r"(?<![\w/.])(?:kfsheet|tests|docs)/[\w./]*", PAGE)))


def found(name):
    """What a dotted name means: a module, or something in it."""
    parts = name.split(".")
    for n in range(len(parts), 0, -1):
        try:
            thing = import_module(".".join(parts[:n]))
        except ModuleNotFoundError:
            continue
        for part in parts[n:]:
            thing = getattr(thing, part)
        return thing
    raise ModuleNotFoundError(name)


@pytest.mark.parametrize("name", NAMES)
def test_every_name_on_the_page_can_be_imported(name):
    assert found(name) is not None


@pytest.mark.parametrize("path", PATHS)
def test_every_path_on_the_page_is_there(path):
    assert (ROOT / path).exists()


def test_the_page_names_each_package_and_ten_changes():
    rooms = {p.parent.name for p in (ROOT / "kfsheet").glob("*/__init__.py")} - {"tennis"}
    assert rooms <= {name.split(".")[1] for name in NAMES}
    changes = PAGE.split("## Where do I put ...")[1].split("## Tests")[0]
    assert len(re.findall(r"^\| an? ", changes, flags=re.MULTILINE)) >= 10
    assert len(PATHS) > 20


def test_the_test_that_the_page_runs_exists():
    path, word = re.search(r"pytest (\S+) -k (\w+)", PAGE).groups()
    assert re.search(rf"def test_\w*{word}", (ROOT / path).read_text(encoding="utf-8"))
