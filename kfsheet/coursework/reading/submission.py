"""Reading what came back: a submission is hostile until read.

:mod:`kfsheet.workbook.reading` reads all workbooks with suspicion; here stand the limits for what
strangers send, and what a submission must not hold.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from kfsheet.errors import SubmissionError, UnreadableFileError
from kfsheet.workbook.reading.archive import SUBMISSION, Container, plain_name, readable
from kfsheet.workbook.reading.book import Book, read_book

MOST_CELLS, MOST_SHEETS, MOST_NAMES = 400_000, 60, 5_000


def read_submission(path: str | Path) -> Book:
    """Read a workbook within limits.

    Parameters
    ----------
    path : path
        The file that was handed in, whatever it is called.

    Raises
    ------
    SubmissionError
        If it is no workbook, is damaged, encrypted, too large, holds macros or tricks; the error's
        ``status`` says which.
    """
    try:
        with readable():
            return _read(Container.open(path, SUBMISSION))
    except UnreadableFileError as error:
        raise SubmissionError(error.status, error.remark) from None


def _read(container: Container) -> Book:
    names = [plain_name(name) for name in container.names]
    if any(name.endswith("vbaproject.bin") for name in names):
        raise SubmissionError("refused", "the file holds macros; save it as .xlsx")
    digest = hashlib.sha256(container.content).hexdigest()
    limits = {"cells": MOST_CELLS, "sheets": MOST_SHEETS, "names": MOST_NAMES}
    book = read_book(container, digest, **limits)
    if any("externallink" in name for name in names):
        book.remarks.append("links to other files were not followed")
    return book
