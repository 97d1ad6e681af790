"""Who is in the course."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from kfsheet.errors import DataError

ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,63}")
SEPARATORS = ",;\t"
SEPARATOR_LINE = re.compile(r"sep=([,;\t])\r?\n", re.IGNORECASE)
# Where a cell begins in some locale, and what begins a formula there; East Asian programs also
# take the wide forms of the signs.
FORMULA = re.compile(r"(^|[,;\t\r\n])(?=\s*[=+\-@＝＋－＠]|[\t\r])")


@dataclass(frozen=True)
class Student:
    """One line of the roster."""

    id: str
    name: str
    email: str = ""

    @property
    def login(self) -> str:
        """What a learning platform knows the student by."""
        return self.email or self.id


def read_roster(path: str | Path) -> list[Student]:
    """Students of a CSV file with the columns ``id,name`` and optionally ``email``.

    UTF-8, with or without a byte order mark; comma, semicolon or tab; a first line ``sep=;`` and
    empty lines, as Excel writes them, are passed over.

    Raises
    ------
    DataError
        If the file cannot be read, lacks a column, a line has more fields than the header, an id is
        empty or no file name, or two students share an id or a login.
    """
    path = Path(path)
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise DataError(f"the roster {path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise DataError(f"the roster {path} is not UTF-8; save it as CSV UTF-8") from None
    lines = _lines(text)
    fields = [(field or "").strip().lower() for field in lines.fieldnames or ()]
    if missing := {"id", "name"} - set(fields):
        raise DataError(f"the roster {path} has no column {sorted(missing)[0]!r}; give id,name")
    lines.fieldnames = fields
    known: dict[str, tuple[Student, int]] = {}
    for line in lines:
        if any(map(_has_text, line.values())):
            student = _student(line, f"{path}, line {lines.line_num}")
            _refuse_twins(path, known, student, lines.line_num)
            known[student.id.lower()] = student, lines.line_num
    if not known:
        raise DataError(f"the roster {path} names nobody")
    return [student for student, _ in known.values()]


def _lines(text: str) -> csv.DictReader:
    """Lines by the names in the header, whatever separates the fields."""
    announced = SEPARATOR_LINE.match(text)
    body = text[announced.end() :] if announced else text
    header = body.partition("\n")[0]
    delimiter = announced[1] if announced else max(SEPARATORS, key=header.count)
    # Of the many characters that end a line for Python (vertical tab, U+2028, ...), a CSV file
    # knows two; the others stand in names that somebody pasted.
    return csv.DictReader(StringIO(body, newline=""), delimiter=delimiter, skipinitialspace=True)


def _has_text(field: str | list[str] | None) -> bool:
    return bool("".join(field or ()).strip())


def _student(line: dict[str | None, Any], where: str) -> Student:
    if _has_text(line.get(None)):
        raise DataError(
            f"{where} has more fields than the header; put a field that holds a separator in "
            'quotes, as in "Doe, Jane"'
        )
    values = {key: " ".join((line.get(key) or "").split()) for key in ("id", "name", "email")}
    if not ID.fullmatch(values["id"]) or ".." in values["id"]:
        raise DataError(
            f"{where}: the id {values['id']!r} must be letters, digits, or one of . - _ @: "
            "it names a folder"
        )
    return Student(**values)


def _refuse_twins(
    path: Path, known: dict[str, tuple[Student, int]], new: Student, line: int
) -> None:
    """Refuse an id or a login that somebody has already: marks would reach the wrong student."""
    for other, before in known.values():
        if other.id.lower() == new.id.lower():
            words = f"the id {new.id} twice"
        elif other.login.lower() == new.login.lower():
            words = f"the login {new.login} twice"
        else:
            continue
        raise DataError(f"the roster {path} has {words}, in lines {before} and {line}")


def harmless(text: str) -> str:
    """Text for a cell of a CSV file that no spreadsheet program takes for a formula.

    A program that expects semicolons splits what a comma would have kept together, so what follows
    any separator counts as the beginning of a cell.

    >>> harmless("=1+1"), harmless("Doe;=1+1"), harmless("a-b")
    ("'=1+1", "Doe;'=1+1", 'a-b')
    """
    return FORMULA.sub(r"\1'", text)
