"""The former name of :mod:`kfsheet.exercises.tennis.methods`, for one release."""

import sys
from importlib import import_module
from pkgutil import iter_modules
from warnings import warn

from kfsheet.exercises import tennis
from kfsheet.exercises.tennis import methods

warn(
    "kfsheet.tennis is now kfsheet.exercises.tennis.methods; the old name goes with 0.3.0",
    DeprecationWarning,
    stacklevel=2,
)
_HOMES = {
    module.name: f"{methods.__name__}.{module.name}" for module in iter_modules(methods.__path__)
}
_HOMES |= {
    "charts": f"{tennis.__name__}.charts",
    "inputs": f"{methods.__name__}.arguments",
    "sheets": f"{tennis.__name__}.calculators",
    "track": f"{tennis.__name__}.track",
}
for _name, _home in _HOMES.items():
    # The very same modules under both names: a Camera of one is a Camera of the other.
    _found = import_module(_home)
    sys.modules[f"{__name__}.{_name}"] = globals()[_name] = _found
