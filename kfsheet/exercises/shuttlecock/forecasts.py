"""When and where the shuttlecock falls: from a fit to all frames so far, or from a filter's state.

Every forecast adds the columns ``t_fall``, ``x_fall``, ``y_fall`` and ``e_fall`` with its own
ending, and on the way to them c, w and W of Lambert's function; see :mod:`kfsheet.estimation.drag`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from sympy import Expr, Matrix, Piecewise, Symbol, exp, log, sqrt, symbols

from kfsheet.estimation.drag import (
    distorted,
    fall_argument,
    fall_asymptote,
    flight,
    lambert_start,
    lambert_step,
)
from kfsheet.estimation.least_squares import least_squares
from kfsheet.exercises.shuttlecock.filters import AXES, WAYS
from kfsheet.model.expressions import Last, Missing, t, when_observed
from kfsheet.model.recurrence import Recurrence

FORECASTS = {
    "raw": "fit to the cameras",
    "kf": "fit to the filter",
    "now": "latest state of the filter",
    "ex": "latest state of the exact filter",
}
NEWTON_STEPS = 4  # three for every flight that is slower than the terminal velocity


def add_landing(
    m: Recurrence,
    page: str,
    run: str,
    words: str,
    p: Sequence[Expr],
    v: Sequence[Expr],
    *,
    k: Expr,
    since: Expr,
    start: Sequence[Expr] = (),
    certain: bool = False,
) -> None:
    """When and where a flight ends: the columns ``t_fall_run``, ``x_fall_run``, ``y_fall_run``.

    Parameters
    ----------
    m : Recurrence
        It has the parameters ``g`` and ``z_fall``.
    page, run, words : str
        The worksheet, the ending of the names, and who forecasts.
    p, v : sequence of Expr
        Position in m and velocity in m/s along x, y and z.
    k, since : Expr
        Drag over mass in 1/s, and the time at which position and velocity hold, in s.
    start : sequence of Expr
        Values of the first rows, where there is no forecast yet.
    certain : bool
        Whether there always is an end: where the flight stays below ``z_fall``, its highest point.
        By default such a flight has none.

    Notes
    -----
    The time is right within some 1e-15/k^2 seconds (k in 1/s); see
    :func:`kfsheet.estimation.drag.lambert_step`.
    """
    steps = [f"W_{n}" for n in range(NEWTON_STEPS + 1)]
    names = ["c", "w", "reach", *steps, "t_fall", "x_fall", "y_fall"]
    m.columns(*(f"{name}_{run}" for name in names), section=page)

    def put(name: str, rule: Expr, unit: str, what: str, read: str = "") -> Expr:
        cell = m[f"{name}_{run}"][t]
        if read and not certain:
            rule = when_observed(m[f"{read}_{run}"][t], rule)
        m.define(cell, rule, unit, f"{words}: {what}", start=start)
        return cell

    c = fall_asymptote(k, m["g"], p[2] - m["z_fall"], v[2])
    c = put("c", c, "", "when the asymptote of the flight ends, times k")
    w = put("w", fall_argument(k, m["g"], v[2], c), "", "argument of Lambert's W")
    reach = put("reach", 1 + exp(1) * w, "", "1 + e w; below 0 the flight stays below")
    first = Piecewise((lambert_start(reach), reach > 0), (-1 if certain else Missing, True))
    W = put("W_0", first, "", "W(w), first guess")
    for before, name in pairwise(steps):
        rule = lambert_step(W, w)
        if certain:  # at -1, where both moments meet, a step would divide 0 by 0
            rule = Piecewise((rule, reach > 0), (-1, True))
        W = put(name, rule, "", f"W(w), step {name[2:]} of Newton's method", before)
    after = (c + W) / k
    if certain:
        after = Piecewise((after, reach > 0), (log(1 + k * v[2] / m["g"]) / k, True))
    end = put("t_fall", since + after, "s", "time of the fall", steps[-1])
    for n, axis in enumerate(("x", "y")):
        place = p[n] + v[n] * distorted(k, end - since)
        put(f"{axis}_fall", place, "m", f"fall point, {AXES[axis]}", "t_fall")


def _add_error(m: Recurrence, page: str, run: str, words: str, start: Sequence[Expr] = ()) -> None:
    (e,) = m.columns(f"e_fall_{run}", section=page)
    ahead, aside = m[f"x_fall_{run}"][t], m[f"y_fall_{run}"][t]
    error = sqrt((ahead - m["x_fall"]) ** 2 + (aside - m["y_fall"]) ** 2)
    words = f"{words}: distance from the true fall point"
    m.define(e[t], when_observed((ahead, aside), error), "m", words, start=start)
    m.summary(f"last_{run}", Last(e), "m", f"{words}, last frame")


def add_latest(m: Recurrence, page: str, run: str, words: str, suffix: str = "") -> None:
    """The fall point from the latest analysis of a filter alone, without any fit.

    Parameters
    ----------
    m : Recurrence
        It has the columns of the filter: ``x_a``, ``vx_a``, ... and the ending.
    page, run, words : str
        The worksheet, the ending of the new names, and who forecasts.
    suffix : str
        The ending of the filter's columns.

    Raises
    ------
    ModelError
        If the filter is not there.
    """
    p = [m[f"{axis}_a{suffix}"][t] for axis in AXES]
    v = [m[f"v{axis}_a{suffix}"][t] for axis in AXES]
    add_landing(m, page, run, words, p, v, k=m["k_fit"], since=m["time"][t])
    _add_error(m, page, run, words)


# -- fits ----------------------------------------------------------------------------------------


def track_fit() -> tuple[dict[str, Expr], dict[str, Symbol]]:
    """Position and velocity at the start by least squares, equations (7) and (8).

    Returns
    -------
    solution, sums : dict
        ``p`` and ``v`` as formulas of the sums ``n, X, XX, y, Xy``; the symbols of these sums.
    """
    p, v, X, y = symbols("p v X y", real=True)
    sums = dict(zip("n X XX y Xy".split(), symbols("n S_X S_XX S_y S_Xy", real=True), strict=True))
    monomials = dict(zip((1, X, X**2, y, X * y), sums.values(), strict=True))
    solution = least_squares(p + v * X, [p, v], y, monomials)
    return {"p": solution[p], "v": solution[v]}, sums


def add_regressors(m: Recurrence, page: str) -> None:
    """What all fits share: X, its sums, and the part of the height that gravity alone makes."""
    k, g, time = m["k_fit"], m["g"], m["time"][t]
    X, drop = m.columns("X", "drop", section=page)
    m.define(X[t], distorted(k, time), "s", "distorted time, in which the track is linear")
    m.define(drop[t], flight(k, g, time, X[t])[0, 2], "m", "what gravity alone does to the height")
    _running_sum(m, page, "sum_X", X[t], "s", "sum of X")
    _running_sum(m, page, "sum_XX", X[t] ** 2, "s2", "sum of the squares of X")


def add_fit(m: Recurrence, page: str, run: str, words: str, positions: str) -> None:
    """The fit to the positions of the frames 0..t, from running sums, and its fall point.

    Parameters
    ----------
    m : Recurrence
        It has the columns of :func:`add_regressors`.
    page, run, words : str
        The worksheet, the ending of the names, and what the fit is called.
    positions : str
        The ending of the columns to fit: ``"obs"`` for ``x_obs, y_obs, z_obs``.

    Raises
    ------
    ModelError
        If there are no such columns, or the regressors are missing.
    """
    solution, sums = track_fit()
    found: dict[str, list[Expr]] = {"p": [], "v": []}
    for axis, what in AXES.items():
        y = m[f"{axis}_{positions}"][t] - (m["drop"][t] if axis == "z" else 0)
        S_y = _running_sum(m, page, f"sum_{axis}_{run}", y, "m", f"sum of {what}, without gravity")
        S_Xy = _running_sum(
            m, page, f"sum_X{axis}_{run}", m["X"][t] * y, "m s", f"sum of X times {what}"
        )
        cells = (t + 1, m["sum_X"][t], m["sum_XX"][t], S_y, S_Xy)
        at = dict(zip(sums.values(), cells, strict=True))
        for letter, unit, start in (("p", "m", what), ("v", "m/s", f"velocity {WAYS[axis]}")):
            (column,) = m.columns(f"{letter}_{axis}_{run}", section=page)
            rule = solution[letter].xreplace(at)
            m.define(column[t], rule, unit, f"{words}: start, {start}", start=[Missing])
            found[letter].append(column[t])
    at_start = {"k": m["k_fit"], "since": 0, "start": [Missing]}
    add_landing(m, page, run, words, found["p"], found["v"], **at_start)
    _add_error(m, page, run, words, start=[Missing])


def _running_sum(m: Recurrence, page: str, name: str, term: Expr, unit: str, words: str) -> Expr:
    (total,) = m.columns(name, section=page)
    m.define(total[t], total[t - 1] + term, unit, words, start=[term])
    return total[t]


def add_theory(m: Recurrence, page: str) -> None:
    """The error that the fit to raw positions should have: the column ``e_theory``.

    A line fitted to the frames 0..t, each with an error of variance 1, has at X_end, the moment of
    the fall, the variance

        (S_XX - 2 X_end S_X + n X_end^2) / (n S_XX - S_X^2).

    An error of the height moves the time of the fall, and with it the place. Root
    mean square, to first order in the errors, and for a fit whose model is right.
    """
    k, end = m["k_fit"], m["t_fall"]
    X = m.summary("X_end", distorted(k, end), "s", "truth, fall: distorted time")
    _, falling = flight(k, m["g"], end, X) * Matrix([0, m["v_z"], 1])
    vz = m.summary("vz_end", falling, "m/s", "truth, fall: velocity upwards")
    _, level = flight(k, 0, end, X) * Matrix([0, sqrt(m["v_x"] ** 2 + m["v_y"] ** 2), 1])
    v = m.summary("v_end", level, "m/s", "truth, fall: velocity over the ground")
    n, S_X, S_XX = t + 1, m["sum_X"][t], m["sum_XX"][t]
    spread = (S_XX - 2 * X * S_X + n * X**2) / (n * S_XX - S_X**2)
    error = sqrt(spread * (m["var_x"] + m["var_y"] + m["var_z"] * (v / vz) ** 2))
    (expected,) = m.columns("e_theory", section=page)
    words = "theory: rms error of the fall point of this fit"
    m.define(expected[t], error, "m", words, start=[Missing])
