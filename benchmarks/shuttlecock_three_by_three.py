"""Three filters of three states against one of nine: what the source's decomposition saves.

    python benchmarks/shuttlecock_three_by_three.py

Arithmetic operations of one step, equations (10) to (14), are counted by SymPy in matrices without
a single 0; the time of one step is NumPy's, best of several, with calls on three matrices one after
the other, on three at once (stacked), and on the nine-state matrix.
"""

from __future__ import annotations

import itertools
import timeit

import numpy as np
import pandas as pd
from sympy import Matrix, MatrixSymbol, count_ops

STEPS, REPEATS = 2000, 7


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


def step(x, P, A, H, Q, R, y):  # noqa: ANN001, ANN201 - arrays, stacked or not
    """One step of the filter, equations (10) to (14)."""
    x, P = A @ x, A @ P @ A.mT + Q
    PH = P @ H.mT
    K = PH @ np.linalg.inv(H @ PH + R)
    return x + K @ (y - H @ x), P - K @ H @ P


def problems() -> tuple[list[np.ndarray], list[np.ndarray]]:
    """The arrays of three filters, stacked along a first axis, and of the joint one."""
    T, I3 = 1 / 30, np.eye(3)
    A = np.array([[1, T, T**2 / 2], [0, 1, T], [0, -1, -T]])
    H, one = np.array([[1.0, 0, 0]]), np.ones((1, 1))
    small = [np.ones((3, 1)), np.diag([0.04, 25, 25]), A, H, 0.04 * I3, 0.04 * one, one]
    joint = [np.vstack([small[0]] * 3), *(np.kron(I3, part) for part in small[1:-1])]
    return [np.stack([part] * 3) for part in small], [*joint, np.ones((3, 1))]


def timed() -> pd.Series:
    """Microseconds of one step, by way of computing."""
    stacked, joint = problems()
    single = [[part[n] for part in stacked] for n in range(3)]
    ways = {
        "three 3 x 3, one after the other": lambda: [step(*parts) for parts in single],
        "three 3 x 3, stacked": lambda: step(*stacked),
        "one 9 x 9": lambda: step(*joint),
    }
    best = {w: min(timeit.repeat(run, number=STEPS, repeat=REPEATS)) for w, run in ways.items()}
    return pd.Series(best) / STEPS * 1e6


def disagreement() -> float:
    """Largest difference between the two filters after a step; they are one filter."""
    stacked, joint = problems()
    (x, P), (x_9, P_9) = step(*stacked), step(*joint)
    blocks = np.zeros((9, 9))
    for n, (i, j) in itertools.product(range(3), itertools.product(range(3), repeat=2)):
        blocks[3 * n + i, 3 * n + j] = P[n, i, j]
    return max(np.abs(x.reshape(9, 1) - x_9).max(), np.abs(blocks - P_9).max())


def main() -> None:
    """Print both tables."""
    print("Arithmetic operations of one step, matrices without zeros (SymPy)\n")
    print(counted().to_string())
    print(f"\nTime of one step (NumPy {np.__version__}, best of {REPEATS} times {STEPS})\n")
    print(timed().map("{:.1f} us".format).to_string())
    print(f"\nLargest difference of the results: {disagreement():.0e}")


if __name__ == "__main__":
    main()
