"""Given quantities that are an answer in other words: reading them is no answer.

Found from the exercise alone, by trying all of them in whole runs of the model. A given quantity
*rearranges* an answer if the answer follows from it and at most two other quantities by few
operations, though the answer does not build on it: ``K_x = a*p_x/r_i``. What is no more than a step
of the answer, as ``i_f = a*x_f`` is of ``i - a*x_f``, may be read: writing it out is no more work.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from sympy import Add, Basic, Indexed, IndexedBase, Mul, Number, Piecewise, Pow

from kfsheet.coursework.judging.dependencies import closed
from kfsheet.coursework.judging.model_runs import ModelRuns, World
from kfsheet.model.expressions import REMEMBERED, columns_read, scalars, t
from kfsheet.model.quantities import Column, Scalar
from kfsheet.model.schedule import same_row

STEP = 2  # operations that are as soon written out as referred to
MORE = 2  # parameters and data that a quantity may need and the answer does not
SAMPLES = 10
LEVELS = 2  # how far from an answer's own formula the quantities may be that it is combined with
EXACT = 1e-9  # relative
LOST = 1e-4
Vectors = NDArray[np.float64]
Quantity = tuple[str, int]
"""A name, and how many rows above."""


@lru_cache(maxsize=8)
def rearrangements(runs: ModelRuns) -> Rearrangements:
    """Those of an exercise, looked for once."""
    return Rearrangements(runs)


class Rearrangements:
    """Of one exercise, for all its answers."""

    def __init__(self, runs: ModelRuns) -> None:
        self.runs, self.model = runs, runs.model
        exercise, model = runs.exercise, runs.model
        self.asked = {q.name for q in exercise.questions}
        self.items: dict[str, Column | Scalar] = {
            **{c.name: c for c in model.all_columns()},
            **model.derived_scalars,
            **model.summaries,
        }
        numbers = {c.name for c in model.table.values() if c.section in exercise.frozen}
        self.given = [
            name
            for name, item in self.items.items()
            if name not in self.asked | numbers and item.rules and item is not model.clock
        ]
        self.names = [*model.parameters, *(n for n in self.items if n not in numbers)]
        self._found: dict[str, dict[str, bool]] = {}
        self._others: dict[str, dict[str, set[str]]] = {}
        self._leaves: dict[str, set[str]] = {}

    def forbidden(self, name: str) -> frozenset[str]:
        """Given columns and scalars that may not be read for an answer, and what follows from them.

        >>> from kfsheet import load_exercise
        >>> football = Rearrangements(ModelRuns(load_exercise("football")))
        >>> sorted(football.forbidden("K_x"))[:3]
        ['d_i_high', 'd_i_low', 'goal_sigma']
        """
        found = self.found(name).items()
        first = {g for g, alone in found if alone or self.steps(g, name) > STEP}
        first |= set(self.runs.exercise.veiled) - self.ancestors(name)
        return frozenset(self._followers(first)) & set(self.given)

    def strangers(self, name: str) -> list[str]:
        """Given columns and scalars on which an answer does not build."""
        built_on = self.ancestors(name)
        return [n for n in self.given if n not in built_on]

    def found(self, name: str) -> dict[str, bool]:
        """Given quantities from which an answer follows; whether it does from them alone."""
        if name not in self._found:
            self._found[name] = dict(_Search(self, name))
        return self._found[name]

    # -- who builds on whom ----------------------------------------------------------------

    def reads(self, name: str) -> set[str]:
        """What the formulas of a quantity refer to."""
        return self._reads.get(name, set())

    def ancestors(self, name: str) -> set[str]:
        """All that an answer builds on."""
        return closed(self._reads, self._reads[name])

    def leaves(self, name: str) -> set[str]:
        """The parameters and data on which a quantity depends."""
        if name not in self._leaves:
            found = closed(self._reads, {name})
            self._leaves[name] = {n for n in found if not self._reads.get(n)}
        return self._leaves[name]

    def consequences(self, name: str) -> set[str]:
        """What follows from a column in its own row, itself included; of a scalar, everything."""
        scalar = name in self.model.derived_scalars
        return self._followers({name}, self._reads if scalar else self._reads_here)

    def steps(self, given: str, name: str) -> int:
        """Operations from what an answer builds on to a given quantity."""
        found = closed(self._apart(name), {given})
        loop = any(given in self._reads[n] for n in found)
        return sum(operations(self.items[n].rules[-1]) for n in found) + (STEP + 1) * loop

    def _apart(self, name: str) -> dict[str, set[str]]:
        """What given quantities read of each other, but for those that an answer builds on."""
        if name not in self._others:
            own = set(self.given) - self.ancestors(name)
            self._others[name] = {n: self._reads[n] & own for n in own}
        return self._others[name]

    def _followers(self, names: set[str], reads: dict[str, set[str]] | None = None) -> set[str]:
        reads = self._reads if reads is None else reads
        readers: dict[str, set[str]] = {}
        for reader, read in reads.items():
            for name in read:
                readers.setdefault(name, set()).add(reader)
        return closed(readers, names)

    @cached_property
    def _reads(self) -> dict[str, set[str]]:
        return {n: set().union(*map(_names, item.rules)) for n, item in self.items.items()}

    @cached_property
    def _reads_here(self) -> dict[str, set[str]]:
        return {n: set().union(*map(same_row, item.rules)) for n, item in self.items.items()}


class _Search:
    """Of one answer: pairs of a given quantity and whether it is enough by itself."""

    def __init__(self, of: Rearrangements, name: str) -> None:
        self.of, self.name, self.model = of, name, of.model
        self._here = of.consequences(name)
        self._builds_on, self._needs = of.ancestors(name), of.leaves(name)
        self._samples = _samples(of, name)

    def __iter__(self) -> Iterator[tuple[str, bool]]:
        given = [n for n in self.of.given if n not in self._builds_on and self._is_near(n)]
        if not given or len(self._samples) < 3:
            return
        wanted = self._vector((self.name, 0))[None]
        single, close = _Index(wanted), self._around(self.name, LEVELS)
        # What is seen anyway is no evidence: K*S = P tells nothing of what else gives P.
        visible = self._vectors(q for q in close if self._is_seen(q))
        seen, known = self._seen, _powers(self._vectors(self._but(single, close)))
        sought = _Index(_joined(np.concatenate([wanted, wanted**2]), known), seen)
        pairs = _Index(_joined(visible, visible))
        for name in given:
            vectors = self._vectors(self._places(name))
            vectors = vectors[~seen.holds(vectors) & ~_constant(vectors)]
            forms = _inverses(_powers(vectors))
            if not forms.size:
                continue
            if single.holds(forms).any():
                yield name, True
                continue
            others = self._vectors(self._but(single, self._around(name, 1)))
            found = [forms, _joined(forms, np.concatenate([known, _powers(others)]))]
            if (
                sought.holds(np.concatenate(found)).any()
                or pairs.holds(_joined(wanted, forms)).any()
            ):
                yield name, False

    def _is_near(self, name: str) -> bool:
        """Whether a quantity depends on what the answer depends on, and on little else."""
        needs = self.of.leaves(name)
        return bool(needs & self._needs) and len(needs - self._needs) <= MORE

    def _around(self, name: str, levels: int) -> list[Quantity]:
        """Where the quantities stand that a formula reads, and that those read."""
        found = set(self.of.reads(name))
        for _ in range(levels - 1):
            found = found.union(*map(self.of.reads, found))
        return [q for n in sorted(found - {name}) for q in self._places(n)]

    def _but(self, twins: _Index, places: list[Quantity]) -> list[Quantity]:
        """Places without those that hold the answer: beside one of them anything would do."""
        same = twins.holds(self._vectors(places))
        return [q for q, twin in zip(places, same, strict=True) if not twin]

    @cached_property
    def _seen(self) -> _Index:
        found = [q for n in self.of.names for q in self._places(n)]
        return _Index(self._vectors(q for q in found if self._is_seen(q)))

    def _is_seen(self, quantity: Quantity) -> bool:
        name = quantity[0]  # the other answers will be there, too
        return name in self._builds_on | self.of.asked or not self.of.reads(name)

    def _places(self, name: str) -> Iterator[Quantity]:
        """Where a quantity may be read: in the answer's row, and in the one above."""
        if name not in self._here:
            yield name, 0
        if name in self._columns and self.name in self._columns:
            yield name, 1

    @cached_property
    def _columns(self) -> set[str]:
        return {c.name for c in self.model.all_columns()}

    def _vectors(self, places: Iterable[Quantity]) -> Vectors:
        found = [self._vector(q) for q in places]
        return np.array(found).reshape(len(found), len(self._samples))

    def _vector(self, quantity: Quantity) -> Vectors:
        name, above = quantity
        if name in self._columns:
            return np.array([world.columns[name][row - above] for world, row in self._samples])
        return np.array([world.scalars[name] for world, _ in self._samples])


def _samples(of: Rearrangements, name: str) -> list[tuple[World, int]]:
    """Rows of worlds in which an answer has a value, and not 0, of each world in turn."""
    worlds, column = of.runs.worlds, of.model.table.get(name)
    first = len(column.start) if column else 0
    there = []
    for n, world in enumerate(worlds):
        rows = [
            row
            for row in range(max(first, 1), of.model.rows)
            if not column or abs(world.columns[name][row]) > 0
        ]
        picked = rows[n % 2 :: max(1, len(rows) * len(worlds) // SAMPLES)]
        if picked:
            there.append([(world, row) for row in picked])
    return [pair for pairs in zip(*there, strict=False) for pair in pairs][:SAMPLES]


class _Index:
    """Vectors by their direction: those that differ by a factor are one."""

    def __init__(self, vectors: Vectors, but: _Index | None = None) -> None:
        found = _directions(vectors)
        found = found[~np.isnan(found).any(axis=1)]
        if but is not None:
            found = found[~but.holds(found)]
        self._sorted = found[np.argsort(found[:, 1])]

    def holds(self, vectors: Vectors) -> NDArray[np.bool_]:
        """Which vectors are there."""
        asked = _directions(vectors)
        answer = np.zeros(len(asked), bool)
        by, near = self._sorted[:, 1], EXACT * np.abs(asked[:, 1])
        at = np.searchsorted(by, asked[:, 1] - near)
        end = np.searchsorted(by, asked[:, 1] + near, side="right")
        open_ = np.flatnonzero((at < end) & ~np.isnan(asked).any(axis=1))
        while open_.size:
            close = np.isclose(self._sorted[at[open_]], asked[open_], rtol=EXACT, atol=0)
            answer[open_] |= close.all(axis=1)
            at[open_] += 1
            open_ = open_[~answer[open_] & (at[open_] < end[open_])]
        return answer


def _directions(vectors: Vectors) -> Vectors:
    """Divided by the first figure; NaN for what is constant, or has no value somewhere."""
    with np.errstate(all="ignore"):
        found = vectors / vectors[:, :1]
    found[~np.isfinite(found).all(axis=1) | _constant(found)] = np.nan
    return found


def _constant(vectors: Vectors) -> NDArray[np.bool_]:
    return np.abs(vectors - vectors[:, :1]).max(axis=1) <= EXACT * np.abs(vectors[:, 0])


def _powers(vectors: Vectors) -> Vectors:
    """Vectors, their squares and their roots."""
    with np.errstate(all="ignore"):
        return np.concatenate([vectors, vectors**2, np.sqrt(vectors)])


def _inverses(vectors: Vectors) -> Vectors:
    with np.errstate(all="ignore"):
        return np.concatenate([vectors, 1 / vectors])


def _joined(first: Vectors, second: Vectors) -> Vectors:
    """Sum, difference, product and quotient of each pair."""
    a, b = first[:, None], second[None]
    with np.errstate(all="ignore"):
        found = np.stack([a + b, a - b, a * b, a / b])
        share = np.abs(a / b)
        lost = ~((share > LOST) & (share < 1 / LOST)).all(axis=2)
    found[:2, lost] = np.nan  # beside a large number there is no telling whether it counts
    return found.reshape(-1, first.shape[1])


def _names(rule: Basic) -> set[str]:
    return {s.name for s in scalars(rule) if s != t} | columns_read(rule)


@lru_cache(maxsize=REMEMBERED)
def operations(rule: Basic) -> int:
    """Operations of an expression; a sign or a factor that is a number is none.

    >>> from sympy.abc import a, b, x
    >>> [operations(e) for e in (-2 * x, a / b, a - b * x)]
    [0, 1, 2]
    """
    if isinstance(rule, Piecewise):  # of a guard the values count
        return max(operations(value) for value, _ in rule.args)
    if isinstance(rule, Indexed | IndexedBase) or not rule.args:
        return 0
    parts = [p for p in rule.args if not (isinstance(rule, Mul | Pow) and isinstance(p, Number))]
    own = len(parts) - 1 if isinstance(rule, Add | Mul) else 1
    if isinstance(rule, Pow) and rule.exp == -1:
        own = 0  # a division is counted where it is a factor
    return own + sum(map(operations, parts))
