"""Make the notebooks from their py:percent sources, and execute them, two at a time.

    python tools/execute_notebooks.py [notebooks/01_football.py ...]

Without names: those whose source, package or outputs have changed since they were executed here.

The same source gives the same file: cells are numbered, times and versions are left out, and a
cell tagged ``interactive`` (a widget, with random names) keeps no output and is not run here; nbval
runs it.
"""

from __future__ import annotations

import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import TYPE_CHECKING

from made import ROOT, everything, is_made, note_made

from kfsheet.files import write_file

# Jupyter's packages take seconds to import: they are imported where a notebook is to be executed.
if TYPE_CHECKING:
    from nbformat import NotebookNode

FOLDER = ROOT / "notebooks"
AT_A_TIME = 2
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def unexecuted(source: Path) -> NotebookNode:
    """The notebook of a source, without outputs."""
    import jupytext
    import nbformat

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


def executed(source: Path) -> NotebookNode:
    """The notebook of a source, with outputs and nothing that another run would change."""
    from nbclient import NotebookClient

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


def timed(source: Path) -> tuple[bytes, float]:
    """The file of an executed notebook, and the seconds that it took."""
    import nbformat

    begin = time.perf_counter()
    text = nbformat.writes(executed(source)) + "\n"
    return text.encode(), time.perf_counter() - begin


def main(names: list[str]) -> None:
    """Execute the notebooks named, or all that are not as their sources would make them."""
    package = everything()
    sources = [Path(name).resolve() for name in names] or sorted(FOLDER.glob("*.py"))
    stale = [s for s in sources if names or not is_made(s.with_suffix(".ipynb"), [*package, s])]
    # A kernel is a process of its own: a thread has only to wait for it.
    with ThreadPoolExecutor(AT_A_TIME) as pool:
        running = {pool.submit(timed, source): source for source in stale}
        for done in as_completed(running):
            source = running[done]
            content, seconds = done.result()
            write_file(source.with_suffix(".ipynb"), content)
            note_made(source.with_suffix(".ipynb"), [*package, source])
            print(f"    {source.stem}.ipynb: {seconds:.0f} s", flush=True)
    print(f"notebooks: {len(stale)} executed, {len(sources) - len(stale)} as they were")


if __name__ == "__main__":
    main(sys.argv[1:])
