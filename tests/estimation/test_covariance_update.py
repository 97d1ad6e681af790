"""A start that nobody knows beside a precise sensor: exact rationals are the oracle."""

from fractions import Fraction
from math import inf

import pytest
from sympy import Matrix, Symbol

from kfsheet import Observation, Recurrence, State, StateSpace, add_filter, evaluate, t

SEEN = [0.0, 1.0, 1.0001, None, 1.0002, 7.0, 1.0001]
START, R, WALK = 1e10, 1e-8, 1e-9


def exact(F, Q, h, seen, gate=inf):
    """The filter of n states and one observation in rationals; returns P after each row."""
    n = len(F)
    x = [Fraction(0)] * n
    P = [[Fraction(START) * (i == j) for j in range(n)] for i in range(n)]
    found = [P]
    for z in seen[1:]:
        x = [sum(F[i][k] * x[k] for k in range(n)) for i in range(n)]
        FP = [[sum(F[i][k] * P[k][j] for k in range(n)) for j in range(n)] for i in range(n)]
        P = [
            [sum(FP[i][k] * F[j][k] for k in range(n)) + Q[i][j] for j in range(n)]
            for i in range(n)
        ]
        Ph = [sum(P[i][k] * h[k] for k in range(n)) for i in range(n)]
        S = sum(h[k] * Ph[k] for k in range(n)) + Fraction(R)
        if z is not None:
            d = Fraction(z) - sum(h[k] * x[k] for k in range(n))
            if d * d <= S * Fraction(gate) ** 2 if gate < inf else True:
                x = [x[i] + Ph[i] * d / S for i in range(n)]
                P = [[P[i][j] - Ph[i] * Ph[j] / S for j in range(n)] for i in range(n)]
        found.append(P)
    return found


def filtered(transition, Q, predicted, gate=None):
    m = Recurrence("diffuse", title="A start that nobody knows")
    P_0 = m.parameter("P_0", START, "", "variance of the start", sign="positive")
    r = m.parameter("r_z", R, "", "variance of an observation", sign="positive")
    m.parameter("q", WALK, "", "walk", sign="positive")
    m.parameter("gate", 4, "", "gate", sign="positive")
    z = m.data("z_obs", SEEN, "", "seen", section="Data", may_be_missing=True)
    states = [Symbol("x", real=True), Symbol("v", real=True)][: len(transition)]
    state = {symbol: State("", "state", 0, P_0) for symbol in states}
    seen = Observation("z", z[t], predicted(*states), r, "", gate=gate and m["gate"])
    model = StateSpace(state, transition, Q(m["q"]), [seen])
    add_filter(m, model, section="Filter")
    return evaluate(m)


x, v = Symbol("x", real=True), Symbol("v", real=True)


@pytest.mark.parametrize("gate", [None, 4])
@pytest.mark.parametrize("slope", [1, 3])
def test_a_level_that_nobody_knows_is_known_as_well_as_its_first_photo(slope, gate):
    run = filtered([x], lambda q: Matrix([[q]]), lambda x: slope * x, gate)
    wanted = exact([[1]], [[Fraction(WALK)]], [slope], SEEN, gate or inf)
    for row, P in enumerate(wanted):
        assert run["P_xx_a"][row] == pytest.approx(float(P[0][0]), rel=1e-12), row
    assert run["P_xx_a"][1] == pytest.approx(R / slope**2, rel=1e-9)


def test_a_position_that_is_seen_gives_its_row_of_the_covariance_to_all_digits():
    run = filtered([x + v, v], lambda q: Matrix([[q, 0], [0, q]]), lambda x, v: x)
    Q = [[Fraction(WALK), 0], [0, Fraction(WALK)]]
    wanted = exact([[1, 1], [0, 1]], Q, [1, 0], SEEN)
    for row, P in enumerate(wanted[:2]):
        assert run["P_xx_a"][row] == pytest.approx(float(P[0][0]), rel=1e-12), row
        assert run["P_xv_a"][row] == pytest.approx(float(P[0][1]), rel=1e-9, abs=1e-12), row
    # Of the velocity, 1e10 - 5e9 keeps its figures; later 5e9 - 5e9 cannot, in any form of P.
    assert run["P_vv_a"][1] == pytest.approx(float(wanted[1][1][1]), rel=1e-12)
    assert (run["P_xx_a"] > 0).all()
    photos = [row for row in range(1, len(SEEN)) if SEEN[row] is not None]
    assert (run["P_xx_a"][photos] <= R * (1 + 1e-9)).all(), "a photo knows it that well alone"
