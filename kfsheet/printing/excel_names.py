"""Which names Excel takes, and how far its worksheets go."""

from __future__ import annotations

import re

from openpyxl.utils import column_index_from_string

LAST_COLUMN = 16_384  # XFD
LAST_ROW = 1_048_576


def excel_name_problem(name: str) -> str | None:
    """Why Excel cannot take ``name`` as the name of a cell; None if it can."""
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_.]*", name) or len(name) > 255:
        return "a name in Excel is a letter followed by letters, digits, underscores and dots"
    if re.fullmatch(r"(?i)r\d*c?\d*|c\d*", name):
        return f"Excel reads {name} as a row or a column; add an underscore, as in {name}_"
    if name.upper() in {"TRUE", "FALSE"}:
        return f"Excel reads {name} as a truth value"
    cell = re.fullmatch(r"([A-Za-z]{1,3})(\d+)", name)
    if cell and _column(cell[1]) <= LAST_COLUMN and 1 <= int(cell[2]) <= LAST_ROW:
        return f"Excel reads {name} as a cell; write {cell[1]}_{cell[2]}"
    return None


def _column(letters: str) -> int:
    return column_index_from_string(letters) if len(letters) < 3 or letters.upper() <= "ZZZ" else 0
