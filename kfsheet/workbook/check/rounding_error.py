"""How far two programs that are both right may differ in one cell: a running error analysis.

Where two terms cancel, the figures that are left are rounding errors, and no two programs need
agree in them. Each operation is followed by a bound of what rounding may have done so far:

    a + b:   e_a + e_b + u max(|a|, |b|, |a + b|)
    a b:     |b| e_a + |a| e_b + u |a b|
    f(a):    |f'(a)| e_a + u |f(a)|

with u = 2^-48, since LibreOffice takes a difference for 0 that is smaller than this beside its
terms, and mathematical libraries may err in their last bits. Source: N. J. Higham, Accuracy and
Stability of Numerical Algorithms, 2nd edition, section 3.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from kfsheet.evaluation import numerics

UNIT = 2.0**-48


class Rounded:
    """A number and a bound of what rounding may have done to it."""

    __slots__ = ("error", "value")

    def __init__(self, value: float, error: float = 0.0) -> None:
        self.value, self.error = value, error

    @staticmethod
    def of(number: Any) -> Rounded:
        """A number as it is, without an error; what has one stays."""
        return number if isinstance(number, Rounded) else Rounded(number)

    def _sum(self, other: Rounded, value: float) -> Rounded:
        largest = max(abs(self.value), abs(other.value), abs(value))
        return Rounded(value, self.error + other.error + UNIT * largest)

    def __add__(self, other: Any) -> Rounded:
        other = Rounded.of(other)
        return self._sum(other, self.value + other.value)

    def __sub__(self, other: Any) -> Rounded:
        other = Rounded.of(other)
        return self._sum(other, self.value - other.value)

    def __mul__(self, other: Any) -> Rounded:
        other = Rounded.of(other)
        value = self.value * other.value
        passed_on = abs(other.value) * self.error + abs(self.value) * other.error
        return Rounded(value, passed_on + UNIT * abs(value))

    def __truediv__(self, other: Any) -> Rounded:
        other = Rounded.of(other)
        value = self.value / other.value
        passed_on = (self.error + abs(value) * other.error) / abs(other.value)
        return Rounded(value, passed_on + UNIT * abs(value))

    def __pow__(self, other: Any) -> Rounded:
        other = Rounded.of(other)
        value = self.value**other.value
        passed_on = 0.0
        if self.error:
            passed_on += abs(other.value * self.value ** (other.value - 1)) * self.error
        if other.error:
            passed_on += abs(value * math.log(self.value)) * other.error
        return Rounded(value, passed_on + UNIT * abs(value))

    def __mod__(self, other: Any) -> Rounded:
        other = Rounded.of(other)
        turns = abs(self.value / other.value)
        largest = max(abs(self.value), abs(other.value))
        passed_on = self.error + (turns + 1) * other.error
        return Rounded(self.value % other.value, passed_on + UNIT * largest)

    def __neg__(self) -> Rounded:
        return Rounded(-self.value, self.error)

    def __radd__(self, other: Any) -> Rounded:
        return Rounded.of(other) + self

    def __rsub__(self, other: Any) -> Rounded:
        return Rounded.of(other) - self

    def __rmul__(self, other: Any) -> Rounded:
        return Rounded.of(other) * self

    def __rtruediv__(self, other: Any) -> Rounded:
        return Rounded.of(other) / self

    def __rpow__(self, other: Any) -> Rounded:
        return Rounded.of(other) ** self

    def __rmod__(self, other: Any) -> Rounded:
        return Rounded.of(other) % self

    def __lt__(self, other: Any) -> bool:
        return self.value < Rounded.of(other).value

    def __le__(self, other: Any) -> bool:
        return self.value <= Rounded.of(other).value

    def __gt__(self, other: Any) -> bool:
        return self.value > Rounded.of(other).value

    def __ge__(self, other: Any) -> bool:
        return self.value >= Rounded.of(other).value

    def __eq__(self, other: object) -> bool:
        return self.value == Rounded.of(other).value

    def __hash__(self) -> int:
        return hash(self.value)


SLOPES: dict[str, Callable[[float], float]] = {
    "sqrt": lambda x: 0.5 / math.sqrt(x),
    "exp": math.exp,
    "log": lambda x: 1 / x,
    "sin": math.cos,
    "cos": math.sin,
    "tan": lambda x: 1 / math.cos(x) ** 2,
    "asin": lambda x: 1 / math.sqrt(1 - x * x),
    "acos": lambda x: 1 / math.sqrt(1 - x * x),
    "atan": lambda x: 1 / (1 + x * x),
    "sinh": math.cosh,
    "cosh": math.sinh,
    "tanh": lambda x: 1 / math.cosh(x) ** 2,
    "asinh": lambda x: 1 / math.sqrt(x * x + 1),
    "acosh": lambda x: 1 / math.sqrt(x * x - 1),
    "atanh": lambda x: 1 / (1 - x * x),
    "fabs": lambda x: 1.0,
}


def _followed(function: Callable[[float], float], slope: Callable[[float], float]) -> Any:
    def apply(x: Any) -> Rounded:
        x = Rounded.of(x)
        value = function(x.value)
        # Of a number known exactly the slope is not asked for: at 0 that of a root has no value.
        passed_on = abs(slope(x.value)) * x.error if x.error else 0.0
        return Rounded(value, passed_on + UNIT * abs(value))

    return apply


def _atan2(y: Any, x: Any) -> Rounded:
    y, x = Rounded.of(y), Rounded.of(x)
    value, square = math.atan2(y.value, x.value), x.value**2 + y.value**2
    passed_on = abs(x.value) * y.error + abs(y.value) * x.error
    return Rounded(value, (passed_on / square if passed_on else 0.0) + UNIT * abs(value))


def _step(function: Callable[[float], float]) -> Any:
    """A function that rounding moves only where it jumps."""
    return lambda x: Rounded(function(Rounded.of(x).value))


FUNCTIONS: dict[str, Any] = {
    **{name: _followed(getattr(math, name), slope) for name, slope in SLOPES.items()},
    "atan2": _atan2,
    "floor": _step(math.floor),
    "ceil": _step(math.ceil),
    "sign": _step(numerics.sign),
    "observed": lambda x: numerics.observed(Rounded.of(x).value),
}


class _Cells(list):
    """A column: a single cell is followed, a sum of all is taken as a program's own business."""

    def __getitem__(self, row: Any) -> Any:
        return Rounded(super().__getitem__(row))


def followed_names(names: Mapping[str, Any]) -> dict[str, Any]:
    """The names of a model and of its functions, for :func:`rounding_bound`; made once."""
    return {**{name: _followed_name(value) for name, value in names.items()}, **FUNCTIONS}


def _followed_name(value: Any) -> Any:
    if isinstance(value, list):
        return _Cells(value)
    return Rounded(value) if isinstance(value, float) else value


def rounding_bound(source: str, names: Mapping[str, Any]) -> float:
    """A bound of what rounding may do to the value of generated Python source; 0 if none is known.

    Parameters
    ----------
    source : str
        An expression over the names of :mod:`kfsheet.evaluation.numerics` and of the model.
    names : mapping
        What :func:`followed_names` makes of values by name, columns being lists.

    Examples
    --------
    >>> rounding_bound("1 - cos(x)", followed_names({"x": 1e-4})) > 1e-16
    True
    """
    try:
        found = eval(source, dict(names))  # printed by python_code
    except (ArithmeticError, ValueError, TypeError):
        return 0.0
    bound = found.error if isinstance(found, Rounded) else 0.0
    return bound if math.isfinite(bound) else 0.0
