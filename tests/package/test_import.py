"""``import kfsheet`` costs next to nothing: what is heavy is imported when it is used."""

import re
import subprocess
import sys

import pytest

HEAVY = {"numpy", "sympy", "pandas", "openpyxl", "scipy", "pint", "matplotlib", "numba", "ironcalc"}
SECONDS = 0.1


def fresh(program, *options):
    """A program in a process of its own, as ``python -c``."""
    return subprocess.run(
        [sys.executable, *options, "-c", program], capture_output=True, text=True, check=True
    )


@pytest.mark.parametrize("use", ["kfsheet", "kfsheet.__version__", "kfsheet.KfsheetError"])
def test_what_is_light_imports_nothing_heavy(use):
    modules = fresh(f"import sys, kfsheet; {use}; print(*sys.modules)").stdout.split()
    assert not HEAVY & set(modules)


def test_importing_kfsheet_is_quick():
    """The least of three: a busy machine is not a slow package."""
    told = [fresh("import kfsheet", "-X", "importtime").stderr for _ in range(3)]
    seconds = [int(re.search(r"(\d+) \| kfsheet\n", text)[1]) / 1e6 for text in told]
    assert min(seconds) < SECONDS
