"""Write a workbook of as many rows as asked for; print the seconds and the peak megabytes."""

import sys
import time

import numpy as np
from measuring import peak
from sympy import Matrix, Symbol

import kfsheet as kf
from kfsheet.workbook.write.write_workbook import workbook_bytes


def walk(rows: int) -> kf.Exercise:
    """A body whose velocity walks at random, seen in every row: a filter of two states."""
    noise = np.random.RandomState(1).standard_normal(rows)
    m = kf.Recurrence("walk", title="A random walk")
    dt = m.parameter("dt", 0.1, "s", "time step", sign="positive")
    q = m.parameter("q", 1.0, "m2/s3", "spectral density of the noise", sign="positive")
    r = m.parameter("r_x", 1.0, "m2", "variance of the observation", sign="positive")
    seen = m.data("x_obs", noise.cumsum(), "m", "observed position", section="Data")
    x, v = Symbol("x"), Symbol("vx")
    state = {
        x: kf.State("m", "position", m.parameter("x_0", 0, "m", "start"), r),
        v: kf.State("m/s", "velocity", m.parameter("v_0", 0, "m/s", "start"), q * dt),
    }
    Q = Matrix([[q * dt**3 / 3, q * dt**2 / 2], [q * dt**2 / 2, q * dt]])
    observation = kf.Observation("x", seen[kf.t], x, r, "m")
    kf.add_filter(m, kf.StateSpace(state, [x + v * dt, v], Q, [observation]), section="Filter")
    return kf.Exercise(model=m, about=("A long table.",), source="benchmarks")


if __name__ == "__main__":
    exercise = walk(int(sys.argv[1]))
    began = time.perf_counter()
    workbook_bytes(exercise)
    print(time.perf_counter() - began, peak())
