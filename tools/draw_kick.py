"""Draw the football's photos anew: the first kick that is typical, into its two data files.

python tools/draw_kick.py
"""

import numpy as np

from kfsheet.exercises.football import DATA, football
from kfsheet.exercises.football.kick import flight
from kfsheet.exercises.football.typical import SEED, first_typical_seed, photos_of
from kfsheet.files import write_file


def tables(seed: int) -> dict[str, str]:
    """The contents of the data files, by name."""
    p = football.defaults()
    x, z = (np.round(axis, 6) for axis in flight(p))
    camera, truth = ["photo,t,i,j"], ["photo,t,x,z"]
    for k, (i, j) in enumerate(zip(*photos_of(seed).values(), strict=True)):
        camera.append(f"{k},{k * p['dt']:.1f},{i:.1f},{j:.1f}")
        truth.append(f"{k},{k * p['dt']:.1f},{x[k]:.6f},{z[k]:.6f}")
    lines = {"football_camera.csv": camera, "football_truth.csv": truth}
    return {name: "\n".join([*text, ""]) for name, text in lines.items()}


def main() -> None:
    """Find the seed, say how many were tried, and write."""
    seed = first_typical_seed()
    print(f"{seed + 1} kicks tried, seed {seed} is typical; kfsheet says {SEED}")
    for name, text in tables(seed).items():
        write_file(DATA / name, text.encode())


if __name__ == "__main__":
    main()
