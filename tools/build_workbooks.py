"""Build the workbooks whose sources have changed, the football first.

python tools/build_workbooks.py
"""

import sys
import time

from made import ROOT, everything, is_made, note_made

from kfsheet.errors import KfsheetError

FOLDER = ROOT / "workbooks"


def main() -> None:
    """Build what is not as the sources would make it."""
    sources = everything()
    models = (ROOT / "kfsheet" / "exercises").glob("*/model.py")
    names = sorted(
        (path.parent.name for path in models), key=lambda name: (name != "football", name)
    )
    stale = [name for name in names if not is_made(FOLDER / f"{name}.xlsx", sources)]
    for name in stale:
        build(name)
        note_made(FOLDER / f"{name}.xlsx", sources)
    print(f"workbooks: {len(stale)} built, {len(names) - len(stale)} as they were")


def build(name: str) -> None:
    """Write one, and say how long it took."""
    from kfsheet import load_exercise, write_workbook  # imports SymPy: seconds

    begin = time.perf_counter()
    try:
        path = write_workbook(load_exercise(name), FOLDER)
    except KfsheetError as error:  # somebody has changed it, or has it open
        sys.exit(f"{error}")
    print(f"    {path.name}: {time.perf_counter() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main()
