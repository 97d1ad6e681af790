"""What a user may write, for a type checker to read."""

from pathlib import Path
from typing import assert_type

from sympy import IndexedBase, Matrix, Symbol, diag

import kfsheet
from kfsheet import (
    Exercise,
    Observation,
    Recurrence,
    State,
    StateSpace,
    add_filter,
    check_workbook,
    discrete_noise,
    load_exercise,
    t,
    write_workbook,
)

m = Recurrence("walk", title="A walker, seen once a second", step="second")
dt = m.parameter("dt", 1, "s", "time step", sign="positive")
q = m.parameter("q", 0.1, "m2/s3", "spectral density of the model's noise", sign="positive")
r_z = m.parameter("r_z", 4, "m2", "variance of an observation", sign="positive")
m.time(t * dt, "s", "time")
z_obs = m.data("z_obs", [0.3, 1.9], "m", "seen", section="Data", may_be_missing=True)
assert_type(m, Recurrence)
assert_type(t, Symbol)
assert_type(dt, Symbol)
assert_type(z_obs, IndexedBase)

z, v = Symbol("z", real=True), Symbol("v", real=True)
state = {z: State("m", "position", 0, r_z), v: State("m/s", "velocity", 0, r_z / dt**2)}
noise = discrete_noise(Matrix([[0, 1], [0, 0]]), diag(0, q), dt)
camera = Observation("z", z_obs[t], z, r_z, "m")
add_filter(m, StateSpace(state, [z + v * dt, v], noise, [camera]), section="Filter")

exercise = Exercise(model=m, about=("Change q and r_z.",), source="a lecturer's own")
assert_type(exercise.model, Recurrence)


def build_and_check(folder: Path) -> list[str]:
    """Write the workbook and say what is wrong with it."""
    path = write_workbook(exercise, folder)
    assert_type(path, Path)
    assert_type(load_exercise("football"), Exercise)
    assert_type(kfsheet.__version__, str)
    return check_workbook(path, exercise).lines()
