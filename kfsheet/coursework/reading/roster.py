"""Who is in the course."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

from kfsheet.errors import DataError

ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,63}")
FORMULA_BEGINS = ("=", "+", "-", "@", "\t", "\r")


@dataclass(frozen=True)
class Student:
    """One line of the roster."""

    id: str
    name: str
    email: str = ""


def read_roster(path: str | Path) -> list[Student]:
    """Students of a CSV file with the columns ``id,name`` and optionally ``email``.

    UTF-8, with or without a byte order mark; comma or semicolon.

    Raises
    ------
    DataError
        If the file cannot be read, lacks a column, or an id is doubled, empty or no file name.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise DataError(f"the roster {path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise DataError(f"the roster {path} is not UTF-8; save it as CSV UTF-8") from None
    first = text.partition("\n")[0]
    delimiter = ";" if first.count(";") > first.count(",") else ","
    lines = csv.DictReader(text.splitlines(), delimiter=delimiter, skipinitialspace=True)
    fields = [(field or "").strip().lower() for field in lines.fieldnames or ()]
    if missing := {"id", "name"} - set(fields):
        raise DataError(f"the roster {path} has no column {sorted(missing)[0]!r}; give id,name")
    lines.fieldnames = fields
    students = [_student(line, f"{path}, line {lines.line_num}") for line in lines]
    _check(students, path)
    return students


def _student(line: dict[str, str | None], where: str) -> Student:
    values = {key: (line.get(key) or "").strip() for key in ("id", "name", "email")}
    if not ID.fullmatch(values["id"]) or ".." in values["id"]:
        raise DataError(
            f"{where}: the id {values['id']!r} must be letters, digits, or one of . - _ @: "
            "it names a folder"
        )
    return Student(**values)


def _check(students: list[Student], path: Path) -> None:
    if not students:
        raise DataError(f"the roster {path} names nobody")
    seen: set[str] = set()
    for student in students:
        if student.id.lower() in seen:
            raise DataError(f"the roster {path} has the id {student.id} twice")
        seen.add(student.id.lower())


def harmless(text: str) -> str:
    """Text for a cell of a CSV file that no spreadsheet program takes for a formula."""
    return f"'{text}" if text.startswith(FORMULA_BEGINS) else text
