"""What README shows works as it stands."""

import re
from pathlib import Path

import pytest

from kfsheet.cli.commands import main

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
WALK, MANY = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


def test_the_filter_that_readme_shows_builds_and_agrees(tmp_path, monkeypatch, capsys):
    (tmp_path / "walk.py").write_text(WALK, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    shown = re.search(r"```sh\nkfsheet (.*)\nkfsheet (.*)\n```", README)
    for call in shown.groups():
        assert main(call.split()) == 0
    assert "formulas agree with NumPy in IronCalc" in capsys.readouterr().out
    names = re.search(r"columns \(`z_f`.*?\.\.\.\)", README, re.DOTALL)[0]
    namespace = {}
    exec(WALK, namespace)
    assert set(re.findall(r"`(\w+)`", names)) <= set(namespace["m"].table)
    assert namespace["m"].check_units() == []


def test_the_study_that_readme_shows_runs():
    namespace = {}
    exec(MANY.replace("10_000", "20"), namespace)
    flights = namespace["flights"]
    assert flights.members == 20
    assert flights.rows["NEES"]["mean"].iloc[-1] == pytest.approx(4, abs=3)
