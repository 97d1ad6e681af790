"""Given formulas that show what an answer looks like; a handout hides them, their values stay.

Such a one is an answer's own formula for another axis, camera or stage, a part of an answer, or
what an answer follows from; see :mod:`kfsheet.coursework.judging.rearrangements`.
"""

from __future__ import annotations

from collections.abc import Iterator

from sympy import Add, Basic, Expr, Indexed, IndexedBase, Piecewise, Symbol

from kfsheet.coursework.judging.model_runs import ModelRuns
from kfsheet.coursework.judging.rearrangements import Rearrangements, operations
from kfsheet.model.exercise import Exercise
from kfsheet.model.expressions import Missing, lag, t, walk
from kfsheet.model.quantities import Column

FAR = 2  # operations of a formula on another worksheet that is recognised


_known: dict[tuple, frozenset[str]] = {}


def shown_answers(exercise: Exercise) -> frozenset[str]:
    """Names of the given columns and derived scalars whose formulas show an answer.

    >>> from kfsheet import load_exercise
    >>> shown_answers(load_exercise("tennis"))  # beside those of its sealed worksheets
    frozenset({'eps'})
    """
    key = exercise.model, exercise.questions, exercise.frozen, exercise.sealed, exercise.veiled
    if key not in _known:
        found = _found(Rearrangements(ModelRuns(exercise)))
        table = exercise.model.table
        _known[key] = frozenset(
            n
            for n in found.union(exercise.veiled)
            if n not in table or table[n].section not in exercise.sealed
        )
    return _known[key]


def _found(of: Rearrangements) -> frozenset[str]:
    parts = {
        given: answer
        for answer in of.asked
        for given in of.found(answer)
        if len(of.reads(given)) > 1 and of.reads(given) <= of.reads(answer)
    }
    patterns = [p for name in {*of.asked, *parts} for p in _patterns(of, name, parts=True)]
    same_sheet = set(patterns)
    anywhere = {shape for _, shape, size in patterns if size >= FAR}
    found = {
        given
        for given in of.given
        for section, shape, size in _patterns(of, given)
        if size and ((section, shape, size) in same_sheet or shape in anywhere)
    }
    return frozenset((found | set(parts)) - set(of.model.summaries))


def _patterns(of: Rearrangements, name: str, parts: bool = False) -> Iterator[tuple[str, str, int]]:
    """Worksheet, shape and size of a quantity's general formula, and of it but for one term."""
    item = of.items[name]
    section = item.section if isinstance(item, Column) else ""
    rule = _value(item.rules[-1])
    less = [rule - term for term in rule.args] if parts and isinstance(rule, Add) else []
    for part in (rule, *less):
        for signed in (part, -part):
            yield section, shape(signed), operations(part)


def _value(rule: Expr) -> Expr:
    """What a formula gives where there is something to give."""
    if isinstance(rule, Piecewise):
        return max((v for v, _ in rule.args if v is not Missing), key=operations, default=rule)
    return rule


def shape(expression: Expr) -> str:
    """What an expression looks like, whatever its quantities are called.

    >>> from sympy.abc import a, b, c, x, y, z
    >>> shape(a + b * x**2) == shape(z + y * c**2), shape(a * b + a) == shape(a * b + c)
    (True, False)
    """
    leaves = {node for node in walk(expression) if isinstance(node, Indexed | Symbol)} - {t}
    kinds = {leaf: f"cell {lag(leaf)}" if isinstance(leaf, Indexed) else "" for leaf in leaves}
    # A quantity is known by its kind and by all places in which it stands.
    places = {leaf: _text(expression, kinds | {leaf: "here"}) for leaf in leaves}
    return _text(expression, {leaf: f"{kinds[leaf]}[{places[leaf]}]" for leaf in leaves})


def _text(node: Basic, names: dict[Basic, str]) -> str:
    if node in names:
        return names[node]
    if isinstance(node, IndexedBase) or not node.args:
        return str(node)
    parts = [_text(part, names) for part in node.args]
    parts = sorted(parts) if node.is_commutative and node.is_Add | node.is_Mul else parts
    return f"{type(node).__name__}({', '.join(parts)})"
