"""Units of expressions: pint does the algebra, this module walks the SymPy tree."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from sympy import (
    Abs,
    Add,
    Basic,
    Indexed,
    IndexedBase,
    Max,
    Min,
    Mod,
    Mul,
    Number,
    Piecewise,
    Pow,
    Rational,
    atan2,
    ceiling,
    floor,
    pi,
    sign,
)
from sympy.core.numbers import NumberSymbol
from sympy.core.relational import Relational
from sympy.logic.boolalg import Boolean

from kfsheet.errors import ModelError
from kfsheet.model.expressions import Aggregate, Count, Missing, Observed, SumProduct
from kfsheet.model.quantities import Column, Scalar
from kfsheet.printing.formula_printer import human_terms
from kfsheet.printing.python import python_code

if TYPE_CHECKING:
    from pint import Quantity


@cache
def _registry():
    from pint import UnitRegistry

    registry = UnitRegistry()
    registry.define("px = pixel")
    return registry


def parse_unit(text: str) -> Quantity:
    """The unit that ``text`` means, ``"m/s2"`` or ``"1/s"`` or ``""``, as a quantity of size 1.

    Raises
    ------
    ModelError
        If pint does not know the unit; the message shows the forms that it reads.
    """
    try:
        quantity = _registry().Quantity(1.0, re.sub(r"([^\W\d])(?=[0-9])", r"\1**", text))
    except Exception as error:  # pint raises a dozen kinds, among them tokenize's own
        raise ModelError(
            f"the unit {text!r} does not parse ({error}); write it like m, px, m/s2, 1/s, or ''"
        ) from None
    if not quantity._is_multiplicative:
        raise ModelError(f"the unit {text!r} has an offset; use K, or a difference in delta_degC")
    if quantity.magnitude != 1:
        raise ModelError(f"the unit {text!r} holds a number; a unit is like m, px, m/s2 or 1/s")
    return quantity


def unit_text(quantity: Quantity) -> str:
    """The text that :func:`parse_unit` reads, of a product or quotient of units.

    >>> unit_text(parse_unit("m/s") * parse_unit("m"))
    'm2/s'
    """
    return f"{quantity.units:~C}".replace("**", "").replace("pixel", "px").replace("*", " ")


@dataclass(frozen=True)
class UnitProblem:
    """One expression whose terms do not agree: where it stands and what disagrees."""

    name: str
    reason: str

    def __str__(self) -> str:
        return f"{self.name}: {self.reason}"


class _DisagreementError(Exception):
    """Carries the reason up from the node where two units meet."""


class UnitWalker:
    """Finds the unit of an expression from the units of its symbols.

    ``units`` maps names to unit texts; ``values`` gives the numbers of scalars, which matter where
    a scalar is an exponent (``dt**p`` has the unit s only if p is 1).
    """

    def __init__(self, units: Mapping[str, str], values: Mapping[str, float]) -> None:
        self.units = {name: parse_unit(text) for name, text in units.items()}
        self.values = values
        self.none = parse_unit("")

    def problem(self, expression: Basic, unit: str) -> str | None:
        """Why ``expression`` is not in ``unit``; None if it is."""
        try:
            found = self.of(expression)
        except _DisagreementError as disagreement:
            return str(disagreement)
        if found is None or self.same(found, parse_unit(unit)):
            return None
        return f"{python_code(expression)} is in {show(found)}, not in {show(parse_unit(unit))}"

    def of(self, e: Basic) -> Quantity | None:
        """Unit of a node; None for 0 and Missing, which have every unit."""
        # 0 m and 0 px are the same nothing, so that v = 0 may start any column.
        if e == 0 or e is Missing:
            return None
        if isinstance(e, Number | NumberSymbol):
            return self.none
        if isinstance(e, Indexed | IndexedBase):
            return self.units[str(e.base.label if isinstance(e, Indexed) else e.label)]
        if e.is_Symbol:
            return self.units.get(e.name, self.none)
        return self._compound(e)

    def _compound(self, e: Basic) -> Quantity | None:
        if isinstance(e, Mul):
            return self._product(e)
        if isinstance(e, Pow):
            return self._power(e)
        if isinstance(e, Piecewise):
            for _, condition in e.args:
                self.condition(condition)
            return self.agree([value for value, _ in e.args])
        if isinstance(e, Add):
            return self.agree(human_terms(e))
        if isinstance(e, Max | Min | Mod):
            return self.agree(e.args)
        if isinstance(e, Abs | floor | ceiling):
            return self.of(e.args[0])
        if isinstance(e, SumProduct):
            return self._product(e)
        if isinstance(e, Count):
            return self.none
        if isinstance(e, sign):
            self.of(e.args[0])
            return self.none
        if isinstance(e, Aggregate):
            return self.of(e.args[0])
        if isinstance(e, atan2):
            self.agree(e.args)
            return self.none
        for argument in e.args:
            self._dimensionless(argument, f"the argument of {type(e).__name__}")
        return self.none

    def _product(self, e: Basic) -> Quantity | None:
        result = self.none
        for factor in e.args:
            unit = self.of(factor)
            if unit is None:
                return None
            result = result * unit
        if e.has(pi) and e.as_coeff_Mul()[0] == Rational(1, 180) and "degree" in _names(result):
            return result * parse_unit("rad") / parse_unit("deg")  # pi/180 is a conversion here
        return result

    def _power(self, e: Pow) -> Quantity | None:
        self._dimensionless(e.exp, "an exponent")
        base = self.of(e.base)
        if base is None or (base.unitless and self.same(base, self.none)):
            return base
        # A parameter may be an exponent, as p of dt**p; its value decides the unit.
        known = {s: self.values[s.name] for s in e.exp.free_symbols if str(s) in self.values}
        exponent = e.exp.subs(known)
        if not exponent.is_number:
            text = python_code(e)
            raise _DisagreementError(f"{text} has no unit: its exponent differs from row to row")
        return base ** float(exponent)

    def condition(self, e: Boolean) -> None:
        """Check the relations inside a condition."""
        if isinstance(e, Relational):
            self.agree(e.args)
        elif not isinstance(e, Observed):
            for part in e.args:
                self.condition(part)

    def agree(self, terms: list[Basic]) -> Quantity | None:
        """The common unit of terms that are added or compared."""
        known = [(term, unit) for term in terms if (unit := self.of(term)) is not None]
        for term, unit in known[1:]:
            if not self.same(unit, known[0][1]):
                (first, one), (second, two) = known[0], (term, unit)
                raise _DisagreementError(
                    f"{python_code(first)} is in {show(one)} "
                    f"but {python_code(second)} is in {show(two)}"
                )
        return known[0][1] if known else None

    def _dimensionless(self, e: Basic, what: str) -> None:
        unit = self.of(e)
        if unit is not None and not self.same(unit, self.none):
            raise _DisagreementError(
                f"{what}, {python_code(e)}, is in {show(unit)}; it must be a number"
            )

    @staticmethod
    def same(one: Quantity, two: Quantity) -> bool:
        """Whether two units are equal, prefix and all: m and km are not."""
        if one.dimensionality != two.dimensionality:
            return False
        return abs((one / two).to_base_units().magnitude - 1) < 1e-9


def unit_problems(
    formulas: Iterable[Column | Scalar], units: Mapping[str, str], values: Mapping[str, float]
) -> list[UnitProblem]:
    """Every formula whose terms do not agree, or that is not in the unit of its name."""
    walker = UnitWalker(units, values)
    found = []
    for item in formulas:
        # The general expression first: it says more than a start value.
        reasons = (walker.problem(rule, units[item.name]) for rule in reversed(item.rules))
        if reason := next(filter(None, reasons), None):
            found.append(UnitProblem(item.name, reason))
    return found


def _names(quantity: Quantity) -> set[str]:
    return {name for name, _ in quantity.unit_items()}


def show(unit: Quantity) -> str:
    """Name of a unit in a message."""
    return f"{unit.units:~P}".replace("pixel", "px") or "no unit"
