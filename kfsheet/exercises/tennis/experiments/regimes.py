"""Which laws hold for a tennis ball: Reynolds number, slow and fast laws, time scales (3.5.1)."""

from __future__ import annotations

import numpy as np

from kfsheet.exercises.tennis.methods.arguments import number
from kfsheet.exercises.tennis.methods.dynamics import DIAMETER, MASS, TEXTBOOK_DRAG, Ball

DENSITY, VISCOSITY = 1.2, 1.8e-5
"""Of air, kg/m3 and Pa s."""
RADIUS = DIAMETER / 2
INERTIA = 2 / 3 * MASS * RADIUS**2
"""Of a hollow ball, kg m2."""


def reynolds(speed: float) -> float:
    """Reynolds number of a tennis ball, rho v D / mu: inertia of the air over its viscosity.

    >>> round(reynolds(30))
    140000
    """
    return DENSITY * number("speed", speed, 0) * DIAMETER / VISCOSITY


def slow_drag(speed: float) -> float:
    """Stokes's drag 6 pi mu a v, which Rubinow and Keller's begins with, N."""
    return 6 * np.pi * VISCOSITY * RADIUS * number("speed", speed, 0)


def fast_drag(speed: float) -> float:
    """The report's drag c_D v^2, with the textbook's c_D of a sphere, N."""
    return TEXTBOOK_DRAG * number("speed", speed, 0) ** 2


def drag_coefficient(c_D: float = TEXTBOOK_DRAG) -> float:
    """The coefficient without a unit that a c_D in kg/m stands for: c_D / (rho A / 2)."""
    return c_D / (DENSITY * np.pi * RADIUS**2 / 2)


def slow_lift() -> float:
    """Rubinow and Keller's c_L = pi a^3 rho, kg: their lift is c_L Omega x v."""
    return np.pi * RADIUS**3 * DENSITY


def rate_of_spin(ball: Ball) -> float:
    """|Omega| that its lambda stands for, with Rubinow and Keller's c_L, rad/s."""
    return float(np.linalg.norm(ball.spin)) * MASS / slow_lift()


def spin_lasts(omega: float) -> dict[str, float]:
    """Time I Omega / torque in which the air would stop the spin, by a slow law and a fast one, s.

    The slow torque is Stokes's, 8 pi mu a^3 Omega. The fast one is that of a sphere which turns in
    air at rest, with a boundary layer: rho Omega^2 a^5 M/2, M = 6.45/sqrt(Re) + 32.1/Re, with
    Re = rho Omega a^2 / mu (Dennis, Singh and Ingham, 1980).
    """
    turning = DENSITY * number("omega", omega, 0) * RADIUS**2 / VISCOSITY
    slow = 8 * np.pi * VISCOSITY * RADIUS**3 * omega
    M = 6.45 / np.sqrt(turning) + 32.1 / turning
    fast = DENSITY * omega**2 * RADIUS**5 * M / 2
    return {"slow": INERTIA * omega / slow, "fast": INERTIA * omega / fast}


def time_scales(ball: Ball) -> dict[str, float]:
    """How long the quadratic (3.2) could hold: m/(c_D |V|), and m |V|/(c_L |Omega x V|), s.

    The second is the report's, which is no time, with the |V| that it lacks.
    """
    speed = float(np.linalg.norm(ball.V))
    across = float(np.linalg.norm(np.cross(ball.spin, ball.V)))
    return {"drag": 1 / (ball.kappa * speed), "spin": speed / across}


def parabola(ball: Ball, times: np.ndarray) -> np.ndarray:
    """The quadratic (3.2) with the true quantities of the start, (n, 3), m."""
    t = np.asarray(times, float)[:, None]
    push = -ball.kappa * np.linalg.norm(ball.V) * ball.V + np.cross(ball.spin, ball.V)
    return ball.X + t * ball.V + t**2 / 2 * (push - [0, 0, ball.g])
