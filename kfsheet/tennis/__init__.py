"""The former name of :mod:`kfsheet.exercises.tennis.methods`, for one release."""

import sys
from importlib import import_module
from pkgutil import iter_modules
from warnings import warn

from kfsheet.exercises.tennis import methods

warn(
    "kfsheet.tennis is now kfsheet.exercises.tennis.methods; the old name goes with 0.3.0",
    DeprecationWarning,
    stacklevel=2,
)
for _module in iter_modules(methods.__path__):
    # The very same modules under both names: a Camera of one is a Camera of the other.
    _found = import_module(f"{methods.__name__}.{_module.name}")
    sys.modules[f"{__name__}.{_module.name}"] = globals()[_module.name] = _found
