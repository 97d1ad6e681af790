"""Build the workbooks whose sources have changed, the football first.

python tools/build_workbooks.py
"""

import sys
import time

from made import ROOT, everything, is_made, note_made

from kfsheet.cli.commands import main as kfsheet
from kfsheet.exercises import exercise_names

FOLDER = ROOT / "workbooks"


def main() -> int:
    """Build what is not as the sources would make it; the exit status is that of the command."""
    sources = everything()
    names = sorted(exercise_names(), key=lambda name: name != "football")
    stale = [name for name in names if not is_made(FOLDER / f"{name}.xlsx", sources)]
    for name in stale:
        begin = time.perf_counter()
        if status := kfsheet(["build", name, "--out", str(FOLDER.relative_to(ROOT))]):
            return status
        note_made(FOLDER / f"{name}.xlsx", sources)
        print(f"    {name}.xlsx: {time.perf_counter() - begin:.1f} s", flush=True)
    print(f"workbooks: {len(stale)} built, {len(names) - len(stale)} as they were")
    return 0


if __name__ == "__main__":
    sys.exit(main())
