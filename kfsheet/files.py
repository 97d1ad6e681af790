"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from kfsheet.errors import WorkbookError


def write_file(path: str | Path, content: bytes) -> Path:
    """Write a file whole or not at all: to a temporary neighbour, then renamed.

    Raises
    ------
    WorkbookError
        If the folder cannot be made or written, naming it.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise _unwritable(path, error) from None
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except OSError as error:
        Path(temporary).unlink(missing_ok=True)
        raise _unwritable(path, error) from None
    return path


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _unwritable(path: Path, error: OSError) -> WorkbookError:
    return WorkbookError(
        f"{path} cannot be written ({error.strerror}); choose another folder, "
        "or close the file if a program holds it open"
    )
