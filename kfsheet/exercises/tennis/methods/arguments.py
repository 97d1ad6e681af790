"""What the public functions of this package ask of their arguments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kfsheet.errors import DataError

Array = NDArray[np.float64]


def array(name: str, value: ArrayLike, shape: Sequence[int | None], *, gaps: bool = False) -> Array:
    """``value`` as an array of floats whose last axes have ``shape``; None is any length.

    Raises
    ------
    DataError
        If it is no array of numbers, has another shape, or holds infinities, or NaN without
        ``gaps``.
    """
    try:
        numbers = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise DataError(f"{name} is {value!r:.60}; give numbers") from None
    tail = numbers.shape[numbers.ndim - len(shape) :] if shape else ()
    fits = len(tail) == len(shape) and all(
        want in (None, got) for want, got in zip(shape, tail, strict=True)
    )
    if not fits:
        wanted = " x ".join("n" if n is None else str(n) for n in shape)
        raise DataError(f"{name} has the shape {numbers.shape}; its last axes must be {wanted}")
    if not (np.isfinite(numbers) | (gaps & np.isnan(numbers))).all():
        raise DataError(f"{name} holds a value that is not finite; leave that row out")
    return numbers


def number(name: str, value: float, low: float = -np.inf, high: float = np.inf) -> float:
    """``value`` as a float strictly between ``low`` and ``high``.

    Raises
    ------
    DataError
        If it is no number, or lies outside.
    """
    try:
        given = float(value)
    except (TypeError, ValueError):
        raise DataError(f"{name} is {value!r:.60}; give a number") from None
    if not low < given < high:
        raise DataError(f"{name} is {given:g}; it must lie between {low:g} and {high:g}")
    return given
