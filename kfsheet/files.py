"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

from kfsheet.errors import UnwrittenError

FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


def write_file(path: str | Path, content: bytes) -> Path:
    """Write a file whole or not at all: to a temporary neighbour, then renamed.

    Raises
    ------
    UnwrittenError
        If the folder cannot be made or written, or the disk is full, naming the file.
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
    except BaseException as error:  # also if somebody interrupts us
        Path(temporary).unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise _unwritable(path, error) from None
        raise
    return path


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _unwritable(path: Path, error: OSError) -> UnwrittenError:
    remedy = "choose another folder, or close the file if a program holds it open"
    if error.errno in FULL:
        remedy = "make room on the disk"
    return UnwrittenError(f"{path} cannot be written ({error.strerror}); {remedy}")
