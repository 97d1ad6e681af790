"""How fast kfsheet is beside its peers: one table of ratios, each measured in this one run.

    make bench

Every figure is the median of several repeats; both sides of a ratio are measured in turn, so that
a busy machine slows both. A peer that is not installed, or a missing C compiler, leaves its lines
out. The table is written to benchmarks/README.md.
"""

import ctypes
import math
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from statistics import median

import numpy as np

import kfsheet as kf
from kfsheet import evaluation
from kfsheet.exercises.cannonball import cannonball
from kfsheet.exercises.cannonball import exercise as cannonball_exercise
from kfsheet.exercises.football import football
from kfsheet.files import write_file

HERE = Path(__file__).parent
ROWS, MEMBERS = 1320, 10_000
STATE = ["x_a", "vx_a", "y_a", "vy_a"]
Line = tuple[str, float, float, str]


def seconds(work: Callable[[], object], repeats: int = 5, calls: int = 1) -> float:
    """Median time of a call, in seconds."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(calls):
            work()
        times.append((time.perf_counter() - start) / calls)
    return median(times)


def main() -> None:
    """Measure, print and keep the table."""
    groups = (one_run, many_runs, sheets, starts)
    lines = []
    for group in groups:
        for line in group():
            lines.append(line)
            print(_row(line), flush=True)
    table = "\n".join(
        [
            "| what | kfsheet | peer | peer/kfsheet | wanted |",
            "|---|---|---|---|---|",
            *map(_row, lines),
        ]
    )
    write_file(HERE / "README.md", (_preface() + table + "\n").encode())


def _row(line: Line) -> str:
    what, ours, peer, note = line
    ratio = f"{peer / ours:.2f}" if peer else ""
    return f"| {what} | {_time(ours)} | {_time(peer) if peer else ''} | {ratio} | {note} |"


def _time(value: float) -> str:
    return f"{value:.2f} s" if value >= 1 else f"{value * 1e3:.3g} ms"


def _preface() -> str:
    return (
        "# Benchmarks\n\n"
        "The last table that `make bench` printed; every line was measured in one run, as medians "
        f"of several repeats.\nMachine: {platform.machine()}, {os.cpu_count()} cores, "
        f"{platform.system()}, Python {platform.python_version()}.\n\n"
    )


# -- one run -------------------------------------------------------------------------------


def one_run() -> Iterator[Line]:
    """One flight of the cannon-ball: 1,320 steps of the extended filter."""
    frame = kf.evaluate(cannonball)
    observed = frame[["theta_obs", "r_obs"]].to_numpy()
    kf.warm_up(cannonball, STATE)

    def ours() -> object:
        return kf.evaluate(cannonball, columns=STATE)

    peer = filterpy_loop(observed)
    assert np.allclose(peer, frame[STATE], rtol=1e-6, atol=1e-3)
    fast = seconds(ours, calls=50)
    yield "one EKF, 1,320 steps: filterpy", fast, seconds(lambda: filterpy_loop(observed)), "100"
    yield "one EKF: NumPy by hand", fast, seconds(lambda: numpy_loop(observed)), ""
    if c := c_library():
        found = np.empty((5, ROWS))
        draws = [np.ascontiguousarray(frame[n]) for n in ("n_theta", "n_r")]

        def by_c() -> None:
            c.fly(ROWS, *map(_pointer, draws), _pointer(found))

        by_c()
        assert np.allclose(found[:4].T, frame[STATE], rtol=1e-7, atol=1e-4)
        yield "one EKF: C by hand", fast, seconds(by_c, calls=50), "0.67 (within 1.5 of C)"
    slow = _without_compiler(ours)
    yield (
        "one EKF without a compiler: filterpy",
        slow,
        seconds(lambda: filterpy_loop(observed)),
        "2",
    )
    yield "compile the model, once", _compile_time(), 0, "then kept on disk"


def _without_compiler(work: Callable[[], object]) -> float:
    can = evaluation.can_compile
    evaluation.can_compile = lambda: False
    try:
        work()
        return seconds(work)
    finally:
        evaluation.can_compile = can


def _compile_time() -> float:
    program = (
        "import time, kfsheet as kf\n"
        "from kfsheet.exercises.cannonball import cannonball as m\n"
        "kf.evaluate(m); t = time.perf_counter()\n"
        f"kf.warm_up(m, {STATE}); print(time.perf_counter() - t)"
    )
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "KFSHEET_CACHE": cache}
        done = subprocess.run(
            [sys.executable, "-c", program],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
    return float(done.stdout)


DT, G, X_R = 0.1, 9.80665, 30480.0
F = np.array([[1, DT, 0, 0], [0, 1, 0, 0], [0, 0, 1, DT], [0, 0, 0, 1]])
FALL = np.array([0, 0, -G * DT**2 / 2, -G * DT])
R = np.diag([0.01**2, 30.48**2])
SPEED = 915 / math.sqrt(2)


def start() -> tuple[np.ndarray, np.ndarray]:
    """The state and covariance of row 0."""
    x = np.array([304.8, SPEED - 30.48, -304.8, SPEED + 30.48])
    return x, np.diag([304.8, 30.48, 304.8, 30.48]) ** 2


def look(x: np.ndarray) -> np.ndarray:
    """Angle and range."""
    return np.array([math.atan2(x[2], x[0] - X_R), math.hypot(x[0] - X_R, x[2])])


def slope(x: np.ndarray) -> np.ndarray:
    """Jacobian of angle and range."""
    a, b = x[0] - X_R, x[2]
    r = math.hypot(a, b)
    return np.array([[-b / r**2, 0, a / r**2, 0], [a / r, 0, b / r, 0]])


def residual(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Difference of two observations, the angle wrapped."""
    return np.array([math.remainder(a[0] - b[0], 2 * math.pi), a[1] - b[1]])


def filterpy_loop(observed: np.ndarray) -> np.ndarray:
    """The same filter in filterpy."""
    from filterpy.kalman import ExtendedKalmanFilter

    ekf = ExtendedKalmanFilter(dim_x=4, dim_z=2)
    ekf.x, ekf.P = start()
    ekf.F, ekf.R, ekf.Q = F, R, np.zeros((4, 4))
    found = [ekf.x]
    for y in observed[1:]:
        ekf.predict()
        ekf.x = ekf.x + FALL
        ekf.update(y, slope, look, residual=residual)
        found.append(ekf.x)
    return np.array(found)


def numpy_loop(observed: np.ndarray) -> np.ndarray:
    """The same filter written by hand."""
    x, P = start()
    found = [x]
    for y in observed[1:]:
        x, P = F @ x + FALL, F @ P @ F.T
        H = slope(x)
        PHt = P @ H.T
        K = PHt @ np.linalg.inv(H @ PHt + R)
        x, P = x + K @ residual(y, look(x)), P - K @ PHt.T
        found.append(x)
    return np.array(found)


# -- many runs -----------------------------------------------------------------------------


def many_runs() -> Iterator[Line]:
    """Ten thousand flights, all cores on both sides, the same draws."""
    draws = np.random.RandomState(1).standard_normal((2, MEMBERS, ROWS))
    data = {"n_theta": draws[0], "n_r": draws[1]}
    wanted = [*STATE, "NIS"]

    def ours() -> object:
        return kf.evaluate(cannonball, data, members=MEMBERS, columns=wanted, scalars=())

    study = ours()
    fast = seconds(ours, repeats=3)
    if c := c_library():
        sums = np.zeros((5, ROWS))

        def by_c() -> None:
            sums[:] = 0
            c.many(MEMBERS, ROWS, *map(_pointer, draws), _pointer(sums))

        peer = seconds(by_c, repeats=3)
        for name, total in zip(wanted, sums, strict=True):
            mean = study.rows[name]["mean"].fillna(0)
            assert np.allclose(mean, total / MEMBERS, rtol=1e-6, atol=1e-3)
        yield "10,000 cannon-balls: C by hand, OpenMP", fast, peer, "0.5 (within 2 of C)"
    else:
        yield "10,000 cannon-balls", fast, 0, ""
    photos = np.array(football.table["i"].values)
    photos = photos + 3 * np.random.RandomState(2).standard_normal((MEMBERS, 16))

    def kicks() -> object:
        return kf.evaluate(
            football, {"i": photos}, members=MEMBERS, columns=["x_a", "z_a"], scalars=()
        )

    kicks()
    yield (
        "10,000 footballs: vectorised NumPy",
        seconds(kicks),
        seconds(lambda: vectorised_football(photos)),
        "1",
    )

    if find_spec("simdkalman"):
        yield shuttlecocks()


def shuttlecocks() -> Line:
    """The filter of one axis of the shuttlecock, beside simdkalman, which is given its input."""
    import simdkalman

    from kfsheet.exercises.shuttlecock import joint_model, shuttlecock

    draws = np.random.RandomState(3).standard_normal((MEMBERS, shuttlecock.rows))
    wanted = ["x_a", "vx_a", "ax_a"]

    def ours() -> object:
        return kf.evaluate(shuttlecock, {"n_x": draws}, members=MEMBERS, columns=wanted, scalars=())

    run = kf.evaluate(shuttlecock)
    values = {**run.attrs["parameters"], **run.attrs["scalars"]}
    model = joint_model(shuttlecock, "x")
    A, Q = (
        np.array(matrix.subs({s: values[s.name] for s in matrix.free_symbols}), dtype=float)
        for matrix in (model.F, model.Q)
    )
    noise = (run["x_obs"] - run["x_true"])[1] / run["n_x"][1]
    seen = run["x_true"].to_numpy() + noise * draws
    start = np.zeros((MEMBERS, 3, 1))
    start[:, 0, 0] = seen[:, 0]
    P = A @ np.diag([values["r_obs"], values["var_v"], values["var_a"]]) @ A.T + Q
    peer = simdkalman.KalmanFilter(A, Q, np.array([[1, 0, 0]]), np.array([[values["r_obs"]]]))

    def theirs() -> np.ndarray:
        found = peer.compute(
            seen[:, 1:], 0, A @ start, P, smoothed=False, filtered=True, observations=False
        )
        return found.filtered.states.mean.mean(axis=0)

    study = ours()
    means = np.column_stack([study.rows[name]["mean"][1:] for name in wanted])
    assert np.allclose(means, theirs(), rtol=1e-9, atol=1e-9)
    return "10,000 shuttlecocks, one axis: simdkalman", seconds(ours), seconds(theirs), "1"


def vectorised_football(i: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The football filter, all members at once, row after row."""
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
    return x.mean(axis=1), z.mean(axis=1)


# -- sheets --------------------------------------------------------------------------------


def sheets() -> Iterator[Line]:
    """Write and check the workbook of the cannon-ball."""
    from kfsheet.excel.recalculate import libreoffice, recalculate, strip_values
    from kfsheet.excel.workbook import workbook_bytes

    content = workbook_bytes(cannonball_exercise)
    yield (
        "write 190,000 cells: openpyxl, bare strings",
        seconds(lambda: workbook_bytes(cannonball_exercise), repeats=3),
        seconds(lambda: bare_strings(content), repeats=3),
        "0.77 (within 1.3)",
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cannonball.xlsx"
        path.write_bytes(content)
        check = seconds(lambda: kf.check_workbook(path, cannonball_exercise), repeats=3)
        yield "check it with IronCalc", check, 0, "under 2 s wanted"
        engine = seconds(lambda: recalculate(path), repeats=3)
        if libreoffice():
            other = seconds(lambda: recalculate(path, "libreoffice"), repeats=3)
            yield "recalculate it: LibreOffice", engine, other, ""
        if find_spec("formualizer"):
            bare = Path(folder) / "bare.xlsx"
            strip_values(path, bare)
            yield (
                "recalculate it: formualizer",
                engine,
                seconds(lambda: by_formualizer(bare), 3),
                "",
            )


def by_formualizer(path: Path) -> object:
    """Load and evaluate with formualizer."""
    import formualizer

    book = formualizer.load_workbook(str(path))
    return book.evaluate_all()


def bare_strings(content: bytes) -> None:
    """Write the formulas of a workbook as plain strings: what openpyxl costs at least."""
    from io import BytesIO

    import openpyxl

    if content not in _TEXTS:
        book = openpyxl.load_workbook(BytesIO(content))
        _TEXTS[content] = [
            [["" if v is None else str(v).lstrip("=") for v in row] for row in sheet.values]
            for sheet in book
        ]
    book = openpyxl.Workbook()
    for rows in _TEXTS[content]:
        sheet = book.create_sheet()
        for row in rows:
            sheet.append(row)
    book.save(BytesIO())


_TEXTS: dict[bytes, list[list[list[str]]]] = {}


# -- starting ------------------------------------------------------------------------------


def starts() -> Iterator[Line]:
    """What a user waits for before anything happens."""
    for what, code, goal in (
        ("kfsheet --help", "from kfsheet.cli import parser; parser().format_help()", "under 0.3 s"),
        ("import kfsheet", "import kfsheet", "under 0.6 s"),
    ):
        yield what, seconds(lambda code=code: subprocess.run([sys.executable, "-c", code])), 0, goal
    yield "a dense 9-state model to columns", seconds(nine_states, repeats=3), 0, "under 2 s"


def nine_states() -> None:
    """Nine states, all coupled, three observations."""
    from sympy import Matrix, Symbol, eye

    m = kf.Recurrence("nine", title="Nine states", rows=3)
    a = m.parameter("a", 0.1, "", "coupling")
    names = [Symbol(f"s{k}_", real=True) for k in range(9)]
    state = {s: kf.State("", f"element {k}", 0, 1) for k, s in enumerate(names)}
    x = Matrix(names)
    A = eye(9) + a * Matrix(9, 9, lambda i, j: 1 if abs(int(i) - int(j)) < 2 else 0)
    seen = [
        kf.Observation(
            f"y{k}", m.data(f"y_{k}", [0, 0, 0], "", "seen", section="D")[kf.t], s, 1, ""
        )
        for k, s in enumerate(names[:3])
    ]
    kf.add_filter(m, kf.StateSpace(state, list(A * x), eye(9) * a, seen), section="Filter")


# -- C -------------------------------------------------------------------------------------


def c_library() -> ctypes.CDLL | None:
    """The hand-written loops, compiled; None without a C compiler."""
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if compiler is None:
        return None
    target = Path(tempfile.gettempdir()) / f"kfsheet-bench-{os.getpid()}.so"
    if not target.exists():
        flags = ["-O3", "-march=native", "-fopenmp", "-shared", "-fPIC"]
        subprocess.run(
            [compiler, *flags, "-o", str(target), str(HERE / "cannonball.c"), "-lm"], check=True
        )
    return ctypes.CDLL(str(target))


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


if __name__ == "__main__":
    main()
