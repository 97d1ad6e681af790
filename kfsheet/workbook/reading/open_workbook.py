"""A workbook opened by openpyxl, which reads every cell; most questions need only its parts."""

from __future__ import annotations

import warnings
from io import BytesIO
from pathlib import Path

import openpyxl

from kfsheet.workbook.reading.archive import Container, refusing
from kfsheet.workbook.reading.normal_form import normal_form


def open_workbook(path: str | Path, *, data_only: bool = False) -> openpyxl.Workbook:
    """Open an ``.xlsx`` file, or say in one line why it is none.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """
    with refusing(path), warnings.catch_warnings():
        # openpyxl warns of parts that it does not keep; we only read.
        warnings.simplefilter("ignore", UserWarning)
        content = normal_form(Container.open(path)).content
        return openpyxl.load_workbook(BytesIO(content), data_only=data_only)
