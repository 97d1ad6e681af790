"""The files that came back, and whose folder or name they carry."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Iterator, Sequence
from pathlib import Path

from kfsheet.coursework.reading.roster import Student
from kfsheet.errors import DataError

IGNORED = {"__MACOSX", "Thumbs.db", "desktop.ini"}
NOTES = {".txt", ".html"}  # what a platform adds of its own


def submitted_files(folder: str | Path, without: Path | None = None) -> list[Path]:
    """Every file below a folder that somebody handed in, in order; no links, no reports of ours.

    Raises
    ------
    DataError
        If there is no such folder.
    """
    return sorted(path for path, taken in _walk(_folder(folder), without) if taken)


def passed_over(folder: str | Path, without: Path | None = None) -> list[Path]:
    """What lies there and is no submission: notes, links, hidden files, a system's own files.

    Raises
    ------
    DataError
        If there is no such folder.
    """
    return sorted(path for path, taken in _walk(_folder(folder), without) if not taken)


def readable(name: str) -> str:
    r"""A file name as it can be shown and stored: any bytes may stand in one.

    >>> readable("a\nb"), readable(os.fsdecode(b"\xe9t\xe9.xlsx"))
    ('a\\nb', '\\xe9t\\xe9.xlsx')
    """
    text = os.fsencode(name).decode(errors="backslashreplace")
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _folder(folder: str | Path) -> Path:
    if not Path(folder).is_dir():
        raise DataError(f"{folder} is no folder; give the folder that holds the submissions")
    return Path(folder)


def _walk(folder: Path, without: Path | None) -> Iterator[tuple[Path, bool]]:
    ours = without and without.resolve()
    for path in folder.iterdir():
        hidden = path.name.startswith((".", "~$")) or path.name in IGNORED
        # A link could name any file of the lecturer's machine; ~$ is Excel's note of an open file.
        if hidden or path.is_symlink():
            yield path, False
        elif path.is_dir() and path.resolve() != ours:
            yield from _walk(path, without)
        elif path.is_file():
            yield path, path.suffix.lower() not in NOTES


def owner(
    path: Path, folder: Path, students: Sequence[Student], holder: Student | None = None
) -> Student | None:
    """The one student whose name or id the path carries, as Moodle, Canvas or a person wrote it.

    ``holder`` is the one whose token the file carries; a path that could be that student's is.
    Platforms write numbers of their own into names, and browsers count copies, so a plain number is
    somebody's id only where it is a whole name of a folder or file.
    """
    parts = path.relative_to(folder).parts
    words = _words("/".join(parts))
    whole = {*parts[:-1], path.stem}
    by_name = [s for s in students if _named(words, s.name)]
    by_id = [s for s in students if (s.id in whole if s.id.isdigit() else _has(words, s.id))]
    if holder and holder in (*by_name, *by_id):
        return holder
    found = by_id or by_name
    return found[0] if len(found) == 1 else None


def _plain(text: str) -> str:
    decomposed = unicodedata.normalize("NFKD", text.casefold())
    return "".join(c for c in decomposed if not unicodedata.combining(c))


def _words(text: str) -> str:
    return f" {' '.join(re.split(r'[^a-z0-9]+', _plain(text)))} "


def _has(words: str, text: str) -> bool:
    return bool(_words(text).strip()) and _words(text) in words


def _named(words: str, name: str) -> bool:
    """First and last name, in either order, or written together as Canvas does."""
    parts = _words(name).split()
    turned = [*parts[1:], *parts[:1]], [*parts[-1:], *parts[:-1]], parts
    return bool(parts) and any(
        f" {joiner.join(order)} " in words for order in turned for joiner in (" ", "")
    )
