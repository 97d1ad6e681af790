"""Lines of sight, the start of the filter, and the flight to the ground, as worksheets."""

from __future__ import annotations

from sympy import Abs, Expr, Matrix, Min, Piecewise, S, floor, sqrt

from kfsheet.model.expressions import RMS, Count, Last, Mean, Sum, SumProduct, t, when_observed
from kfsheet.model.recurrence import Recurrence

AXES = {1: "away from camera 1", 2: "away from camera 2", 3: "up"}


def push(m: Recurrence, v: list[Expr], speed: Expr) -> list[Expr]:
    """Equation (3.1) over m: acceleration by drag, spin and gravity."""
    kappa, g = m["kappa", "g"]
    spin = Matrix(m["lambda_1", "lambda_2", "lambda_3"])
    return list(-kappa * speed * Matrix(v) + spin.cross(Matrix(v)) - Matrix([0, 0, g]))


def length(v: list[Expr]) -> Expr:
    """Length of a vector."""
    return sqrt(sum(component**2 for component in v))


def add_triangulation(m: Recurrence) -> None:
    """Closest points of the two lines of sight, their midpoint and the gap (section 3.3).

    With lines c1 + s1 r1 and c2 + s2 r2, the way between the closest points is orthogonal to both:

        s1 = (a22 b1 - a12 b2) / (a11 a22 - a12^2),   a_jk = r_j.r_k,   b_j = r_j.(c2 - c1)
        s2 = (a12 b1 - a11 b2) / (a11 a22 - a12^2)
    """
    page = "Triangulation"
    lines = _lines_of_sight(m, page)
    _how_far(m, page, lines)
    ends = _closest_points(m, page, lines)
    for n, words in AXES.items():
        (x,) = m.columns(f"x{n}_tri", section=page)
        pair = (ends[1, n], ends[2, n])
        m.define(x[t], when_observed(pair, sum(pair) / 2), "m", f"triangulated, {words}")
    apart = m.columns(*(f"apart_{n}" for n in AXES), section=page)
    for n, column in zip(AXES, apart, strict=True):
        pair = (ends[1, n], ends[2, n])
        m.define(column[t], when_observed(pair, pair[0] - pair[1]), "m", f"line 1 - line 2, x{n}")
    (gap,) = m.columns("gap", section=page)
    between = [column[t] for column in apart]
    m.define(gap[t], when_observed(tuple(between), length(between)), "m", "between the lines")
    m.summary("rms_gap", RMS(gap), "m", "root mean square of the gap")


def _lines_of_sight(m: Recurrence, page: str) -> dict[int, Matrix]:
    """Directions r1 = (1, p1, q1) and r2 = (p2, 1, q2), from the pixels."""
    f, u_c = m["f_px", "u_c"]
    slopes = m.columns("p1", "q1", "p2", "q2", section=page)
    ways = {"u1": -1, "v1": -1, "u2": 1, "v2": -1}  # right is -x2 for camera 1, +x1 for camera 2
    for slope, (name, way) in zip(slopes, ways.items(), strict=True):
        seen, words = m[name][t], f"slope of the line of sight, from {name}"
        m.define(slope[t], when_observed(seen, way * (seen - u_c) / f), "", words)
    p1, q1, p2, q2 = (slope[t] for slope in slopes)
    return {1: Matrix([1, p1, q1]), 2: Matrix([p2, 1, q2])}


def _camera(m: Recurrence, k: int) -> Matrix:
    """Where camera k stands."""
    return Matrix(m[f"c{k}_x", f"c{k}_y", f"c{k}_z"])


def _how_far(m: Recurrence, page: str, lines: dict[int, Matrix]) -> None:
    """The lengths s1 and s2 along the lines, and the products that they are made of."""
    one, two, way = lines[1], lines[2], _camera(m, 2) - _camera(m, 1)
    both = (one[1], one[2], two[0], two[2])
    products = {
        "a11": (one.dot(one), "", "line 1 times itself"),
        "a12": (one.dot(two), "", "line 1 times line 2"),
        "a22": (two.dot(two), "", "line 2 times itself"),
        "b1": (one.dot(way), "m", "line 1 times the way from camera 1 to camera 2"),
        "b2": (two.dot(way), "m", "line 2 times that way"),
    }
    a11, a12, a22, b1, b2 = (column[t] for column in m.columns(*products, section=page))
    for name, (rule, unit, words) in products.items():
        m.define(m[name][t], when_observed(both, rule), unit, words)
    det, s1, s2 = m.columns("a_det", "s1", "s2", section=page)
    squares = when_observed((a11, a12, a22), a11 * a22 - a12**2)
    m.define(det[t], squares, "", "determinant: 0 if the lines are parallel")
    first = when_observed((a12, a22, b1, b2, det[t]), (a22 * b1 - a12 * b2) / det[t])
    m.define(s1[t], first, "m", "how far along line 1 the closest point is")
    second = when_observed((a11, a12, b1, b2, det[t]), (a12 * b1 - a11 * b2) / det[t])
    m.define(s2[t], second, "m", "the same for line 2")


def _closest_points(
    m: Recurrence, page: str, lines: dict[int, Matrix]
) -> dict[tuple[int, int], Expr]:
    """Cells of c_k + s_k r_k, by line and axis."""
    ends = {}
    for k, line in lines.items():
        s = m[f"s{k}"][t]
        for n, corner in zip(AXES, _camera(m, k), strict=True):
            (end,) = m.columns(f"y{k}_{n}", section=page)
            # One component of each direction is 1 and has no cell that could be missing.
            asked = tuple(cell for cell in (s, line[n - 1]) if cell.args)
            rule, words = corner + s * line[n - 1], f"closest point of line {k}"
            m.define(end[t], when_observed(asked, rule), "m", f"{words}, x{n}")
            ends[k, n] = end[t]
    return ends


def add_start(m: Recurrence) -> None:
    """Position and velocity at t = 0 from a parabola through the triangulated points.

    The slope through points at even times is the velocity at their middle; drag, spin and gravity
    at that velocity bend the parabola. The filter meets the same pixels again in their images; the
    start is claimed to be so much worse than they are that counting them twice does no harm.
    """
    when, off = m.columns("time_tri", "time_off", section="Triangulation")
    seen = when_observed(m["x1_tri"][t], m.clock.base[t])
    m.define(when[t], seen, "s", "time of the image, where both cameras have it")
    n = m.summary("n_tri", Count(when), "", "images that both cameras have")
    t_m = m.summary("t_mid", Mean(when), "s", "middle of their times")
    # Times since the middle: sums of products of times since 0 would cancel, and lose digits.
    m.define(off[t], when_observed(when[t], when[t] - t_m), "s", "time since the middle of those")
    spread = m.summary("t_var", SumProduct(off, off) / n, "s2", "variance of those times")
    middle, slope = [], []
    for k in AXES:
        x = m[f"x{k}_tri"]
        middle.append(m.summary(f"x{k}_mid", Mean(x), "m", f"mean of x{k}_tri"))
        # The times since the middle sum up to rounding errors only; they must not meet 5 m.
        both = SumProduct(off, x) - Sum(off) * middle[-1]
        both = m.summary(f"tx{k}_mid", both, "m*s", f"sum of time times x{k}, from their means")
        rule = both / (n * spread)
        slope.append(m.summary(f"v{k}_mid", rule, "m/s", f"slope of x{k}_tri"))
    for k, bend in zip(AXES, push(m, slope, length(slope)), strict=True):
        a = m.summary(f"a{k}_mid", bend, "m/s2", f"acceleration {k} at that velocity")
        level = middle[k - 1] - slope[k - 1] * t_m + a * (t_m**2 - spread) / 2
        m.summary(f"x{k}_0", _rounded(level, m["s_x"], m["n_round"]), "m", f"start, x{k}")
        speed = _rounded(slope[k - 1] - a * t_m, m["s_v"], m["n_round"])
        m.summary(f"v{k}_0", speed, "m/s", f"start, velocity {k}")


def _rounded(value: Expr, error: Expr, parts: Expr) -> Expr:
    """To a fraction of the error that is claimed: it claims no more.

    Programs add in different orders. Rounded, the start is the same in all of them to the last
    digit, which an innovation, a small difference of large pixels, would otherwise magnify.
    """
    return floor(parts * value / error + S.Half) * error / parts


def add_flight(m: Recurrence) -> None:
    """Runge and Kutta's steps of (3.1) from the last analysis; the last steps end on the ground.

    A step is no longer than the time to the ground by the present acceleration, so that the rows
    close in on the impact and then stay there.
    """
    page = "Flight"
    m.rows_are(page, "step")
    last = {}
    for k, words in AXES.items():
        for name, unit, what in ((f"x{k}", "m", ""), (f"vx{k}", "m/s", "velocity ")):
            rule, words_of = Last(m[f"{name}_a"]), f"last analysis: {what}{words}"
            last[name] = m.summary(f"{name}_end", rule, unit, words_of)
    clock, h = m.columns("t_fly", "h_step", section=page)
    x = m.columns("x1_fly", "x2_fly", "x3_fly", section=page)
    v = m.columns("v1_fly", "v2_fly", "v3_fly", section=page)
    stages = _stages(m, page, [c[t] for c in v], h[t])
    fall, height = -stages[0][1][2], x[2][t] - m["r_ball"]
    reach = (v[2][t] + sqrt(v[2][t] ** 2 + 2 * fall * height)) / fall
    m.define(h[t], Min(m["h_fly"], reach), "s", "step: to the ground at most")
    before = [[e.xreplace({t: t - 1}) for e in (*w, *a)] for w, a in stages]
    step, weights = h[t - 1], (1, 2, 2, 1)
    for k in AXES:
        for n, column, name, unit, words in (
            (k - 1, x[k - 1], f"x{k}", "m", AXES[k]),
            (k + 2, v[k - 1], f"vx{k}", "m/s", f"velocity {AXES[k]}"),
        ):
            slope = sum(b * s[n] for b, s in zip(weights, before, strict=True)) / 6
            m.define(column[t], column[t - 1] + step * slope, unit, words, start=[last[name]])
    m.define(clock[t], clock[t - 1] + step, "s", "time since the last image", start=[0])
    m.summary(
        "impact_time", Last(m.clock.base) + Last(clock), "s", "impact: time since the first image"
    )
    for k in AXES:
        m.summary(f"impact_x{k}", Last(x[k - 1]), "m", f"impact: x{k}")
    # The steps close in on the ground; rounding leaves them a hair above or below it.
    down = Abs(Last(x[2]) - m["r_ball"]) < m["h_ground"]
    words = "1: the last row is on the ground; 0: in the air, no impact yet, make h_fly larger"
    m.summary("landed", Piecewise((1, down), (0, True)), "", words)


def _stages(
    m: Recurrence, page: str, v: list[Expr], h: Expr
) -> list[tuple[list[Expr], list[Expr]]]:
    """The four velocities of a step and the accelerations that go with them, as cells."""
    found = []
    for stage, share in enumerate((0, h / 2, h / 2, h), 1):
        if stage > 1:
            names = m.columns(*(f"w{stage}_{k}" for k in AXES), section=page)
            for name, start, a in zip(names, v, found[-1][1], strict=True):
                m.define(name[t], start + share * a, "m/s", f"velocity at stage {stage}")
            now = [name[t] for name in names]
        else:
            now = v
        (speed,) = m.columns(f"speed_{stage}", section=page)
        m.define(speed[t], length(now), "m/s", f"speed at stage {stage}")
        rates = m.columns(*(f"k{stage}_{k}" for k in AXES), section=page)
        for name, rule in zip(rates, push(m, now, speed[t]), strict=True):
            m.define(name[t], rule, "m/s2", f"acceleration at stage {stage}")
        found.append((now, [name[t] for name in rates]))
    return found
