"""A workbook opened by openpyxl, which reads every cell; most questions need only its parts."""

from __future__ import annotations

import warnings
from pathlib import Path

import openpyxl
from openpyxl.utils.exceptions import InvalidFileException

from kfsheet.workbook.reading.archive import refusing

# What openpyxl raises by accident, where XML is not what a spreadsheet program writes.
ACCIDENTS = ValueError, TypeError, AttributeError, IndexError


def open_workbook(path: str | Path, *, data_only: bool = False) -> openpyxl.Workbook:
    """Open an ``.xlsx`` file, or say in one line why it is none.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """
    with refusing(path, InvalidFileException, *ACCIDENTS), warnings.catch_warnings():
        # openpyxl warns of parts that it does not keep; we only read.
        warnings.simplefilter("ignore", UserWarning)
        return openpyxl.load_workbook(path, data_only=data_only)
