"""What the calculator calculates with: numbers as a spreadsheet has them, or any others.

Numbers of an arithmetic know Python's operators ``+ - * /`` and comparisons. Where a spreadsheet
shows #DIV/0!, ``/`` and the functions raise ZeroDivisionError; for #NUM!, OverflowError or
ValueError; a result that is not finite is #NUM! too, which whoever calls them looks after.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any, Protocol

FARTHEST_ANGLE = 2**27 * math.pi
"""Excel takes no sine of a larger angle: of its digits, too few lie behind the point."""
UNARY = (
    "sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log log10 sqrt erf erfc lgamma"
).split()
CLOSE = 2.0**-48
"""Two numbers nearer than that, relatively, count as equal: 15 digits are compared."""


class Arithmetic(Protocol):
    """Numbers, and the functions of one number that mathematics calls elementary."""

    kind: type
    functions: dict[str, Callable[[Any], Any]]
    """By the names of Python's :mod:`math`; see ``UNARY``."""

    def precise(self) -> AbstractContextManager[Any]:
        """What to enter before calculating; operators may depend on it."""
        ...

    def from_float(self, x: float) -> Any:
        """The number that a cell holds."""
        ...

    def to_float(self, x: Any) -> float:
        """The nearest float."""
        ...

    def compare(self, a: Any, b: Any) -> int:
        """-1, 0 or 1, as a spreadsheet compares."""
        ...

    def floor(self, x: Any) -> Any:
        """The largest whole number that is not above ``x``."""
        ...

    def pow(self, base: Any, exponent: Any) -> Any:
        """A power other than 0 to one that is not positive."""
        ...

    def atan2(self, y: Any, x: Any) -> Any:
        """The angle of a point, its ordinate first."""
        ...

    def pi(self) -> Any:
        """The ratio of a circle's circumference to its diameter."""
        ...


def angle(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A function of an angle that is not too large for a spreadsheet."""

    def apply(x: Any) -> Any:
        if not -FARTHEST_ANGLE < x < FARTHEST_ANGLE:
            raise ValueError("an angle beyond what a spreadsheet takes")
        return function(x)

    return apply


class Doubles:
    """Numbers of 53 bits, as spreadsheets have them."""

    kind = float
    functions = {name: getattr(math, name) for name in UNARY} | {
        name: angle(getattr(math, name)) for name in ("sin", "cos", "tan")
    }

    def precise(self) -> AbstractContextManager[Any]:
        """Floats need nothing entered."""
        return nullcontext()

    def from_float(self, x: float) -> float:
        """The number itself."""
        return x

    def to_float(self, x: float) -> float:
        """The number itself."""
        return x

    def compare(self, a: float, b: float) -> int:
        """-1, 0 or 1; what differs after the 15th digit is equal."""
        if a == b or (abs(a - b) < CLOSE * min(abs(a), abs(b)) and not _whole(a, b)):
            return 0
        return -1 if a < b else 1

    def floor(self, x: float) -> float:
        """The largest whole number that is not above ``x``."""
        return float(math.floor(x))

    def pow(self, base: float, exponent: float) -> float:
        """A power; of a negative number only a whole one."""
        return math.pow(base, exponent)

    def atan2(self, y: float, x: float) -> float:
        """The angle of a point, its ordinate first."""
        return math.atan2(y, x)

    def pi(self) -> float:
        """Pi to 53 bits."""
        return math.pi


def _whole(a: float, b: float) -> bool:
    """Whether both are whole numbers that a float holds exactly: these are told apart."""
    return a.is_integer() and b.is_integer() and abs(a) < 2**53 and abs(b) < 2**53


DOUBLES = Doubles()
