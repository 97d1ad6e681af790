"""A syntax tree as a function of where it stands: operators, references, names and calls.

Each node of a tree becomes a closure of the :class:`Context`. SymPy is not asked: it would cancel
``x/x`` and ``SQRT(x)^2``, which a spreadsheet calculates and which may be errors there.

A formula is compiled for one of two worlds. In an old one a range where one value belongs is the
cell of it in the formula's own row or column (implicit intersection); with ``arrays`` the whole
range is calculated with, as in array formulas and in programs with dynamic arrays.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial

from openpyxl.utils import column_index_from_string

from kfsheet.errors import ForbiddenError
from kfsheet.parsing.calculator import (
    averages,
    criteria,
    line_fits,
    logic,
    lookups,
    mathematics,
    words,
)
from kfsheet.parsing.calculator.broadcasting import broadcast, intersect, lifted
from kfsheet.parsing.calculator.values import (
    EMPTY,
    LARGEST,
    Area,
    Areas,
    Context,
    Error,
    Lambda,
    Program,
    Scalar,
    TooMuchWorkError,
    UnsupportedError,
    Value,
    areas_of,
    compare,
    is_reference,
    number,
    read,
    text,
)
from kfsheet.parsing.references import Corner, Reference
from kfsheet.printing.excel_names import LAST_COLUMN, LAST_ROW

Tree = tuple
FUNCTIONS = (
    mathematics.FUNCTIONS
    | averages.FUNCTIONS
    | line_fits.FUNCTIONS
    | criteria.FUNCTIONS
    | logic.FUNCTIONS
    | lookups.FUNCTIONS
    | words.FUNCTIONS
)
FORBIDDEN = frozenset(
    "RAND RANDBETWEEN RANDARRAY NOW TODAY INDIRECT INFO CELL WEBSERVICE HYPERLINK DDE RTD CALL "
    "REGISTER.ID FILTERXML IMAGE IMPORTXML IMPORTDATA IMPORTHTML IMPORTRANGE IMPORTFEED CUBEVALUE "
    "EXEC SQL.REQUEST EVALUATE".split()
)
"""Functions whose value is not the workbook's alone."""
SIGNS = {"SINGLE": "@", "ANCHORARRAY": "#"}


@lru_cache(maxsize=20_000)
def program(tree: Tree, arrays: bool = False) -> Program:
    """The value of a formula as a function of where it stands; compiled once for each tree.

    Parameters
    ----------
    tree : tuple
        A syntax tree, as :func:`kfsheet.parsing.formula.parse_formula` gives it; references are
        distances from ``context.host`` (see ``relative_tree``).
    arrays : bool, optional
        Whether ranges are calculated with as a whole, as in an array formula.

    Returns
    -------
    callable
        ``program(tree)(context)`` is a scalar or, where the formula gives one, an array; errors
        are values. It raises TooMuchWorkError beyond ``context.work``, and ForbiddenError or
        UnsupportedError if it comes to call a function that must not or cannot be called.
    """
    run = compiled(tree, arrays)

    def value(c: Context) -> Value:
        with c.arithmetic.precise():
            result = _guarded(run, c)
        if result is EMPTY:  # a formula that refers to an empty cell shows 0
            return c.arithmetic.from_float(0.0)
        return Error.CALC if type(result) is Lambda else result

    return value


@lru_cache(maxsize=20_000)
def compiled(tree: Tree, arrays: bool) -> Program:
    """The closure alone: who calls it enters the arithmetic, and looks after what is too deep."""
    return _guarded(Compiler(arrays).operand, tree)


@lru_cache(maxsize=5_000)
def reference_program(tree: Tree) -> Program:
    """Like :func:`program`, but a reference stays one: what a defined name stands for."""
    run = _guarded(Compiler(True).raw, tree)
    return lambda c: _guarded(run, c)


def _guarded(function: Callable, argument: Context | Tree) -> Value:
    try:
        return function(argument)
    except RecursionError:
        raise TooMuchWorkError("the formula is nested too deep") from None


class Compiler:
    """Makes closures of trees; ``arrays`` says what a range is where one value belongs."""

    def __init__(self, arrays: bool) -> None:
        self.arrays = arrays

    @property
    def of_arrays(self) -> Compiler:
        """The compiler for arguments that are arrays whatever the formula is."""
        return self if self.arrays else Compiler(True)

    def raw(self, tree: Tree) -> Program:
        """The value of a node; a reference stays a reference."""
        return getattr(self, f"_{tree[0]}", self._unknown)(*tree[1:])

    def operand(self, tree: Tree) -> Program:
        """The value of a node in a calculation: a scalar or an array, never a reference."""
        if tree[0] == "reference" and not tree[1].name and tree[1].last is None:
            return _cell(tree[1])
        run = self.raw(tree)
        if tree[0] in ("number", "text", "truth", "error", "array", "omitted"):
            return run
        if tree[0] == "binary" and tree[1] in OPERATORS:
            return run
        settle = _whole_array if self.arrays else _one_cell

        def value(c: Context) -> Value:
            found = run(c)
            if type(found) is Area and found.top == found.bottom and found.left == found.right:
                return c.cell(found.sheet, found.top, found.left)
            return settle(c, found) if is_reference(found) else found

        return value

    # -- nodes, one method for each kind ------------------------------------------------

    def _unknown(self, *parts: object) -> Program:
        raise UnsupportedError("the formula holds what is not calculated")

    def _number(self, value: float) -> Program:
        return lambda c: c.arithmetic.from_float(value)

    def _text(self, value: str) -> Program:
        return lambda c: value

    _truth = _text

    def _omitted(self) -> Program:
        return lambda c: EMPTY

    def _error(self, code: str) -> Program:
        try:
            error = Error(code)
        except ValueError:
            raise UnsupportedError(f"the error {code} is not known") from None
        return lambda c: error

    def _array(self, *rows: Tree) -> Program:
        items = [[self.operand(i) for i in row[1 if row[0] == "row" else 0 :]] for row in rows]
        if len({len(row) for row in items}) > 1:
            raise UnsupportedError("the rows of an array are not of one length")
        return lambda c: tuple(tuple(item(c) for item in row) for row in items)

    def _reference(self, reference: Reference) -> Program:
        if reference.name:
            return _name(reference.sheet, reference.name)
        first, last = reference.first, reference.last or reference.first

        def area(c: Context) -> Value:
            sheet, *host = c.host
            (top, left), (bottom, right) = first.at(host), last.at(host)
            rows = sorted((_wrapped(top, LAST_ROW), _wrapped(bottom, LAST_ROW)))
            columns = sorted((_wrapped(left, LAST_COLUMN), _wrapped(right, LAST_COLUMN)))
            return Area(reference.sheet or sheet, rows[0], columns[0], rows[1], columns[1])

        return area

    def _foreign(self, words: str) -> Program:
        return self.raw(foreign(words))

    def _sheets(self, first: str, last: str, node: Tree) -> Program:
        """One area on each of several neighbouring sheets: Jan:Dec!A1."""
        area = self._reference(replace(node[1], sheet=None))

        def areas(c: Context) -> Value:
            lower = [sheet.lower() for sheet in c.sheets]
            if first.lower() not in lower or last.lower() not in lower:
                return Error.REF
            ends = sorted((lower.index(first.lower()), lower.index(last.lower())))
            here = area(c)
            if type(here) is Error:
                return here
            return Areas(tuple(here._replace(sheet=s) for s in c.sheets[ends[0] : ends[1] + 1]))

        return areas

    def _unary(self, sign: str, tree: Tree) -> Program:
        if sign == "@":
            run = self.raw(tree)
            return lambda c: intersect(c, run(c))
        if sign == "#":
            return _spilled(self.raw(tree))
        if sign == "+":  # it does nothing, to a text neither
            return self.operand(tree)
        if sign not in UNARY:
            raise UnsupportedError(f"the operator {sign} is not known")
        run, function = self.operand(tree), UNARY[sign]
        return lambda c: lifted(c, partial(_signed, function), run(c))

    def _binary(self, sign: str, left: Tree, right: Tree) -> Program:
        if sign in JOINS:
            join, sides = JOINS[sign], (self.raw(left), self.raw(right))
            return lambda c: join(c, *(side(c) for side in sides))
        if sign not in OPERATORS:
            raise UnsupportedError(f"the operator {sign!r} is not known")
        if left[0] == "binary" and left[1] in OPERATORS:
            return self._chain(sign, left, right)
        return _applied(OPERATORS[sign], self.operand(left), self.operand(right))

    def _chain(self, sign: str, left: Tree, right: Tree) -> Program:
        """A sum of a thousand terms is a thousand levels of a tree: go down without recursion."""
        links = [(sign, right)]
        while left[0] == "binary" and left[1] in OPERATORS:
            links.append((left[1], left[3]))
            left = left[2]
        run = self.operand(left)
        steps = [(OPERATORS[sign], self.operand(tree)) for sign, tree in reversed(links)]
        if len(steps) <= 6:  # a few closures are quicker than a loop
            for function, operand in steps:
                run = _applied(function, run, operand)
            return run

        def value(c: Context) -> Value:
            result = run(c)
            for function, operand in steps:
                result = function(c, result, operand(c))
            return result

        return value

    def _call(self, name: str, *arguments: Tree) -> Program:
        name = name.upper().removeprefix("_XLFN.").removeprefix("_XLWS.")
        if name in SIGNS and len(arguments) == 1:  # as Excel stores @A:A and A1#
            return self._unary(SIGNS[name], *arguments)
        if name in FORBIDDEN:
            return _raising(ForbiddenError(f"{name} is not allowed"))
        if name not in FUNCTIONS:
            return _variable_call(name, [self.raw(a) for a in arguments])
        least, most, build = FUNCTIONS[name]
        if not least <= len(arguments) <= most:
            raise UnsupportedError(f"{name} has {len(arguments)} arguments, which is no formula")
        run = build(self, *arguments)

        def value(c: Context) -> Value:
            c.work -= 1
            if c.work < 0:
                c.spend(0)
            return run(c)

        return value

    def _apply(self, function: Tree, *arguments: Tree) -> Program:
        """LAMBDA(x, x+1)(2)."""
        run, given = self.raw(function), [self.raw(a) for a in arguments]
        return lambda c: logic.called(c, run(c), [a(c) for a in given])


def _raising(error: Exception) -> Program:
    def refuse(c: Context) -> Value:
        raise error

    return refuse


def _variable_call(name: str, arguments: list[Program]) -> Program:
    def value(c: Context) -> Value:
        function = c.variables.get(name.lower())
        if function is None:
            raise UnsupportedError(f"the function {name} is not known")
        return logic.called(c, function, [a(c) for a in arguments])

    return value


# -- references ------------------------------------------------------------------------------------


def _wrapped(place: int, last: int) -> int:
    """A relative name may lead over the edge of a worksheet, and comes in at the other side."""
    return (place - 1) % last + 1


def _cell(reference: Reference) -> Program:
    """What one cell holds; by far the most frequent node."""
    sheet, corner = reference.sheet, reference.first
    row, row_fixed, column, column_fixed = (
        corner.row, corner.row_fixed, corner.column, corner.column_fixed
    )  # fmt: skip

    def value(c: Context) -> Scalar:
        here, down, right = c.host
        y = row if row_fixed else row + down
        x = column if column_fixed else column + right
        if y < 1 or x < 1 or y > LAST_ROW or x > LAST_COLUMN:
            y, x = _wrapped(y, LAST_ROW), _wrapped(x, LAST_COLUMN)
        return c.cell(sheet or here, y, x)

    return value


def _name(sheet: str | None, name: str) -> Program:
    key = name.lower()

    def value(c: Context) -> Value:
        if sheet is None and key in c.variables:
            return c.variables[key]
        return c.name(sheet, name)

    return value


def _spilled(run: Program) -> Program:
    def value(c: Context) -> Value:
        anchor = run(c)
        return c.spilled(*anchor[:3]) if type(anchor) is Area else Error.REF

    return value


def _whole_array(c: Context, reference: Area | Areas) -> Value:
    if type(reference) is Areas:
        return Error.VALUE
    if reference.height == reference.width == 1:
        return c.cell(*reference[:3])
    return read(c, reference)


def _one_cell(c: Context, reference: Area | Areas) -> Scalar:
    return intersect(c, reference)


def _hull(c: Context, left: Value, right: Value) -> Value:
    """``A1:INDEX(A:A,5)``: the smallest area that holds both."""
    for side in (left, right):
        if not is_reference(side):
            return side if type(side) is Error else Error.VALUE
    parts = areas_of(left) + areas_of(right)
    if len({part.sheet.lower() for part in parts}) > 1:
        return Error.REF
    tops, lefts, bottoms, rights = zip(*(part[1:] for part in parts), strict=True)
    return Area(parts[0].sheet, min(tops), min(lefts), max(bottoms), max(rights))


def _union(c: Context, left: Value, right: Value) -> Value:
    for side in (left, right):
        if not is_reference(side):
            return side if type(side) is Error else Error.VALUE
    return Areas(areas_of(left) + areas_of(right))


def _common(c: Context, left: Value, right: Value) -> Value:
    """The intersection ``A1:C1 B1:B9``; #NULL! if no cell lies in both."""
    for side in (left, right):
        if type(side) is not Area:
            return side if type(side) is Error else Error.VALUE
    top, lefts = max(left.top, right.top), max(left.left, right.left)
    bottom, rights = min(left.bottom, right.bottom), min(left.right, right.right)
    if left.sheet.lower() != right.sheet.lower() or top > bottom or lefts > rights:
        return Error.NULL
    return Area(left.sheet, top, lefts, bottom, rights)


JOINS = {":": _hull, ",": _union, " ": _common}

FOREIGN = re.compile(
    r"(?:(?P<sheet>'(?:[^']|'')+'|[^'!\[\]*?/\\ ]+)!)?"
    r"(?:(?P<ca>\$?)(?P<a>[A-Za-z]{1,3}):(?P<cb>\$?)(?P<b>[A-Za-z]{1,3})"
    r"|(?P<r1>\$?)(?P<y1>\d+):(?P<r2>\$?)(?P<y2>\d+)"
    r"|\$?(?P<c>[A-Za-z]{1,3})\$?(?P<y>\d+)(?::\$?(?P<c2>[A-Za-z]{1,3})\$?(?P<y3>\d+))?)"
)


def foreign(words: str) -> Tree:
    """The node of a reference that is no cell, range or name: C:C, 5:5, Jan:Dec!A1.

    Whole columns and rows are ranges here, as long as a worksheet is.

    Raises
    ------
    UnsupportedError
        For tables and other workbooks.
    """
    match = FOREIGN.fullmatch(words)
    if not match:
        raise UnsupportedError(f"{words[:40]} is no reference within the workbook")
    sheet = (match["sheet"] or "").strip("'").replace("''", "'") or None
    reference = Reference(sheet, *_corners(match))
    if sheet and ":" in sheet:
        return ("sheets", *sheet.split(":", 1), ("reference", reference))
    return ("reference", reference)


def _corners(match: re.Match[str]) -> tuple[Corner, Corner | None]:
    if match["a"]:
        ends = (column_index_from_string(match[end].upper()) for end in "ab")
        fixed = (bool(match[f"c{end}"]) for end in "ab")
        rows = (1, LAST_ROW)
        first, last = (Corner(r, e, True, f) for r, e, f in zip(rows, ends, fixed, strict=True))
        return first, last
    if match["y1"]:
        return (
            Corner(int(match["y1"]), 1, bool(match["r1"]), True),
            Corner(int(match["y2"]), LAST_COLUMN, bool(match["r2"]), True),
        )
    first = Corner(int(match["y"]), column_index_from_string(match["c"].upper()))
    if not match["c2"]:
        return first, None
    return first, Corner(int(match["y3"]), column_index_from_string(match["c2"].upper()))


# -- operators -------------------------------------------------------------------------------------


def _signed(function: Callable, c: Context, value: Scalar) -> Scalar:
    x = number(c, value)
    return x if type(x) is Error else function(x)


UNARY = {"-": operator.neg, "%": lambda x: x / 100}


def _applied(function: Callable, left: Program, right: Program) -> Program:
    """An operator at once for two floats, which is what most operands are."""
    quick = QUICK.get(function)
    if quick is None:
        return lambda c: function(c, left(c), right(c))

    def value(c: Context) -> Value:
        a, b = left(c), right(c)
        if type(a) is float is type(b):
            result = quick(a, b)
            return result if -LARGEST <= result <= LARGEST else Error.NUM
        return function(c, a, b)

    return value


def _arithmetic(function: Callable) -> Callable:
    """An operator of two numbers, on scalars and arrays."""

    def scalars(c: Context, left: Scalar, right: Scalar) -> Scalar:
        a, b = number(c, left), number(c, right)
        if type(a) is Error:
            return a
        if type(b) is Error:
            return b
        try:
            result = function(c, a, b)
        except ZeroDivisionError:
            return Error.DIV0
        except (ArithmeticError, ValueError):
            return Error.NUM
        return result if -LARGEST <= result <= LARGEST else Error.NUM

    def apply(c: Context, left: Value, right: Value) -> Value:
        if type(left) is tuple or type(right) is tuple:
            return broadcast(c, scalars, left, right)
        return scalars(c, left, right)

    return apply


def _divided(c: Context, a: Scalar, b: Scalar) -> Scalar:
    if b == 0:  # not every arithmetic raises
        raise ZeroDivisionError
    return a / b


def _joined(c: Context, left: Scalar, right: Scalar) -> Scalar:
    a, b = text(c, left), text(c, right)
    if type(a) is Error or type(b) is Error:
        return a if type(a) is Error else b
    c.spend((len(a) + len(b)) // 64)
    return a + b if len(a) + len(b) <= words.LONGEST else Error.VALUE


def _compared(holds: Callable[[int, int], bool]) -> Callable:
    def scalars(c: Context, left: Scalar, right: Scalar) -> Scalar:
        for side in (left, right):
            if type(side) is Error:
                return side
        return holds(compare(c, left, right), 0)

    return _over(scalars)


def _over(scalars: Callable) -> Callable:
    def apply(c: Context, left: Value, right: Value) -> Value:
        if type(left) is tuple or type(right) is tuple:
            return broadcast(c, scalars, left, right)
        return scalars(c, left, right)

    return apply


OPERATORS: dict[str, Callable] = {
    "+": _arithmetic(lambda c, a, b: a + b),
    "-": _arithmetic(lambda c, a, b: a - b),
    "*": _arithmetic(lambda c, a, b: a * b),
    "/": _arithmetic(_divided),
    "^": _arithmetic(mathematics.power),
    "&": _over(_joined),
    "=": _compared(operator.eq),
    "<>": _compared(operator.ne),
    "<": _compared(operator.lt),
    "<=": _compared(operator.le),
    ">": _compared(operator.gt),
    ">=": _compared(operator.ge),
}
# None of these can raise.
QUICK = {OPERATORS["+"]: operator.add, OPERATORS["-"]: operator.sub, OPERATORS["*"]: operator.mul}
