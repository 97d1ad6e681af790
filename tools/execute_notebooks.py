"""Make the notebooks from their py:percent sources, and execute them.

    python tools/execute_notebooks.py [notebooks/01_football.py ...]

The same source gives the same file: cells are numbered, times and versions are left out, and a
cell tagged ``interactive`` (a widget, with random names) keeps no output and is not run here; nbval
runs it.
"""

import os
import sys
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

from kfsheet.cli.terminal import progress
from kfsheet.files import write_file

FOLDER = Path(__file__).parents[1] / "notebooks"
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def unexecuted(source: Path) -> nbformat.NotebookNode:
    """The notebook of a source, without outputs."""
    notebook = jupytext.read(source)
    for number, cell in enumerate(notebook.cells, 1):
        cell.id = f"cell-{number:02d}"
    notebook.metadata = nbformat.from_dict(
        {
            "jupytext": {"formats": "ipynb,py:percent"},
            "kernelspec": KERNEL,
            "language_info": {"name": "python"},
        }
    )
    notebook.nbformat, notebook.nbformat_minor = 4, 5
    return notebook


def executed(source: Path) -> nbformat.NotebookNode:
    """The notebook of a source, with outputs and nothing that another run would change."""
    notebook = unexecuted(source)
    widgets = [c for c in notebook.cells if "interactive" in c.metadata.get("tags", [])]
    sources = [cell.source for cell in widgets]
    for cell in widgets:
        cell.source = "pass"
    client = NotebookClient(
        notebook,
        timeout=300,
        coalesce_streams=True,  # else it is chance in how many pieces lines are stored
        resources={"metadata": {"path": str(FOLDER)}},
        extra_arguments=["--IPKernelApp.log_level=40"],  # errors only
    )
    # A progress bar is no output that could be compared.
    client.execute(env={**os.environ, "TQDM_DISABLE": "1"})
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
    for cell, text in zip(widgets, sources, strict=True):
        cell.source = text
    notebook.metadata = unexecuted(source).metadata
    return notebook


def main(names: list[str]) -> None:
    """Execute the notebooks named, or all."""
    sources = [Path(name) for name in names] or sorted(FOLDER.glob("*.py"))
    for source in progress(sources, "notebook", len(sources), lambda s: s.name):
        text = nbformat.writes(executed(source)) + "\n"
        write_file(source.with_suffix(".ipynb"), text.encode())


if __name__ == "__main__":
    main(sys.argv[1:])
