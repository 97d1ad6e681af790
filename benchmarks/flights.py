"""The cannon-ball, 1,320 steps of the extended filter: by hand, by filterpy, in C."""

import ctypes
import math
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

HERE = Path(__file__).parent
ROWS = 1320
STATE = ["x_a", "vx_a", "y_a", "vy_a"]
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


def c_compiler() -> str | None:
    """Path of a C compiler."""
    return next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)


@cache
def c_library() -> ctypes.CDLL | None:
    """The hand-written loops, compiled; None without a C compiler."""
    compiler = c_compiler()
    if compiler is None:
        return None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        target = str(Path(folder) / "cannonball.so")
        flags = ["-O3", "-march=native", "-fopenmp", "-shared", "-fPIC"]
        source = str(HERE / "cannonball.c")
        subprocess.run([compiler, *flags, "-o", target, source, "-lm"], check=True)
        return ctypes.CDLL(target)


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """Where an array begins."""
    return array.ctypes.data_as(ctypes.c_void_p)


def one_by_c(frame: pd.DataFrame) -> Callable[[], None] | None:
    """One flight in C, for the draws of a run; None without a C compiler."""
    c = c_library()
    if c is None:
        return None
    found = np.empty((5, ROWS))
    draws = [np.ascontiguousarray(frame[n]) for n in ("n_theta", "n_r")]

    def fly() -> None:
        c.fly(ROWS, *map(pointer, draws), pointer(found))

    fly()
    assert np.allclose(found[:4].T, frame[STATE], rtol=1e-7, atol=1e-4)
    return fly
