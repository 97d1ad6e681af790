"""Tables of measurements in CSV files, read with suspicion."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Collection, Sequence
from math import nan
from pathlib import Path

from kfsheet.errors import DataError
from kfsheet.model.quantities import as_number

Table = dict[str, list[float]]
"""Columns of numbers by name."""


def read_table(
    path: str | Path,
    columns: Sequence[str],
    *,
    times: str,
    may_be_missing: Collection[str] = (),
) -> Table:
    """Read a CSV file that has exactly ``columns``, as lists of floats by name.

    Parameters
    ----------
    path : path
        The file: UTF-8, with a header, columns separated by commas.
    columns : sequence of str
        The columns it must have, in any order.
    times : str
        The column that must increase from row to row.
    may_be_missing : collection of str
        Columns in which an empty field means "not observed" and becomes NaN.

    Raises
    ------
    DataError
        For a file that cannot be read, missing, extra or repeated columns, a row of another
        length, text in place of a number, an infinite value, or times that repeat or go back.
    """
    path = Path(path)
    try:
        # Excel begins a CSV file with a byte-order mark, else a part of the first name.
        with path.open(newline="", encoding="utf-8-sig") as file:
            header, *rows = [row for row in csv.reader(file) if row] or [[]]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{path} cannot be read: {error}") from None
    _check_header(path, header, columns)
    if not rows:
        raise DataError(f"{path} has a header but no rows")
    table: Table = {name: [] for name in header}
    for line, row in enumerate(rows, start=2):
        if len(row) != len(header):
            raise DataError(f"{path}, line {line} has {len(row)} fields, the header {len(header)}")
        for name, text in zip(header, row, strict=True):
            optional = name in may_be_missing
            table[name].append(_number(text, f"{path}, line {line}, column {name}", optional))
    _check_times(path, times, table[times])
    return {name: table[name] for name in columns}


def _check_header(path: Path, header: list[str], columns: Sequence[str]) -> None:
    for word, names in (
        ("lacks", [c for c in columns if c not in header]),
        ("has an extra", [c for c in header if c not in columns]),
        ("repeats", [c for n, c in enumerate(header) if c in header[:n]]),
    ):
        if names:
            raise DataError(f"{path} {word} column {names[0]!r}; it needs {', '.join(columns)}")


def _number(text: str, what: str, optional: bool) -> float:
    if optional and not text.strip():
        return nan
    try:
        return as_number(float(text), what)
    except ValueError as error:
        raise (
            error
            if isinstance(error, DataError)
            else DataError(f"{what} is {text!r}; it must be a number")
        ) from None


def _check_times(path: Path, name: str, times: list[float]) -> None:
    for line, (before, now) in enumerate(itertools.pairwise(times), start=3):
        if now <= before:
            what = "repeats" if now == before else "goes back from"
            raise DataError(
                f"{path}, line {line}, column {name}: {now:g} {what} {before:g}; "
                "sort the rows by time and remove doubles"
            )
