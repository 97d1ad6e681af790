"""A type checker knows the public names: a user's script passes mypy --strict, none is Any."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import kfsheet

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def mypy(script):
    """What mypy says, as of an installed package: mistakes in kfsheet itself are not its business.

    sympy and pandas ship hints but not the mark ``py.typed``; mypy reads them if told so. (Without
    them what sympy and pandas bring would be Any, and an assertion about it would be empty.)
    """
    config = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["mypy"]
    assert config["strict"]
    assert "ignore_missing_imports" not in config
    done = subprocess.run(
        [sys.executable, "-m", "mypy", script],
        cwd=ROOT,
        env=os.environ | {"MYPYPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    return done.stdout + done.stderr


def test_a_users_script_is_typed_throughout():
    assert mypy(HERE / "users_script.py").startswith("Success")


def test_one_run_is_a_table_and_many_are_a_study():
    assert mypy(HERE / "users_study.py").startswith("Success")


def test_a_wrong_type_is_found(tmp_path):
    (tmp_path / "wrong.py").write_text(
        "from kfsheet import write_workbook\nwrite_workbook('football', 3)\n"
    )
    said = mypy(tmp_path / "wrong.py")
    assert 'Argument 1 to "write_workbook" has incompatible type "str"' in said
    assert 'Argument 2 to "write_workbook" has incompatible type "int"' in said


def test_the_package_says_that_it_is_typed():
    assert (ROOT / "kfsheet" / "py.typed").exists()


@pytest.mark.parametrize("name", kfsheet.__all__)
def test_a_public_name_is_there(name):
    assert getattr(kfsheet, name) is not None


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="worlds"):
        kfsheet.worlds  # noqa: B018 - looking is the deed


def test_no_public_name_is_any(tmp_path):
    """What mypy reveals of each; a type such as ``type[Any]`` would hide every mistake as well."""
    names = [name for name in kfsheet.__all__ if name not in ("Missing", "t", "__version__")]
    lines = ["import kfsheet", *(f"reveal_type(kfsheet.{name})" for name in names)]
    (tmp_path / "names.py").write_text("\n".join(lines) + "\n")
    said = [line for line in mypy(tmp_path / "names.py").splitlines() if "Revealed" in line]
    assert len(said) == len(names)
    revealed = {n: line.split('"')[1] for n, line in zip(names, said, strict=True)}
    assert [n for n, kind in revealed.items() if kind in ("Any", "type[Any]")] == []
