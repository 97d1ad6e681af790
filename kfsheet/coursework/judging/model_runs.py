"""Worlds in which answers are compared with the key: whole runs of the model, other ones each time.

In a run all columns follow from parameters and data, so that every true relation between them
holds: an answer that takes another route to the same value is right in all of them. Only in all of
them: parameters and data differ from run to run, observations are taken out, and a student's own
numbers make runs of their own.

The draws do not depend on the student, and are made once per exercise and process.
"""

from __future__ import annotations

import math
import random
from collections.abc import Container, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.random import RandomState

from kfsheet.errors import DataError, KfsheetError
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import Missing, columns_read
from kfsheet.model.quantities import Column
from kfsheet.parsing.calculator import EMPTY
from kfsheet.workbook.write.run import Run

NEAR, FAR = False, True
COMPLETE, HALF, NONE = 0.0, 0.5, 1.0  # share of the observations that is taken out
KINDS = (
    (NEAR, COMPLETE), (FAR, COMPLETE), (NEAR, COMPLETE), (FAR, COMPLETE),
    (NEAR, HALF), (FAR, HALF), (FAR, NONE),
)  # fmt: skip
SPREAD = 0.3  # of a value about the model's own
ATTEMPTS = 12  # ranges that are each sensible may have no value together; then closer to home
LARGEST = 1e8  # times the model's own values: beyond, a run says nothing
Values = Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class OwnNumbers:
    """A student's own parameters and data."""

    parameters: tuple[tuple[str, float], ...] = ()
    data: tuple[tuple[str, tuple[float, ...]], ...] = ()


@dataclass(frozen=True, eq=False)
class World:
    """One run, and what is special in it."""

    columns: Mapping[str, Sequence[float]]
    scalars: Mapping[str, float]
    empty: Mapping[str, Container[int]]
    """Rows of a column that hold nothing where there is no value: those of data, and a start that
    has none. In other rows a formula stands, which gives an empty text."""
    gaps: bool = False
    """Whether observations are missing."""
    own: bool = False
    """Whether parameters are the student's own."""
    own_data: bool = False
    known: dict[Hashable, Any] = field(default_factory=dict, repr=False)
    """The cells of a workbook in this world, by where they stand."""

    def cell(self, name: str, step: int = 0) -> float | str | None:
        """What a cell of a column or scalar holds: EMPTY without a datum, "" without a value."""
        if name == "t":
            return float(step)
        value = self.scalars[name] if name in self.scalars else self.columns[name][step]
        if math.isnan(value):
            return EMPTY if step in self.empty.get(name, ()) else ""
        return float(value)

    @cached_property
    def sizes(self) -> dict[str, float]:
        """Root mean square of each column, a scale for what is small in it."""
        return {name: _rms(values) for name, values in self.columns.items()}


class ModelRuns:
    """The runs of one exercise."""

    def __init__(self, exercise: Exercise) -> None:
        self.exercise, self.model = exercise, exercise.model
        self._data = [c for c in self.model.table.values() if c.is_data]
        self._names = frozenset(c.name for c in self._data)
        self._observed = [c for c in self._data if c.may_be_missing]

    @cached_property
    def base(self) -> Run:
        """The model's own run."""
        return Run.of(self.model)

    @cached_property
    def worlds(self) -> tuple[World, ...]:
        """Runs for all students."""
        kinds = [k for k in KINDS if self._observed or k[1] == COMPLETE]
        found = (self._drawn(n, far, taken) for n, (far, taken) in enumerate(kinds))
        return tuple(filter(None, found))

    def own_worlds(self, own: OwnNumbers) -> tuple[World, ...]:
        """Runs with a student's parameters: own data, own data with gaps, other data."""
        parameters, data = dict(own.parameters), {n: list(v) for n, v in own.data}
        dice = random.Random(f"{self.model.name}/own")
        found = [self._world(Run.of(self.model, data, parameters), data, True, True)]
        trials = [(self._with_gaps(data, taken, dice), True) for taken in (HALF, NONE)]
        trials = trials if self._observed else []
        trials += [({n: w.columns[n] for n in self._names}, False) for w in self.worlds[:1]]
        for values, own_data in trials:
            try:
                run = Run.of(self.model, values, parameters)
            except DataError:
                continue  # what is not observed, or others' data, need not suit these parameters
            found.append(self._world(run, values, True, own_data))
        return tuple(found)

    def own_world(self, own: OwnNumbers, changed: Mapping[str, float]) -> World | None:
        """A student's own numbers with some parameters changed; None if nothing comes of them."""
        data = {n: list(v) for n, v in own.data}
        try:
            run = Run.of(self.model, data, {**dict(own.parameters), **changed})
        except KfsheetError:
            return None
        return self._world(run, data, True, True)

    def _world(self, run: Run, data: Values, own: bool = False, own_data: bool = False) -> World:
        gaps = any(math.isnan(v) for c in self._observed for v in data[c.name])
        columns = {**run.columns, **self._frozen}
        return World(columns, run.scalars, self._empty, gaps, own, own_data)

    @cached_property
    def _empty(self) -> dict[str, Container[int]]:
        found: dict[str, Container[int]] = {name: range(self.model.rows) for name in self._names}
        for column in self.model.all_columns():
            if hollow := {k for k, rule in enumerate(column.start) if rule is Missing}:
                found[column.name] = hollow
        return found

    @cached_property
    def _frozen(self) -> dict[str, Sequence[float]]:
        """Columns that stand as numbers in a handout: they follow from nothing."""
        asked = [self.model.table.get(q.name) for q in self.exercise.questions]
        read = {n for c in asked if c for rule in c.rules for n in columns_read(rule)}
        return {
            name: self.base.columns[name]
            for name, column in self.model.table.items()
            if column.section in self.exercise.frozen and name not in read
        }

    def _drawn(self, number: int, far: bool, taken: float) -> World | None:
        for attempt in range(ATTEMPTS):
            dice = random.Random(f"{self.model.name}/{number}/{attempt}")
            calm = 0.7**attempt
            parameters = self._parameters(dice, far and attempt < ATTEMPTS // 2, SPREAD * calm)
            try:
                series = self._series(dice, far and attempt < ATTEMPTS - 2, calm, parameters)
                # Where nothing can be computed without observations, fewer are taken out.
                data = self._with_gaps(series, taken * calm if attempt > 2 else taken, dice)
                run = Run.of(self.model, data, parameters)
            except DataError:
                continue
            if self._is_sensible(run):
                return self._world(run, data)
        return None

    def _is_sensible(self, run: Run) -> bool:
        for name, values in run.columns.items():
            largest = max((abs(v) for v in values if not math.isnan(v)), default=0.0)
            if not largest <= LARGEST * (self._largest[name] or 1.0):
                return False
        return True

    @cached_property
    def _largest(self) -> dict[str, float]:
        columns = self.base.columns.items()
        return {n: max((abs(v) for v in vs if not math.isnan(v)), default=0.0) for n, vs in columns}

    def _parameters(self, dice: random.Random, far: bool, spread: float) -> dict[str, float]:
        found = {}
        for name, parameter in self.model.parameters.items():
            size = parameter.value * math.exp(dice.gauss(0, spread)) or abs(dice.gauss(0, spread))
            found[name] = -size if far and not parameter.sign and dice.random() < 0.3 else size
        return found

    def _series(
        self, dice: random.Random, far: bool, calm: float, parameters: Mapping[str, float]
    ) -> dict[str, list[float]]:
        """Data of one run: drawn as for students where the exercise can, else about its own."""
        exercise, rows = self.exercise, self.model.rows
        seed = RandomState(dice.randrange(2**32))
        found = {}
        if exercise.draw and not far:
            given = exercise.draw(seed, parameters)
            found = {
                n: [math.nan if v is None else float(v) for v in vs] for n, vs in given.items()
            }
        for column in self._data:
            if column.name in exercise.noise and not far:
                found[column.name] = seed.normal(size=rows).tolist()
            elif column.name not in found:
                found[column.name] = self._about(column, dice, far, calm)
        for name, (low, high) in exercise.ranges.items():
            found[name] = [_within(v, low, high) for v in found[name]]
        return {name: _without_gaps(values) for name, values in found.items()}

    def _about(self, column: Column, dice: random.Random, far: bool, calm: float) -> list[float]:
        values = _without_gaps(list(column.values))
        kinds = sorted(set(values))
        if len(values) > 4 >= len(kinds) > 1 and all(v.is_integer() for v in kinds):
            return [dice.choice(kinds) for _ in values]  # a switch, say
        size = _rms(values) or 1.0
        if far:
            return [v + calm * dice.uniform(-size, size) for v in values]
        return [v * math.exp(dice.gauss(0, SPREAD * calm)) for v in values]

    def _with_gaps(self, data: Values, taken: float, dice: random.Random) -> dict[str, list[float]]:
        gone = {c.name for c in self._observed} if taken else set()
        return {
            name: [math.nan if name in gone and dice.random() < taken else v for v in values]
            for name, values in data.items()
        }


def _within(value: float, low: float, high: float) -> float:
    """A value as it is if it lies within a range, or mirrored at its ends; NaN stays NaN."""
    beyond = (value - low) % (2 * (high - low))
    return value if low <= value <= high else low + min(beyond, 2 * (high - low) - beyond)


def _without_gaps(values: list[float]) -> list[float]:
    """Missing values replaced by those between their neighbours."""
    there = [n for n, v in enumerate(values) if not math.isnan(v)]
    known = [values[n] for n in there]
    return np.interp(range(len(values)), there, known).tolist() if there else [1.0] * len(values)


def _rms(values: Sequence[float]) -> float:
    there = [v for v in values if not math.isnan(v)]
    return math.sqrt(sum(v * v for v in there) / len(there)) if there else 0.0
