"""``python -m kfsheet``."""

import sys

from kfsheet.cli import main

if __name__ == "__main__":
    sys.exit(main())
