"""What a formula of a submission refers to, and what no formula may use; read as text only."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

from kfsheet.parsing.calculator import Formula
from kfsheet.parsing.formula import parse_formula, references, relative_tree
from kfsheet.parsing.references import Reference, relative_key
from kfsheet.parsing.syntax import Tree

DANGEROUS = sorted(
    "WEBSERVICE HYPERLINK INDIRECT DDE RTD CALL REGISTER.ID FILTERXML IMAGE IMPORTXML IMPORTDATA "
    "IMPORTHTML IMPORTRANGE IMPORTFEED CUBEVALUE EXEC SQL.REQUEST".split()
)
REACHES_OUT = re.compile(rf"(?<![\w.])(?:_XLFN\.)?({'|'.join(map(re.escape, DANGEROUS))})\s*\(")
LINK = re.compile(r"\[\d+\]")


@lru_cache(maxsize=20_000)
def forbidden(text: str) -> str | None:
    """What a formula uses that no answer may use, if there is such a thing."""
    # As text, before anything is parsed: also in a branch that is never taken, or in a string.
    if found := REACHES_OUT.search(text.upper()):
        return found[1]
    if LINK.search(text):
        return "a link to another file"
    return "DDE" if "|" in text and "!" in text else None


class Parsed(NamedTuple):
    """A formula, seen from its cell: equal ones, filled down, have one key and one tree."""

    key: str
    tree: Tree
    references: tuple[Reference, ...]


_parsed: dict[str, Parsed] = {}
"""By key, for all rows, files and students."""


def parsed(formula: Formula) -> Parsed:
    """A formula with what it refers to; equal ones are parsed once.

    Raises
    ------
    FormulaError
        If the text is no formula that can be read.
    """
    key = relative_key(formula.text, formula.host)
    if key not in _parsed:
        if len(_parsed) > 100_000:  # of many files that were each written to be odd
            _parsed.clear()
        tree = relative_tree(parse_formula(formula.text), formula.host)
        _parsed[key] = Parsed(key, tree, tuple(references(tree)))
    return _parsed[key]
