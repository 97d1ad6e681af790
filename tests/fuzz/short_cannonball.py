"""The cannon-ball with 66 sweeps two seconds apart: as many kinds of rows as the long table."""

import csv
import tempfile
from dataclasses import replace
from pathlib import Path

from kfsheet.exercises.cannonball.model import DATA, build_model
from kfsheet.exercises.cannonball.model import exercise as long

ROWS = 66

with tempfile.TemporaryDirectory() as folder:
    table = Path(folder) / "draws.csv"
    with (DATA / "cannonball_draws.csv").open(newline="") as draws, table.open("w") as short:
        csv.writer(short).writerows(list(csv.reader(draws))[: ROWS + 1])
    model = build_model(table)
exercise = replace(long, model=model, vary={**long.vary, "dt": (2.0, 2.2)})
