"""Imports run one way, and in no circle: the contract of pyproject.toml holds, and can fail."""

import graphlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[2]


def verdict(root):
    """What import-linter says of the package ``kfsheet`` that lies in ``root``."""
    program = "from importlinter.cli import import_linter as run; run()"
    options = ("lint", "--no-cache", str(ROOT / "pyproject.toml"))
    done = subprocess.run(
        [sys.executable, "-c", program, *options],
        cwd=root,
        env=os.environ | {"PYTHONPATH": str(root), "NO_COLOR": "1"},
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stdout + done.stderr


@pytest.fixture
def planted(tmp_path):
    """Add lines to a copy of the package; returns what the contract then says."""
    shutil.copytree(ROOT / "kfsheet", tmp_path / "kfsheet")

    def plant(**lines):
        for module, line in lines.items():
            path = tmp_path / "kfsheet" / f"{module.replace('__', '/')}.py"
            path.write_text(path.read_text() + line)
        return verdict(tmp_path)

    return plant


def test_the_contract_holds():
    status, said = verdict(ROOT)
    assert status == 0, said


def test_a_late_import_against_the_order_breaks_it(planted):
    status, said = planted(model__names="\n\ndef late():\n    import kfsheet.cli.show\n")
    assert status == 1
    assert "kfsheet.model is not allowed to import kfsheet.cli" in said


def test_an_import_for_types_only_breaks_it(planted):
    late = "\nfrom typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import kfsheet.cli.show\n"
    status, said = planted(printing__latex=late)
    assert status == 1
    assert "kfsheet.printing is not allowed to import kfsheet.cli" in said


def test_a_circle_of_two_files_of_a_package_breaks_it(planted):
    status, said = planted(
        printing__latex="\n\ndef late():\n    import kfsheet.printing.python\n",
        printing__python="\n\ndef late():\n    import kfsheet.printing.latex\n",
    )
    assert status == 1
    assert "No cycles are allowed in kfsheet.printing" in said


def test_a_package_that_the_contract_does_not_name_breaks_it(planted, tmp_path):
    (tmp_path / "kfsheet" / "misc.py").touch()
    status, said = planted()
    assert status == 1
    assert "kfsheet.misc" in said


def test_no_file_is_in_a_circle_with_the_init_of_its_package():
    """The contract compares neighbours; it does not see an ``__init__`` beside what is below it."""
    graph = grimp.build_graph("kfsheet")
    reads = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    graphlib.TopologicalSorter(reads).prepare()  # raises CycleError, which names the circle


FRONT_DOOR = re.compile(r"^\s*(?:import kfsheet(?:\s+as .*|,.*)?|from kfsheet import .*)$", re.M)


def through_the_front_door(package):
    """Imports of ``kfsheet`` itself, late ones too, but for its version."""
    found = [(path, line) for path in package.rglob("*.py") for line in lines_of(path)]
    return [(path.name, line) for path, line in found if line != "from kfsheet import __version__"]


def lines_of(path):
    code = re.sub(r'"""(?s:.*?)"""', "", path.read_text(encoding="utf-8"))  # examples may
    return [line.strip() for line in FRONT_DOOR.findall(code)]


def test_inside_the_package_nothing_is_imported_through_its_front_door(planted, tmp_path):
    """``from kfsheet import evaluate`` would hide from the contract where evaluate comes from."""
    assert through_the_front_door(ROOT / "kfsheet") == []
    planted(model__names="\n\ndef late():\n    import kfsheet\n    return kfsheet.evaluate\n")
    assert through_the_front_door(tmp_path / "kfsheet") == [("names.py", "import kfsheet")]
