"""Syntax trees of formulas by openpyxl's tokens: a parser for tests, independent of our own."""

from openpyxl.formula import Tokenizer

from kfsheet.errors import FormulaError
from kfsheet.parsing.references import read_reference

LEVELS = {"=": 1, "<>": 1, "<": 1, "<=": 1, ">": 1, ">=": 1, "&": 2, "+": 3, "-": 3}
LEVELS |= {"*": 4, "/": 4, "^": 5}
SIGNS = 6


def tree_of(text):
    """The tree of a formula, in the form of kfsheet.parsing."""
    reader = Reader([*split_tokens(text), (None, None)])
    tree = reader.expression(0)
    assert reader.next[0] is None, text
    return tree


def split_tokens(text):
    """The tokens of a formula, as (kind, text)."""
    items = Tokenizer(text if text.startswith("=") else f"={text}").items
    found = []
    for i, token in enumerate(items):
        if token.type != "WHITE-SPACE":
            found += _split(token)
        elif 0 < i < len(items) - 1 and _ends(items[i - 1]) and _begins(items[i + 1]):
            found.append(("op", " "))
    return found


def _ends(token):
    return token.subtype == "CLOSE" or token.type == "OPERAND"


def _begins(token):
    return token.subtype == "OPEN" or token.type == "OPERAND"


def _split(token):
    """A token as (kind, text); openpyxl takes @ and : for parts of names."""
    value = token.value
    if token.type in ("OPERATOR-PREFIX", "OPERATOR-INFIX"):
        return [("op", value)]
    if token.type == "OPERATOR-POSTFIX":
        return [("post", value)]
    if token.type == "OPERAND" and token.subtype != "RANGE":
        return [(token.subtype.lower(), value)]
    if token.type == "OPERAND" or (token.type, token.subtype) == ("FUNC", "OPEN"):
        call = token.type == "FUNC"
        ats = len(value) - len(value.lstrip("@"))
        *left, last = value[ats:].rstrip("(").split(":") if call else [value[ats:]]
        pieces = [("op", "@")] * ats
        if left or last.startswith(":"):
            pieces += [("ref", name) for name in left if name] + [("op", ":")]
        return [*pieces, ("call" if call else "ref", last.lstrip(":"))]
    return [(f"{token.type} {token.subtype}", value)]


class Reader:
    def __init__(self, tokens):
        self.tokens, self.at = tokens, 0

    @property
    def next(self):
        return self.tokens[self.at]

    def take(self):
        self.at += 1
        return self.tokens[self.at - 1]

    def expression(self, level):
        left = self.signed()
        while self.next[0] == "op" and LEVELS.get(self.next[1], -1) >= level:
            sign = self.take()[1]
            left = ("binary", sign, left, self.expression(LEVELS[sign] + 1))
        return left

    def signed(self):
        signs = []
        while self.next[0] == "op" and self.next[1] in ("+", "-", "@"):
            signs.append(self.take()[1])
        node = self.joined()
        while self.next == ("post", "%"):
            node = ("unary", self.take()[1], node)
        for sign in reversed(signs):
            node = ("unary", sign, node)
        return node

    def joined(self):
        """Ranges of calls, A1:INDEX(...), and intersections."""
        node = self.postfixed()
        while self.next in (("op", ":"), ("op", " ")):
            sign = self.take()[1]
            node = ("binary", sign, node, self.postfixed())
        return node

    def postfixed(self):
        node = self.operand()
        while self.next == ("post", "#"):
            node = ("unary", self.take()[1], node)
        return node

    def operand(self):
        kind, text = self.take()
        if kind == "number":
            return ("number", float(text))
        if kind == "text":
            return ("text", text[1:-1].replace('""', '"'))
        if kind == "logical":
            return ("truth", text.upper() == "TRUE")
        if kind == "error":
            return ("error", text)
        if kind == "ref":
            return self.reference(text)
        if kind == "call":
            return self.call(text)
        if kind == "PAREN OPEN":
            return self.parenthesis()
        assert kind == "ARRAY OPEN", kind
        return self.array()

    def reference(self, text):
        try:
            return ("reference", read_reference(text))
        except FormulaError:
            return ("foreign", text)

    def call(self, name):
        parts = self.parts("FUNC CLOSE", "SEP ARG")
        node = ("call", name.upper().removeprefix("_XLFN."), *parts)
        if self.next[0] == "PAREN OPEN":  # LAMBDA(x,x+1)(2)
            self.take()
            node = ("apply", node, *self.parts("PAREN CLOSE", "SEP ARG"))
        return node

    def parts(self, end, separator):
        parts = []
        if self.next[0] == end:
            self.take()
            return parts
        while True:
            omitted = self.next[0] in (end, separator)
            parts.append(("omitted",) if omitted else self.expression(0))
            if self.take()[0] == end:
                return parts

    def parenthesis(self):
        node = self.expression(0)
        while self.next[1] == ",":
            self.take()
            node = ("binary", ",", node, self.expression(0))
        assert self.take()[0] == "PAREN CLOSE"
        return node

    def array(self):
        rows, row = [], [self.signed()]
        while True:
            kind = self.take()[0]
            if kind == "SEP ARG":
                row.append(self.signed())
                continue
            rows.append(("row", *row))
            if kind == "ARRAY CLOSE":
                return ("array", *rows)
            row = [self.signed()]
