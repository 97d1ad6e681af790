"""The oracle of a derivative is a difference quotient, away from the kinks."""

import numpy as np
import pytest
from sympy import Abs, Matrix, Max, Min, Mod, Piecewise, Symbol, ceiling, floor, pi, sign, sin

from kfsheet import (
    ModelError,
    Observation,
    Recurrence,
    State,
    StateSpace,
    add_filter,
    discrete_noise,
    evaluate,
    t,
)
from kfsheet.estimation.derivatives import derivative

x = Symbol("x", real=True)
POINTS = np.linspace(-3.07, 2.93, 31)
FUNCTIONS = {
    "a tank that overflows": Max(x - 1, 0),
    "three branches": Max(x, 1 - x, x**2 / 3),
    "a valve": Min(2 * x, 1, x**2),
    "quadratic drag": x - sign(x) * x**2 / 4,
    "a wrapped heading": pi - Mod(pi - x - 1, 2 * pi),
    "a divisor that varies": Mod(7, x**2 + 1),
    "a counter that resets": x - floor(x) + ceiling(2 * x) / 3,
    "a kink inside another": Max(Abs(x) - 1, Min(x, 0)) ** 2,
    "a kink inside sine": sin(Abs(x - 1) * x),
    "a kink in a branch": Piecewise((Max(x, 1), x < 2), (Abs(x) * x, True)),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_derivative_is_the_difference_quotient(name):
    f, step = FUNCTIONS[name], 1e-6
    slope = derivative(f, x)
    for at in POINTS:
        quotient = (f.subs(x, at + step) - f.subs(x, at - step)) / (2 * step)
        assert float(slope.subs(x, at)) == pytest.approx(float(quotient), abs=1e-7), at


def filtered(transition):
    m = Recurrence("k", title="K")
    z = m.data("z_obs", [1.0, 2, 3, 2.5], "", "seen", section="Data")
    r = m.parameter("r_z", 1, "", "variance", sign="positive")
    state = {x: State("", "level", 1, r)}
    seen = [Observation("z", z[t], x, r, "")]
    add_filter(m, StateSpace(state, [transition], Matrix([[r]]), seen), section="Filter")
    return evaluate(m)


def by_hand(f, slope):
    """The scalar extended filter in floating point."""
    x_a, P_a, found = 1.0, 1.0, [1.0]
    for seen in (2, 3, 2.5):
        P = slope(x_a) ** 2 * P_a + 1
        x_f = f(x_a)
        K = P / (P + 1)
        x_a, P_a = x_f + K * (seen - x_f), (1 - K) * P
        found.append(x_a)
    return found


@pytest.mark.parametrize(
    ("transition", "f", "slope"),
    [
        (Max(x - 1, 0), lambda v: max(v - 1, 0), lambda v: float(v > 1)),
        (x - sign(x) * x**2 / 4, lambda v: v - abs(v) * v / 4, lambda v: 1 - abs(v) / 2),
        (x - floor(x), lambda v: v % 1, lambda v: 1.0),
    ],
    ids=["tank", "quadratic drag", "reset counter"],
)
def test_a_filter_with_a_kink_is_the_one_written_by_hand(transition, f, slope):
    assert filtered(transition)["x_a"].tolist() == pytest.approx(by_hand(f, slope), rel=1e-13)


def test_a_state_that_is_called_like_a_parameter_is_refused():
    m = Recurrence("twins", title="One name for two things")
    z = m.data("z_obs", [1.0, 2], "m", "seen", section="Data")
    r = m.parameter("r_z", 1, "m2", "variance", sign="positive")
    known = m.parameter("x", 7, "m", "known offset")
    model = StateSpace(
        {x: State("m", "level", 0, r)},
        [x],
        Matrix([[r]]),
        [Observation("z", z[t], x + known, r, "m")],
    )
    with pytest.raises(ModelError, match=r"scalar x and the state space too.*another name"):
        add_filter(m, model, section="F")


@pytest.mark.parametrize("order", [2, 3, 4])
def test_the_noise_of_a_chain_of_integrators_is_no_typed_number(order):
    m = Recurrence("chain", title="A chain of integrators")
    dt = m.parameter("dt", 1, "s", "time step", sign="positive")
    q = m.parameter("q", 1, f"m2/s{2 * order - 1}", "noise", sign="positive")
    z = m.data("z_obs", [0.0, 1, 4, 9], "m", "seen", section="Data")
    states = [Symbol(f"p{n}_", real=True) for n in range(order)]
    F = Matrix(order, order, lambda i, j: int(j == i + 1))
    spectral = Matrix(order, order, lambda i, j: q if i == j == order - 1 else 0)
    taylor = (F * dt).exp() * Matrix(states)
    unit = [f"m/s{n}" if n > 1 else ("m/s" if n else "m") for n in range(order)]
    start = {
        s: State(unit[n], "state", 0, q * dt ** (2 * (order - n) - 1)) for n, s in enumerate(states)
    }
    seen = [Observation("z", z[t], states[0], q * dt ** (2 * order - 1), "m")]
    add_filter(
        m, StateSpace(start, list(taylor), discrete_noise(F, spectral, dt), seen), section="Filter"
    )
    assert m.check_units() == []
    assert evaluate(m)["p0__a"].notna().all()
