"""What a cell means: its formula as a SymPy expression of parameters, data and columns.

Helper cells and names are followed until only those remain. The expression is the same object for
every row of a formula that was filled down, since references are taken as distances from the row
that is asked for; so each formula is read once, for all rows and all students.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

from sympy import Basic, Integer, S

from kfsheet.coursework.reading.cell_addresses import CellAddresses, find_sheet
from kfsheet.coursework.reading.submission import Book
from kfsheet.coursework.reading.worksheet import Formula
from kfsheet.errors import ForbiddenError, FormulaError
from kfsheet.model.expressions import Missing, t
from kfsheet.model.recurrence import Recurrence
from kfsheet.parsing.formula import number, references, relative_tree, tree_to_sympy
from kfsheet.parsing.functions import as_number
from kfsheet.parsing.references import Address, Reference, relative_key
from kfsheet.parsing.syntax import Tree, parse_formula

DANGEROUS = sorted(
    "WEBSERVICE HYPERLINK INDIRECT DDE RTD CALL REGISTER.ID FILTERXML IMAGE IMPORTXML IMPORTDATA "
    "IMPORTHTML IMPORTRANGE IMPORTFEED CUBEVALUE EXEC SQL.REQUEST".split()
)
REACHES_OUT = re.compile(rf"(?<![\w.])(?:_XLFN\.)?({'|'.join(map(re.escape, DANGEROUS))})\s*\(")
LINK = re.compile(r"\[\d+\]")
DISTANCE = re.compile(r"\{[^{}]*\}")
DEEPEST_HELPERS = 40  # helper cell upon helper cell
LARGEST = 3_000  # nodes of an expression, helpers written out
WIDEST = 64  # cells of a range that is no whole column

Slot = tuple
"""What a reference means, hashable: ``("column", name, lag)``, ``("scalar", name)``, ..."""


class Meaning(NamedTuple):
    """An expression, and whether a reference in it is fixed to one row."""

    expression: Basic
    fixed_rows: tuple[int, ...] = ()


class Interpreter:
    """Reads the formulas of one workbook."""

    def __init__(self, book: Book, addresses: CellAddresses) -> None:
        self._book, self._addresses, self.model = book, addresses, addresses.model
        self._open: list[Address] = []
        self._sizes: dict[Slot, int] = {}
        self._scalars: dict[str, Slot] = {}  # names that stand for one, whatever the row

    def meaning(self, address: Address, step: int) -> Meaning | None:
        """What the formula in a cell means in row ``step``; None if it holds no formula.

        Raises
        ------
        FormulaError
            If it cannot be read as mathematics, goes in a circle or grows beyond all limits.
        ForbiddenError
            If it, or a helper cell that it reads, reaches out of the workbook.
        """
        content = self._content(address)
        if not isinstance(content, Formula):
            return None
        signature = self._signature(address, content, step)
        try:
            return _meaning(self.model, signature)
        except RecursionError:  # each formula is within limits, long helpers of helpers are not
            raise FormulaError("the formula with its helper cells is too deep to be read") from None

    def shape(self, address: Address, step: int) -> Slot:
        """The same for formulas that differ only in how far they are from what they refer to.

        Raises
        ------
        FormulaError, ForbiddenError
            As for ``meaning``.
        """
        _, key, slots = self._signature(address, self._content(address), step)
        return (DISTANCE.sub("{}", key), slots)

    def _content(self, address: Address):
        sheet, *cell = address
        return self._book.sheets[sheet].get(tuple(cell))

    def _signature(self, address: Address, formula: Formula, step: int) -> Slot:
        if words := forbidden(formula.text):
            raise ForbiddenError(f"{words} is not allowed")
        if formula.area:
            raise FormulaError("an array formula is not read as mathematics")
        # Helper cells are the student's own: they may lead in a circle, or double at each step.
        if address in self._open:
            raise FormulaError("the formula goes in a circle through its helper cells")
        if len(self._open) >= DEEPEST_HELPERS:
            raise FormulaError(f"helper cells follow each other more than {DEEPEST_HELPERS} times")
        self._open.append(address)
        try:
            key, found = parsed(formula)
            slots = tuple(self._slot(r, address, step) for r in found)
        finally:
            self._open.pop()
        signature = ("formula", key, slots)
        self._sizes[signature] = len(found) + 1 + sum(self._size(slot) for slot in slots)
        if self._sizes[signature] > LARGEST:
            raise FormulaError("the formula with its helper cells is too long to be read")
        return signature

    def _size(self, slot: Slot) -> int:
        if slot[0] == "range":
            return sum(self._size(cell) for row in slot[1] for cell in row)
        return self._sizes.get(slot, 1) if slot[0] == "formula" else 1

    def _slot(self, reference: Reference, host: Address, step: int) -> Slot:
        if reference.name:
            slot = self._scalars.get(reference.name) or self._named(reference, host, step)
            if slot[0] == "scalar":
                self._scalars[reference.name] = slot
            return slot
        sheet = find_sheet(self._book, reference.sheet or host[0])
        if sheet not in self._book.sheets:
            raise FormulaError(f"there is no worksheet {reference.sheet}")
        if reference.last is None:
            fixed = reference.first.row_fixed
            return self._cell((sheet, *reference.first.at(host[1:])), step, fixed)
        whole = self._whole_column(sheet, reference, host)
        if whole:
            return ("whole", whole)
        rows = reference.cells(host[1:], WIDEST)
        return ("range", tuple(tuple(self._cell((sheet, *c), step) for c in row) for row in rows))

    def _named(self, reference: Reference, host: Address, step: int) -> Slot:
        text = self._book.names.get(reference.name.lower())
        if text is None:
            raise FormulaError(f"there is no name {reference.name}")
        formula = Formula(text if text.startswith("=") else f"={text}", (1, 1))
        # A name for one cell is that cell; any other name is a formula of its own.
        key, found = parsed(formula)
        if _trees[key][0][0] == "reference" and not found[0].name:
            return self._slot(found[0], (found[0].sheet or host[0], 1, 1), step)
        return self._signature(("", 0, hash(text)), formula, step)

    def _whole_column(self, sheet: str, reference: Reference, host: Address) -> str | None:
        (top, left), (bottom, right) = (c.at(host[1:]) for c in (reference.first, reference.last))
        first, last = (self._addresses.role((sheet, row, left)) for row in (top, bottom))
        if left != right or not isinstance(first, tuple) or not isinstance(last, tuple):
            return None
        covers = first[0] == last[0] != "t" and (first[1], last[1]) == (0, self.model.rows - 1)
        return first[0] if covers else None

    def _cell(self, address: Address, step: int, fixed: bool = False) -> Slot:
        role = self._addresses.role(address)
        if isinstance(role, str):
            return ("scalar", role)
        if role:
            name, there = role
            return ("fixed", name, there) if fixed else ("column", name, step - there)
        content = self._content(address)
        if isinstance(content, Formula):
            return self._signature(address, content, step)
        if content is None:
            return ("blank",)
        return ("text",) if isinstance(content, str) else ("number", float(content))


@lru_cache(maxsize=20_000)
def forbidden(text: str) -> str | None:
    """What a formula uses that no answer may use, if there is such a thing."""
    # As text, before anything is parsed: also in a branch that is never taken, or in a string.
    upper = text.upper()
    if found := REACHES_OUT.search(upper):
        return found[1]
    if LINK.search(text):
        return "a link to another file"
    return "DDE" if "|" in text and "!" in text else None


_trees: dict[str, tuple[Tree, tuple[Reference, ...]]] = {}
"""Tree and references of a formula by its relative key, for all rows, files and students."""


def parsed(formula: Formula) -> tuple[str, tuple[Reference, ...]]:
    """Key and references of a formula, seen from its cell; equal ones are parsed once.

    Raises
    ------
    FormulaError
        If the text is no formula that can be read as mathematics.
    """
    key = relative_key(formula.text, formula.host)
    if key not in _trees:
        tree = relative_tree(parse_formula(formula.text), formula.host)
        _trees[key] = (tree, tuple(references(tree)))
    return key, _trees[key][1]


@lru_cache(maxsize=20_000)
def _meaning(model: Recurrence, signature: Slot) -> Meaning:
    expression = as_number(_expression(model, signature))
    return Meaning(expression, tuple(sorted(set(_fixed(signature)))))


def _expression(model: Recurrence, signature: Slot) -> Basic:
    _, key, slots = signature
    tree, found = _trees[key]
    meanings = dict(zip(found, slots, strict=True))
    return tree_to_sympy(tree, lambda reference: _value(model, meanings[reference]))


def _value(model: Recurrence, slot: Slot, inside: bool = False):
    kind = slot[0]
    if kind == "formula":
        return _expression(model, slot)
    if kind == "scalar":
        return model[slot[1]]
    if kind == "whole":
        return model[slot[1]]
    if kind == "number":
        return number(slot[1])
    if kind == "range":
        return [[_value(model, cell, inside=True) for cell in row] for row in slot[1]]
    if kind in ("blank", "text"):
        return S.Zero if kind == "blank" and not inside else Missing
    row = Integer(slot[2]) if kind == "fixed" else t - slot[2]
    return row if slot[1] == "t" else model[slot[1]][row]


def _fixed(signature: Slot) -> Iterator[int]:
    """Rows to which references are fixed."""
    if signature[0] == "fixed":
        yield signature[2]
    elif signature[0] == "formula":
        for slot in signature[2]:
            yield from _fixed(slot)
