"""Which names a recurrence may use: Python's, Excel's and the generated source's rules at once."""

from __future__ import annotations

import keyword
import re
from collections.abc import Collection

CHARACTER_CODE = r"_x[0-9A-Fa-f]{1,4}_"  # Excel wants four digits, LibreOffice does with fewer
# The generated Python source, or a keyword of evaluate() or study(), uses these itself.
RESERVED = frozenset(
    "t rows nan sqrt exp log sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh "
    "sign floor ceil abs min max pi observed present mean rms std total count largest smallest "
    "last sumproduct isnan fsum range len zip dict columns scalars model data "
    "members quantiles nees executor compiled".split()
)
OWN_SHEETS = ("Read me", "Parameters", "Charts", "Check", "History", "Questions", "kfsheet")
FORBIDDEN_IN_SHEETS = set("[]:*?/\\'{}!")


def name_problem(name: str) -> str | None:
    """Why ``name`` cannot be a column; None if it can."""
    if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        return "a name is a letter followed by letters, digits and underscores"
    if code := re.search(CHARACTER_CODE, name):
        return f"LibreOffice reads {code[0]} as the code of a character; leave an underscore out"
    if keyword.iskeyword(name):
        return "this is a word of the Python language"
    if name in RESERVED or name.startswith("kfsheet"):
        return "kfsheet uses this name itself"
    return None


def section_problem(name: str, others: Collection[str]) -> str | None:
    """Why a worksheet cannot be called ``name`` beside ``others``; None if it can."""
    if not name.strip() or len(name) > 31:
        return "the name of a worksheet has 1 to 31 characters"
    if bad := FORBIDDEN_IN_SHEETS & set(name):
        return f"the name of a worksheet cannot contain {' '.join(sorted(bad))}"
    twins = {o for o in (*OWN_SHEETS, *others) if o.lower() == name.lower() and o not in others}
    if twins or any(o != name and o.lower() == name.lower() for o in others):
        return "the workbook has another sheet of this name"
    return None
