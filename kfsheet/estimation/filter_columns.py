"""The columns of a Kalman filter, definition by definition."""

from __future__ import annotations

import itertools
from collections.abc import Generator, Iterator, Sequence

from sympy import (
    Abs,
    Add,
    And,
    Expr,
    Indexed,
    Matrix,
    Mod,
    Or,
    Piecewise,
    S,
    Symbol,
    expand,
    pi,
    sqrt,
    zeros,
)

from kfsheet.errors import ModelError
from kfsheet.estimation.derivatives import derivative
from kfsheet.estimation.filter_cells import Definition, FilterCells, when_words
from kfsheet.estimation.state_space import Observation, StateSpace
from kfsheet.model.expressions import Missing, Observed
from kfsheet.model.recurrence import Recurrence
from kfsheet.model.unit_text import Unit

MOST_ASKED = 2  # cells that may be missing, in the formula of NIS; more give shares columns
MOST_TERMS = 6  # of a product of matrices within one formula; more get columns of their own


def wrapped(angle: Expr) -> Expr:
    """The same direction within (-pi, pi].

    >>> from sympy import Rational, pi
    >>> wrapped(Rational(3, 2) * pi), wrapped(-pi)
    (-pi/2, pi)
    """
    return pi - Mod(pi - angle, 2 * pi)


class FilterColumns(FilterCells):
    """The columns of a filter, in the order of its equations.

    ``x`` and ``P`` are the cells that hold the state and its covariance so far: after the forecast
    (names end in ``_f``), after some of the observations (``_1``, ``_2``, ...), and at last the
    analysis (``_a``).
    """

    def __init__(self, m: Recurrence, model: StateSpace, suffix: str) -> None:
        _check_names(m, model)
        super().__init__(m, model, suffix)
        self.weighed: list[tuple[Indexed, Indexed, tuple[Indexed, ...]]] = []
        self.x = [self.cell(f"{name}_f") for name in self.names]
        self.P = self.covariances("f")

    def __iter__(self) -> Iterator[Definition]:
        yield from self.forecast()
        for k, observation in enumerate(self.model.observations):
            h, d = yield from self.innovation(observation, k)
            yield from self.update(observation, k, h, d)
        yield from self.unobserved()
        yield from self.nis()

    # -- forecast --------------------------------------------------------------------------

    def forecast(self) -> Iterator[Definition]:
        """x_f = f(x_a) and P_f = F P_a F' + Q."""
        x_a = [self.cell(f"{name}_a", back=1) for name in self.names]
        slopes: dict[Symbol, list[Expr]] = {}
        for w, item in self.model.intermediates.items():
            unit = Unit.read(item.unit)
            yield self.column(w.name, self.at(item.value, x_a), unit, item.description)
            slopes[w] = yield from self.slopes(f"D_{w}", w.name, item.value, unit, x_a, slopes)
        F = zeros(len(self.all), len(self.all))
        for i, rule in enumerate(self.model.transition):
            to, unit = self.names[i], self.units[i]
            F[i, :] = Matrix(
                [(yield from self.slopes(f"F_{to}", f"the next {to}", rule, unit, x_a, slopes))]
            )
        for name, element, unit, rule in zip(
            self.names, self.elements, self.units, self.model.transition, strict=True
        ):
            words = f"forecast: {element.description}"
            yield self.column(f"{name}_f", self.at(rule, x_a), unit, words, element.start)
        yield from self.forecast_covariance(F, self.model.Q.applyfunc(lambda e: self.at(e, x_a)))

    def slopes(
        self,
        name: str,
        what: str,
        value: Expr,
        unit: Unit,
        x_a: Sequence[Expr],
        known: dict[Symbol, list[Expr]],
    ) -> Generator[Definition, None, list[Expr]]:
        """Derivatives of a value with respect to the state, by the chain rule."""
        found = []
        for j, symbol in enumerate(self.model.state):
            inner = Add(*(derivative(value, w) * slope[j] for w, slope in known.items()))
            words = f"derivative of {what} with respect to {symbol}"
            slope = yield from self.derivative(
                f"{name}_{symbol}",
                derivative(value, symbol) + inner,
                x_a,
                unit / self.units[j],
                words,
            )
            found.append(slope)
        return found

    def forecast_covariance(self, F: Matrix, Q: Matrix) -> Iterator[Definition]:
        """P_f = F P_a F' + Q, the upper triangle."""
        FP = F * self.covariances("a", back=1)
        P_f = (FP * F.T).applyfunc(expand)
        # A product of three matrices makes formulas that nobody can audit; F P gets columns.
        if max(map(_terms, P_f)) > MOST_TERMS:
            for i, j in itertools.product(self.all, repeat=2):
                if FP[i, j] == 0:
                    continue
                name = f"FP_{self.names[i]}_{self.names[j]}"
                unit = self.units[i] * self.units[j]
                yield self.column(name, expand(FP[i, j]), unit, "F P_a, on the way to F P_a F'")
                FP[i, j] = self.cell(name)
            P_f = FP * F.T
        for i, j in self.pairs():
            start = self.elements[i].variance if i == j else S.Zero
            yield self.covariance(i, j, "f", P_f[i, j] + Q[i, j], start)

    # -- observations ----------------------------------------------------------------------

    def innovation(
        self, o: Observation, k: int
    ) -> Generator[Definition, None, tuple[Matrix, Indexed]]:
        """Columns d = y - h(x_f) and H at x_f; returns H and the innovation to weigh."""
        x_f, unit = [self.cell(f"{name}_f") for name in self.names], Unit.read(o.unit)
        d = o.value - self.at(o.predicted, x_f)
        d = self.guarded(wrapped(d) if o.angle else d, self.gaps(o.value))
        words = f"innovation: {o.name} observed - {o.name} of the forecast"
        yield self.column(f"d_{o.name}", d, unit, words)
        h = zeros(1, len(self.all))
        for j, name in enumerate(self.names):
            h[j] = yield from self.derivative(
                f"H_{o.name}_{name}",
                self.model.H[k, j],
                x_f,
                unit / self.units[j],
                f"derivative of {o.name} with respect to {name}, at the forecast",
            )
        # Those before have moved x, but h is linearised at x_f for all of them: only then
        # is the result that of the joint update. What they explained of d is h (x - x_f).
        moved = [now - before for now, before in zip(self.x, x_f, strict=True)]
        if all(h[j] == 0 or moved[j] == 0 for j in self.all):
            return h, self.cell(f"d_{o.name}")
        yield from self.left(o, h, moved)
        return h, self.cell(f"d_{o.name}_left")

    def left(self, o: Observation, h: Matrix, moved: Sequence[Expr]) -> Iterator[Definition]:
        """What the observations before have left of d, and the variance of d itself."""
        unit, d = Unit.read(o.unit), self.cell(f"d_{o.name}")
        rest = d - sum(slope * move for slope, move in zip(h, moved, strict=True))
        asked = (d,) if self.gaps(o.value) else ()
        words = f"what the observations before have left of {d.base}"
        yield self.column(f"d_{o.name}_left", self.guarded(rest, asked), unit, words)
        Ph = yield from self.covariance_with(o, self.covariances("f"), h, "_f")
        rule = self.guarded(expand((h * Ph)[0]) + o.variance, self.gaps(o.variance))
        yield self.column(f"S_{o.name}_f", rule, unit**2, f"variance of {d.base} itself")

    def covariance_with(
        self, o: Observation, P: Matrix, h: Matrix, stage: str = ""
    ) -> Generator[Definition, None, Matrix]:
        """P h', in columns of its own where it has more than two terms."""
        Ph = P * h.T
        if sum(entry != 0 for entry in h) > 2:
            for i, name in enumerate(self.names):
                if Ph[i] != 0:
                    words = f"covariance of {name} with the {o.name} that is expected"
                    column = f"PH_{name}_{o.name}{stage}"
                    unit = self.units[i] * Unit.read(o.unit)
                    yield self.column(column, Ph[i], unit, words)
                    Ph[i] = self.cell(column)
        return Ph

    def update(self, o: Observation, k: int, h: Matrix, d: Indexed) -> Iterator[Definition]:
        """S = h P h' + r and K = P h' / S, then what they do to x and P."""
        unit, touched = Unit.read(o.unit), self.touched(k)
        Ph = yield from self.covariance_with(o, self.P, h)
        S_o = self.cell(f"S_{o.name}")
        asked = (d,) if self.gaps(o.value) else ()
        asked = (d, S_o) if self.gaps(o.variance) else asked
        self.weighed.append((d, S_o, asked))
        variance = self.guarded(expand((h * Ph)[0]) + o.variance, self.gaps(o.variance))
        yield self.column(f"S_{o.name}", variance, unit**2, f"variance of {d.base}")
        K = {i: self.cell(f"K_{self.names[i]}_{o.name}") for i in touched}
        for i in touched:
            # Without an observation the gain is 0, not missing: P then stays what it was.
            gain = self.guarded(self.gated(o, Ph[i] / S_o, d, S.Zero), asked, S.Zero)
            words = f"gain: {self.names[i]} for one unit of {d.base}"
            yield self.column(f"K_{self.names[i]}_{o.name}", gain, self.units[i] / unit, words)
        yield from self.moved_state(k, K, d, asked)
        yield from self.moved_covariance(o, k, K, asked)

    def moved_state(
        self, k: int, K: dict[int, Indexed], d: Indexed, asked: tuple[Indexed, ...]
    ) -> Iterator[Definition]:
        """The state: x <- x + K d."""
        for i in K:
            stage = self.stage(k, i)
            rule = self.guarded(self.x[i] + K[i] * d, asked and (d,), self.x[i])
            words = f"{when_words(stage)}: {self.elements[i].description}"
            start = self.cell(f"{self.names[i]}_f") if stage == "a" else Missing
            yield self.column(f"{self.names[i]}_{stage}", rule, self.units[i], words, start)
            self.x[i] = self.cell(f"{self.names[i]}_{stage}")

    def moved_covariance(
        self, o: Observation, k: int, K: dict[int, Indexed], asked: tuple[Indexed, ...]
    ) -> Iterator[Definition]:
        """The covariance: P <- P - K S K', the upper triangle."""
        S_o, alone = self.cell(f"S_{o.name}"), self.seen_alone(k)
        for i, j in self.pairs():
            if i in K and j in K:
                stage, before = self.stage(k, i, j), self.P[i, j]
                if alone in (i, j):
                    # Of the one element that is seen, P - K S K' is P r/S: without a difference,
                    # which would leave nothing of a precise sensor's r beside a start of 1e10.
                    rule = self.gated(o, before * o.variance / S_o, self.weighed[-1][0], before)
                    rule = self.guarded(rule, asked + self.gaps(o.variance), before)
                else:
                    # K S K' is symmetric as computed, K h P only in exact arithmetic.
                    rule = before - K[i] * K[j] * S_o
                    rule = self.guarded(rule, (S_o,) if self.gaps(o.variance) else (), before)
                start = self.cell(self.P_name(i, j, "f")) if stage == "a" else Missing
                yield self.covariance(i, j, stage, rule, start)
                self.P[i, j] = self.P[j, i] = self.cell(self.P_name(i, j, stage))

    def seen_alone(self, k: int) -> int | None:
        """The element that observation k depends on, if it is the only one."""
        seen = [j for j in self.all if self.model.H[k, j] != 0]
        return seen[0] if len(seen) == 1 else None

    def stage(self, k: int, *elements: int) -> str:
        """Where observation k brings some elements: to the analysis, if it is the last for them."""
        later = range(k + 1, len(self.model.observations))
        return str(k + 1) if any(set(elements) <= set(self.touched(n)) for n in later) else "a"

    def unobserved(self) -> Iterator[Definition]:
        """The analysis of what no observation moves is the forecast."""
        known = [set(self.touched(k)) for k in range(len(self.model.observations))]
        for i, j in self.pairs():
            if any({i, j} <= those for those in known):
                continue
            if i == j:
                words = f"analysis: {self.elements[i].description}"
                x_f = self.cell(f"{self.names[i]}_f")
                yield self.column(f"{self.names[i]}_a", x_f, self.units[i], words, x_f)
            forecast = self.cell(self.P_name(i, j, "f"))
            yield self.covariance(i, j, "a", forecast, forecast)

    def nis(self) -> Iterator[Definition]:
        """The sum of d^2/S over the observations that are there."""
        parts = [
            self.guarded(d**2 / S_o, asked, S.Zero if len(self.weighed) > 1 else Missing)
            for d, S_o, asked in self.weighed
        ]
        seen = [And(*map(Observed, asked)) for _, _, asked in self.weighed]
        missing_some = len(parts) > 1 and Or(*seen) != True  # noqa: E712 - a SymPy condition
        if missing_some and sum(len(asked) for _, _, asked in self.weighed) > MOST_ASKED:
            for n, (part, o) in enumerate(zip(parts, self.model.observations, strict=True)):
                yield self.column(f"NIS_{o.name}", part, Unit.read(""), f"share of {o.name}")
                parts[n] = self.cell(f"NIS_{o.name}")
        rule = Add(*parts)
        # A row without any observation has no NIS; 0 would lower its mean.
        if missing_some:
            rule = Piecewise((rule, Or(*seen)), (Missing, True))
        words = f"normalised innovation squared; expected: {len(parts)}"
        yield self.column("NIS", rule, Unit.read(""), words)

    def gated(self, o: Observation, rule: Expr, d: Indexed, otherwise: Expr) -> Expr:
        """A rule for an innovation within the gate; beyond it neither x nor P moves."""
        if o.gate is None:
            return rule
        within = Abs(d) <= o.gate * sqrt(self.cell(f"S_{o.name}"))
        return Piecewise((rule, within), (otherwise, True))


def _check_names(m: Recurrence, model: StateSpace) -> None:
    """Refuse a state or an intermediate that is called like a scalar: its cell would replace it."""
    scalars = {**m.parameters, **m.derived_scalars, **m.summaries}
    for symbol in (*model.state, *model.intermediates):
        if symbol.name in scalars:
            raise ModelError(
                f"{m.name} has a scalar {symbol.name} and the state space too; a formula could not "
                "tell which is meant, so give one of them another name"
            )


def _terms(expression: Expr) -> int:
    return len(Add.make_args(expression))
