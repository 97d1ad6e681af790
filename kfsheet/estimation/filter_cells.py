"""The cells of a Kalman filter: their names, units and words."""

from __future__ import annotations

import itertools
import re
from collections.abc import Generator, Iterator, Sequence
from typing import NamedTuple

from sympy import Expr, Indexed, Matrix, S, Symbol

from kfsheet.estimation.state_space import StateSpace
from kfsheet.model.expressions import ColumnBase, Missing, column_references, t, when_observed
from kfsheet.model.names import CHARACTER_CODE
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.unit_text import Unit
from kfsheet.model.validation import ENDLESS


def readable(name: str) -> str:
    """The name, without underscores that would make a part of it the code of a character.

    >>> readable("K_y_theta"), readable("K_x1_theta")
    ('K_y_theta', 'Kx1_theta')
    """
    return re.sub(f"_(?={CHARACTER_CODE[1:]})", "", name)


class Definition(NamedTuple):
    """One column: name, general expression, unit, words, and what stands in row 0."""

    name: str
    rule: Expr
    unit: str
    words: str
    start: Expr = Missing


class FilterCells:
    """What a filter's columns are called, which of them there are, and how they are defined.

    A covariance that is 0 for ever, and a gain that is, have no columns: what does not depend on
    each other falls apart into filters of its own.
    """

    def __init__(self, m: Recurrence, model: StateSpace, suffix: str) -> None:
        self.m, self.model, self.suffix = m, model, suffix
        self.names = [symbol.name for symbol in model.state]
        self.elements = list(model.state.values())
        self.units = [Unit.read(element.unit) for element in self.elements]
        self.related = _related(model)

    @property
    def all(self) -> range:
        """Indices of the state."""
        return range(len(self.names))

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Indices of the upper triangle, without those that are 0 for ever."""
        return ((i, j) for i in self.all for j in self.all[i:] if (i, j) in self.related)

    def touched(self, k: int) -> list[int]:
        """Elements that observation k moves."""
        h = self.model.H[k, :]
        return [i for i in self.all if any(h[j] != 0 and (i, j) in self.related for j in self.all)]

    def cell(self, name: str, back: int = 0) -> Indexed:
        """Cell of a column of this filter, ``back`` rows above."""
        return ColumnBase(readable(name + self.suffix), real=True)[t - back]

    def P_name(self, i: int, j: int, stage: str) -> str:
        """Name of an entry of a covariance."""
        return f"P_{self.names[min(i, j)]}{self.names[max(i, j)]}_{stage}"

    def covariances(self, stage: str, back: int = 0) -> Matrix:
        """Cells of a covariance, with 0 for what stays 0."""

        def entry(i: int, j: int) -> Expr:
            known = (i, j) in self.related
            return self.cell(self.P_name(i, j, stage), back) if known else S.Zero

        return Matrix(len(self.all), len(self.all), entry)

    @property
    def changing(self) -> set[Symbol]:
        """Symbols whose values differ from row to row."""
        return {*self.model.state, *self.model.intermediates}

    def at(self, expression: Expr, cells: Sequence[Expr]) -> Expr:
        """An expression in symbols of the state and intermediates, with cells in their place."""
        known = dict(zip(self.model.state, cells, strict=True))
        known |= {w: self.cell(w.name) for w in self.model.intermediates}
        return expression.xreplace(known)

    def gaps(self, expression: Expr) -> tuple[Indexed, ...]:
        """Cells in an expression that may be missing from row 1 on."""
        cells = sorted(column_references(expression), key=str)
        after = range(1, ENDLESS)
        return tuple(c for c in cells if self.m.column(str(c.base.label)).gap_possible(after))

    def column(
        self, name: str, rule: Expr, unit: Unit, words: str, start: Expr = Missing
    ) -> Definition:
        """A definition, its name with the suffix."""
        return Definition(readable(name + self.suffix), rule, str(unit), words, start)

    def covariance(self, i: int, j: int, stage: str, rule: Expr, start: Expr) -> Definition:
        """An entry of a covariance at a stage."""
        pair = f"variance of {self.names[i]}"
        if i != j:
            pair = f"covariance of {self.names[i]} and {self.names[j]}"
        unit = self.units[i] * self.units[j]
        return self.column(
            self.P_name(i, j, stage), rule, unit, f"{when_words(stage)}: {pair}", start
        )

    def derivative(
        self, name: str, entry: Expr, cells: Sequence[Expr], unit: Unit, words: str
    ) -> Generator[Definition, None, Expr]:
        """An entry of a Jacobian: a constant stays where it is used, others get a column."""
        if not entry.free_symbols & self.changing and not column_references(entry):
            return entry
        yield self.column(name, self.at(entry, cells), unit, words)
        return self.cell(name)

    @staticmethod
    def guarded(rule: Expr, cells: tuple[Indexed, ...], otherwise: Expr = Missing) -> Expr:
        """A rule where some cells hold numbers; the rule itself if there are none to ask for."""
        return when_observed(cells, rule, otherwise) if cells else rule


def _related(model: StateSpace) -> set[tuple[int, int]]:
    """Pairs of elements whose covariance does not stay 0 for ever."""
    every = list(itertools.product(range(len(model.state)), repeat=2))
    nonzero_F = {(i, j) for i, j in every if model.F[i, j] != 0}
    nonzero_H = [{j for _, j in every if model.H[k, j] != 0} for k in range(model.H.rows)]
    found = {(i, i) for i, _ in every} | {(i, j) for i, j in every if model.Q[i, j] != 0}
    while True:
        # F P F' relates i and j if they come from k and l that are related.
        new = {(i, j) for i, k in nonzero_F for j, m in nonzero_F if (k, m) in found}
        for seen in nonzero_H:
            moved = {i for i, j in found if j in seen}
            new |= set(itertools.product(moved, repeat=2))
        if new <= found:
            return found
        found |= new


def when_words(stage: str) -> str:
    """What a stage is called: ``"f"``, ``"a"``, or after how many observations.

    >>> when_words("f"), when_words("2")
    ('forecast', 'after 2 observations')
    """
    words = {"f": "forecast", "a": "analysis", "1": "after the first observation"}
    return words.get(stage, f"after {stage} observations")
