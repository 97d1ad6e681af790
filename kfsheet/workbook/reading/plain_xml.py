"""One part of a workbook in plain words: as Excel writes it, whatever program has."""

from __future__ import annotations

from datetime import datetime, time
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

from kfsheet.errors import UnreadableFileError
from kfsheet.workbook.reading.archive import MAIN

STRICT_MAIN = "http://purl.oclc.org/ooxml/spreadsheetml/main"


def plain_xml(xml: bytes) -> bytes:
    """A part of a workbook without prefixes, comments and choices, in UTF-8, each cell placed.

    >>> plain_xml(b'<x:c xmlns:x="%s"><x:v>1</x:v></x:c>' % MAIN.encode()).decode()[-25:]
    'main" r="A1"><v>1</v></c>'
    """
    return _Plain().read(xml)


class _Plain:
    """Writes what it hears, in plain words."""

    def __init__(self) -> None:
        self._parser = expat.ParserCreate(namespace_separator=" ")
        self._parser.buffer_text = self._parser.namespace_prefixes = True
        self._parser.StartNamespaceDeclHandler = self._declare
        self._parser.StartElementHandler, self._parser.EndElementHandler = self._start, self._end
        self._parser.CharacterDataHandler = self._hear
        self._parser.StartDoctypeDeclHandler = self._refuse
        self._out: list[str] = []
        self._declared: list[str] = []
        self._tags: list[str] = []
        self._row = self._column = 0
        self._deaf = 0  # how deep within what is for programs that know less
        self._date = False

    def read(self, xml: bytes) -> bytes:
        self._parser.Parse(xml, True)
        return "".join(self._out).encode()

    @staticmethod
    def _refuse(*_: object) -> None:
        raise UnreadableFileError("refused", "its XML declares a document type")

    def _declare(self, prefix: str | None, space: str | None) -> None:
        if not _is_main(space or ""):
            self._declared.append(
                f" xmlns{':' * bool(prefix)}{prefix or ''}={quoteattr(space or '')}"
            )

    def _name(self, name: str) -> str:
        space, _, rest = name.partition(" ")
        if not rest or _is_main(space):
            return (rest or name).partition(" ")[0]
        local, _, prefix = rest.partition(" ")
        return f"{prefix}:{local}" if prefix else local

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        name = self._name(tag)
        local = name.rpartition(":")[2]
        if self._deaf or local == "Fallback":
            self._deaf += 1
            return
        if local in ("AlternateContent", "Choice") and ":" in name:
            self._declared.clear()
            self._tags.append("")
            return
        attributes.pop("conformance", "")  # only the strict variant has it
        if name in ("row", "c"):
            attributes = self._placed(name, attributes)
        space = "" if self._tags else f' xmlns="{MAIN}"'
        words = "".join(f" {self._name(k)}={quoteattr(v)}" for k, v in attributes.items())
        self._out.append(f"<{name}{space}{''.join(self._declared)}{words}>")
        self._declared.clear()
        self._tags.append(name)

    def _placed(self, name: str, attributes: dict[str, str]) -> dict[str, str]:
        from openpyxl.utils import coordinate_to_tuple, get_column_letter  # costly, seldom needed

        place = attributes.pop("r", "").strip().upper()
        if name == "row":
            self._row, self._column = int(place or self._row + 1), 0
            return {"r": str(self._row), **attributes}
        row, column = coordinate_to_tuple(place) if place else (self._row, self._column + 1)
        self._row, self._column = row or 1, column
        self._date = attributes.get("t") == "d"
        more = {"t": "n"} if self._date else {}
        return {"r": f"{get_column_letter(column)}{self._row}", **attributes, **more}

    def _hear(self, words: str) -> None:
        if self._deaf:
            return
        if self._date and self._tags and self._tags[-1] == "v":
            words = str(serial_of_date(words))
        self._out.append(escape(words))

    def _end(self, _: str) -> None:
        if self._deaf:
            self._deaf -= 1
        elif tag := self._tags.pop():
            self._out.append(f"</{tag}>")


def _is_main(space: str) -> bool:
    return space in (MAIN, STRICT_MAIN)


def serial_of_date(text: str) -> float:
    """The number of a date in ISO 8601: days since the last day of 1899, and parts of a day.

    >>> serial_of_date("1900-03-01T12:00:00")
    61.5
    """
    text = text.strip().removesuffix("Z")
    if "-" not in text:
        clock = time.fromisoformat(text)
        return (clock.hour * 3600 + clock.minute * 60 + clock.second) / 86400
    days = datetime.fromisoformat(text).replace(tzinfo=None) - datetime(1899, 12, 30)
    return days.days + days.seconds / 86400 + days.microseconds / 86400e6
