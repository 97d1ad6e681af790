"""A workbook opened by openpyxl, which reads every cell; most questions need only its parts."""

from __future__ import annotations

import warnings
import zipfile
import zlib
from pathlib import Path
from xml.etree.ElementTree import ParseError

import openpyxl
from openpyxl.utils.exceptions import InvalidFileException

from kfsheet.errors import WorkbookError


def open_workbook(path: str | Path, *, data_only: bool = False) -> openpyxl.Workbook:
    """Open an ``.xlsx`` file, or say in one line why it is none.

    Raises
    ------
    WorkbookError
        If the file cannot be read or is no workbook.
    """
    try:
        with warnings.catch_warnings():
            # openpyxl warns of parts that it does not keep; we only read.
            warnings.simplefilter("ignore", UserWarning)
            return openpyxl.load_workbook(path, data_only=data_only)
    except OSError as error:
        raise WorkbookError(f"{path} cannot be read: {error.strerror or error}") from None
    except (
        InvalidFileException,
        zipfile.BadZipFile,
        zlib.error,
        ParseError,
        # What openpyxl raises by accident while it reads XML that is none of a spreadsheet's.
        KeyError,
        ValueError,
        TypeError,
        AttributeError,
        IndexError,
    ) as error:
        detail = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise WorkbookError(f"{path} is not a workbook (.xlsx): {detail}") from None
