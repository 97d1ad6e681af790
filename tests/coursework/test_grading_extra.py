"""What only grading needs may be missing: the rest works, handout and grade say what to install."""

import subprocess
import sys

import pytest

BLOCKED = "import sys; sys.modules.update(dict.fromkeys({names!r}))\n"  # None: no such module


def without(names, program, *arguments):
    """The program's process, in which nothing of these names can be imported."""
    text = BLOCKED.format(names=names) + program
    return subprocess.run([sys.executable, "-c", text, *arguments], capture_output=True, text=True)


def test_evaluate_build_show_check_and_reading_formulas_need_nothing_of_grading(tmp_path):
    program = """
from kfsheet import evaluate, load_exercise
from kfsheet.cli.commands import main
from kfsheet.parsing.formula import read_formula
assert len(evaluate(load_exercise("football").model)) == 16
assert read_formula("=2^3^2") == 64
assert main(["build", "football", "--out", sys.argv[1]]) == 0
assert main(["check", sys.argv[1] + "/football.xlsx"]) == 0
assert main(["show", "football", "--as", "excel"]) == 0
"""
    done = without(["matplotlib"], program, str(tmp_path))
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", ["ironcalc", "matplotlib"])
@pytest.mark.parametrize("command", ["handout", "grade"])
def test_handout_and_grade_name_the_extra_in_one_line(command, name, tmp_path):
    (tmp_path / "roster.csv").write_text("id,name\ns1,Ada\n")
    program = "from kfsheet.cli.commands import main; sys.exit(main(sys.argv[1:]))"
    folder = [str(tmp_path)] if command == "grade" else []
    files = ["--roster", str(tmp_path / "roster.csv"), "--out", str(tmp_path / "out")]
    done = without([name], program, command, "football", *folder, *files)
    assert done.returncode != 0
    assert done.stderr == (
        f'kfsheet: handouts and grading need {name}: pip install "kfsheet[grading]"\n'
    )
    assert not (tmp_path / "out").exists()
