"""Errors that a person can act on: each message names the culprit and the remedy."""


class KfsheetError(ValueError):
    """Base of every error kfsheet raises on purpose; the command line prints it as one line."""


class ModelError(KfsheetError):
    """A recurrence, an exercise or one of its expressions is not well formed."""


class DataError(KfsheetError):
    """A number that was given, in a table, a cell or an argument, cannot be used."""


class PrintError(KfsheetError):
    """An expression has no equivalent in the language it should be printed in."""


class WorkbookError(KfsheetError):
    """A file is not a workbook, is not one of ours, or lost a part of itself."""


class UnwrittenError(WorkbookError):
    """A file was not written: the disk is full, or nobody may write there."""


class EngineError(KfsheetError):
    """A spreadsheet engine or a compiler is missing, crashed or ran out of time."""


class MissingEngineError(EngineError):
    """A spreadsheet engine is not installed."""


class ForbiddenError(KfsheetError):
    """A formula uses what no answer may use."""


class FormulaError(KfsheetError):
    """A formula cannot be read as mathematics: arrays, look-ups, text, or no formula at all."""


class TooMuchWorkError(FormulaError):
    """A formula takes more operations, or levels, than it was given."""


class UnreadableFileError(WorkbookError):
    """A file cannot be read as a workbook; ``status`` is one word for a table."""

    def __init__(self, status: str, remark: str) -> None:
        super().__init__(f"{status}: {remark}")
        self.status, self.remark = status, remark


class SubmissionError(UnreadableFileError):
    """A file that was handed in cannot be graded."""
