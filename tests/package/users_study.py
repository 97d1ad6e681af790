"""What a user may write about one run and about many, for a type checker to read."""

from typing import assert_type

import pandas as pd

from kfsheet import NEES, Draws, Study, evaluate, study
from kfsheet.exercises.cannonball import cannonball

run = evaluate(cannonball, r=4)
assert_type(run, pd.DataFrame)
many = study(
    cannonball,
    members=100,
    data=Draws("n_theta", "n_r", seed=1),
    columns=["NIS"],
    nees={"NEES": NEES(("x", "vx", "y", "vy"))},
)
assert_type(many, Study)
assert_type(many.rows["NIS"], pd.DataFrame)
