"""Formulas as trees that keep references as they are written, and back to text."""

from formula_trees import LEVELS, Reader, split_tokens

UNARY = 6


class RawReader(Reader):
    """A reader of formulas that leaves references and names as text."""

    def reference(self, text):
        return ("ref", text)


def read(text):
    """The tree of a formula."""
    return RawReader([*split_tokens(text), (None, None)]).expression(0)


def number(value):
    """A number as a node, negative ones with a sign before them."""
    value = float(value)
    return ("unary", "-", ("number", -value)) if value < 0 else ("number", value)


def call(name, *parts):
    return ("call", name, *parts)


def binary(sign, left, right):
    return ("binary", sign, left, right)


def text_of(tree, level=0):
    """A formula, with the parentheses that it needs."""
    kind = tree[0]
    if kind == "number":
        value = tree[1]
        return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
    if kind == "text":
        return '"' + tree[1].replace('"', '""') + '"'
    if kind == "truth":
        return str(tree[1]).upper()
    if kind in ("ref", "error", "raw"):
        return tree[1]
    if kind == "omitted":
        return ""
    if kind == "call":
        return f"{tree[1]}({','.join(text_of(part) for part in tree[2:])})"
    if kind == "unary" and tree[1] == "%":
        return f"{text_of(tree[2], UNARY + 1)}%"
    if kind == "unary":
        inside = f"{tree[1]}{text_of(tree[2], UNARY)}"
        return f"({inside})" if level >= LEVELS["^"] else inside
    if kind == "array":
        rows = (",".join(map(text_of, row[1:])) for row in tree[1:])
        return "{" + ";".join(rows) + "}"
    _, sign, left, right = tree
    own = LEVELS.get(sign, UNARY + 1)
    inside = f"{text_of(left, own)}{sign}{text_of(right, own + 1)}"
    return f"({inside})" if level > own else inside


def places(tree, counts=False, path=()):
    """Every subtree as (path, subtree, whether it is used as a number there)."""
    if tree[0] in ("array", "row"):
        return
    yield path, tree, counts or is_number(tree)
    for n, part in enumerate(tree):
        if isinstance(part, tuple) and part:
            yield from places(part, _used_as_number(tree, n), (*path, n))


def replaced(tree, path, new):
    """The tree with another subtree at a path."""
    if not path:
        return new
    n = path[0]
    return (*tree[:n], replaced(tree[n], path[1:], new), *tree[n + 1 :])


NUMERIC = {
    "SUM", "PRODUCT", "SUMPRODUCT", "SUMSQ", "EXP", "LN", "SQRT", "SIN", "COS", "ATAN2", "MOD",
    "PI", "ABS", "SIGN", "POWER", "AVERAGE", "MAX", "MIN", "N", "INT", "TAN", "ACOS", "ASIN",
}  # fmt: skip


def is_number(tree):
    """Whether a subtree has a number for its value, whatever its cells hold."""
    if tree[0] == "number" or (tree[0] == "unary" and tree[1] != "@"):
        return True
    if tree[0] == "binary":
        return tree[1] in "+-*/^"
    return tree[0] == "call" and tree[1] in NUMERIC


def _used_as_number(tree, n):
    if tree[0] == "binary":
        return tree[1] in "+-*/^"
    if tree[0] == "unary":
        return True
    return tree[0] == "call" and tree[1] in NUMERIC - {"SUM", "PRODUCT", "SUMPRODUCT", "N", "MAX"}
