"""What a recurrence is made of: parameters, scalars, columns, and the numbers in them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite, isnan, nan
from typing import Any

from sympy import Expr, IndexedBase, Symbol

from kfsheet.errors import DataError
from kfsheet.model.expressions import Missing


@dataclass(frozen=True)
class Parameter:
    """A scalar that a user may change: ``sign`` is '', 'positive' or 'nonnegative'."""

    symbol: Symbol
    value: float
    unit: str
    description: str
    sign: str = ""

    @property
    def name(self) -> str:
        """The symbol as text, and the defined name in a workbook."""
        return self.symbol.name

    def checked(self, value: Any, where: str = "") -> float:
        """``value`` as a float, or a DataError that says what the parameter may be."""
        number = as_number(value, f"parameter {self.name}{where}")
        if (self.sign == "positive" and number <= 0) or (self.sign == "nonnegative" and number < 0):
            raise DataError(
                f"parameter {self.name}{where} is {number:g}, but {self.description} "
                f"must be {self.bound}"
            )
        return number

    @property
    def bound(self) -> str:
        """What the value must be, in words; '' if it may be any number."""
        return {"positive": "greater than 0", "nonnegative": "0 or greater"}.get(self.sign, "")


@dataclass(frozen=True)
class Scalar:
    """A derived scalar or a summary: a formula of parameters, or of aggregated columns."""

    symbol: Symbol
    expression: Expr
    unit: str
    description: str

    @property
    def name(self) -> str:
        """The symbol as text, and the defined name in a workbook."""
        return self.symbol.name

    @property
    def rules(self) -> tuple[Expr, ...]:
        """The one expression, in the form in which a column gives its several."""
        return (self.expression,)


@dataclass(frozen=True)
class Column:
    """A column: fixed numbers (``values``), or ``start`` rows followed by ``expression``."""

    base: IndexedBase
    section: str
    unit: str = ""
    description: str = ""
    expression: Expr | None = None
    start: tuple[Expr, ...] = ()
    values: tuple[float, ...] | None = None
    may_be_missing: bool = False
    """Whether data may have gaps, or the general expression may give no value."""

    @property
    def name(self) -> str:
        """The name, and the header in a workbook."""
        return self.base.label.name

    @property
    def is_data(self) -> bool:
        """Whether the rows are numbers that were given, not formulas."""
        return self.values is not None

    @property
    def rules(self) -> tuple[Expr, ...]:
        """The expressions of the start rows and the general one; none for data."""
        return (*self.start, self.expression) if self.expression is not None else ()

    def gap_possible(self, rows: range) -> bool:
        """Whether a value may be missing in one of ``rows``."""
        starts = self.start[rows.start : rows.stop]
        general = rows.stop > len(self.start) and self.may_be_missing
        return general or any(rule.has(Missing) for rule in starts)

    def definition(self, row: int) -> Expr | None:
        """The expression that holds in ``row``: a start value, or the general one."""
        return self.start[row] if row < len(self.start) else self.expression


def as_number(value: Any, what: str) -> float:
    """``value`` as a finite float; a DataError that names ``what`` otherwise."""
    if isinstance(value, (bool, str)) or value is None:
        raise DataError(f"{what} is {value!r}; it must be a number")
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise DataError(f"{what} is {value!r}; it must be a number") from None
    if not isfinite(number):
        raise DataError(f"{what} is {number}; it must be a finite number")
    return number


def checked_values(column: str, values: Iterable[Any], may_be_missing: bool) -> tuple[float, ...]:
    """Numbers of a data column; a missing one is None or NaN and becomes NaN.

    Raises
    ------
    DataError
        For a value that is no number, is infinite, or is missing where that is not allowed.
    """
    return tuple(
        nan if may_be_missing and _is_missing(value) else as_number(value, f"{column}, row {row}")
        for row, value in enumerate(values)
    )


def _is_missing(value: Any) -> bool:
    return value is None or (isinstance(value, float) and isnan(value))
