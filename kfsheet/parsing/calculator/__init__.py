"""A spreadsheet calculator: syntax trees evaluated by the spreadsheet's own rules.

Here belong operators, functions, references and what a whole workbook makes of them.
Errors, empty cells, texts that hold numbers and arrays are values here, and nothing is simplified:
``SQRT(x)^2`` of a negative number is #NUM!. Nothing here may open a file or know what a formula is
for. Begin with :func:`program` for one formula and :class:`SheetCalculator` for a whole workbook.
"""

from kfsheet.parsing.calculator.arithmetic import DOUBLES, Arithmetic
from kfsheet.parsing.calculator.program import FORBIDDEN, FUNCTIONS, program
from kfsheet.parsing.calculator.sheets import Content, Formula, SheetCalculator
from kfsheet.parsing.calculator.values import (
    EMPTY,
    Area,
    Context,
    Error,
    TooMuchWorkError,
    UnsupportedError,
)

__all__ = [
    "DOUBLES",
    "EMPTY",
    "FORBIDDEN",
    "FUNCTIONS",
    "Area",
    "Arithmetic",
    "Content",
    "Context",
    "Error",
    "Formula",
    "SheetCalculator",
    "TooMuchWorkError",
    "UnsupportedError",
    "program",
]
