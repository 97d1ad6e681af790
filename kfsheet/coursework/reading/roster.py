"""Who is in the course."""

from __future__ import annotations

import codecs
import csv
import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from kfsheet.errors import DataError

ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,63}")
SEPARATORS = ",;\t"
SEPARATOR_LINE = re.compile(r'\s*"?sep= *([^\w\s"]|\t) *"?[,;\t ]*(?=[\r\n])', re.IGNORECASE)
MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
INVISIBLE = {"Cc", "Cf"}
JOINERS = "\u200c\u200d"  # zero-width, and a part of how names are written in some scripts
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

    UTF-8, with or without a byte order mark, or UTF-16 with one; comma, semicolon or tab; a first
    line ``sep=;`` and empty lines, as Excel writes them, are passed over.

    Raises
    ------
    DataError
        If the file cannot be read, lacks a column, a line has more fields than the header, an id is
        empty or no file name, or two students share an id or a login.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DataError(f"the roster {path} cannot be read: {error.strerror}") from None
    known: dict[str, tuple[Student, int]] = {}
    for number, line in records(content, f"the roster {path}", ("id", "name")):
        student = _student(line, f"{path}, line {number}")
        _refuse_twins(path, known, student, number)
        known[student.id] = student, number
    if not known:
        raise DataError(f"the roster {path} names nobody")
    return [student for student, _ in known.values()]


def records(
    content: bytes, what: str, columns: Sequence[str]
) -> Iterator[tuple[int, dict[str | None, Any]]]:
    """Numbers of the lines that hold something, and their fields by the names in the header.

    Raises
    ------
    DataError
        If ``what`` is no such file, or lacks one of ``columns``.
    """
    text = _decoded(content, what)
    announced = SEPARATOR_LINE.match(text)
    delimiter = announced[1] if announced else _delimiter(text)
    # Of the many characters that end a line for Python (vertical tab, U+2028, ...), a CSV file
    # knows two; the others stand in names that somebody pasted. A quote that nobody closes would
    # swallow the lines after it.
    file = StringIO(text, newline="")
    lines = csv.DictReader(file, delimiter=delimiter, skipinitialspace=True, strict=True)
    try:
        if announced:
            next(row for row in lines.reader if has_text(row))
        lines.fieldnames = [_plain(field) for field in next(filter(has_text, lines.reader), ())]
        for column in columns:
            if (count := lines.fieldnames.count(column)) != 1:
                fault = "no column" if not count else f"{count} columns"
                raise DataError(f"{what} has {fault} {column!r}; give {','.join(columns)}")
        for line in lines:
            if any(map(has_text, line.values())):
                yield lines.line_num, line
    except csv.Error as error:
        raise DataError(
            f"{what}, up to line {lines.reader.line_num}: a quote is not closed, or a field does "
            f"not end with it ({error})"
        ) from None


def _decoded(content: bytes, what: str) -> str:
    encoding = next((e for mark, e in MARKS if content.startswith(mark)), "utf-8")
    try:
        text = content.decode(encoding).lstrip("\ufeff")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        raise DataError(f"{what} is not UTF-8; save it as CSV UTF-8")
    return text


def _delimiter(text: str) -> str:
    """The separator with which the header names an id; the most frequent one in it otherwise."""
    header = re.split(r"[\r\n]", text.lstrip(), maxsplit=1)[0]

    def fits(separator: str) -> tuple[bool, int]:
        fields = [_plain(field.strip('" ')) for field in header.split(separator)]
        return "id" in fields, header.count(separator)

    return max(SEPARATORS, key=fits)


def visible(text: str) -> str:
    r"""Text on one line, without the characters that nobody sees.

    >>> visible("Doe \u200b\n Jane\u2028")
    'Doe Jane'
    """
    kept = (
        c for c in text if c in JOINERS or c.isspace() or unicodedata.category(c) not in INVISIBLE
    )
    return " ".join("".join(kept).split())


def _plain(text: str) -> str:
    """What stays the same however a program or a person wrote it: width, capitals, accents."""
    text = unicodedata.normalize("NFKC", visible(text)).translate(dict.fromkeys(map(ord, JOINERS)))
    return unicodedata.normalize("NFKC", text.casefold())


def has_text(field: str | list[str] | None) -> bool:
    """Whether a field holds more than white space and what nobody sees."""
    return bool(visible("".join(field or ())))


def _student(line: dict[str | None, Any], where: str) -> Student:
    if has_text(line.get(None)):
        raise DataError(
            f"{where} has more fields than the header; put a field that holds a separator in "
            'quotes, as in "Doe, Jane"'
        )
    values = {key: visible(line.get(key) or "") for key in ("id", "name", "email")}
    for key in ("id", "email"):
        wide = values[key].translate(dict.fromkeys(map(ord, JOINERS)))
        values[key] = unicodedata.normalize("NFKC", wide)
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
        if _plain(other.id) == _plain(new.id):
            words = f"the id {new.id} twice"
        elif _plain(other.login) == _plain(new.login):
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
