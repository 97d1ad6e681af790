"""kfsheet: a Kalman filter derived once, evaluated, written as a workbook, checked and taught.

``t`` is the row of a recurrence, a SymPy symbol: ``x[t - 1]`` is the cell above ``x[t]``.
The public names stand in ``__init__.pyi``, which type checkers read too; each is imported when it
is first used, so that ``import kfsheet`` is quick.
"""

import lazy_loader

__version__ = "0.2.0"
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__.append("__version__")
