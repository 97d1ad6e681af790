"""What a folder of results belongs to: the secret of a course, the exercise that was graded.

The file ``kfsheet.json`` in the folder says so. Of the secret it keeps a fingerprint from which
nobody can work it back.
"""

from __future__ import annotations

import json
from pathlib import Path

from kfsheet.errors import DataError
from kfsheet.files import write_file

RECORD = "kfsheet.json"


def belongs_to(folder: str | Path, kind: str) -> str | None:
    """What the folder belongs to in that way; None if nothing was put there yet.

    Raises
    ------
    DataError
        If the file that says so is damaged.
    """
    return _read(Path(folder) / RECORD).get(kind)


def claim(folder: str | Path, kind: str, value: str) -> bool:
    """Make the folder belong to ``value``; False if it belongs to something else.

    Raises
    ------
    DataError
        If the file that says so is damaged.
    """
    path = Path(folder) / RECORD
    known = _read(path)
    if kind not in known:
        write_file(path, (json.dumps(known | {kind: value}, indent=1) + "\n").encode())
    return known.get(kind, value) == value


def _read(path: Path) -> dict[str, str]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError):
        found = None
    if not isinstance(found, dict) or not all(isinstance(v, str) for v in found.values()):
        raise DataError(f"{path} is damaged; choose another --out, or remove that file")
    return found
