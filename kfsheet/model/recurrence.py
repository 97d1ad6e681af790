"""The central type: a table of named columns, each defined by one SymPy expression.

A :class:`Recurrence` is written down once and then seen in several ways: as numbers
(:mod:`kfsheet.evaluation.evaluate`), as Python source (:mod:`kfsheet.evaluation.python_source`) and
as a workbook of live formulas (:mod:`kfsheet.workbook`). A definition looks like the printed
equation, with ``t`` for the row: ``x_a[t - 1]`` is the analysis one step earlier.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from sympy import Basic, Expr, Indexed, IndexedBase, Symbol

from kfsheet.errors import DataError, ModelError
from kfsheet.model import validation
from kfsheet.model.expressions import (
    ColumnBase,
    Missing,
    column_references,
    columns_read,
    scalars,
    t,
)
from kfsheet.model.names import name_problem, section_problem
from kfsheet.model.quantities import Column, Parameter, Scalar, checked_values
from kfsheet.model.schedule import Pass, refuse_circle, schedule
from kfsheet.model.unit_text import Unit
from kfsheet.model.units import UnitProblem, unit_problems
from kfsheet.printing.excel_names import excel_name_problem


class Recurrence:
    """An ordered table of parameters, data, columns and summaries, validated as it is written.

    Parameters
    ----------
    name : str
        Identifier, also the name of the generated Python function.
    title : str
        One line for people.
    step : str
        What a row is: "photo", "sweep", "pixel".
    rows : int, optional
        Number of rows of a table that has no data columns.

    Examples
    --------
    A stone that falls, without drag:

    >>> from kfsheet import Recurrence, evaluate, t
    >>> m = Recurrence("stone", title="A falling stone", rows=3)
    >>> dt = m.parameter("dt", 0.5, "s", "time step", sign="positive")
    >>> g = m.parameter("g", 9.8, "m/s2", "gravity")
    >>> (v,) = m.columns("v", section="Fall")
    >>> m.define(v[t], v[t - 1] - g*dt, "m/s", "velocity", start=[0])
    >>> evaluate(m)["v"].tolist()
    [0.0, -4.9, -9.8]
    """

    def __init__(self, name: str, *, title: str, step: str = "step", rows: int | None = None):
        if problem := name_problem(name):
            raise ModelError(f"recurrence {name!r}: {problem}")
        for words in (title, step):
            validation.check_words(name, words)
        if rows is not None and (not isinstance(rows, int) or rows < 1):
            raise ModelError(f"recurrence {name}: rows is {rows!r}; give a whole number from 1 up")
        self.name, self.title, self.step = name, title, step
        self._rows = rows
        self.parameters: dict[str, Parameter] = {}
        self.derived_scalars: dict[str, Scalar] = {}
        self.summaries: dict[str, Scalar] = {}
        self.table: dict[str, Column] = {}
        self.clock: Column | None = None
        self._steps: dict[str, str] = {}  # of sections whose rows are something else
        self._readers: dict[str, set[str]] = {}  # who reads a column
        self.version = 0
        """How often something was added; so a run can tell whether what it knows is current."""

    def __repr__(self) -> str:
        return (
            f"<Recurrence {self.name}: {len(self.parameters)} parameters, "
            f"{len(self.table)} columns, {self._rows} rows>"
        )

    # -- writing it down -------------------------------------------------------------------

    def parameter(
        self, name: str, value: float, unit: str, description: str, *, sign: str = ""
    ) -> Symbol:
        """Add a scalar that a user may change, and return its symbol.

        Parameters
        ----------
        name, unit, description : str
            Name in formulas, unit as in ``"m/s2"``, and plain words.
        value : float
            The value at the start.
        sign : {'', 'positive', 'nonnegative'}
            What the value must be; checked wherever a value enters.

        Raises
        ------
        ModelError
            If the name is taken or Excel cannot take it, or the unit does not parse.
        DataError
            If the value is no finite number or has the wrong sign.
        """
        if sign not in ("", "positive", "nonnegative"):
            raise ModelError(f"parameter {name}: sign is {sign!r}, not positive or nonnegative")
        self._check_scalar_name(name)
        validation.check_words(name, description)
        Unit.read(unit)
        symbol = Symbol(name, real=True, **({sign: True} if sign else {}))
        new = Parameter(symbol, value, unit, description, sign)
        self.parameters[name] = replace(new, value=new.checked(value))
        self.version += 1
        return symbol

    def derived(self, name: str, expression: Expr, unit: str, description: str) -> Symbol:
        """Add a scalar that is a formula of parameters and earlier scalars; see ``parameter``."""
        expression = self._checked(name, expression)
        read = scalars(expression) & {s.symbol for s in self.summaries.values()}
        if columns_read(expression) or t in scalars(expression) or read:
            raise ModelError(f"derived scalar {name} reads a column; make it a summary or a column")
        return self._add_scalar(self.derived_scalars, name, expression, unit, description)

    def summary(self, name: str, expression: Expr, unit: str, description: str) -> Symbol:
        """Add a scalar made of aggregates of columns, as ``RMS(e_x)``; columns may read it."""
        expression = self._checked(name, expression)
        if column_references(expression) or t in scalars(expression):
            raise ModelError(
                f"summary {name} reads single rows; take Last, Mean, RMS, ... of columns"
            )
        symbol = self._add_scalar(self.summaries, name, expression, unit, description)
        for read in columns_read(expression):
            self._readers.setdefault(read, set()).add(name)
        return symbol

    def data(
        self,
        name: str,
        values: Sequence[float],
        unit: str,
        description: str,
        *,
        section: str,
        may_be_missing: bool = False,
    ) -> IndexedBase:
        """Add a column of fixed numbers; NaN, where allowed, means "not observed".

        Raises
        ------
        DataError
            If a value is no number, is infinite, or is missing where that is not allowed, or the
            column has another length than the table.
        """
        validation.check_words(name, description)
        Unit.read(unit)
        numbers = checked_values(name, values, may_be_missing)
        if self._rows not in (None, len(numbers)):
            raise DataError(f"column {name} has {len(numbers)} values, the table {self._rows} rows")
        if not numbers:
            raise DataError(f"column {name} has no values; a table needs at least one row")
        (base,) = self.columns(name, section=section)
        self.version += 1
        self._rows = len(numbers)
        self.table[name] = replace(
            self.table[name],
            unit=unit,
            description=description,
            values=numbers,
            may_be_missing=may_be_missing,
        )
        return base

    def columns(self, *names: str, section: str) -> tuple[IndexedBase, ...]:
        """Announce columns, in the order in which they stand on the worksheet ``section``."""
        if problem := section_problem(section, {c.section for c in self.table.values()}):
            raise ModelError(f"section {section!r}: {problem}")
        for n, name in enumerate(names):
            taken = "the name is taken" if name in names[:n] else self._taken(name)
            if problem := name_problem(name) or taken:
                raise ModelError(f"column {name!r}: {problem}")
        for name in names:
            self.table[name] = Column(ColumnBase(name, real=True), section)
        return tuple(self.table[name].base for name in names)

    def define(
        self,
        cell: Indexed,
        expression: Expr,
        unit: str,
        description: str,
        *,
        start: Sequence[Expr] = (),
    ) -> None:
        """Define a column: ``m.define(v[t], v[t - 1] - g*dt, "m/s", "velocity", start=[v_0])``.

        ``start`` holds the expressions of the first rows, in order; each may look back at most
        to row 0. The general expression holds from row ``len(start)`` on.

        Raises
        ------
        ModelError
            For an undefined symbol, a column that needs itself in the same row, a reference to a
            later row or to a row before the start values, a missing value that is read without
            ``when_observed``, a number that should be a parameter, or a unit that does not parse.
        """
        column = self._definable(cell)
        validation.check_words(column.name, description)
        Unit.read(unit)
        if not isinstance(start, Sequence) or isinstance(start, str):
            raise ModelError(f"{column.name}: start is {start!r}; give a list, as in start=[0]")
        rules = tuple(self._checked(column.name, rule) for rule in (*start, expression))
        for row, rule in enumerate(rules):
            validation.check_lags(column.name, rule, row, len(start))
            validation.check_summaries(column.name, rule, self.summaries, self.column)
        new = replace(
            column,
            unit=unit,
            description=description,
            expression=rules[-1],
            start=rules[:-1],
            may_be_missing=rules[-1].has(Missing),
        )
        self._install(column, new)

    def time(self, expression: Expr, unit: str, description: str) -> IndexedBase:
        """Define the clock, a column ``time`` that stands second on every worksheet."""
        if self.clock:
            raise ModelError("the clock is defined already")
        expression = self._checked("time", expression)
        if columns_read(expression):
            raise ModelError("the clock reads a column; give it as a formula of t and parameters")
        Unit.read(unit)
        self.clock = Column(ColumnBase("time", real=True), "", unit, description, expression)
        self.version += 1
        return self.clock.base

    def rows_are(self, section: str, step: str) -> None:
        """Say that a row of ``section`` is another thing than elsewhere: an angle, a pixel.

        Such a worksheet counts its own steps and shows no clock.

        Raises
        ------
        ModelError
            If the name of the step is taken or is no word.
        """
        validation.check_words(section, step)
        if problem := self._taken(step):
            raise ModelError(f"step {step!r} of section {section!r}: {problem}")
        self._steps[section] = step

    # -- asking it -------------------------------------------------------------------------

    def __getitem__(self, names: str | tuple[str, ...]) -> Any:
        """Symbol of a scalar or base of a column: ``m["dt"]``; of several: ``m["dt", "x_a"]``."""
        if isinstance(names, tuple):
            return tuple(self[name] for name in names)
        scalar = self.scalars().get(names)
        return scalar.symbol if scalar else self.column(names).base

    __iter__ = None  # a recurrence has no order of its own: see table, sections, parameters

    @property
    def rows(self) -> int:
        """Number of rows."""
        if self._rows is None:
            raise ModelError(f"{self.name} has no data; say how many rows: Recurrence(..., rows=N)")
        return self._rows

    @property
    def sections(self) -> dict[str, list[Column]]:
        """Columns by worksheet, in order."""
        result: dict[str, list[Column]] = {}
        for column in self.table.values():
            result.setdefault(column.section, []).append(column)
        return result

    def step_of(self, section: str) -> str:
        """What a row of a worksheet is."""
        return self._steps.get(section, self.step)

    def clock_of(self, section: str) -> list[Column]:
        """The clock, where the rows of a worksheet follow it; else nothing."""
        return [self.clock] if self.clock and section not in self._steps else []

    @property
    def start_rows(self) -> int:
        """How many rows at the top have definitions of their own."""
        return max((len(c.start) for c in self.table.values()), default=0)

    def all_columns(self) -> list[Column]:
        """The clock, if there is one, and every column."""
        return [*([self.clock] if self.clock else []), *self.table.values()]

    def column(self, name: str) -> Column:
        """A column or the clock, by name."""
        if name in self.table:
            return self.table[name]
        if self.clock and self.clock.name == name:
            return self.clock
        there = ", ".join(self.table) or "none yet"
        raise ModelError(f"{self.name} has no column {name!r}; it has {there}")

    def units(self) -> dict[str, str]:
        """Unit text of every name."""
        scalars = [*self.parameters.values(), *self.derived_scalars.values()]
        return {i.name: i.unit for i in (*scalars, *self.summaries.values(), *self.all_columns())}

    def defaults(self) -> dict[str, float]:
        """Value of every parameter."""
        return {p.name: p.value for p in self.parameters.values()}

    def passes(self) -> list[Pass]:
        """The order of computation: runs through the rows, each followed by summaries."""
        self.validate()
        return schedule(self)

    def validate(self) -> None:
        """Refuse a recurrence that is not complete."""
        for column in self.table.values():
            if not column.is_data and column.expression is None:
                raise ModelError(f"column {column.name} is announced but never defined")
        if not self.table:
            raise ModelError(f"{self.name} has no columns")
        if self.rows < self.start_rows:
            raise ModelError(f"{self.name} has {self.rows} rows but {self.start_rows} start values")

    def check_units(
        self, units: Mapping[str, str] | None = None, values: Mapping[str, float] | None = None
    ) -> list[UnitProblem]:
        """Name every expression whose terms do not agree in their units.

        Parameters
        ----------
        units, values : mapping, optional
            Other units and values of parameters, to ask "what if f were in 1/m?". A value
            matters where a parameter is an exponent.

        Returns
        -------
        list of UnitProblem
            Empty if all expressions are sound.
        """
        for what, given, names in (
            ("unit", units, self.units()),
            ("value", values, self.defaults()),
        ):
            if unknown := sorted(set(given or {}) - set(names)):
                raise ModelError(f"a {what} is given for {unknown[0]}, which {self.name} lacks")
        numbers = {**self.defaults(), **(values or {})}
        for scalar in self.derived_scalars.values():
            numbers[scalar.name] = scalar.expression.subs(numbers)
        formulas = [*self.derived_scalars.values(), *self.all_columns(), *self.summaries.values()]
        return unit_problems(formulas, {**self.units(), **(units or {})}, numbers)

    # -- helpers of the above --------------------------------------------------------------

    def _add_scalar(
        self, home: dict[str, Scalar], name: str, expression: Expr, unit: str, description: str
    ) -> Symbol:
        self._check_scalar_name(name)
        validation.check_words(name, description)
        Unit.read(unit)
        symbol = Symbol(name, real=True)
        home[name] = Scalar(symbol, expression, unit, description)
        self.version += 1
        return symbol

    def _check_scalar_name(self, name: str) -> None:
        problem = name_problem(name) or excel_name_problem(name) or self._taken(name)
        twins = {other for other in self.scalars() if other.lower() == str(name).lower()}
        if twins and not problem:
            problem = f"Excel does not tell it from {twins.pop()}: names ignore capitals"
        if problem:
            raise ModelError(f"name {name!r}: {problem}")

    def scalars(self) -> dict[str, Parameter | Scalar]:
        """Parameters, derived scalars and summaries, by name."""
        return {**self.parameters, **self.derived_scalars, **self.summaries}

    def _own_headers(self) -> set[str]:
        return {"time", self.step, *self._steps.values()}

    def _taken(self, name: str) -> str | None:
        taken = name in self.scalars() or name in self.table or name in self._own_headers()
        return "the name is taken" if taken else None

    def _checked(self, name: str, expression: Expr) -> Expr:
        known: set[Basic] = {t, *(s.symbol for s in self.scalars().values())}
        known |= {c.base for c in self.all_columns()}
        expression = validation.checked_expression(name, expression)
        validation.check_symbols(name, expression, known)
        return expression

    def _definable(self, cell: Indexed) -> Column:
        if not isinstance(cell, Indexed) or cell.indices != (t,):
            raise ModelError(f"define a column as name[t], not as {cell}")
        column = self.table.get(str(cell.base.label))
        if column is None:
            raise ModelError(f"column {cell.base} is not announced; call columns() first")
        if column.is_data or column.expression is not None:
            raise ModelError(f"column {column.name} is defined already")
        return column

    def _install(self, old: Column, new: Column) -> None:
        """Put a column into the table, unless it breaks those that are there."""
        self.table[new.name] = new
        reads = {name for rule in new.rules for name in columns_read(rule)}
        symbols = {s.name for rule in new.rules for s in scalars(rule)}
        readers = self._readers.get(new.name, set())
        try:
            validation.check_gaps(new, self.column)
            # Only a column that something reads already, or a summary's reader, closes a circle.
            if readers or new.name in reads or symbols & set(self.summaries):
                refuse_circle(self, new)
            for name in readers & set(self.table):
                validation.check_gaps(self.table[name], self.column)
        except ModelError:
            self.table[new.name] = old
            raise
        for name in reads:
            self._readers.setdefault(name, set()).add(new.name)
        self.version += 1
