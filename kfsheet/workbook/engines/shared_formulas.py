"""Formulas that are filled down, written once.

Excel cannot share a formula that refers to another worksheet, so that in our workbooks each such
cell has its own. IronCalc can, and reads a shared formula at once: the copy that it is given shares
every formula that is the one above, filled down. What references move is read here as our own
formulas are written; a formula that holds anything else is left alone.
"""

from __future__ import annotations

import re
from itertools import count

RELATIVE = re.compile(rb"(?<![\w.$])(\$?[A-Z]{1,3})([1-9][0-9]*)(?![\w.(!])")
"""A reference whose row moves when a formula is filled down."""
UNSURE = re.compile(
    rb"[^ -~]|[\[\]{}@#'\\]|&(?!amp;|lt;|gt;|quot;)"  # texts, tables, other alphabets, entities
    rb"|(?<![\w.$])\$?(?=[A-Z]*[a-z])[A-Za-z]{1,3}\$?[0-9]"  # a1, which is A1
    rb"|(?<![\w.$])\$?(?:XF[E-Z]|X[G-Z][A-Z]|[YZ][A-Z]{2})\$?[0-9]"  # YAW1, a name: columns end
    rb"|(?<![\w.$])\$?[A-Z]{1,3}\$?0[0-9]"  # A01, which is A1
    rb"|[0-9]:\$?[0-9]"  # 5:5, a whole row
    rb"|[0-9]{7}"  # rows near the end of a worksheet
)
"""What this module does not read as a spreadsheet does, or might not."""
FIRST = 1_000_000_000  # number of a group; those that are in a file count from 0


def share_formulas(xml: bytes) -> bytes:
    r"""A worksheet in which formulas that are filled down are shared.

    IronCalc does not ask how far a group reaches; the file is for no other program.

    >>> column = b'<c r="B1"><f>A!C1+$D$1</f></c> <c r="B2"><f>A!C2+$D$1</f></c>'
    >>> print(share_formulas(column).decode().replace("> <", ">\n<"))
    <c r="B1"><f t="shared" ref="B1" si="1000000000">A!C1+$D$1</f></c>
    <c r="B2"><f t="shared" si="1000000000"/></c>
    """
    groups: dict[bytes, tuple[bytes, list[int], int]] = {}
    numbers = count(FIRST)
    # Twice as quick as a regular expression that looks for cells.
    before, *parts = xml.split(b"><f>")
    pieces = [before]
    for part in parts:
        text, end, after = part.partition(b"</f>")
        column, row = _address(before)
        known = groups.get(column)
        if known and text == known[0] % tuple([row + back for back in known[1]]):
            pieces.append(b'><f t="shared" si="%d"/>' % known[2])
        elif column and (pattern := _pattern(text, row)):
            groups[column] = *pattern, (si := next(numbers))
            pieces.append(b'><f t="shared" ref="%s%d" si="%d">%s</f>' % (column, row, si, text))
        else:
            pieces += [b"><f>", text, end]
        pieces.append(after)
        before = after
    return b"".join(pieces)


def _address(before: bytes) -> tuple[bytes, int]:
    """Column and row of a cell, from what stands before its formula; b"" if they do not."""
    address, _, more = before[before.rfind(b' r="') + 4 :].partition(b'"')
    column = address.rstrip(b"0123456789")
    row = address[len(column) :]
    return (column, int(row)) if column.isalpha() and row and b"<" not in more else (b"", 0)


def _pattern(text: bytes, row: int) -> tuple[bytes, list[int]] | None:
    """A formula with a place for every row that moves, and how far each is from the cell's own.

    None if it is not certain which references move, as within a text in quotes none does.
    """
    if UNSURE.search(text) or b'"' in text.replace(b"&quot;", b'"').replace(b'""', b""):
        return None
    back: list[int] = []

    def place(match: re.Match[bytes]) -> bytes:
        back.append(int(match[2]) - row)
        return match[1] + b"%d"

    return RELATIVE.sub(place, text.replace(b"%", b"%%")), back
