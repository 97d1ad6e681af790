"""When and how high the football will cross x = 0, forecast anew from every photo."""

from __future__ import annotations

from sympy import Abs, Expr, Piecewise, sign, sqrt

from kfsheet.model.expressions import Last, Missing, t, when_observed
from kfsheet.model.recurrence import Recurrence


def add_goal_line(m: Recurrence) -> None:
    """The worksheet "Goal line", from the columns of the worksheet "Reanalysis"."""
    names = "u_next", "w_next", "wait", "s_wait", "z_goal", "slope", "s_goal"
    m.columns(*names, section="Goal line")
    _crossing(m)
    _spread_of_crossing(m)
    wait, s_wait, z_goal, s_goal = m["wait", "s_wait", "z_goal", "s_goal"]
    m.summary("goal_wait", Last(wait), "s", "goal line: time after the last photo")
    m.summary("goal_wait_sigma", Last(s_wait), "s", "goal line: standard deviation of that time")
    m.summary("goal_height", Last(z_goal), "m", "goal line: height of the ball")
    m.summary("goal_sigma", Last(s_goal), "m", "goal line: standard deviation of the height")


def _friction(m: Recurrence, v: Expr) -> Expr:
    return m["f"] * sign(v) * v**2


def _crossing(m: Recurrence) -> None:
    """The time left, the height and the slope there, from the latest two analyses."""
    dt, g, u, w, x_a, z_a = m["dt", "g", "u", "w", "x_a", "z_a"]
    u_next, w_next, wait, z_goal, slope = m["u_next", "w_next", "wait", "z_goal", "slope"]
    step_x = (x_a[t] - x_a[t - 1]) / dt - _friction(m, u[t]) * dt
    step_z = (z_a[t] - z_a[t - 1]) / dt - _friction(m, w[t]) * dt - g * dt
    start_x, start_z = [m["u_0"]], [m["w_0"]]
    m.define(u_next[t], step_x, "m/s", "mean horizontal velocity of the next step", start=start_x)
    m.define(w_next[t], step_z, "m/s", "mean vertical velocity of the next step", start=start_z)
    m.define(
        wait[t],
        Piecewise((-x_a[t] / u_next[t], u_next[t] < 0), (Missing, True)),
        "s",
        "time left until the goal line, at this velocity",
    )
    # Within the next step w_next is the mean velocity; gravity bends the path around it.
    bend = g * wait[t] * (dt - wait[t]) / 2
    m.define(
        z_goal[t],
        when_observed(wait[t], z_a[t] + w_next[t] * wait[t] + bend),
        "m",
        "height at the goal line, forecast from this photo on",
    )
    slope_then = (w_next[t] + g * (dt / 2 - wait[t])) / u_next[t]
    m.define(slope[t], when_observed(wait[t], slope_then), "", "slope of the path at the goal line")


def _spread_of_crossing(m: Recurrence) -> None:
    """Standard deviations of the time left and of the height, to first order in the errors."""
    dt, u_next, wait, s_wait, slope, s_goal = m["dt", "u_next", "wait", "s_wait", "slope", "s_goal"]
    # Error propagation: x_a and z_a of this photo and of the one before, taken as independent.
    # Their errors are in fact positively correlated, so both spreads are on the safe side.
    spread = (1 + wait[t] / dt) ** 2 + (wait[t] / dt) ** 2
    in_time, in_height = spread * m["p_x"], spread * (m["p_z"] + slope[t] ** 2 * m["p_x"])
    m.define(
        s_wait[t],
        when_observed(wait[t], sqrt(in_time) / Abs(u_next[t])),
        "s",
        "standard deviation of wait, as if analyses erred independently",
    )
    m.define(
        s_goal[t],
        when_observed((wait[t], slope[t]), sqrt(in_height)),
        "m",
        "standard deviation of z_goal, as if analyses erred independently",
    )
