"""What a recurrence adds to SymPy: row index, missing values, aggregates; what is read."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Self

from sympy import Basic, Expr, Function, Indexed, IndexedBase, Piecewise, Symbol, true
from sympy.core.singleton import Singleton
from sympy.logic.boolalg import Boolean, BooleanFunction
from sympy.printing.printer import Printer

REMEMBERED = 4096  # expressions whose parts are asked for again and again

t = Symbol("t", integer=True, nonnegative=True)
"""The row index. ``x_a[t - 1]`` is the cell above ``x_a[t]``."""


class Observed(BooleanFunction):
    """``Observed(i[t])``: the cell holds a number (ISNUMBER in a sheet, not-NaN in NumPy)."""

    nargs = 1

    def __new__(cls, *cells: Expr, **options: bool) -> Self:
        """The condition on one cell."""
        return super().__new__(cls, *cells, **options)

    @classmethod
    def eval(cls, cell: Expr) -> Boolean | None:
        """A missing value is never observed; all else is decided when a row is evaluated."""
        return ~true if cell is Missing else None


class _Missing(Expr, metaclass=Singleton):
    """No value: an empty cell in a sheet, NaN in NumPy."""

    is_commutative = True
    is_extended_real = True

    def _sympystr(self, printer: object) -> str:
        return "Missing"

    def _latex(self, printer: object) -> str:
        return r"\varnothing"


Missing = _Missing()


class ColumnBase(IndexedBase):
    """A column as a whole; ``x[t]`` is its cell in row t."""

    # Python would otherwise iterate over x[0], x[1], ... for ever, as in the builtin sum(x).
    __iter__ = None


def when_observed(
    cells: Indexed | tuple[Indexed, ...], value: Expr, otherwise: Expr = Missing
) -> Piecewise:
    """``value`` where every one of ``cells`` holds a number, else ``otherwise``.

    >>> from sympy import IndexedBase
    >>> i = IndexedBase("i", real=True)
    >>> when_observed(i[t], 2 * i[t], 0)
    Piecewise((2*i[t], Observed(i[t])), (0, True))
    """
    cells = cells if isinstance(cells, tuple) else (cells,)
    condition = true
    for cell in cells:
        condition &= Observed(cell)
    return Piecewise((value, condition), (otherwise, True))


class Aggregate(Function):
    """A number made of all rows of a column; rows without a value are left out."""

    nargs = 1
    is_real = True

    # SymPy's own is unknown to type checkers, which would take every aggregate for Any.
    def __new__(cls, *columns: Expr, **options: bool) -> Self:
        """The aggregate of one column, or of two."""
        return super().__new__(cls, *columns, **options)

    @classmethod
    def eval(cls, column: IndexedBase) -> None:
        """Stay symbolic: only a run of the recurrence, or a sheet, can say the value."""
        return None

    # SymPy's printers go by the name of a class, and would take our Sum for theirs.

    def _sympystr(self, printer: Printer) -> str:
        return printer._print_Function(self)

    def _pretty(self, printer: Printer) -> object:
        return printer._print_Function(self)

    def _latex(self, printer: Printer, exp: str = "") -> str:
        power = f"^{{{exp}}}" if exp else ""
        columns = ",".join(map(printer._print, self.args))
        return rf"\operatorname{{{type(self).__name__}}}{power}{{\left({columns} \right)}}"


class Mean(Aggregate):
    """Arithmetic mean of a column."""


class RMS(Aggregate):
    """Root mean square of a column: sqrt(mean(x**2))."""


class Std(Aggregate):
    """Sample standard deviation of a column, with n - 1 in the denominator."""


class Sum(Aggregate):
    """Sum of a column."""


class Count(Aggregate):
    """How many rows of a column hold a number."""


class Largest(Aggregate):
    """Largest value of a column."""


class Smallest(Aggregate):
    """Smallest value of a column."""


class Last(Aggregate):
    """The value in the last row of a column."""


class SumProduct(Aggregate):
    """Sum of the products, row by row, of two columns."""

    nargs = 2

    @classmethod
    def eval(cls, first: IndexedBase, second: IndexedBase) -> None:
        """Stay symbolic, as every aggregate."""
        return None


def column_references(expression: Expr) -> set[Indexed]:
    """Every ``column[t - k]`` that an expression reads."""
    return expression.atoms(Indexed)


def lag(cell: Indexed) -> Expr:
    """How many rows above row ``t`` a reference lies: ``lag(x[t - 2])`` is 2."""
    return t - cell.indices[0]


def walk(expression: Basic) -> Iterator[Basic]:
    """Every node of an expression; a cell reference counts as one."""
    yield expression
    if not isinstance(expression, Indexed | IndexedBase):
        for argument in expression.args:
            yield from walk(argument)


@lru_cache(maxsize=REMEMBERED)
def scalars(expression: Basic) -> frozenset[Symbol]:
    """Symbols that stand for scalars, or for the row index."""
    return frozenset(node for node in walk(expression) if isinstance(node, Symbol))


@lru_cache(maxsize=REMEMBERED)
def columns_read(expression: Basic) -> frozenset[str]:
    """Names of the columns that an expression reads, row by row or as a whole."""
    return frozenset(str(base.label) for base in expression.atoms(IndexedBase))
