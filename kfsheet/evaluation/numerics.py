"""The functions that generated Python source needs and Python's math module lacks.

``kfsheet show --as python`` copies those that it uses into what it prints, hence their plainness.
An aggregate leaves missing values (NaN) out, as a spreadsheet leaves empty cells out, and is NaN
itself where nothing is left.
"""

from math import fsum, isnan, nan, sqrt


def observed(x):
    return not isnan(x)


def sign(x):
    return (x > 0) - (x < 0)


def present(column):
    return [x for x in column if x == x]  # a missing value is not even equal to itself


def count(column):
    return len(present(column))


def total(column):
    return fsum(present(column))


def mean(column):
    values = present(column)
    return fsum(values) / len(values) if values else nan


def rms(column):
    return sqrt(mean([x * x for x in column]))


def std(column):
    centre = mean(column)
    squares = [(x - centre) ** 2 for x in present(column)]
    return sqrt(fsum(squares) / (len(squares) - 1)) if len(squares) > 1 else nan


def largest(column):
    return max(present(column), default=nan)


def smallest(column):
    return min(present(column), default=nan)


def last(column):
    return column[-1]


def sumproduct(first, second):
    return total([x * y for x, y in zip(first, second, strict=True)])
