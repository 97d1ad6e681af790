"""``kfsheet show``: every exercise in every dress, and what the dresses say."""

import re

import pytest
import sympy as sp

from kfsheet import excel_code, latex_code, load_exercise, python_code
from kfsheet.cli.show import DRESSES
from kfsheet.exercises import exercise_names
from kfsheet.model.expressions import Aggregate, ColumnBase
from kfsheet.printing.latex import latex_name, verbatim_name

AGGREGATES = Aggregate.__subclasses__()


def aggregate(kind):
    (count,) = kind.nargs
    return kind(*(ColumnBase(name, real=True) for name in ("x", "y")[:count]))


@pytest.mark.parametrize("dress", DRESSES)
@pytest.mark.parametrize("name", exercise_names())
def test_every_exercise_can_be_shown_in_every_dress(name, dress):
    model = load_exercise(name).model
    text = DRESSES[dress](model)
    for summary in model.summaries:
        latex = {latex_name(summary), verbatim_name(summary)}
        assert any(name in text for name in (latex if dress == "latex" else {summary}))


@pytest.mark.parametrize("kind", AGGREGATES, ids=lambda kind: kind.__name__)
def test_every_printer_knows_every_aggregate(kind):
    """SymPy's printers too, which go by the name of a class and have a Sum of their own."""
    one = aggregate(kind)
    cells = {arg: f"$B${n}:$B${n + 8}" for n, arg in enumerate(one.args, 4)}
    cells[one] = "$B$12"  # what Last asks for
    for expression in (one, one**2 / 2):
        assert kind.__name__ in str(expression)
        assert kind.__name__ in latex_code(expression)
        assert kind.__name__ in sp.latex(expression)
        assert kind.__name__ in sp.pretty(expression)
        assert "x" in python_code(expression)
        assert "$B$" in excel_code(expression, cells.__getitem__)


def test_the_table_shows_both_ends_of_a_long_run_in_80_columns():
    """The cannon-ball flies for more than a thousand rows."""
    model = load_exercise("cannonball").model
    lines = DRESSES["table"](model).splitlines()
    assert max(map(len, lines)) <= 80
    assert len(lines) < 1000
    assert f"rows 0 to 4 and {model.rows - 5} to {model.rows - 1} of {model.rows}" in lines[0]
    first = {line.split()[0] for line in lines if line[:1].isdigit() or line[:1] == " "}
    assert {"0", "4", str(model.rows - 5), str(model.rows - 1)} <= first
    assert not {"5", str(model.rows - 6)} & first


def test_every_formula_stands_in_the_same_place_of_its_line():
    lines = DRESSES["excel"](load_exercise("tennis").model).splitlines()
    cells = [re.match(r"  (\S*) +[A-Z]+\d+ +(=|\(data\)|\(empty\))", line) for line in lines]
    found = [match for match in cells if match]
    assert len({match.start(2) for match in found}) == 1
    assert len(found) == sum(line.startswith("  ") for line in lines)
    assert "(empty)" in {match[2] for match in found}


def test_latex_start_rows_speak_of_their_own_rows():
    """Row 0 is row 0 on both sides, and a parameter is no row of a column of the same name."""
    lines = DRESSES["latex"](load_exercise("football").model).splitlines()
    starts = [line for line in lines if re.match(r"  \S*\d\} &= ", line)]
    assert len(starts) > 10
    assert [line for line in starts if re.search(r"[{,]t[-},]", line)] == []
    sides = [line.rstrip("\\ ").split(" &= ") for line in starts]
    assert [left.strip() for left, right in sides if left.strip() in right] == []
    assert r"  u_{0} &= \mathtt{u\_0} \\" in lines
