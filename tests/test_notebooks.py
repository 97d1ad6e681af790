"""Notebooks are executed, match their sources, and hold outputs that nbval can compare."""

import re
import sys
from pathlib import Path

import nbformat
import pytest
from conftest import MACHINE_PATH, without_images

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tools"))
from execute_notebooks import unexecuted  # noqa: E402 - from tools/, which is no package

SOURCES = sorted((ROOT / "notebooks").glob("*.py"))
LEAST_COMPARED = 10
NOT_COMPARED = {"image/png", "text/latex"}


@pytest.fixture(params=SOURCES, ids=lambda path: path.stem)
def source(request):
    return request.param


def notebook_of(source):
    return nbformat.read(source.with_suffix(".ipynb"), as_version=4)


def code_cells(source):
    return [cell for cell in notebook_of(source).cells if cell.cell_type == "code"]


def tags(cell):
    return cell.metadata.get("tags", [])


def test_there_are_notebooks():
    assert SOURCES


def test_a_notebook_is_its_source_executed(source):
    written, made = notebook_of(source), unexecuted(source)
    assert [(c.cell_type, c.source, c.id) for c in written.cells] == [
        (c.cell_type, c.source, c.id) for c in made.cells
    ]
    assert written.metadata == made.metadata


def test_every_code_cell_was_executed_in_order_and_none_failed(source):
    cells = code_cells(source)
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1))
    kinds = {output.output_type for cell in cells for output in cell.outputs}
    assert "error" not in kinds


def test_nbval_has_enough_to_compare(source):
    """A notebook without outputs passes nbval; this one has them."""
    compared = [
        output
        for cell in code_cells(source)
        if not {"nbval-ignore-output", "nbval-skip"} & set(tags(cell))
        for output in cell.outputs
        if output.output_type == "stream" or set(output.data) - NOT_COMPARED
    ]
    assert len(compared) >= LEAST_COMPARED


def test_only_interactive_cells_are_left_out_of_the_comparison(source):
    for cell in code_cells(source):
        assert ("nbval-ignore-output" in tags(cell)) == ("interactive" in tags(cell))
        assert "nbval-skip" not in tags(cell)
        assert ("interact" in cell.source) == ("interactive" in tags(cell))


def test_nothing_machine_dependent_is_kept(source):
    text = without_images(source.with_suffix(".ipynb").read_text())
    assert re.search(MACHINE_PATH, text) is None
    for word in ("np.float64", "0x7f", "Traceback", "stderr"):
        assert word not in text


def test_cells_are_short_and_prose_leads_to_them(source):
    cells = notebook_of(source).cells
    lengths = sorted(len(c.source.splitlines()) for c in cells if c.cell_type == "code")
    assert lengths[len(lengths) // 2] <= 6
    assert lengths[-1] <= 15
    assert cells[0].source.startswith("# ")
    for kind in ("**Routine**", "**Break it**", "**Extend it**"):
        assert kind in cells[-1].source
