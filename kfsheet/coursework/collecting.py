"""The files that came back, and whose folder or name they carry."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Sequence
from pathlib import Path

from kfsheet.coursework.roster import Student
from kfsheet.errors import DataError

IGNORED = {"__MACOSX", "Thumbs.db", "desktop.ini"}
OTHER_KINDS = {".pdf", ".docx", ".doc", ".txt", ".html", ".png", ".jpg", ".jpeg", ".py", ".ipynb"}


def submitted_files(folder: str | Path) -> list[Path]:
    """Every file below a folder that could be meant as a workbook, in order; no links.

    Raises
    ------
    DataError
        If there is no such folder.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise DataError(f"{folder} is no folder; give the folder that holds the submissions")
    return sorted(_walk(folder))


def _walk(folder: Path) -> Iterator[Path]:
    for path in folder.iterdir():
        if path.name.startswith((".", "~$")) or path.name in IGNORED or path.is_symlink():
            continue
        if path.is_dir():
            yield from _walk(path)
        elif path.is_file() and path.suffix.lower() not in OTHER_KINDS:
            yield path


def owner(path: Path, folder: Path, students: Sequence[Student]) -> Student | None:
    """The one student whose id or name the path carries, as Moodle, Canvas or a person wrote it."""
    words = _words("/".join(path.relative_to(folder).parts))
    by_id = [s for s in students if _has(words, s.id)]
    if by_id:
        return by_id[0] if len(by_id) == 1 else None
    by_name = [s for s in students if _named(words, s.name)]
    return by_name[0] if len(by_name) == 1 else None


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
