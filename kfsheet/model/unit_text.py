"""Units as they are written: ``m/s`` times ``m`` is ``m2/s``.

What a unit measures, and whether two are the same, is known to pint (:mod:`kfsheet.model.units`).
To multiply what everybody writes, it need not be loaded, which takes longer than many a model.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass

from kfsheet.errors import ModelError

COMMON = frozenset("A Hz J K N Pa V W deg g kg m px rad s".split())
"""Symbols that pint reads, and that stand for themselves there: no prefix, no other name."""
FACTOR = re.compile(r"([ */])([^\s*/\d.]+)([1-9][0-9]?(?:\.[0-9]+)?|0\.[0-9]+)?")
SUPERSCRIPTS = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Unit:
    """A product of powers of units, ``powers`` by symbol.

    >>> str(Unit.read("m/s") ** 2 / Unit.read("px"))
    'm2/px/s2'
    """

    powers: dict[str, float]

    @classmethod
    def read(cls, text: str) -> Unit:
        """The unit that a text means.

        Raises
        ------
        ModelError
            If nobody knows it; see :func:`kfsheet.model.units.parse_unit`.
        """
        powers = _powers(text) if isinstance(text, str) else None
        if powers is None or not powers.keys() <= COMMON:
            from kfsheet.model.units import parse_unit, unit_text

            powers = _powers(unit_text(parse_unit(text)))
        if powers is None:
            raise ModelError(f"the unit {text!r} cannot be multiplied; write it like m, px, m/s2")
        return cls(powers)

    def __mul__(self, other: Unit) -> Unit:
        powers = Counter(self.powers)
        powers.update(other.powers)
        return Unit({symbol: power for symbol, power in powers.items() if power})

    def __pow__(self, exponent: float) -> Unit:
        powers = {symbol: power * exponent for symbol, power in self.powers.items()}
        return Unit({symbol: power for symbol, power in powers.items() if power})

    def __truediv__(self, other: Unit) -> Unit:
        return self * other**-1

    def __str__(self) -> str:
        """As pint writes it: first what is multiplied, then what divides."""
        powers = sorted(self.powers.items(), key=lambda item: item[0].lower())
        up = [symbol + _exponent(power) for symbol, power in powers if power > 0]
        down = [f"/{symbol}{_exponent(-power)}" for symbol, power in powers if power < 0]
        return (" ".join(up) or "1" * bool(down)) + "".join(down)


def _powers(text: str) -> dict[str, float] | None:
    """Power of every symbol in a text, read from left to right; None if it is no such text."""
    rest = text[1:] if text.startswith("1/") else f" {text}" if text else ""
    factors = FACTOR.findall(rest)
    if "".join(map("".join, factors)) != rest:
        return None
    found: Counter[str] = Counter()
    for sign, symbol, exponent in factors:
        found[symbol] += float(exponent or 1) * (-1 if sign == "/" else 1)
    return {symbol: power for symbol, power in found.items() if power}


def _exponent(power: float) -> str:
    return "" if power == 1 else f"{power:g}"


def pretty_unit(text: str) -> str:
    """A unit for the eye: ``m/s2`` as m/s², no unit as an en dash.

    >>> pretty_unit("m/s2")
    'm/s²'
    """
    return re.sub(r"(?<=[A-Za-z])\d+", lambda m: m[0].translate(SUPERSCRIPTS), text) or "–"
