"""Answers that are computed from themselves, through other answers and what follows from them."""

from __future__ import annotations

from openpyxl.utils import get_column_letter
from sympy import Indexed

from kfsheet.coursework.judging.formula_meaning import Interpreter
from kfsheet.coursework.judging.precise_values import cell_of
from kfsheet.coursework.reading.cell_addresses import CellAddresses
from kfsheet.errors import ForbiddenError, FormulaError

MOST = 500  # cells that are looked at

Node = tuple[str, int]
"""Name of a column and step, or of a derived scalar and 0."""


def circular_reference(
    interpreter: Interpreter, addresses: CellAddresses, name: str, step: int
) -> list[str]:
    """Addresses from an answer back to itself; empty if there is no such circle."""
    start: Node = (name, step)
    paths, seen = [[start]], set()
    while paths and len(seen) < MOST:
        path = paths.pop()
        for node in _read_by(interpreter, addresses, *path[-1]):
            if node == start:
                return [_address(addresses, n) for n in [*path, start]]
            if node not in seen:
                seen.add(node)
                paths.append([*path, node])
    return []


def _address(addresses: CellAddresses, node: Node) -> str:
    address = addresses.of(*node)
    return f"{get_column_letter(address[2])}{address[1]}" if address else node[0]


def _read_by(
    interpreter: Interpreter, addresses: CellAddresses, name: str, step: int
) -> list[Node]:
    """What the formula in a cell reads: the student's, or the one that was given."""
    address = addresses.of(name, step)
    try:
        meaning = address and interpreter.meaning(address, step)
    except (FormulaError, ForbiddenError):
        return []
    if not meaning:
        return []
    model, e = interpreter.model, meaning.expression
    scalars = {(s.name, 0) for s in e.free_symbols if s.name in model.derived_scalars}
    read = map(cell_of, e.atoms(Indexed))
    cells = {(column, place if fixed else step - place) for column, fixed, place in read}
    return sorted(scalars | {n for n in cells if n[0] in model.table and 0 <= n[1] < model.rows})
