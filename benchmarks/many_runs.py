"""Ten thousand runs: kfsheet beside C, vectorised NumPy and simdkalman."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from statistics import median

import numpy as np
from flights import ROWS, STATE, c_library, pointer
from measuring import Line, in_turn, peak_memory, seconds
from one_run import AXIS, Axis

import kfsheet as kf
from kfsheet.evaluation.compiling import can_compile
from kfsheet.exercises.cannonball import cannonball
from kfsheet.exercises.football import football
from kfsheet.exercises.shuttlecock import shuttlecock

MEMBERS = 10_000
COMPILER = can_compile()
STUDY = {"scalars": (), "compiled": COMPILER}


def lines() -> Iterator[Line]:
    """All cores on our side, statistics of every step over the members on both."""
    yield from first_study()
    yield cannonballs()
    yield from drawn()
    yield footballs()
    if find_spec("simdkalman"):
        yield shuttlecocks()


def first_study() -> Iterator[Line]:
    """Two hundred cannon-balls with an empty cache, each time in a process of its own."""
    ways = {"NumPy arrays": False, "by default": None, **({"compiled": True} if COMPILER else {})}
    times = {}
    for way, compiled in ways.items():
        times[way] = seconds_alone(FIRST.format(compiled=compiled))
        note = "1.5 times the arrays' at most" if compiled is None else ""
        what = f"200 cannon-balls, fresh process, empty cache: {way}"
        peer = times["NumPy arrays"] if compiled is None else 0.0
        yield Line(what, times[way], peer, note)


FIRST = """
import time, kfsheet as kf
from kfsheet.exercises.cannonball import cannonball
start = time.perf_counter()
kf.study(cannonball, 200, kf.Draws("n_theta", "n_r"), columns=["NIS"], compiled={compiled})
print(time.perf_counter() - start)
"""


def seconds_alone(program: str, repeats: int = 3) -> float:
    """Median of what a program prints, in processes that find no machine code."""
    found = []
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as cache:
            around = {**os.environ, "KFSHEET_CACHE": cache}
            command = [sys.executable, "-c", program]
            done = subprocess.run(command, env=around, capture_output=True, text=True, check=True)
            found.append(float(done.stdout))
    return median(found)


def cannonballs() -> Line:
    """The same draws in C, on the same cores."""
    draws = np.random.RandomState(1).standard_normal((2, MEMBERS, ROWS))
    data = {"n_theta": draws[0], "n_r": draws[1]}
    wanted = [*STATE, "NIS"]

    def ours() -> object:
        return kf.study(cannonball, MEMBERS, data, columns=wanted, **STUDY)

    study = ours()
    c = c_library()
    if c is None:
        return Line("10,000 cannon-balls", seconds(ours, repeats=3))
    sums = np.zeros((5, ROWS))

    def by_c() -> None:
        sums[:] = 0
        c.many(MEMBERS, ROWS, *map(pointer, draws), pointer(sums))

    by_c()
    for name, total in zip(wanted, sums, strict=True):
        mean = study.rows[name]["mean"].fillna(0)
        assert np.allclose(mean, total / MEMBERS, rtol=1e-6, atol=1e-3)
    times = in_turn(ours, by_c, repeats=5)
    return Line("10,000 cannon-balls: C by hand, OpenMP", *times, "0.5 (within 2 of C)")


def drawn() -> Iterator[Line]:
    """The same with draws of our own, and with all that a study can be asked for."""
    four = kf.NEES(("x", "vx", "y", "vy"))

    def draws(**more: object) -> None:
        kf.study(
            cannonball, MEMBERS, kf.Draws("n_theta", "n_r", seed=1), columns=[*STATE, "NIS"], **more
        )

    everything = {"nees": {"NEES": four}, "quantiles": [0.05, 0.5, 0.95]}
    draws(scalars=())
    yield Line("the same, draws included", seconds(lambda: draws(scalars=()), repeats=3))
    draws(**everything)
    with tempfile.TemporaryDirectory() as cache:
        compiling, memory = (peak_memory(EVERYTHING, KFSHEET_CACHE=cache) for _ in range(2))
    yield Line(
        "the same, with NEES, all scalars and three quantiles",
        seconds(lambda: draws(**everything), repeats=3),
        0,
        f"at most {memory:.0f} MB (under 500); {compiling:.0f} MB once, to compile",
    )


EVERYTHING = f"""
import kfsheet as kf
from kfsheet.exercises.cannonball import cannonball
kf.study(
    cannonball, {MEMBERS}, kf.Draws("n_theta", "n_r"), columns=["NIS"],
    nees={{"NEES": kf.NEES(("x", "vx", "y", "vy"))}}, quantiles=[0.05, 0.5, 0.95],
)
"""


def footballs() -> Line:
    """All members at once in NumPy, row after row."""
    photos = np.array(football.table["i"].values)
    photos = photos + 3 * np.random.RandomState(2).standard_normal((MEMBERS, 16))

    def ours() -> object:
        return kf.study(football, MEMBERS, {"i": photos}, columns=["x_a", "z_a"], **STUDY)

    study, theirs = ours(), vectorised_football(photos)
    for name, table in theirs.items():
        for statistic, values in table.items():
            assert np.allclose(study.rows[name][statistic], values, rtol=1e-9, atol=1e-9)
    # Several calls of each: a first one finds the other's numbers in the cache.
    times = in_turn(ours, lambda: vectorised_football(photos), repeats=15, calls=[5, 5])
    return Line("10,000 footballs: vectorised NumPy", *times, "1")


def shuttlecocks() -> Line:
    """The filter of one axis of the shuttlecock, beside simdkalman, which is given its input."""
    import simdkalman

    axis = Axis()
    draws = np.random.RandomState(3).standard_normal((MEMBERS, shuttlecock.rows))

    def ours() -> object:
        return kf.study(shuttlecock, MEMBERS, {"n_x": draws}, columns=AXIS, **STUDY)

    run = kf.evaluate(shuttlecock)
    noise = (run["x_obs"] - run["x_true"])[1] / run["n_x"][1]
    seen = run["x_true"].to_numpy() + noise * draws
    start = np.zeros((MEMBERS, 3, 1))
    start[:, 0, 0] = seen[:, 0]
    peer = simdkalman.KalmanFilter(axis.A, axis.Q, axis.H, axis.r)

    def theirs() -> np.ndarray:
        found = peer.compute(
            seen[:, 1:], 0, axis.A @ start, axis.P, smoothed=False, filtered=True,
            observations=False,
        )  # fmt: skip
        return found.filtered.states.mean.mean(axis=0)

    study = ours()
    means = np.column_stack([study.rows[name]["mean"][1:] for name in AXIS])
    assert np.allclose(means, theirs(), rtol=1e-9, atol=1e-9)
    words = "1; it stores every state and covariance"
    return Line("10,000 shuttlecocks, one axis: simdkalman", *in_turn(ours, theirs), words)


def vectorised_football(i: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    """The football filter and the statistics that a study has: mean, rms and deviation."""
    p = football.defaults()
    j = np.array(football.table["j"].values)
    dt, f, a, h, g = p["dt"], p["f"], p["a"], p["h"], p["g"]
    K = p["b_x"] * a / (p["r_i"] + a**2 * p["b_x"])
    n = len(i)
    x, z = np.empty((16, n)), np.empty((16, n))
    u, w = np.full(n, p["u_0"]), np.full(n, p["w_0"])
    x[0], z[0] = p["x_0"], p["z_0"]
    for t in range(1, 16):
        before_u = (x[t - 1] - x[t - 2]) / dt if t > 1 else p["u_0"]
        before_w = (z[t - 1] - z[t - 2]) / dt if t > 1 else p["w_0"]
        u = before_u - f * np.sign(u) * u**2 * dt
        w = before_w - f * np.sign(w) * w**2 * dt - g * dt
        x_f = x[t - 1] + u * dt - h * f * np.sign(u) * u**2 * dt ** p["p"]
        z_f = z[t - 1] + w * dt - h * f * np.sign(w) * w**2 * dt ** p["p"] - h * g * dt**2
        x[t] = x_f + K * (i[:, t] - a * x_f)
        z[t] = z_f - K * (j[t] - p["j_0"] + a * z_f)
    return {
        name: {
            "mean": values.mean(axis=1),
            "rms": np.sqrt((values**2).mean(axis=1)),
            "std": values.std(axis=1, ddof=1),
        }
        for name, values in (("x_a", x), ("z_a", z))
    }
