"""What a definition may contain: the refusals of a recurrence, one function for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Set
from math import factorial
from typing import Any

from sympy import (
    Basic,
    Expr,
    Float,
    Indexed,
    IndexedBase,
    Piecewise,
    Rational,
    Symbol,
    SympifyError,
    sympify,
)
from sympy.logic.boolalg import And, Not, Or

from kfsheet.errors import ModelError, PrintError
from kfsheet.model.expressions import (
    Aggregate,
    Last,
    Observed,
    column_references,
    lag,
    scalars,
    walk,
)
from kfsheet.model.quantities import Column, Scalar
from kfsheet.printing.python import python_code

LARGEST_NUMBER, LARGEST_DENOMINATOR = 12, 16
# Denominators of Taylor's series, k!, and of the noise that integrators of white noise gather,
# i! j! (i + j + 1): dt^5/20 for a constant acceleration, dt^7/252 one order further.
OF_SERIES = {
    *(factorial(k) for k in range(8)),
    *(factorial(i) * factorial(j) * (i + j + 1) for i in range(5) for j in range(5)),
}
FULL_CIRCLE = {60, 90, 180, 360}
ENDLESS = 1_048_576  # more rows than a worksheet has


def checked_expression(name: str, expression: Any) -> Expr:
    """``expression`` as SymPy, with 0.5 as 1/2, and with no other decimal number in it."""
    try:
        expression = sympify(expression, strict=True)
    except SympifyError:
        raise ModelError(f"{name} is defined as {expression!r}; give a SymPy expression") from None
    if not isinstance(expression, Expr):
        raise ModelError(f"{name} is defined as {expression}, which is no number in a row")
    # 0.5 is what people write for a half; SymPy would carry it as a float and print 0.5*x.
    expression = expression.xreplace({f: _exact(f) for f in expression.atoms(Float)})
    for number in (node for node in walk(expression) if isinstance(node, Float | Rational)):
        if isinstance(number, Float) or not _small(number):
            raise ModelError(
                f"{name} holds the number {_shown(number)}; make it a parameter, "
                "so that it has a name, a unit and a place where it can be changed"
            )
    _check_columns(name, expression)
    # What cannot be printed now would fail later, far from the line that wrote it.
    try:
        python_code(expression)
    except PrintError as error:
        raise ModelError(f"{name}: {error}") from None
    return expression


def _check_columns(name: str, expression: Expr) -> None:
    """Refuse a whole column where a cell is meant, and an aggregate of something else."""
    for node in walk(expression):
        columns = [a for a in node.args if isinstance(a, IndexedBase)]
        if isinstance(node, Aggregate) and len(columns) < len(node.args):
            raise ModelError(f"{name} reads {node}; an aggregate takes columns, as in Mean(x)")
        whole = [] if isinstance(node, Aggregate | Indexed) else columns
        if isinstance(expression, IndexedBase):
            whole = [expression]
        if whole:
            raise ModelError(f"{name} reads {whole[0]}, a whole column; write {whole[0]}[t]")


def _small(number: Rational) -> bool:
    denominators = number.q <= LARGEST_DENOMINATOR or number.q in OF_SERIES
    small = abs(number.p) <= LARGEST_NUMBER and denominators
    return small or {abs(number.p), number.q} <= FULL_CIRCLE | {1}


def _shown(number: Float | Rational) -> str:
    return f"{float(number):.15g}" if isinstance(number, Float) else str(number)


def _exact(number: Float) -> Expr:
    """Halves, quarters, ... as fractions; any other decimal number stays, to be refused."""
    fraction = Rational(float(number))
    return fraction if fraction.q <= LARGEST_DENOMINATOR else number


def check_symbols(name: str, expression: Expr, known: Set[Basic]) -> None:
    """Refuse a symbol or a column that the recurrence does not know."""
    for node in walk(expression):
        thing = node.base if isinstance(node, Indexed) else node
        if isinstance(thing, Symbol | IndexedBase) and thing not in known:
            twin = any(str(thing) == str(other) for other in known)
            remedy = (
                "use the symbol that parameter(), derived() or columns() returned"
                if twin
                else "add it with parameter(), data() or columns() first"
            )
            raise ModelError(f"{name} reads {thing}, which is not defined; {remedy}")


def check_lags(name: str, expression: Expr, first_row: int, starts: int) -> None:
    """Refuse a look-ahead, and a look-back beyond row 0, for a rule used from ``first_row`` on."""
    for cell in column_references(expression):
        back = lag(cell) if len(cell.indices) == 1 else None
        if back is None or not back.is_Integer:
            raise ModelError(f"{name} reads {cell}; a row is t, t - 1, t - 2, ...")
        if back < 0:
            raise ModelError(f"{name} reads {cell}, a later row; a recurrence looks back only")
        if back > first_row:
            rule = f"start value {first_row}" if first_row < starts else "the definition"
            raise ModelError(
                f"{name}: {rule} reads {cell}, but holds from row {first_row} on; "
                + ("give a start value" if back == 1 else f"give {back} start values")
            )


def check_observed(name: str, expression: Expr, gap_possible: Callable[[Indexed], bool]) -> None:
    """Refuse a formula that reads a value which may be missing without asking first."""
    culprit = _unguarded(expression, frozenset(), gap_possible)
    if culprit is not None:
        raise ModelError(
            f"{name} reads {culprit}, which may be missing; "
            f"write when_observed({culprit}, ...) around the part that needs it"
        )


def check_gaps(column: Column, find: Callable[[str], Column]) -> None:
    """Refuse a column with a rule that reads a value which may be missing where the rule holds."""
    for first, rule in enumerate(column.rules):
        # A start value holds in its own row, the general expression in all that follow.
        last = first if first < len(column.start) else ENDLESS

        def gap_possible(cell: Indexed, first: int = first, last: int = last) -> bool:
            back = int(lag(cell))
            return find(str(cell.base.label)).gap_possible(range(first - back, last - back + 1))

        check_observed(column.name, rule, gap_possible)


def check_summaries(
    name: str, rule: Expr, summaries: Mapping[str, Scalar], find: Callable[[str], Column]
) -> None:
    """Refuse an aggregate inside a column, and a summary that may have no value."""
    if rule.has(Aggregate):
        raise ModelError(f"{name} holds an aggregate; make it a summary() and read that")
    for symbol in scalars(rule):
        summary = summaries.get(symbol.name)
        for last in summary.expression.atoms(Last) if summary else ():
            if find(str(last.args[0].label)).may_be_missing:
                raise ModelError(f"{name} reads {symbol}, which may be missing in the last row")


def _unguarded(e: Basic, known: frozenset, gap_possible: Callable[[Indexed], bool]) -> Basic | None:
    if isinstance(e, Indexed):
        return e if e not in known and gap_possible(e) else None
    if isinstance(e, Observed | Aggregate):
        return None
    if isinstance(e, And):
        known |= _seen(e)
    if not isinstance(e, Piecewise):
        return next(filter(None, (_unguarded(a, known, gap_possible) for a in e.args)), None)
    for value, condition in e.args:
        culprit = _unguarded(condition, known, gap_possible)
        culprit = culprit or _unguarded(value, known | _seen(condition), gap_possible)
        if culprit is not None:
            return culprit
        known |= _seen_otherwise(condition)
    return None


def _seen(condition: Basic) -> frozenset:
    """Cells that hold a number wherever the condition is true."""
    parts = condition.args if isinstance(condition, And) else (condition,)
    return frozenset(part.args[0] for part in parts if isinstance(part, Observed))


def _seen_otherwise(condition: Basic) -> frozenset:
    """Cells that hold a number wherever the condition is false."""
    parts = condition.args if isinstance(condition, Or) else (condition,)
    return frozenset().union(*(_seen(part.args[0]) for part in parts if isinstance(part, Not)))


def check_words(name: str, words: str) -> None:
    """Refuse a title or description that would break a line of source or become a formula."""
    if not words or words != " ".join(words.split()) or '"""' in words or words[0] in "=+-@":
        raise ModelError(
            f"{name}: the words {words!r} must be one line, not begin with = + - @ "
            "and not hold triple quotes"
        )
