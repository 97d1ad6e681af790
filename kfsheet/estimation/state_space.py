"""A model of a state and of what is observed of it, before any column is written.

    x[t] = f(x[t - 1]) + w,    Cov w = Q,    F = df/dx
    y[t] = h(x[t]) + v,        Cov v = R diagonal,    H = dh/dx

R is diagonal because every observation brings a variance of its own; so a filter may take them one
after the other. Source: P. Zarchan, H. Musoff, Fundamentals of Kalman Filtering, chapters 4 and 7.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from sympy import Expr, Matrix, Symbol, sympify

from kfsheet.errors import ModelError
from kfsheet.estimation.derivatives import jacobian


@dataclass(frozen=True)
class State:
    """One element of the state.

    Parameters
    ----------
    unit, description : str
        Unit as in ``"m/s"``, and plain words.
    start : Expr or float
        The analysis in row 0: a formula of parameters, or of other columns in row ``t``.
    variance : Expr
        Variance of its error, in unit squared.
    """

    unit: str
    description: str
    start: Expr | float
    variance: Expr

    def __post_init__(self) -> None:
        _sympify(self, "start", "variance")


@dataclass(frozen=True)
class Observation:
    """One observed quantity.

    Parameters
    ----------
    name : str
        It names the columns: ``"theta"`` gives ``d_theta``, ``S_theta``, ``K_x_theta``.
    value : Expr
        What was observed, ``theta_obs[t]``; where it is missing, the state stays as it was.
    predicted : Expr
        What would be observed of a state: h(x), a function of the symbols of the state.
    variance : Expr
        Variance of the error of the observation, in unit squared.
    unit : str
        Its unit.
    angle : bool
        Whether the innovation is an angle in rad, to be wrapped to (-pi, pi].
    gate : Expr, optional
        Standard deviations; an innovation beyond them is taken for an outlier and gets no weight.
    """

    name: str
    value: Expr
    predicted: Expr
    variance: Expr
    unit: str
    angle: bool = False
    gate: Expr | None = None

    def __post_init__(self) -> None:
        _sympify(self, "value", "predicted", "variance", "gate")
        if self.gate is not None and self.gate.is_nonpositive:
            raise ModelError(f"the gate of {self.name} is {self.gate}; give a number above 0")


@dataclass(frozen=True)
class Intermediate:
    """A quantity on the way from one state to the next, in a column of its own.

    A transition that would make formulas too long, as the second half of a midpoint step, is
    written in terms of such quantities. Their derivatives get columns too, by the chain rule.

    Parameters
    ----------
    unit, description : str
        Unit as in ``"m/s"``, and plain words.
    value : Expr
        A function of the symbols of the state, and of intermediates before it.
    """

    unit: str
    description: str
    value: Expr

    def __post_init__(self) -> None:
        _sympify(self, "value")


@dataclass(frozen=True)
class StateSpace:
    """A model of a state and of what is observed of it.

    Parameters
    ----------
    state : mapping of Symbol to State
        The n elements; the symbols stand for them in ``transition`` and in the observations.
    transition : sequence of Expr
        The n elements one step later, f(x).
    Q : Matrix
        n x n covariance that a step adds, symmetric.
    observations : sequence of Observation
        In the order in which they are assimilated.
    intermediates : mapping of Symbol to Intermediate, optional
        Quantities that ``transition`` may read, in the order in which they are computed.

    Raises
    ------
    ModelError
        If a shape does not fit, Q is not symmetric, two observations share a name, or an
        intermediate reads one that comes after it.
    """

    state: Mapping[Symbol, State]
    transition: Sequence[Expr]
    Q: Matrix
    observations: Sequence[Observation]
    intermediates: Mapping[Symbol, Intermediate] = field(default_factory=dict)

    def __post_init__(self) -> None:
        n = len(self.state)
        if n == 0:
            raise ModelError("the state has no elements")
        if len(self.transition) != n:
            have = f"the transition has {len(self.transition)}: {self.transition}"
            raise ModelError(f"the state has {n} elements but {have}")
        if self.Q.shape != (n, n) or not self.Q.is_symmetric():
            raise ModelError(f"Q must be symmetric and {n} x {n}; it is {self.Q}")
        names = [o.name for o in self.observations]
        if not names or len(set(names)) < len(names):
            raise ModelError(f"give one or more observations of different names, not {names}")
        waiting = set(self.intermediates)
        for symbol, item in self.intermediates.items():
            if waiting & item.value.free_symbols:
                raise ModelError(f"intermediate {symbol} reads itself or one that comes after it")
            waiting.remove(symbol)
        for k, o in enumerate(self.observations):
            if self.H[k, :].is_zero_matrix:
                raise ModelError(f"observation {o.name} depends on no element of the state")

    @cached_property
    def F(self) -> Matrix:
        """Jacobian of the transition, n x n, as a function of the state alone."""
        f = [sympify(rule) for rule in self.transition]
        for symbol, item in reversed(self.intermediates.items()):
            f = [rule.xreplace({symbol: item.value}) for rule in f]
        return jacobian(f, list(self.state))

    @cached_property
    def H(self) -> Matrix:
        """Jacobian of the observed quantities, m x n."""
        return jacobian([o.predicted for o in self.observations], list(self.state))


def _sympify(thing: State | Observation | Intermediate, *names: str) -> None:
    """Plain numbers are welcome where formulas are."""
    for name in names:
        if getattr(thing, name) is not None:
            object.__setattr__(thing, name, sympify(getattr(thing, name)))
