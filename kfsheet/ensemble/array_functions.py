"""What generated array source calls: NumPy's functions by Python's names, and aggregates.

A value is a number that all members share or an array over them; a column is an array of shape
(rows, members). The source runs while NumPy raises an error for whatever has no value, so a
missing value (NaN) has to pass quietly, and what a branch does not take is made one by ``only``.
"""

from functools import reduce
from math import nan, pi

import numpy as np
from numpy import arccos as acos
from numpy import arccosh as acosh
from numpy import arcsin as asin
from numpy import arcsinh as asinh
from numpy import arctan as atan
from numpy import arctan2 as atan2
from numpy import arctanh as atanh
from numpy import (
    cos,
    cosh,
    exp,
    fabs,
    float64,
    log,
    logical_not,
    power,
    sin,
    sinh,
    sqrt,
    tan,
    tanh,
    where,
)


def only(x, taken):
    """``x`` for the members that take a branch; what the others have in it raises no error."""
    return where(taken, x, nan)


def observed(x):
    return x == x  # a missing value is not even equal to itself


def sign(x):
    return np.subtract(x > 0, x < 0, dtype=float)  # of a missing value 0, as in Python


def floor(x, taken=True):
    return np.floor(known(x, taken))


def ceil(x, taken=True):
    return np.ceil(known(x, taken))


def known(x, taken):
    """``x``; of a missing value, Python's floor is an error."""
    if np.any(np.isnan(x) & taken):
        raise ValueError("cannot convert float NaN to integer")
    return x


def max(*values):
    return reduce(lambda most, x: where(x > most, x, most), values)  # as Python does with NaN


def min(*values):
    return reduce(lambda least, x: where(x < least, x, least), values)


# -- aggregates of a column, missing values left out -----------------------------------------


def count(column):
    return (column == column).sum(axis=0, dtype=float)


def total(column):
    """The sum, adding in pairs and adding up what every addition loses (Knuth's TwoSum)."""
    column, lost = where(column == column, column, 0.0), 0.0
    while len(column) > 1:
        odd, first = column[len(column) // 2 * 2 :], column[: len(column) // 2 * 2 : 2]
        second = column[1::2]
        whole = first + second
        part = whole - first
        lost = lost + ((first - (whole - part)) + (second - part)).sum(axis=0)
        column = np.concatenate([whole, odd])
    return column[0] + lost


def mean(column):
    number = count(column)
    return total(column) / where(number > 0, number, nan)


def rms(column):
    return sqrt(mean(column * column))


def std(column):
    number = count(column)
    return sqrt(total((column - mean(column)) ** 2) / where(number > 1, number - 1, nan))


def largest(column):
    return np.fmax.reduce(column, axis=0)


def smallest(column):
    return np.fmin.reduce(column, axis=0)


def last(column):
    return column[-1]


def sumproduct(first, second):
    return total(first * second)
