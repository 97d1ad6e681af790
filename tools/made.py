"""What was made of what, so that ``make`` does again only what has changed.

Contents are compared, not times: a fresh clone gives every file the time of the cloning.
"""

import hashlib
import json
import sys
from collections.abc import Iterable
from itertools import chain
from pathlib import Path

from kfsheet.files import write_file

ROOT = Path(__file__).parents[1]
NOTES = Path(sys.prefix) / "made.json"  # goes with the environment: another one makes all again


def everything() -> list[Path]:
    """The files that any result may depend on: the package, and the versions of the others."""
    package = chain.from_iterable((ROOT / "kfsheet").rglob(f"*.{end}") for end in ("py", "csv"))
    return sorted([*package, ROOT / "environment.txt"])


def is_made(target: Path, sources: Iterable[Path]) -> bool:
    """Whether a file was made of these sources, as they stand, and is as it was made."""
    return target.exists() and _notes().get(target.name) == _digest([*sources, target])


def note_made(target: Path, sources: Iterable[Path]) -> None:
    """Remember that a file was made of these sources."""
    notes = _notes() | {target.name: _digest([*sources, target])}
    write_file(NOTES, json.dumps(notes, indent=1).encode())


def _notes() -> dict[str, str]:
    return json.loads(NOTES.read_text()) if NOTES.exists() else {}


def _digest(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for path in files:
        digest.update(f"{path.relative_to(ROOT)}\0".encode())
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()
