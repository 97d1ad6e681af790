"""What compiled kernels need: math that refuses what Python's refuses, and aggregates.

Numba's own sqrt(-1) is NaN, which would pass for a missing value, and its exp(1000) is infinite;
Python raises an error. So do these. Its floor(1e300) is an integer of 64 bits; these are floats.
Aggregates add with Neumaier's compensation, which agrees with math.fsum to about one unit in the
last place; as everywhere, missing values (NaN) are left out.
"""

import math
from math import isnan, nan

import numba
import numpy as np

OPTIONS = {"nogil": True, "error_model": "python"}
"""How everything is compiled: without the interpreter's lock, and dividing as Python does."""

# No cache of its own, which a read-only installation could not write: that of a kernel holds it.
compiled = numba.njit(**OPTIONS)

DOMAIN = "math domain error"
RANGE = "it grows beyond 1e308"


@compiled
def bounded(x):
    if math.isinf(x):
        raise OverflowError(RANGE)
    return x


@compiled
def finite(x):
    if math.isinf(x) or isnan(x):
        raise ValueError(DOMAIN)
    return x


@compiled
def exp(x):
    return bounded(math.exp(x))


@compiled
def cosh(x):
    return bounded(math.cosh(x))


@compiled
def sinh(x):
    return bounded(math.sinh(x))


@compiled
def sqrt(x):
    if x < 0:
        raise ValueError(DOMAIN)
    return math.sqrt(x)


@compiled
def log(x):
    if x <= 0:
        raise ValueError(DOMAIN)
    return math.log(x)


@compiled
def asin(x):
    if abs(x) > 1:
        raise ValueError(DOMAIN)
    return math.asin(x)


@compiled
def acos(x):
    if abs(x) > 1:
        raise ValueError(DOMAIN)
    return math.acos(x)


@compiled
def acosh(x):
    if x < 1:
        raise ValueError(DOMAIN)
    return math.acosh(x)


@compiled
def atanh(x):
    if abs(x) >= 1:
        raise ValueError(DOMAIN)
    return math.atanh(x)


@compiled
def power(x, y):
    if (x < 0 and y != math.floor(y)) or (x == 0 and y < 0):
        raise ValueError(DOMAIN)
    return bounded(float(x) ** y)


@compiled
def floor(x):
    return np.floor(finite(x))


@compiled
def ceil(x):
    return np.ceil(finite(x))


@compiled
def observed(x):
    return not isnan(x)


@compiled
def sign(x):
    return (x > 0) - (x < 0)


@compiled
def count(column):
    number = 0.0
    for x in column:
        number += not isnan(x)
    return number


@compiled
def total(column):
    whole, rest = 0.0, 0.0
    for x in column:
        if isnan(x):
            continue
        new = whole + x
        rest += (whole - new) + x if abs(whole) >= abs(x) else (x - new) + whole
        whole = new
    bounded(whole)
    return whole + rest


@compiled
def mean(column):
    number = count(column)
    return total(column) / number if number else nan


@compiled
def rms(column):
    return math.sqrt(mean(column * column))


@compiled
def std(column):
    number = count(column)
    squares = (column - mean(column)) ** 2
    return math.sqrt(total(squares) / (number - 1)) if number > 1 else nan


@compiled
def largest(column):
    found = nan
    for x in column:
        if not isnan(x) and not x <= found:
            found = x
    return found


@compiled
def smallest(column):
    found = nan
    for x in column:
        if not isnan(x) and not x >= found:
            found = x
    return found


@compiled
def last(column):
    return column[-1]


@compiled
def sumproduct(first, second):
    return total(first * second)
