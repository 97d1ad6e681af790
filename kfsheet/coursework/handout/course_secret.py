"""The secret of a course, and what follows from it: seeds of data, tokens in files.

Everything is HMAC-SHA256 of the secret, so that the same call makes the same files, and nobody
without the secret can predict a student's data or sign a file in another student's name.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
from pathlib import Path

from kfsheet.errors import DataError

LENGTH = 32  # bytes
SIGNED = 24  # hexadecimal digits of a signature in a file
MARK = "kfsheet1"


def read_secret(path: str | Path, *, make: bool = False) -> bytes:
    """The secret in a file; with ``make``, a new one is written where there is none (mode 0600).

    Raises
    ------
    DataError
        If the file cannot be read or written, or is too short to be a secret.
    """
    path = Path(path)
    try:
        if make and not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            # Never over another secret, and for the owner only from its first byte on.
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            try:
                with os.fdopen(handle, "w") as file:
                    file.write(secrets.token_hex(LENGTH) + "\n")
            except OSError:
                path.unlink()  # half a secret, on a full disk, would be taken for one
                raise
        content = path.read_bytes().strip()
    except OSError as error:
        raise DataError(f"the secret {path} cannot be used: {error.strerror}") from None
    if len(content) < 16:
        raise DataError(f"{path} is too short for a secret; name another file, or remove it")
    return content


def digest(secret: bytes, *parts: str) -> bytes:
    """HMAC of parts, which may hold any characters."""
    # A separator that no name holds: ("a", "bc") and ("ab", "c") must not sign alike.
    message = "\x1f".join(parts).encode()
    return hmac.new(secret, message, hashlib.sha256).digest()


def seed(secret: bytes, *parts: str) -> int:
    """A seed for numpy's RandomState."""
    return int.from_bytes(digest(secret, "seed", *parts)[:4], "big")


def fingerprint(secret: bytes) -> str:
    """Tells two secrets apart and gives neither away."""
    return digest(secret, "fingerprint").hex()[:SIGNED]


def token(secret: bytes, exercise: str, student: str) -> str:
    """What ties a file, a student and an exercise together."""
    return f"{MARK}|{exercise}|{student}|{_signature(secret, exercise, student)}"


def _signature(secret: bytes, exercise: str, student: str) -> str:
    return digest(secret, "token", exercise, student).hex()[:SIGNED]


def read_token(secret: bytes, text: str) -> tuple[str, str] | None:
    """Exercise and student of a token; None if it is none of ours or was tampered with.

    >>> read_token(b"secret", token(b"secret", "football", "s1"))
    ('football', 's1')
    >>> read_token(b"other secret", token(b"secret", "football", "s1")) is None
    True
    """
    parts = text.strip().split("|")
    if len(parts) != 4 or parts[0] != MARK:
        return None
    _, exercise, student, signature = parts
    good = hmac.compare_digest(signature.encode(), _signature(secret, exercise, student).encode())
    return (exercise, student) if good else None
