"""Is one expression the same function as another? Asked at random points, to 30 figures."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from weakref import WeakKeyDictionary

from sympy import Basic

from kfsheet.coursework.judging import arithmetic
from kfsheet.coursework.judging.arithmetic import MISSING, NoValueError, Value, is_real, value_of
from kfsheet.coursework.judging.worlds import DEPTHS, NOBODY, Own, Scene, World

TOLERANCE = 1e-12
TINY = 1e-20
ROUGH = 3e-3
"""How far most values of a formula may be off for it to be called nearly right."""
ENOUGH = 2
"""How many points must have a number for the answer to count."""
ERROR = "error"


def worth(expression: Basic, world: World) -> Value | str:
    """Value of an expression in a world; ERROR where a spreadsheet would show an error."""
    try:
        return value_of(expression, world, world.row)
    except (NoValueError, RecursionError):
        return ERROR


def difference(found: Value | str, wanted: Value | str) -> float | None:
    """Relative difference of two values; infinite if only one is a number, None if none is."""
    numbers = [is_real(v) for v in (found, wanted)]
    if not any(numbers):
        return 0.0 if found is wanted else float("inf") if wanted is MISSING else None
    if not all(numbers):
        return float("inf")
    far = arithmetic.size(arithmetic.difference(found, wanted))
    return 0.0 if far <= TINY else float(far / max(abs(found), abs(wanted)))


class Question:
    """The key of one question in one row, at all its points."""

    def __init__(self, scene: Scene, name: str, row: int) -> None:
        self.scene, self.name, self.row = scene, name, row
        scalar = scene.model.derived_scalars.get(name)
        self.key = scalar.expression if scalar else scene.model.column(name).definition(row)
        self._wanted: WeakKeyDictionary[World, Value | str] = WeakKeyDictionary()

    def worlds(self, depth: int, own: Own = NOBODY) -> list[World]:
        """The points at which formulas are compared."""
        return self.scene.worlds(self.name, self.row, depth, own)

    def wanted(self, world: World) -> Value | str:
        """Value of the key; most wrong formulas are found out at the first point."""
        if world not in self._wanted:
            self._wanted[world] = worth(self.key, world)
        return self._wanted[world]

    def differences(
        self,
        expression: Basic,
        depth: int,
        own: Own = NOBODY,
        gaps: bool = True,
    ) -> Iterator[float]:
        """Relative differences at the points that can tell something."""
        for world in self.worlds(depth, own):
            if world.gaps and not gaps:
                continue
            found = worth(expression, world)
            if world.wild and found is ERROR:
                continue  # beyond the range for which the formula is meant
            if (far := difference(found, self.wanted(world))) is not None:
                yield far

    def same(self, expression: Basic, own: Own = NOBODY, gaps: bool = True) -> bool:
        """Whether an expression is the key's function, alone or with what the key builds on."""
        if expression == self.key:
            return True
        return any(self._agrees(expression, depth, own, gaps) for depth in DEPTHS)

    def _agrees(self, expression: Basic, depth: int, own: Own, gaps: bool) -> bool:
        count = 0
        for far in self.differences(expression, depth, own, gaps):
            if far > TOLERANCE:
                return False
            count += 1
        wanted = (self.wanted(world) for world in self.worlds(depth, own))
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
        worlds = [w for w in self.worlds(DEPTHS[0]) if not w.gaps]
        found = (worth(expression, world) for world in worlds)
        return tuple(f"{float(v):.10g}" if is_real(v) else str(v) for v in found)


@lru_cache(maxsize=4_096)
def question(scene: Scene, name: str, row: int) -> Question:
    """The question ``name`` in one row, made once."""
    return Question(scene, name, row)
