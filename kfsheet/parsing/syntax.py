"""Text of a spreadsheet formula -> syntax tree: tokens, then a parser that climbs precedences.

The grammar is Excel's. From tight to loose: ``:`` (range), a space (intersection), ``@``, the
signs, ``%``, ``^``, ``* /``, ``+ -``, ``&``, comparisons; every operator is read from the left.
Everything that a spreadsheet can hold has a node here; what of it is mathematics is decided in
:mod:`kfsheet.parsing.formula`. A node is a hashable tuple, its kind first::

    ("number", 0.5)  ("text", "a")  ("truth", True)  ("error", "#REF!")  ("omitted",)
    ("reference", Reference)     a cell, a range of cells or a defined name
    ("foreign", "Table1[x]")     whole columns and rows, tables, other workbooks, several sheets
    ("unary", "-", node)         one of + - @ before its operand, % # after it
    ("binary", "^", node, node)  also ":", " " (intersection) and "," (union, in parentheses)
    ("call", "SIN", node, ...)   ("array", ("row", node, ...), ...)
"""

from __future__ import annotations

import re
from math import isinf
from typing import NamedTuple

from kfsheet.errors import FormulaError, TooMuchWorkError
from kfsheet.parsing.references import read_reference

LONGEST = 8_192  # characters, as in Excel
MOST_ARGUMENTS = 255  # as in Excel
DEEPEST = 60  # levels of parentheses, calls and signs
HIGHEST = 256  # levels of a tree, say terms of a sum; each is three calls on a stack of 1,000

Tree = tuple

CELL = r"\$?[A-Za-z]{1,3}\$?[1-9]\d{0,6}(?![\w.(!])"
TOKEN = re.compile(
    rf"""
    (?P<space>(?<=[\w)\]}}"'#?!%])\s+(?=[\w$("'\[{{\\#.]))   # between two operands
  | \s+
  | (?P<text>"(?:[^"]|"")*")
  | (?P<error>\#(?:N/A|[A-Z]+(?:/0)?[!?]))
  | (?P<call>[A-Za-z_\\][\w.]*\()                     # before names and cells: LOG10( is neither
  | (?P<reference>
        (?:(?:'(?:[^']|'')+'|(?:\[[^\[\]]*\])?[\w.]+(?::[\w.]+)?)!)?      # 'Free run'!  [1]Data!
        (?: {CELL}(?::{CELL})?
          | \$?[A-Za-z]{{1,3}}:\$?[A-Za-z]{{1,3}}(?![\w.(!]) | \$?\d+:\$?\d+(?![\w.(!])
          | (?:[^\W\d][\w.?]*|\\[\w.?]*)?\[(?:[^\[\]]|\[[^\[\]]*\])*\]    # Table1[[#All],[x]]
          | (?:[^\W\d]|\\)[\w.?\\]*
          | (?<=!)\#REF! ))                                               # its sheet is still there
  | (?P<number>(?:\d+\.?\d*|\.\d+)(?:[Ee][+-]?\d+)?(?![\w.]))
  | (?P<operator><>|<=|>=|[-+*/^&=<>%@\#:,;(){{}}])
    """,
    re.VERBOSE,
)
LEVELS = {"=": 1, "<>": 1, "<": 1, "<=": 1, ">": 1, ">=": 1, "&": 2, "+": 3, "-": 3}
LEVELS |= {"*": 4, "/": 4, "^": 5, " ": 7, ":": 8}  # the signs and % stand at 6, see _signed
TIGHT = 7
GOOGLES = "__XLUDF.DUMMYFUNCTION"


class Token(NamedTuple):
    """A piece of a formula, and where it begins."""

    kind: str
    text: str
    place: int


def parse_formula(text: str) -> Tree:
    """The syntax tree of a formula, ``=`` included or not.

    >>> parse_formula("=-2^2")
    ('binary', '^', ('unary', '-', ('number', 2.0)), ('number', 2.0))

    Raises
    ------
    FormulaError
        If the text is no formula, or is too long or too deep to be one that a person wrote.
    """
    if len(text) > LONGEST:
        raise FormulaError(f"the formula has {len(text)} characters; {LONGEST} are read")
    parser = _Parser(tokens(text))
    try:
        tree = parser.expression(0)
    except RecursionError:  # within DEEPEST parentheses, but with operators of every level in each
        raise _too_deep(DEEPEST) from None
    parser.expect("")
    if _height(tree) > HIGHEST:
        raise _too_deep(HIGHEST)
    return tree


def tokens(text: str) -> list[Token]:
    """The pieces of a formula, without the spaces that mean nothing, and an end."""
    found, place = [], int(text.startswith("="))
    while place < len(text):
        match = TOKEN.match(text, place)
        if match is None:
            raise _unreadable(place)
        if match.lastgroup == "space":  # A1:A9 A3:C3 is the cell that both cover
            found.append(Token("operator", " ", place))
        elif match.lastgroup:
            found.append(Token(match.lastgroup, match[0], place))
        place = match.end()
    return [*found, Token("end", "", place)]


def _unreadable(place: int) -> FormulaError:
    return FormulaError(f"the formula cannot be read near its character {place + 1}")


def _too_deep(levels: int) -> TooMuchWorkError:
    return TooMuchWorkError(f"the formula is nested deeper than {levels} levels")


def _height(tree: Tree) -> int:
    """Levels of a tree, counted without recursion: the tree may be too high for that."""
    level, height = [tree], 0
    while level:
        level = [part for node in level for part in node[1:] if isinstance(part, tuple)]
        height += 1
    return height


def _original(call: Tree) -> Tree:
    """What Google Sheets hides where Excel has no such formula: the formula itself, as a text.

    IFERROR around it holds the value that Google calculated, which is not believed.
    """
    text = call[2][1] if len(call) == 3 and call[2][0] == "text" else ""
    if not text or text.startswith('"'):  # "COMPUTED_VALUE", of a cell that another one fills
        raise FormulaError("Google Sheets has saved the value only; download it as values")
    return parse_formula(text)


class _Parser:
    """Reads tokens from the left; a method for each kind of thing that may come next."""

    def __init__(self, found: list[Token]) -> None:
        self._tokens, self._at, self._depth = found, 0, 0

    @property
    def _next(self) -> Token:
        return self._tokens[self._at]

    def _take(self) -> Token:
        self._at += 1
        return self._tokens[self._at - 1]

    def _took(self, text: str) -> bool:
        """Whether that comes next; if so, go on behind it."""
        found = self._next.text == text and self._next.kind != "text"
        self._at += found
        return found

    def expect(self, text: str) -> None:
        """Go on behind what must come next."""
        if not self._took(text):
            raise _unreadable(self._next.place)

    def expression(self, level: int) -> Tree:
        """Operands joined by operators that bind at least as tightly as ``level``."""
        left = self._operand() if level >= TIGHT else self._signed()
        while self._next.kind == "operator":
            here = LEVELS.get(self._next.text, -1)
            if here < level:
                break
            # One level more for the right side makes 2^3^2 (2^3)^2, as in Excel.
            left = ("binary", self._take().text, left, self.expression(here + 1))
        return left

    def _signed(self) -> Tree:
        """Signs bind tighter than ``^``: -2^2 is 4, unlike in mathematics and Python."""
        signs = []
        while self._next.text in ("+", "-", "@") and self._next.kind == "operator":
            signs.append(self._take().text)
        if len(signs) > DEEPEST:
            raise _too_deep(DEEPEST)
        node = self.expression(TIGHT)
        while self._took("%"):
            node = ("unary", "%", node)
        for sign in reversed(signs):
            node = ("unary", sign, node)
        return node

    def _operand(self) -> Tree:
        token = self._take()
        self._depth += 1
        if self._depth > DEEPEST:
            raise _too_deep(DEEPEST)
        node = getattr(self, f"_{token.kind}", self._none)(token)
        self._depth -= 1
        return ("unary", "#", node) if self._took("#") else node

    def _none(self, token: Token) -> Tree:
        raise _unreadable(token.place)

    def _number(self, token: Token) -> Tree:
        value = float(token.text)
        if isinf(value):  # beyond 1.8E308
            raise _unreadable(token.place)
        return ("number", value)

    def _text(self, token: Token) -> Tree:
        return ("text", token.text[1:-1].replace('""', '"'))

    def _error(self, token: Token) -> Tree:
        return ("error", token.text)

    def _reference(self, token: Token) -> Tree:
        if token.text.upper() in ("TRUE", "FALSE"):
            return ("truth", token.text.upper() == "TRUE")
        if token.text.endswith("#REF!"):
            return ("error", "#REF!")
        try:
            return ("reference", read_reference(token.text))
        except FormulaError:
            return ("foreign", token.text)

    def _call(self, token: Token) -> Tree:
        name = token.text[:-1].upper().removeprefix("_XLFN.")
        if self._took(")"):
            return ("call", name)
        arguments = [self._argument()]
        while self._took(","):
            if len(arguments) == MOST_ARGUMENTS:
                raise FormulaError(f"{name} has more than {MOST_ARGUMENTS} arguments")
            arguments.append(self._argument())
        self.expect(")")
        if name == "IFERROR" and arguments[0][:2] == ("call", GOOGLES):
            return _original(arguments[0])
        return ("call", name, *arguments)

    def _argument(self) -> Tree:
        empty = self._next.text in (",", ")") and self._next.kind == "operator"
        return ("omitted",) if empty else self.expression(0)

    def _operator(self, token: Token) -> Tree:
        if token.text == "{":
            return self._array()
        if token.text != "(":
            raise _unreadable(token.place)
        node = self.expression(0)
        while self._took(","):
            node = ("binary", ",", node, self.expression(0))
        self.expect(")")
        return node

    def _array(self) -> Tree:
        rows = [self._row()]
        while self._took(";"):
            rows.append(self._row())
        self.expect("}")
        return ("array", *rows)

    def _row(self) -> Tree:
        items = [self._signed()]
        while self._took(","):
            items.append(self._signed())
        return ("row", *items)
