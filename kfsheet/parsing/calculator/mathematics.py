"""Functions of numbers: elementary ones, roundings, whole numbers, distributions, matrices."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import ROUND_DOWN, ROUND_HALF_UP, ROUND_UP, Decimal
from decimal import Context as Decimals
from statistics import NormalDist
from typing import Any

from kfsheet.parsing.calculator.broadcasting import MANY, Entry, each, whole
from kfsheet.parsing.calculator.values import (
    Array,
    Context,
    Error,
    FailedError,
    Value,
    cells_of,
    is_number,
    number,
    rows_of,
)

Number = Any
"""A number of the context's arithmetic."""
DECIMALS = Decimals(prec=340)  # every float to its last place
LARGEST_WHOLE = 2**53


def ratio(a: Number, b: Number) -> Number:
    """A quotient that raises where a spreadsheet shows #DIV/0!, whatever the arithmetic does."""
    if b == 0:
        raise ZeroDivisionError
    return a / b


def power(c: Context, base: Number, exponent: Number) -> Number:
    """A power; 0^0 is #NUM! as in Excel, 0 to a negative power #DIV/0!."""
    if base == 0 and exponent <= 0:
        raise ZeroDivisionError if exponent < 0 else ValueError
    if base < 0 and exponent != c.arithmetic.floor(exponent):
        return _odd_root(c, base, exponent)
    return c.arithmetic.pow(base, exponent)


def _odd_root(c: Context, base: Number, exponent: Number) -> Number:
    """(-8)^(1/3) is -2 in Excel and LibreOffice: 1/3 is meant, and a cube root is there."""
    turned = c.arithmetic.to_float(1 / exponent)
    if not (turned.is_integer() and turned % 2 and abs(turned) < LARGEST_WHOLE):
        raise ValueError
    return -c.arithmetic.pow(-base, exponent)


def elementary(name: str) -> Callable[[Context, Number], Number]:
    """A function that the arithmetic has, by its name in Python."""
    return lambda c, x: c.arithmetic.functions[name](x)


def _logarithm(name: str) -> Callable[[Context, Number], Number]:
    """An arithmetic may know a logarithm of 0, and divide by zero; a spreadsheet does not."""

    def apply(c: Context, x: Number) -> Number:
        if x <= 0:
            raise ValueError
        return c.arithmetic.functions[name](x)

    return apply


def _atan2(c: Context, x: Number, y: Number) -> Number:
    """Excel's order: the abscissa comes first."""
    if x == 0 == y:
        raise ZeroDivisionError
    return c.arithmetic.atan2(y, x)


def _log(c: Context, x: Number, base: Number | None = None) -> Number:
    if x <= 0 or (base is not None and base <= 0):
        raise ValueError
    if base is None:
        return c.arithmetic.functions["log10"](x)
    return ratio(c.arithmetic.functions["log"](x), c.arithmetic.functions["log"](base))


def _one_over(name: str) -> Callable[[Context, Number], Number]:
    return lambda c, x: ratio(c.arithmetic.from_float(1.0), c.arithmetic.functions[name](x))


def _inverse_hyperbolic_tangent(c: Context, x: Number) -> Number:
    if not -1 < x < 1:
        raise ValueError
    return c.arithmetic.functions["atanh"](x)


def _sign(c: Context, x: Number) -> Number:
    return c.arithmetic.from_float(float((x > 0) - (x < 0)))


# -- roundings -------------------------------------------------------------------------------------


def _rounded(mode: str) -> Callable[..., Number]:
    """Rounding of the decimal that is meant, which is the number to 15 digits: 2.55, not 2.5499...

    It is done on floats in every arithmetic, since what is meant is what a cell would show.
    """

    def apply(c: Context, x: Number, digits: int = 0) -> Number:
        value = c.arithmetic.to_float(x)
        if value == 0 or digits > 300:
            return x
        if digits < -308:
            return c.arithmetic.from_float(0.0)
        if digits >= 14 - math.floor(math.log10(abs(value))):
            return x
        meant = Decimal(f"{value:.14e}")
        found = meant.quantize(Decimal(1).scaleb(-digits), rounding=mode, context=DECIMALS)
        return c.arithmetic.from_float(float(found))

    return apply


def nearly_floor(c: Context, x: Number) -> Number:
    """The floor of a quotient; 0.3/0.1, which is 2.9999999999999996, counts as 3."""
    nearest = c.arithmetic.floor(x + 0.5)
    return nearest if c.arithmetic.compare(x, nearest) == 0 else c.arithmetic.floor(x)


def _floor_to(c: Context, x: Number, step: Number) -> Number:
    """Excel's FLOOR: a negative number needs no negative step, a positive one refuses it."""
    if x > 0 > step:
        raise ValueError
    return x if x == 0 else step * nearly_floor(c, ratio(x, step))


def _ceiling_to(c: Context, x: Number, step: Number) -> Number:
    if x > 0 > step:
        raise ValueError
    return x * 0 if x == 0 or step == 0 else -step * nearly_floor(c, -x / step)


def _floor_math(c: Context, x: Number, step: Number | None = None, mode: Number = 0) -> Number:
    step = abs(step) if step is not None else c.arithmetic.from_float(1.0)
    if step == 0:
        return step
    if x < 0 and mode != 0:
        return -step * nearly_floor(c, -x / step)
    return step * nearly_floor(c, x / step)


def _ceil(c: Context, x: Number, step: Number | None = None, mode: Number = 0) -> Number:
    """CEILING.MATH: up; with a mode, away from zero."""
    step = abs(step) if step is not None else c.arithmetic.from_float(1.0)
    if step == 0:
        return step
    if x < 0 and mode != 0:
        return step * nearly_floor(c, x / step)
    return -step * nearly_floor(c, -x / step)


def _multiple(c: Context, x: Number, step: Number) -> Number:
    if x == 0 or step == 0:
        return x * 0
    if (x > 0) != (step > 0):
        raise ValueError
    return step * nearly_floor(c, x / step + 0.5)


def _away(c: Context, x: Number, odd: int) -> Number:
    """The next even or odd whole number, away from zero."""
    size = abs(x)
    up = -c.arithmetic.floor(-(size - odd) / 2) * 2 + odd
    return -up if x < 0 else abs(up)


def _mod(c: Context, x: Number, divisor: Number) -> Number:
    """The rest takes the sign of the divisor."""
    return x - divisor * c.arithmetic.floor(ratio(x, divisor))


def _quotient(c: Context, x: Number, divisor: Number) -> Number:
    q = ratio(x, divisor)
    return -c.arithmetic.floor(-q) if q < 0 else c.arithmetic.floor(q)


# -- whole numbers ---------------------------------------------------------------------------------


def _factorial(c: Context, n: int) -> Number:
    if not 0 <= n <= 170:
        raise ValueError
    return c.arithmetic.from_float(float(math.factorial(n)))


def _double_factorial(c: Context, n: int) -> Number:
    if not -1 <= n <= 300:
        raise ValueError
    return c.arithmetic.from_float(float(math.prod(range(n, 0, -2))))


def _combinations(c: Context, n: int, k: int) -> Number:
    if not 0 <= k <= n:
        raise ValueError
    if min(k, n - k) > 1100:  # the result is beyond 1E308, if n is not far beyond itself
        raise OverflowError
    return c.arithmetic.from_float(float(math.comb(n, k)))


def _permutations(c: Context, n: int, k: int) -> Number:
    if not 0 <= k <= n:
        raise ValueError
    if k > 1100:
        raise OverflowError
    return c.arithmetic.from_float(float(math.perm(n, k)))


def _of_whole_numbers(function: Callable[..., int]) -> Callable[..., Number]:
    """GCD and LCM: of the whole parts of all numbers, none of them negative."""

    def apply(c: Context, *values: Value) -> Number:
        found = []
        for value in values:
            for cell in cells_of(c, value):
                x = number(c, cell)
                if type(x) is Error:
                    raise FailedError(x)
                if not 0 <= x < LARGEST_WHOLE:
                    raise ValueError
                found.append(int(x))
        result = 1
        if function is math.gcd:
            result = math.gcd(*found)
        else:
            for x in found:
                result = math.lcm(result, x)
                if result > 10**308:
                    raise OverflowError
        return c.arithmetic.from_float(float(result))

    return apply


# -- distributions ---------------------------------------------------------------------------------


def _normal(c: Context, x: Number, mean: Number, deviation: Number, cumulative: bool) -> Number:
    if deviation <= 0:
        raise ValueError
    z, f = (x - mean) / deviation, c.arithmetic.functions
    two = c.arithmetic.from_float(2.0)
    if cumulative:
        return f["erfc"](-z / f["sqrt"](two)) / 2
    return f["exp"](-z * z / 2) / f["sqrt"](two * c.arithmetic.pi()) / deviation


def _standard(c: Context, z: Number, cumulative: bool = True) -> Number:
    return _normal(c, z, z * 0, z * 0 + 1, cumulative)


def _normal_quantile(c: Context, p: Number, mean: Number = 0, deviation: Number = 1) -> Number:
    """To the digits of a float, then two of Newton's steps for an arithmetic that has more."""
    if not 0 < p < 1 or deviation <= 0:
        raise ValueError
    z = c.arithmetic.from_float(NormalDist().inv_cdf(c.arithmetic.to_float(p)))
    for _ in range(2):
        z = z - (_standard(c, z) - p) / _standard(c, z, False)
    return mean + deviation * z


def _erf(c: Context, low: Number, high: Number | None = None) -> Number:
    f = c.arithmetic.functions["erf"]
    return f(low) if high is None else f(high) - f(low)


def _exponential(c: Context, x: Number, rate: Number, cumulative: bool) -> Number:
    if x < 0 or rate <= 0:
        raise ValueError
    tail = c.arithmetic.functions["exp"](-rate * x)
    return 1 - tail if cumulative else rate * tail


def _log_gamma(c: Context, x: Number) -> Number:
    if x <= 0:
        raise ValueError
    return c.arithmetic.functions["lgamma"](x)


def _standardized(c: Context, x: Number, mean: Number, deviation: Number) -> Number:
    if deviation <= 0:
        raise ValueError
    return (x - mean) / deviation


# -- matrices --------------------------------------------------------------------------------------


def matrix(c: Context, value: Value) -> list[list[Number]]:
    """A value as rows of numbers; #VALUE! if one of its cells holds none."""
    rows = [list(row) for row in rows_of(c, value)]
    for cell in (cell for row in rows for cell in row):
        if type(cell) is Error:
            raise FailedError(cell)
        if not is_number(c, cell):
            raise FailedError(Error.VALUE)
    return rows


def _product(c: Context, left: Value, right: Value) -> Array:
    a, b = matrix(c, left), matrix(c, right)
    if len(a[0]) != len(b):
        raise FailedError(Error.VALUE)
    c.spend(len(a) * len(b) * len(b[0]))
    columns = list(zip(*b, strict=True))
    zero = c.arithmetic.from_float(0.0)
    return tuple(
        tuple(sum((x * y for x, y in zip(row, col, strict=True)), zero) for col in columns)
        for row in a
    )


def _eliminated(c: Context, value: Value, beside: bool) -> tuple[Number, list[list[Number]]]:
    """Gauss and Jordan with the largest pivots: the determinant and, beside it, the inverse."""
    a = matrix(c, value)
    n, one = len(a), c.arithmetic.from_float(1.0)
    if n != len(a[0]):
        raise FailedError(Error.VALUE)
    c.spend(n**3)
    if beside:
        a = [row + [one if i == j else one * 0 for j in range(n)] for i, row in enumerate(a)]
    determinant = one
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(a[i][k]))
        if a[pivot][k] == 0:
            return one * 0, a
        if pivot != k:
            a[k], a[pivot], determinant = a[pivot], a[k], -determinant
        determinant = determinant * a[k][k]
        head = [x / a[k][k] for x in a[k]]
        for i in range(0 if beside else k + 1, n):
            if i != k and a[i][k] != 0:
                a[i] = [x - a[i][k] * y for x, y in zip(a[i], head, strict=True)]
        a[k] = head
    return determinant, a


def _determinant(c: Context, value: Value) -> Number:
    return _eliminated(c, value, False)[0]


def _inverse(c: Context, value: Value) -> Array:
    determinant, rows = _eliminated(c, value, True)
    if determinant == 0:
        raise ValueError
    return tuple(tuple(row[len(rows) :]) for row in rows)


def _identity(c: Context, n: int) -> Array:
    if n < 1:
        raise FailedError(Error.VALUE)
    c.spend(n * n)
    one = c.arithmetic.from_float(1.0)
    return tuple(tuple(one if i == j else one * 0 for j in range(n)) for i in range(n))


ELEMENTARY = {name.upper(): name for name in "sin cos tan asin acos atan sinh cosh tanh".split()}
ELEMENTARY |= {name.upper(): name for name in "asinh acosh exp sqrt".split()}
RECIPROCAL = {"SEC": "cos", "CSC": "sin", "COT": "tan", "SECH": "cosh", "CSCH": "sinh"}
RECIPROCAL["COTH"] = "tanh"

FUNCTIONS: dict[str, Entry] = (
    {name: each("n", elementary(python)) for name, python in ELEMENTARY.items()}
    | {name: each("n", _one_over(python)) for name, python in RECIPROCAL.items()}
    | {
        "LN": each("n", _logarithm("log")),
        "LOG10": each("n", _logarithm("log10")),
        "ATANH": each("n", _inverse_hyperbolic_tangent),
        "ATAN2": each("nn", _atan2),
        "LOG": each("nn", _log, 1),
        "POWER": each("nn", power),
        "PI": whole(0, 0, lambda c: c.arithmetic.pi()),
        "SQRTPI": each("n", lambda c, x: c.arithmetic.functions["sqrt"](x * c.arithmetic.pi())),
        "DEGREES": each("n", lambda c, x: x * 180 / c.arithmetic.pi()),
        "RADIANS": each("n", lambda c, x: x * c.arithmetic.pi() / 180),
        "ABS": each("n", lambda c, x: abs(x)),
        "SIGN": each("n", _sign),
        "INT": each("n", lambda c, x: c.arithmetic.floor(x)),
        "ROUND": each("ni", _rounded(ROUND_HALF_UP)),
        "ROUNDUP": each("ni", _rounded(ROUND_UP)),
        "ROUNDDOWN": each("ni", _rounded(ROUND_DOWN)),
        "TRUNC": each("ni", _rounded(ROUND_DOWN), 1),
        "MROUND": each("nn", _multiple),
        "FLOOR": each("nn", _floor_to),
        "CEILING": each("nn", _ceiling_to),
        "FLOOR.MATH": each("nnn", _floor_math, 1),
        "CEILING.MATH": each("nnn", _ceil, 1),
        "FLOOR.PRECISE": each("nn", _floor_math, 1),
        "CEILING.PRECISE": each("nn", _ceil, 1),
        "ISO.CEILING": each("nn", _ceil, 1),
        "EVEN": each("n", lambda c, x: _away(c, x, 0)),
        "ODD": each("n", lambda c, x: _away(c, x, 1) if x != 0 else x + 1),
        "MOD": each("nn", _mod),
        "QUOTIENT": each("nn", _quotient),
        "FACT": each("i", _factorial),
        "FACTDOUBLE": each("i", _double_factorial),
        "COMBIN": each("ii", _combinations),
        "PERMUT": each("ii", _permutations),
        "GCD": whole(1, MANY, _of_whole_numbers(math.gcd)),
        "LCM": whole(1, MANY, _of_whole_numbers(math.lcm)),
        "ERF": each("nn", _erf, 1),
        "ERF.PRECISE": each("n", _erf),
        "ERFC": each("n", elementary("erfc")),
        "ERFC.PRECISE": each("n", elementary("erfc")),
        "GAMMALN": each("n", _log_gamma),
        "NORMSDIST": each("n", _standard),
        "NORM.S.DIST": each("nb", _standard),
        "NORMDIST": each("nnnb", _normal),
        "NORM.DIST": each("nnnb", _normal),
        "NORMSINV": each("n", _normal_quantile),
        "NORM.S.INV": each("n", _normal_quantile),
        "NORMINV": each("nnn", _normal_quantile),
        "NORM.INV": each("nnn", _normal_quantile),
        "EXPONDIST": each("nnb", _exponential),
        "EXPON.DIST": each("nnb", _exponential),
        "STANDARDIZE": each("nnn", _standardized),
        "MMULT": whole(2, 2, _product, arrays=True),
        "MDETERM": whole(1, 1, _determinant, arrays=True),
        "MINVERSE": whole(1, 1, _inverse, arrays=True),
        "MUNIT": each("i", _identity),
    }
)
