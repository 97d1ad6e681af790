"""Random points at which a student's formula and the key are compared as functions.

A *sample* gives every parameter, datum and column of an exercise a random value. In the first kind
every column is drawn independently of all others, so that a formula is judged on its own, whatever
stands in the columns it reads. A student may also have written a column's formula where the key
reads the column; so there are samples in which the columns of the row asked for, and of the one or
two rows before it, follow from earlier rows as the key says. What itself follows from the answer
stays random there: an answer computed from its own consequences goes in a circle.

The draws do not depend on the student, and are made once per exercise.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import exp, isnan

from sympy import Basic

from kfsheet.coursework.judging.precise_values import MISSING, NoValueError, Value, exact, value_of
from kfsheet.model.expressions import columns_read, scalars
from kfsheet.model.quantities import Column, Parameter
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.schedule import same_row
from kfsheet.workbook.write.run import Run

ALONE = -1
"""Depth of the samples in which every column is drawn by itself."""
DEPTHS = (ALONE, 0, 1, 2)
WITHOUT_GAPS, WITH_GAPS = 8, 6  # samples; every other one is wild
SPREAD = 0.3  # of a value about the one in the model's own run


@dataclass(frozen=True)
class OwnNumbers:
    """A student's own parameters and data, where a sample is to have those."""

    parameters: tuple[tuple[str, float], ...] = ()
    data: tuple[tuple[str, tuple[float, ...]], ...] = ()


NOBODY = OwnNumbers()


class Sample:
    """One random point for the formulas of one question in one row."""

    def __init__(
        self,
        sampler: Sampler,
        row: int,
        depth: int,
        number: int,
        blocked: frozenset[str] = frozenset(),
        own: OwnNumbers = OwnNumbers(),
    ) -> None:
        self._sampler, self.row, self.depth, self._blocked = sampler, row, depth, blocked
        self.wild, self.gaps = number % 2 == 1, number >= WITHOUT_GAPS
        self._empty = number in (WITHOUT_GAPS, WITHOUT_GAPS + 1)
        self._number = number
        self._own = dict(own.parameters)
        self._own_data = dict(own.data)
        self._seed = f"{sampler.model.name}/{number}"
        self._known: dict[tuple[str, int], Value | NoValueError] = {}

    def __call__(self, name: str, row: int) -> Value:
        """Value of a scalar (row 0), or of a column in a row."""
        key = (name, row)
        if key not in self._known:
            # Whoever asks for it while it is computed, asks in a circle.
            self._known[key] = NoValueError("it goes in a circle")
            try:
                self._known[key] = self._computed(name, row)
            except NoValueError as error:
                self._known[key] = error
        found = self._known[key]
        if isinstance(found, NoValueError):
            raise found
        return found

    def _computed(self, name: str, row: int) -> Value:
        model = self._sampler.model
        if name in model.parameters:
            return self._parameter(model.parameters[name])
        if name in model.derived_scalars and self.depth > ALONE and name not in self._blocked:
            return value_of(model.derived_scalars[name].expression, self, row)
        if name in model.derived_scalars or name in model.summaries:
            return self._drawn(name, 0, [self._sampler.base.scalars[name]])
        column = model.column(name)
        if not 0 <= row < model.rows:
            return MISSING  # the header above the table, or an empty cell below
        if column is model.clock:
            return value_of(column.expression, self, row)
        return self._column(column, row)

    def _column(self, column: Column, row: int) -> Value:
        name = column.name
        if column.is_data:
            return self._datum(column, row)
        follows = self.row - self.depth <= row <= self.row and self.depth > ALONE
        if follows and not (row == self.row and name in self._blocked):
            return value_of(column.definition(row), self, row)
        if column.gap_possible(range(row, row + 1)) and self._gap(name, row):
            return MISSING
        return self._drawn(name, row, self._sampler.base.columns[name])

    def _datum(self, column: Column, row: int) -> Value:
        if column.name in self._own_data:
            value = self._own_data[column.name][row]
            return None if isnan(value) else exact(value)
        if column.may_be_missing and self._gap(column.name, row):
            return None
        return self._drawn(column.name, row, self._sampler.base.columns[column.name])

    def _random(self, name: str, row: int) -> random.Random:
        return random.Random(f"{self._seed}/{name}/{row}")

    def _gap(self, name: str, row: int) -> bool:
        """Nothing is observed in the first of the samples with gaps, half of it in the others."""
        return self.gaps and (self._empty or self._random(f"gap {name}", row).random() < 0.5)

    def _sign(self, name: str, row: int) -> int:
        """Either sign in two of four neighbouring samples of a kind, in an order of its own."""
        signs = [1, 1, -1, -1]
        random.Random(f"{self._sampler.model.name}/{name}/{row}").shuffle(signs)
        return signs[self._number // 2 % 4]

    def _parameter(self, parameter: Parameter) -> Value:
        if parameter.name in self._own:
            return exact(self._own[parameter.name])
        dice = self._random(parameter.name, 0)
        value = parameter.value * exp(dice.gauss(0, SPREAD)) or abs(dice.gauss(0, SPREAD))
        signed = self.wild and not parameter.sign and dice.random() < 0.5
        return exact(-value if signed else value)

    def _drawn(self, name: str, row: int, base: list[float]) -> Value:
        """Near the model's own run, or anywhere in the column's range, with either sign."""
        dice, largest, few = self._random(name, row), *self._sampler.range(name, base)
        if few:
            return exact(dice.choice(few))
        own = base[row] if row < len(base) else 0.0
        if self.wild or isnan(own) or own == 0:
            return exact(dice.uniform(0, largest) * self._sign(name, row))
        return exact(own * exp(dice.gauss(0, SPREAD)))


class Sampler:
    """What all samples of an exercise share: its model and one run of it."""

    def __init__(self, model: Recurrence) -> None:
        self.model = model
        self._ranges: dict[str, tuple[float, list[float]]] = {}
        self._samples: dict[tuple, list[Sample]] = {}

    @cached_property
    def base(self) -> Run:
        """The model's own run."""
        return Run.of(self.model)

    def range(self, name: str, base: list[float]) -> tuple[float, list[float]]:
        """Largest size in the run; and the values, where there are only a few whole ones."""
        if name not in self._ranges:
            values = {v for v in base if not isnan(v)}
            few = len(base) > 4 and len(values) <= 4 and all(float(v).is_integer() for v in values)
            largest = max(map(abs, values), default=0) or 1.0
            self._ranges[name] = (largest, sorted(values) if few and len(values) > 1 else [])
        return self._ranges[name]

    def samples(self, name: str, row: int, depth: int, own: OwnNumbers = NOBODY) -> list[Sample]:
        """Samples for the formulas of one question in one row; those without gaps come first."""
        key = (name, row, depth, own)
        if key not in self._samples:
            if len(self._samples) > 2_000:  # own numbers make new ones for every student
                self._samples.clear()
            gaps = any(c.may_be_missing for c in self.model.all_columns())
            count = WITHOUT_GAPS + WITH_GAPS * gaps
            blocked = self.consequences(name)
            self._samples[key] = [Sample(self, row, depth, n, blocked, own) for n in range(count)]
        return self._samples[key]

    @lru_cache(maxsize=256)  # noqa: B019 - samplers live as long as the process
    def consequences(self, name: str) -> frozenset[str]:
        """What follows from a column in its own row, itself included; of a scalar, everything."""
        found = {name}
        items = [*self.model.derived_scalars.values(), *self.model.all_columns()]
        while True:
            more = {
                item.name
                for item in items
                for rule in item.rules
                if found & (_read(rule, name in self.model.derived_scalars) | same_row(rule))
            }
            if more <= found:
                return frozenset(found)
            found |= more


def _read(rule: Basic, everything: bool) -> set[str]:
    names = {s.name for s in scalars(rule)}
    return names | columns_read(rule) if everything else names
