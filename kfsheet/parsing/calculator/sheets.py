"""A whole workbook, calculated from its formulas, cell by cell as values are asked for.

A cell that needs another one which is not calculated yet is put aside until that one is: chains of
any length fit, since nothing here calls itself from cell to cell. What leads back to a cell that
was put aside is a circle, and all cells of it are #CIRC!.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from kfsheet.errors import KfsheetError
from kfsheet.parsing.calculator.arithmetic import DOUBLES, Arithmetic
from kfsheet.parsing.calculator.broadcasting import intersect
from kfsheet.parsing.calculator.program import compiled, foreign, reference_program
from kfsheet.parsing.calculator.values import (
    EMPTY,
    Area,
    CellsNeededError,
    Context,
    Error,
    Program,
    Scalar,
    TooMuchWorkError,
    Value,
    is_reference,
)
from kfsheet.parsing.formula import parse_formula, relative_tree
from kfsheet.parsing.references import Address, Cell, relative_key

WORK = 1_000_000
"""Operations that one cell may take."""
DEEPEST = 1_000
"""How often a formula may find out that it needs one more cell."""


class Formula(NamedTuple):
    """The formula in a cell.

    Attributes
    ----------
    text : str
        As it stands in the cell ``host``, which is another one where a formula is shared.
    area : (top, left, bottom, right), optional
        The cells that an array formula fills.
    dynamic : bool
        Whether an array spills as far as it goes.
    """

    text: str
    host: Cell
    area: tuple[int, int, int, int] | None = None
    dynamic: bool = False


Content = Formula | float | bool | str
Name = str | tuple[str, str]
"""A name of the workbook, or a worksheet and a name of its own."""


@dataclass
class _Work:
    """A cell that is being calculated."""

    address: Address
    waiting: list[Address] = field(default_factory=list)
    """Cells that it needs."""
    lowest: int | None = None
    """In a circle: how far down the pile of cells put aside it reaches."""


class _Layers(dict[Cell, Scalar]):
    """Cells by place: those that are known, and below them what others say of theirs."""

    def __init__(self, *below: Mapping[Cell, Scalar]) -> None:
        super().__init__()
        self._below = below

    def __missing__(self, cell: Cell) -> Scalar:
        for layer in self._below:
            try:
                value = self[cell] = layer[cell]
            except KeyError:
                continue
            return value
        raise KeyError(cell)

    def knows(self, cell: Cell) -> bool:
        """Whether a cell has a value, in whatever layer."""
        try:
            self[cell]
        except KeyError:
            return False
        return True


class SheetCalculator:
    """Values of the cells of a workbook.

    Parameters
    ----------
    sheets : mapping
        ``sheets[title][row, column]``: a number, a text, a truth value or a :class:`Formula`.
    names : mapping, optional
        What defined names stand for, as text: ``{"dt": "Parameters!$C$5", ("Lab", "g"): "9.81"}``;
        a worksheet's own name wins on that worksheet.
    arithmetic : Arithmetic, optional
        What to calculate with.

    Examples
    --------
    >>> book = SheetCalculator({"S": {(1, 1): 3.0, (2, 1): Formula("=-A1^2", (2, 1))}})
    >>> book.value(("S", 2, 1))
    9.0
    >>> book.with_changes({("S", 1, 1): 4.0}).value(("S", 2, 1))
    16.0
    """

    def __init__(
        self,
        sheets: Mapping[str, Mapping[Cell, Content]],
        names: Mapping[Name, str] | None = None,
        arithmetic: Arithmetic = DOUBLES,
        *,
        parse: Callable[[str], tuple] = parse_formula,
        work: int = WORK,
    ) -> None:
        self._contents = {title: dict(cells) for title, cells in sheets.items()}
        self._titles = {title.lower(): title for title in sheets}
        self._names = {_key(name): text for name, text in (names or {}).items()}
        self._parse, self._work = parse, work
        self._programs: dict[Address, tuple[Formula, Program]] = {}
        self._trees: dict[str, tuple] = {}
        self._named: dict[tuple[str, str], Program] = {}
        self._parts = self._parts_of_arrays()
        self._spillers = [
            (title, *cell)
            for title, cells in self._contents.items()
            for cell, content in cells.items()
            if isinstance(content, Formula) and content.dynamic and not content.area
        ]
        self._start(arithmetic)

    def _start(self, arithmetic: Arithmetic) -> None:
        places = [cell for cells in self._contents.values() for cell in cells]
        extent = (max((r for r, _ in places), default=1), max((c for _, c in places), default=1))
        self._constants: dict[str, dict[Cell, Scalar]] = {
            title: {
                cell: arithmetic.from_float(float(content)) if type(content) in (int, float)
                else content
                for cell, content in cells.items()
                if not isinstance(content, Formula) and (title, *cell) not in self._parts
            }
            for title, cells in self._contents.items()
        }  # fmt: skip
        self._values = {title: _Layers(cells) for title, cells in self._constants.items()}
        self._arithmetic, self._extent = arithmetic, extent
        self._forget()

    def _forget(self) -> None:
        """Nothing is calculated yet."""
        self._arrays: dict[Address, Value] = {}
        self._unread: dict[Address, KfsheetError] = {}
        self._roots: dict[Address, Address] = {}
        self._pile: list[_Work] = []
        self._aside: dict[Address, int] = {}
        self._context = Context(
            cell=self._cell,
            name=self._name,
            arithmetic=self._arithmetic,
            extent=self._extent,
            sheets=tuple(self._contents),
            formula_at=lambda *address: isinstance(self._content(address), Formula),
            spilled=self._spilled,
        )

    def _parts_of_arrays(self) -> dict[Address, Address]:
        """The cells that array formulas fill, and where these stand."""
        parts: dict[Address, Address] = {}
        for title, cells in self._contents.items():
            for cell, content in cells.items():
                if isinstance(content, Formula) and content.area:
                    top, left, bottom, right = content.area
                    for row in range(top, min(bottom, top + 10_000) + 1):
                        for column in range(left, min(right, left + 1_000) + 1):
                            parts[title, row, column] = (title, *cell)
        return parts

    def with_changes(self, changes: Mapping[Address, Scalar]) -> SheetCalculator:
        """The same workbook with other contents in some cells; None empties one."""
        other = object.__new__(SheetCalculator)
        other.__dict__.update(self.__dict__)
        other._contents = dict(self._contents)
        for title in {self._title(address[0]) for address in changes}:
            other._contents[title] = dict(self._contents[title])
        for (sheet, *cell), content in changes.items():
            cells = other._contents[self._title(sheet)]
            if content is EMPTY:
                cells.pop(tuple(cell), None)
            else:
                cells[tuple(cell)] = content
        other._parts = other._parts_of_arrays()
        other._start(self._context.arithmetic)
        return other

    def with_values(self, values: Mapping[str, Mapping[Cell, Scalar]]) -> SheetCalculator:
        """The same workbook where some cells have values, whatever formulas stand in them.

        :meth:`formula_value` says what such a cell's formula would give. Values are asked for cell
        by cell as they are needed, and may be made then.
        """
        other = object.__new__(SheetCalculator)
        other.__dict__.update(self.__dict__)
        other._values = {
            title: _Layers(values.get(title, {}), cells) for title, cells in self._constants.items()
        }
        other._forget()
        return other

    def is_formula(self, address: Address) -> bool:
        """Whether a formula fills a cell, be it one of an array."""
        return address in self._parts or isinstance(self._content(address), Formula)

    def formula_value(self, address: Address, formula: Formula | None = None) -> Scalar:
        """What the formula that fills a cell gives there, whatever value the cell has; see value.

        Cells that it reads and that have values keep them, its own cell among them. Another
        ``formula`` may be asked for, as if it stood there.
        """
        master = address if formula else self._parts.get(address, address)
        for _ in range(DEEPEST):
            try:
                value = self._run(master, formula) if formula else self._evaluate(master)
                break
            except CellsNeededError as needed:
                for cell in needed.addresses:
                    self._calculate(cell)
                self._pile, self._aside = [], {}
        else:
            raise TooMuchWorkError("the formula needs too many cells, one after the other")
        return value if master == address else _element(self._arrays[master], address, master)

    def value(self, address: Address) -> Scalar:
        """The value of a cell; EMPTY if there is nothing in it.

        Raises
        ------
        FormulaError
            If its formula, or one that it needs, cannot be read or calculated, or takes more work
            than a formula may.
        ForbiddenError
            If it needs a function that no formula may use.
        """
        address = (self._title(address[0]), *address[1:])
        known = self._values[address[0]]
        if not known.knows(address[1:]) and address not in self._unread:
            self._calculate(address)
        if address in self._unread:
            raise self._unread[address]
        return known[address[1:]]

    def _title(self, sheet: str) -> str:
        title = self._titles.get(sheet.lower())
        if title is None:
            raise KeyError(f"there is no worksheet {sheet!r}")
        return title

    def _content(self, address: Address) -> Content | None:
        return self._contents.get(address[0], {}).get(tuple(address[1:]))

    # -- what a formula sees ------------------------------------------------------------

    def _cell(self, sheet: str, row: int, column: int) -> Scalar:
        try:
            value = self._values[sheet][row, column]
        except KeyError:
            return self._unknown_cell(sheet, row, column)
        if value is Error.CIRC:
            self._touch((sheet, row, column))
        return value

    def _unknown_cell(self, sheet: str, row: int, column: int) -> Scalar:
        if sheet not in self._values:
            title = self._titles.get(sheet.lower())
            return Error.REF if title is None else self._cell(title, row, column)
        address = (sheet, row, column)
        if address in self._unread:
            raise self._unread[address]
        if address in self._aside:
            self._close_circle(self._aside[address])
            return Error.CIRC
        if address in self._parts or isinstance(self._content(address), Formula):
            raise CellsNeededError([address])
        self._ask_spillers(address)
        return self._values[sheet].setdefault((row, column), EMPTY)

    def _ask_spillers(self, address: Address) -> None:
        """An empty cell may be filled by an array that spills from above or from the left."""
        sheet, row, column = address
        before = [
            a for a in self._spillers
            if a[0] == sheet and a[1] <= row and a[2] <= column and a not in self._aside
            and not self._values[sheet].knows(a[1:]) and a not in self._unread
        ]  # fmt: skip
        if before:
            raise CellsNeededError(before)

    def _name(self, sheet: str | None, name: str) -> Value:
        key = (sheet or self._context.host[0], name)
        run = self._named.get(key)
        if run is None:
            run = self._named[key] = self._read_name(*key)
        return run(self._context)

    def _read_name(self, sheet: str, name: str) -> Program:
        key = name.lower()
        text = self._names.get((sheet.lower(), key), self._names.get(key))
        if text is None:
            return lambda c: Error.NAME
        # Excel keeps relative names as they would stand in the cell A1.
        tree = relative_tree(_without_foreign(self._parse(text)), (1, 1))
        return _constant(tree) or reference_program(tree)

    def _spilled(self, sheet: str, row: int, column: int) -> Value:
        """The area that an array fills, from the cell that holds its formula: A1#."""
        self._cell(sheet, row, column)
        address = (self._title(sheet), row, column)
        content = self._content(address)
        if isinstance(content, Formula) and content.area:
            return Area(address[0], *content.area)
        array = self._arrays.get(address)
        if type(array) is not tuple:
            return Error.REF
        return Area(address[0], row, column, row + len(array) - 1, column + len(array[0]) - 1)

    # -- one cell after the other -------------------------------------------------------

    def _calculate(self, address: Address) -> None:
        """Calculate a cell and, first, what it needs."""
        self._pile, self._aside = [], {}
        self._put_on(address)
        with self._context.arithmetic.precise():
            self._work_off()

    def _work_off(self) -> None:
        while self._pile:
            top = self._pile[-1]
            if top.waiting:
                following = top.waiting.pop()
                known = self._values[following[0]].knows(following[1:])
                if not known and following not in self._unread and following not in self._aside:
                    self._put_on(following)
                continue
            try:
                value = self._evaluate(top.address)
            except CellsNeededError as needed:
                top.waiting = needed.addresses[::-1]
            except (KfsheetError, RecursionError) as error:
                self._unread[top.address] = _readable(error)
                self._take_off()
            else:
                self._finish(top, value)

    def _put_on(self, address: Address) -> None:
        self._aside[address] = len(self._pile)
        self._pile.append(_Work(address))

    def _take_off(self) -> None:
        del self._aside[self._pile.pop().address]

    def _finish(self, done: _Work, value: Scalar) -> None:
        sheet, *cell = done.address
        if done.lowest is not None:
            value = Error.CIRC
            self._roots[done.address] = self._pile[done.lowest].address
            self._arrays.pop(done.address, None)
        self._values[sheet][tuple(cell)] = value
        self._take_off()

    def _close_circle(self, start: int) -> None:
        """All cells put aside since ``start`` lie in a circle."""
        for work in self._pile[start:]:
            work.lowest = start if work.lowest is None else min(work.lowest, start)

    def _touch(self, address: Address) -> None:
        """Whoever reads a cell of a circle that is not finished lies in it, too."""
        root = self._roots.get(address)
        if root in self._aside:
            self._close_circle(self._aside[root])

    def _evaluate(self, address: Address) -> Scalar:
        sheet, *cell = address
        content = self._contents[sheet].get(tuple(cell))
        if address in self._parts and self._parts[address] != address:
            master = self._parts[address]
            self._cell(*master)  # it comes first
            return _element(self._arrays.get(master, Error.CIRC), address, master)
        if not isinstance(content, Formula):
            self._ask_spillers(address)
            values = self._values[sheet]
            return values[tuple(cell)] if values.knows(tuple(cell)) else EMPTY
        return self._run(address, content)

    def _run(self, address: Address, formula: Formula) -> Scalar:
        context = self._context
        context.host, context.work, context.variables = address, self._work, {}
        value = self._program(address, formula)(context)
        if formula.area or (formula.dynamic and type(value) is tuple):
            return self._spread(address, formula, value)
        if is_reference(value) or type(value) is tuple:
            value = intersect(context, value)
        return context.arithmetic.from_float(0.0) if value is EMPTY else value

    def _program(self, address: Address, formula: Formula) -> Program:
        """Compiled once for each pattern, and looked up once for each cell."""
        known = self._programs.get(address)
        if known is None or known[0] is not formula:
            key = relative_key(formula.text, formula.host)
            tree = self._trees.get(key)
            if tree is None:
                tree = relative_tree(_without_foreign(self._parse(formula.text)), formula.host)
                self._trees[key] = tree
            run = compiled(tree, bool(formula.area) or formula.dynamic)
            known = self._programs[address] = formula, run
        return known[1]

    def _spread(self, address: Address, formula: Formula, value: Value) -> Scalar:
        """Keep an array for the cells that it fills; the value of the first one."""
        zero = self._context.arithmetic.from_float(0.0)
        if type(value) is tuple:
            value = tuple(tuple(zero if x is EMPTY else x for x in row) for row in value)
        self._arrays[address] = value
        if not formula.area:
            sheet, top, left = address
            places = [(top + y, left + x) for y in range(len(value)) for x in range(len(value[0]))]
            if any(place in self._contents[sheet] for place in places[1:]):
                self._arrays[address] = Error.SPILL
                return Error.SPILL
            for y, x in places[1:]:
                self._values[sheet][y, x] = value[y - top][x - left]
        return _element(value, address, address)


def _readable(error: Exception) -> KfsheetError:
    if isinstance(error, KfsheetError):
        return error
    return TooMuchWorkError("the formula is nested too deep")


def _key(name: Name) -> Name:
    return name.lower() if isinstance(name, str) else (name[0].lower(), name[1].lower())


def _element(value: Value, address: Address, master: Address) -> Scalar:
    """What of an array stands in one of the cells that an array formula fills."""
    if type(value) is not tuple:
        return value
    y = address[1] - master[1] if len(value) > 1 else 0
    x = address[2] - master[2] if len(value[0]) > 1 else 0
    return value[y][x] if y < len(value) and x < len(value[0]) else Error.NA


def _without_foreign(tree: tuple) -> tuple:
    """The tree with whole columns, rows and sheets as references, which know distances."""
    if tree[0] == "foreign":
        return foreign(tree[1])
    if tree[0] == "reference" and ":" in (tree[1].sheet or ""):
        return ("sheets", *tree[1].sheet.split(":", 1), tree)
    return tuple(_without_foreign(p) if isinstance(p, tuple) else p for p in tree)


def _constant(tree: tuple) -> Program | None:
    """A name of a fixed place, which most names are: it need not be calculated."""
    if tree[0] != "reference" or tree[1].name or not tree[1].sheet:
        return None
    first, last = tree[1].first, tree[1].last or tree[1].first
    if not all((first.row_fixed, first.column_fixed, last.row_fixed, last.column_fixed)):
        return None
    rows, columns = sorted((first.row, last.row)), sorted((first.column, last.column))
    area = Area(tree[1].sheet, rows[0], columns[0], rows[1], columns[1])
    return lambda c: area
