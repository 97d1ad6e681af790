"""What rounding may do is bounded from above, and not by much more than it does; oracle: mpmath."""

import random

import mpmath
import pytest

from kfsheet.workbook.check.rounding_error import followed_names, rounding_bound

DOUBLES = {n: getattr(__import__("math"), n) for n in "sin cos exp log sqrt atan2 floor".split()}
EXACT = {n: getattr(mpmath, n) for n in "sin cos exp log sqrt atan2 floor".split()}
FORMULAS = [
    "(sin(1 + x) - sin(1))/x - cos(1)",
    "1 - cos(x)",
    "(y + x) - y",
    "exp(x) - 1 - x",
    "sqrt(y + x) - sqrt(y)",
    "log(1 + x)/x",
    "(x + y)**2 - x**2 - 2*x*y - y**2",
    "atan2(x, y)*y/x - 1",
    "1/(1/x - 1/(x + 1/y)) - x",
    "(y*x % 3) - y*x",
]


@pytest.mark.parametrize("source", FORMULAS)
def test_the_bound_holds_and_is_no_excuse_for_everything(source):
    dice = random.Random(source)
    mpmath.mp.dps = 50
    for _ in range(200):
        x, y = 10 ** dice.uniform(-6, 0), 10 ** dice.uniform(0, 6)
        found = eval(source, {**DOUBLES, "x": x, "y": y})
        wanted = eval(source, {**EXACT, "x": mpmath.mpf(x), "y": mpmath.mpf(y)})
        bound = rounding_bound(source, followed_names({"x": x, "y": y}))
        assert abs(found - wanted) <= bound
        assert bound <= 1e-9 * (1 + y) ** 2 / x


def test_a_formula_without_cancellation_gets_a_bound_of_its_last_digits():
    gain = "a*b_x/(r_i + a**2*b_x)"  # 0.0138
    assert rounding_bound(gain, followed_names({"a": 56.3, "b_x": 0.01, "r_i": 9.0})) < 1e-15
    assert rounding_bound("x[t] + 2", followed_names({"x": [1.0, 2.0], "t": 1})) < 2e-14
