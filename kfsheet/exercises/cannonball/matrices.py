"""The article's Riccati equations in matrices, as printed or mended, for many flights at once.

    M = Phi P Phi' + Q_k
    K = M H' [H M H' + R]^-1
    x = x_f + K (z - h(x_f))
    P = M - K H M                        (which the article's list lacks)

The sheet has the same in scalar columns. What the misprints do is run here; the sheet is right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from sympy import diag

from kfsheet.ensemble.draws import Draws
from kfsheet.estimation.algebra import discrete_noise, transition_matrix
from kfsheet.exercises.cannonball.model import DYNAMICS, STATE, cannonball

NAMES = tuple(name for name, *_ in STATE)


@dataclass(frozen=True)
class Flights:
    """What a filter made of some flights; arrays of (flights, sweeps from 1 on, ...).

    Attributes
    ----------
    error : array of (flights, sweeps, 4)
        Estimate minus truth: m, m/s, m, m/s.
    claimed : array of (flights, sweeps, 4)
        The variances that it claims, in units squared.
    NIS, NEES : array of (flights, sweeps)
        Innovations and errors squared, in units of what is claimed of them.
    """

    error: np.ndarray
    claimed: np.ndarray
    NIS: np.ndarray
    NEES: np.ndarray


def fly(
    echoes: np.ndarray,
    truth: np.ndarray,
    *,
    minus: bool = True,
    learns: bool = True,
    **parameters: float,
) -> Flights:
    """Run the article's list of equations.

    Parameters
    ----------
    echoes : array of (flights, sweeps, 2)
        Angle in rad and range in m, from sweep 1 on.
    truth : array of (sweeps + 1, 4)
        x, vx, y, vy in m and m/s, from the shot on.
    minus : bool
        Whether the derivative of the angle by x has its minus; as printed it has none.
    learns : bool
        Whether P is updated; the printed list ends before.
    **parameters : float
        Those of the model that differ.
    """
    value = {n: p.value for n, p in cannonball.parameters.items()} | parameters
    dt, noise = value["dt"], diag(0, value["Phi_s"], 0, value["Phi_s"])
    Phi = np.array(transition_matrix(DYNAMICS, dt), float)
    Q = np.array(discrete_noise(DYNAMICS, noise, dt), float)
    fall = np.array([0, 0, -value["g"] * dt**2 / 2, -value["g"] * dt])
    R = np.diag([(value[f"belief_{n}"] * value[f"sigma_{n}"]) ** 2 for n in ("theta", "r")])
    radar = value["x_R"], value["y_R"]
    x = np.tile(truth[0] + [value[f"e_{n}"] for n in NAMES], (len(echoes), 1))
    P = np.tile(np.diag([value[f"s_{n}"] ** 2 for n in NAMES]), (len(echoes), 1, 1))
    found = []
    for true, z in zip(truth[1:], echoes.swapaxes(0, 1), strict=True):
        x, M = x @ Phi.T + fall, Phi @ P @ Phi.T + Q
        seen, H = _seen(x, radar, minus)
        S_inverse = np.linalg.inv(H @ M @ H.swapaxes(1, 2) + R)
        K = M @ H.swapaxes(1, 2) @ S_inverse
        d = z - seen
        d[:, 0] = np.remainder(d[:, 0] + np.pi, 2 * np.pi) - np.pi
        x = x + np.einsum("nij,nj->ni", K, d)
        P = M - K @ H @ M if learns else M
        e = x - true
        claimed = np.diagonal(P, axis1=1, axis2=2).copy()  # else all of P is kept
        found.append((e, claimed, _square(d, S_inverse), _square(e, np.linalg.inv(P))))
    return Flights(*(np.stack(part, axis=1) for part in zip(*found, strict=True)))


def _seen(x: np.ndarray, radar: tuple[float, float], minus: bool) -> tuple[np.ndarray, np.ndarray]:
    """Angle and range of the states, and their derivatives H."""
    right, up = x[:, 0] - radar[0], x[:, 2] - radar[1]
    r, H = np.hypot(right, up), np.zeros((len(x), 2, 4))
    H[:, 0, 0], H[:, 0, 2] = (-1 if minus else 1) * up / r**2, right / r**2
    H[:, 1, 0], H[:, 1, 2] = right / r, up / r
    return np.column_stack([np.arctan2(up, right), r]), H


def _square(e: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    return np.einsum("ni,nij,nj->n", e, inverse, e)


def echoes_of(run: pd.DataFrame, draws: Draws, flights: int) -> np.ndarray:
    """What the radar sees of so many flights of one ball: (flights, sweeps from 1 on, 2).

    Parameters
    ----------
    run : DataFrame
        Of the model, with the columns ``theta`` and ``r`` of the truth.
    draws : Draws
        Of ``n_theta`` and ``n_r``.
    flights : int
        How many.
    """
    sigma: Mapping[str, float] = {n: cannonball.parameters[n].value for n in SIGMAS}
    noise = np.array([draws.of(k, len(run)) for k in range(flights)])[:, :, 1:]
    true = run[["theta", "r"]].to_numpy(float)[1:]
    return true + noise.swapaxes(1, 2) * [sigma[n] for n in SIGMAS]


SIGMAS = ("sigma_theta", "sigma_r")
