"""One flight: kfsheet beside the libraries that people use."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec

import flights
import numpy as np
from flights import STATE
from measuring import Line, in_turn

import kfsheet as kf
from kfsheet.exercises.cannonball import cannonball
from kfsheet.exercises.shuttlecock import shuttlecock
from kfsheet.exercises.shuttlecock.filters import joint_model


def lines() -> Iterator[Line]:
    """The cannon-ball's filters and an axis of the shuttlecock's."""
    yield from extended()
    yield linear()
    if find_spec("pykalman"):
        yield short()


def extended() -> Iterator[Line]:
    """One flight of the cannon-ball: 1,320 steps of the extended filter."""
    frame = kf.evaluate(cannonball)
    observed = frame[["theta_obs", "r_obs"]].to_numpy()
    kf.warm_up(cannonball, STATE)

    def ours() -> object:
        return kf.evaluate(cannonball, columns=STATE)

    def theirs() -> object:
        return flights.filterpy_loop(observed)

    assert np.allclose(theirs(), frame[STATE], rtol=1e-6, atol=1e-3)

    def by_hand() -> object:
        return flights.numpy_loop(observed)

    by_c = flights.one_by_c(frame)
    works = [ours, theirs, by_hand, *([by_c] if by_c else [])]
    fast, *times = in_turn(*works, calls=[50, 1, 1, 50][: len(works)])
    yield Line("one EKF, 1,320 steps: filterpy", fast, times[0], "100")
    yield Line("one EKF: NumPy by hand", fast, times[1])
    if by_c:
        yield Line("one EKF: C by hand", fast, times[2], "0.67 (within 1.5 of C)")

    def by_python() -> object:
        return kf.evaluate(cannonball, columns=STATE, compiled=False)

    by_python()
    yield Line("one EKF without a compiler: filterpy", *in_turn(by_python, theirs), "2")
    for what, columns in (("four columns of the model", STATE), ("all of its columns", None)):
        first, second = compile_time(columns)
        words = f"in the background, then kept on disk: {second:.2f} s in a second process"
        yield Line(f"compile {what}", first, 0, words)


def linear() -> Line:
    """The linear filter on positions computed from angle and range."""
    from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

    wanted = [f"{name}_lin" for name in STATE]
    frame = kf.evaluate(cannonball)
    seen = np.ascontiguousarray(frame[["x_obs", "y_obs"]])
    seen[0] = np.nan  # the start uses no observation
    peer = KalmanFilter(k_endog=2, k_states=4, k_posdef=4)
    peer.bind(seen)
    start, P = flights.start()
    peer["design"] = np.eye(4)[[0, 2]]
    peer["transition"], peer["selection"] = flights.F, np.eye(4)
    peer["state_intercept"] = flights.FALL[:, None]
    spread = np.zeros((2, 2, len(frame)))
    spread[0, 0], spread[1, 1] = frame["r_x"].fillna(1.0), frame["r_y"].fillna(1.0)
    peer["obs_cov"] = spread
    peer.initialize_known(start, P)
    assert np.allclose(peer.filter().filtered_state.T, frame[wanted], rtol=1e-6, atol=1e-3)
    kf.warm_up(cannonball, wanted)
    times = in_turn(lambda: kf.evaluate(cannonball, columns=wanted), peer.filter, calls=[50, 1])
    return Line("one linear filter, 1,320 steps: statsmodels", *times)


def short() -> Line:
    """One axis of the shuttlecock, 27 frames."""
    import pykalman

    axis = Axis()
    peer = pykalman.KalmanFilter(axis.A, axis.H, axis.Q, axis.r, None, None, axis.mean, axis.P)
    frame = kf.evaluate(shuttlecock)
    seen = frame["x_obs"].to_numpy()[1:]
    assert np.allclose(peer.filter(seen)[0], frame[AXIS][1:], rtol=1e-9, atol=1e-9)
    kf.warm_up(shuttlecock, AXIS)
    times = in_turn(
        lambda: kf.evaluate(shuttlecock, columns=AXIS), lambda: peer.filter(seen), calls=[50, 1]
    )
    return Line("one axis of the shuttlecock, 27 frames: pykalman", *times)


AXIS = ["x_a", "vx_a", "ax_a"]


class Axis:
    """The filter of the shuttlecock's x in matrices, and the forecast of frame 1."""

    def __init__(self) -> None:
        run = kf.evaluate(shuttlecock)
        values = {**run.attrs["parameters"], **run.attrs["scalars"]}
        model = joint_model(shuttlecock, "x")
        self.A, self.Q = (
            np.array(matrix.subs({s: values[s.name] for s in matrix.free_symbols}), dtype=float)
            for matrix in (model.F, model.Q)
        )
        self.H, self.r = np.array([[1.0, 0, 0]]), np.array([[values["r_obs"]]])
        self.mean = self.A @ run[AXIS].to_numpy()[0]
        start = np.diag(run[["P_xx_a", "P_vxvx_a", "P_axax_a"]].to_numpy()[0])
        self.P = self.A @ start @ self.A.T + self.Q


def compile_time(columns: list[str] | None) -> tuple[float, float]:
    """Seconds of compiling a kernel with an empty cache, and of loading it in a second process."""
    program = (
        "import time, kfsheet as kf\n"
        "from kfsheet.exercises.cannonball import cannonball as m\n"
        "kf.evaluate(m); t = time.perf_counter()\n"
        f"kf.warm_up(m, {columns}); print(time.perf_counter() - t)"
    )
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "KFSHEET_CACHE": cache}

        def once() -> float:
            command = [sys.executable, "-c", program]
            done = subprocess.run(
                command, env=environment, capture_output=True, text=True, check=True
            )
            return float(done.stdout)

        return once(), once()
