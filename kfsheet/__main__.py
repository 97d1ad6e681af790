"""``python -m kfsheet``, and the command ``kfsheet``."""

import gc
import sys

from kfsheet.cli.commands import main


def program() -> int:
    """The command line in a process of its own, which ends with it; returns the exit status."""
    gc.set_threshold(100_000, 20, 100)  # a model is many small objects, and all of them stay
    try:
        return main()
    finally:
        gc.freeze()  # what is given up as a whole need not be searched for circles


if __name__ == "__main__":
    sys.exit(program())
