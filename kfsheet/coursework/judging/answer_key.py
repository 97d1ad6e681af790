"""Is one expression the same function as another? Asked at random points, to 30 figures."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from weakref import WeakKeyDictionary

from sympy import Basic

from kfsheet.coursework.judging import precise_values
from kfsheet.coursework.judging.precise_values import (
    MISSING,
    NoValueError,
    Value,
    is_real,
    value_of,
)
from kfsheet.coursework.judging.random_samples import DEPTHS, NOBODY, OwnNumbers, Sample, Sampler
from kfsheet.model.expressions import Missing
from kfsheet.model.recurrence import Recurrence

TOLERANCE = 1e-12  # far above 30 figures, far below the rounding of a constant typed by hand
TINY = 1e-20
ROUGH = 3e-3
"""How far most values of a formula may be off for it to be called nearly right."""
ENOUGH = 2
"""How many points must have a number for the answer to count."""
ERROR = "error"


def value_at(expression: Basic, sample: Sample) -> Value | str:
    """Value of an expression in a sample; ERROR where a spreadsheet would show an error."""
    try:
        return value_of(expression, sample, sample.row)
    except (NoValueError, RecursionError):
        return ERROR


def difference(found: Value | str, wanted: Value | str) -> float | None:
    """Relative difference of two values; infinite if only one is a number, None if none is."""
    numbers = [is_real(v) for v in (found, wanted)]
    if not any(numbers):
        return 0.0 if found is wanted else float("inf") if wanted is MISSING else None
    if not all(numbers):
        return float("inf")
    far = precise_values.size(precise_values.difference(found, wanted))
    return 0.0 if far <= TINY else float(far / max(abs(found), abs(wanted)))


def asked_steps(model: Recurrence, name: str) -> list[int]:
    """Steps in which an answer is asked for; a derived scalar has the one step 0.

    A start that is a plain number is given: there is no formula to find.
    """
    if name in model.derived_scalars:
        return [0]
    column = model.column(name)
    given = [rule is Missing or rule.is_Number for rule in column.start]
    return [k for k in range(model.rows) if not (k < len(given) and given[k])]


class AnswerKey:
    """The key of one question in one row, at all its samples."""

    def __init__(self, sampler: Sampler, name: str, row: int) -> None:
        self.sampler, self.name, self.row = sampler, name, row
        scalar = sampler.model.derived_scalars.get(name)
        self.key = scalar.expression if scalar else sampler.model.column(name).definition(row)
        self._wanted: WeakKeyDictionary[Sample, Value | str] = WeakKeyDictionary()

    def samples(self, depth: int, own: OwnNumbers = NOBODY) -> list[Sample]:
        """The points at which formulas are compared."""
        return self.sampler.samples(self.name, self.row, depth, own)

    def wanted(self, sample: Sample) -> Value | str:
        """Value of the key; most wrong formulas are found out at the first point."""
        if sample not in self._wanted:
            self._wanted[sample] = value_at(self.key, sample)
        return self._wanted[sample]

    def differences(
        self,
        expression: Basic,
        depth: int,
        own: OwnNumbers = NOBODY,
        gaps: bool = True,
    ) -> Iterator[float]:
        """Relative differences at the points that can tell something."""
        for sample in self.samples(depth, own):
            if sample.gaps and not gaps:
                continue
            found = value_at(expression, sample)
            # Wild samples leave the range for which a formula is meant: one that takes a root
            # where the key takes none is not wrong for that.
            if sample.wild and found is ERROR:
                continue
            if (far := difference(found, self.wanted(sample))) is not None:
                yield far

    def same(self, expression: Basic, own: OwnNumbers = NOBODY, gaps: bool = True) -> bool:
        """Whether an expression is the key's function, alone or with what the key builds on."""
        if expression == self.key:  # most right answers are the key itself, filled down
            return True
        # Depth by depth: alone, or with the columns beside it written out as the key has them.
        return any(self._agrees(expression, depth, own, gaps) for depth in DEPTHS)

    def _agrees(self, expression: Basic, depth: int, own: OwnNumbers, gaps: bool) -> bool:
        count = 0
        for far in self.differences(expression, depth, own, gaps):
            if far > TOLERANCE:
                return False
            count += 1
        wanted = (self.wanted(sample) for sample in self.samples(depth, own))
        numbers = sum(map(is_real, wanted))
        return count >= ENOUGH and numbers >= ENOUGH

    def nearly(self, expression: Basic) -> bool:
        """Whether it differs by little at three points of four."""
        for depth in DEPTHS:
            far = sorted(self.differences(expression, depth, gaps=False))
            if len(far) >= ENOUGH and far[3 * len(far) // 4] < ROUGH:
                return True
        return False

    def values(self, expression: Basic) -> tuple[str, ...]:
        """Values at the points without gaps, to 10 figures: the same for the same function."""
        samples = [w for w in self.samples(DEPTHS[0]) if not w.gaps]
        found = (value_at(expression, sample) for sample in samples)
        return tuple(f"{float(v):.10g}" if is_real(v) else str(v) for v in found)


@lru_cache(maxsize=4_096)
def answer_key(sampler: Sampler, name: str, row: int) -> AnswerKey:
    """The question ``name`` in one row, made once."""
    return AnswerKey(sampler, name, row)
