"""Three filters of three states against one of nine: what the source's decomposition saves.

    python benchmarks/shuttlecock_three_by_three.py

Arithmetic operations of one step, equations (10) to (14), are counted by SymPy in matrices without
a single 0. The time of one step is the best of several: NumPy's, with calls on three matrices one
after the other, on three at once (stacked), and on the nine-state matrix; and, where Numba is
installed, that of compiled loops, which pay for operations rather than for calls. What it printed
last is kept in ``shuttlecock_three_by_three.txt`` beside it.
"""

from __future__ import annotations

import os
import platform
import timeit
from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
import pandas as pd
from sympy import Matrix, MatrixSymbol, count_ops

STEPS, REPEATS = 2000, 7
T, K, G = 1 / 30, 1.0, 9.80665


def full(name: str, rows: int, columns: int) -> Matrix:
    """A matrix without a 0: every entry a symbol of its own."""
    return Matrix(MatrixSymbol(name, rows, columns).as_explicit())


def operations(n: int, m: int) -> dict[str, int]:
    """Arithmetic operations of one step of a filter with n states and m observations.

    Every product is counted with its factors already computed, as a program would compute them.

    Returns
    -------
    dict
        Number of additions, subtractions, multiplications and divisions of each stage.
    """
    x, d, u = full("x", n, 1), full("d", m, 1), full("u", n, 1)
    A, P, Q, M = (full(name, n, n) for name in "APQM")
    H, R, S = full("H", m, n), full("R", m, m), full("S", m, m)
    PH, K, V = full("PH", n, m), full("K", n, m), full("V", m, m)
    inverse = S.adjugate() / full("D", 1, 1)[0]
    stages = {
        "forecast, (10)": [A * x + u],
        "its covariance, (11)": [A * P, M * A.T + Q],
        "gain, (13)": [P * H.T, H * PH + R, Matrix([S.det(method="laplace")]), inverse, PH * V],
        "analysis, (12)": [d - H * x, x + K * d],
        "its covariance, (14)": [K * H, Matrix.eye(n) - M, M * P],
    }
    return {name: sum(map(_count, stage)) for name, stage in stages.items()}


def _count(matrix: Matrix) -> int:
    return sum(map(count_ops, matrix))


def counted() -> pd.DataFrame:
    """Operations of three 3 x 3 filters and of one 9 x 9 filter, and their ratio."""
    three, nine = operations(3, 1), operations(9, 3)
    table = pd.DataFrame({"three 3 x 3": three, "one 9 x 9": nine})
    table["three 3 x 3"] *= 3
    table.loc["one step"] = table.sum()
    table["ratio"] = (table["one 9 x 9"] / table["three 3 x 3"]).round(1)
    return table.astype({"three 3 x 3": int, "one 9 x 9": int})


def step(x, P, A, u, H, Q, R, y):  # noqa: ANN001, ANN201 - arrays, stacked or not
    """One step of the filter, equations (10) to (14)."""
    x, P = A @ x + u, A @ P @ np.swapaxes(A, -1, -2) + Q
    PH = P @ np.swapaxes(H, -1, -2)
    K = PH @ np.linalg.inv(H @ PH + R)
    return x + K @ (y - H @ x), P - K @ H @ P


Problem = tuple[np.ndarray, ...]
"""x, P at the start, and A, u, H, Q, R."""


def problems(first: np.ndarray) -> tuple[Problem, Problem]:
    """Three filters stacked along a first axis, and the joint one, started at a first position."""
    I3 = np.eye(3)
    x = np.kron(first, [1.0, 0, 0]).reshape(3, 3, 1)
    u = np.zeros((3, 3, 1))
    u[2, 2] = -G
    A = np.array([[1, T, T**2 / 2], [0, 1, T], [0, -K, -K * T]])
    one = [np.diag([0.04, 25, 25]), A, np.array([[1.0, 0, 0]]), 0.04 * I3, 0.04 * np.ones((1, 1))]
    P, A, H, Q, R = (np.stack([part] * 3) for part in one)
    P_9, A_9, H_9, Q_9, R_9 = (np.kron(I3, part) for part in one)
    three, nine = (x, P, A, u, H, Q, R), (x, P_9, A_9, u, H_9, Q_9, R_9)
    return three, tuple(part.reshape(9, 1) if part.shape == (3, 3, 1) else part for part in nine)


def flown(positions: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """A whole flight by both filters, from positions of shape (frames, 3) that were seen.

    Returns
    -------
    three, nine : list
        The states, shape (frames, 9), and the covariances, (frames, 9, 9), of three small filters
        and of the joint one, which start in frame 0 at the position seen there.
    """
    three, nine = problems(positions[0])
    results = []
    for (x, P, *model), shape in ((three, (3, 1, 1)), (nine, (3, 1))):
        states, covariances = [x], [P]
        for seen in positions[1:]:
            x, P = step(x, P, *model, seen.reshape(shape))
            states.append(x)
            covariances.append(P)
        results.append([np.reshape(states, (-1, 9)), np.array(covariances)])
    results[0][1] = _blocks(results[0][1])
    return results[0], results[1]


def _blocks(P: np.ndarray) -> np.ndarray:
    """Covariances (frames, 3, 3, 3) of three filters as blocks of (frames, 9, 9)."""
    whole = np.zeros((len(P), 9, 9))
    for n in range(3):
        whole[:, 3 * n : 3 * n + 3, 3 * n : 3 * n + 3] = P[:, n]
    return whole


def disagreement(positions: np.ndarray) -> float:
    """Largest difference between both filters in a flight, of any state or covariance."""
    three, nine = flown(positions)
    return max(float(np.abs(a - b).max()) for a, b in zip(three, nine, strict=True))


def timed() -> pd.Series:
    """Microseconds of one step, by way of computing."""
    stacked, joint = problems(np.zeros(3))
    seen, seen_9 = np.ones((3, 1, 1)), np.ones((3, 1))
    single = [[*(part[n] for part in stacked), seen[n]] for n in range(3)]
    ways: dict[str, Callable] = {
        "NumPy: three 3 x 3, one after the other": lambda: [step(*parts) for parts in single],
        "NumPy: three 3 x 3, stacked": lambda: step(*stacked, seen),
        "NumPy: one 9 x 9": lambda: step(*joint, seen_9),
    }
    best = {w: min(timeit.repeat(run, number=STEPS, repeat=REPEATS)) for w, run in ways.items()}
    if find_spec("numba"):
        loops = compiled_steps()
        runs = {
            "compiled loops: three 3 x 3": lambda: [loops(*parts, STEPS) for parts in single],
            "compiled loops: one 9 x 9": lambda: loops(*joint, seen_9, STEPS),
        }
        for way, run in runs.items():
            run()  # compiles
            best[way] = min(timeit.repeat(run, number=1, repeat=50 * REPEATS))
    return pd.Series(best) / STEPS * 1e6


def compiled_steps() -> Callable:
    """Many times the same :func:`step`, in loops that Numba compiles; needs Numba.

    Every intermediate matrix has its place before the first step, as in a program for a robot.
    """
    from numba import njit

    @njit
    def times(a, b, out):  # noqa: ANN001
        for i in range(a.shape[0]):
            for j in range(b.shape[1]):
                out[i, j] = 0
                for k in range(a.shape[1]):
                    out[i, j] += a[i, k] * b[k, j]

    @njit
    def invert(S, out):  # noqa: ANN001 - Gauss and Jordan; S is positive definite, and lost
        n = S.shape[0]
        for i, j in np.ndindex(n, n):
            out[i, j] = i == j
        for i in range(n):
            pivot = S[i, i]
            for k in range(n):
                S[i, k] /= pivot
                out[i, k] /= pivot
            for j in range(n):
                factor = S[j, i]
                for k in range(n if j != i else 0):
                    S[j, k] -= factor * S[i, k]
                    out[j, k] -= factor * out[i, k]

    @njit
    def steps(x, P, A, u, H, Q, R, y, number):  # noqa: ANN001
        x, P, x_f, AP, P_f, KH = x.copy(), P.copy(), x.copy(), P.copy(), P.copy(), P.copy()
        PH, K, S, V, d = H.T.copy(), H.T.copy(), R.copy(), R.copy(), y.copy()
        for _ in range(number):
            times(A, x, x_f)
            x_f += u
            times(A, P, AP)
            times(AP, A.T, P_f)
            P_f += Q
            times(P_f, H.T, PH)
            times(H, PH, S)
            S += R
            invert(S, V)
            times(PH, V, K)
            times(H, x_f, d)
            np.subtract(y, d, d)
            times(K, d, x)
            x += x_f
            times(K, H, KH)
            times(KH, P_f, P)
            np.subtract(P_f, P, P)
        return x, P

    return steps


def main() -> None:
    """Print both tables."""
    print("Arithmetic operations of one step, matrices without zeros (SymPy)\n")
    print(counted().to_string())
    machine = f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    print(
        f"\nTime of one step (NumPy {np.__version__}, best of {REPEATS} times {STEPS}; {machine})\n"
    )
    print(timed().map("{:.1f} us".format).to_string())
    positions = np.random.RandomState(1).standard_normal((27, 3))
    print(f"\nLargest difference of the results in 27 frames: {disagreement(positions):.0e}")


if __name__ == "__main__":
    main()
