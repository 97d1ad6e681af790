"""The mistakes that students make, made to the key: if one gives the answer, it has a name.

Each mutation is a pair of words and expression. The words say what kind of mistake it is and leave
it to the student to find the place; the key is not told.
"""

from __future__ import annotations

from collections.abc import Iterator

from sympy import Abs, Add, Basic, Expr, Indexed, Integer, Mul, Pow, Symbol, atan2, cos, sign, sin

from kfsheet.model.expressions import Missing, Observed, lag, t
from kfsheet.model.recurrence import Recurrence

SIGN = "a sign is wrong"
TERM = "a term is missing"
FACTOR = "a factor is missing"
TWO = "a factor 2 or 1/2 is missing, or one too many"
INVERSE = "a factor stands in the numerator instead of the denominator, or the other way round"
EXPONENT = "an exponent or a root is wrong"
LAG = "a reference points to the wrong row (one step too early or too late)"
SWAPPED = "the two arguments of ATAN2 are swapped; Excel takes ATAN2(x, y)"
FUNCTION = "sine and cosine are confused"
NO_SIGN = "the sign of a velocity or an angle is lost: a square or ABS forgets it"
OTHER = "a reference points to another column or parameter of the same unit"


def typical_mistakes(model: Recurrence, key: Expr) -> Iterator[tuple[str, Expr]]:
    """Pairs of words and mutated key, likely mistakes first."""
    yield SIGN, -key
    yield TWO, 2 * key
    yield TWO, key / 2
    yield from _all_lags(key)
    # Where one quantity is like another, so are many mistakes: the plainer explanation comes first.
    for of_node in (_of_node, _others):
        for path, node in _nodes(key, ()):
            for words, other in of_node(model, node):
                yield words, _replaced(key, path, other)


def _nodes(e: Basic, path: tuple[int, ...]) -> Iterator[tuple[tuple[int, ...], Basic]]:
    if e is Missing or isinstance(e, Observed):
        return
    yield path, e
    if not isinstance(e, Indexed):
        for n, argument in enumerate(e.args):
            yield from _nodes(argument, (*path, n))


def _replaced(e: Basic, path: tuple[int, ...], new: Basic) -> Basic:
    if not path:
        return new
    arguments = list(e.args)
    arguments[path[0]] = _replaced(arguments[path[0]], path[1:], new)
    return e.func(*arguments)


def _of_node(model: Recurrence, e: Basic) -> Iterator[tuple[str, Expr]]:
    if isinstance(e, Add):
        yield from _of_sum(e)
    elif isinstance(e, Mul):
        yield from _of_product(e)
    elif isinstance(e, Pow):
        yield FACTOR, Integer(1)
        yield EXPONENT, e.base
        yield INVERSE, 1 / e
        yield EXPONENT, e.base ** (e.exp + 1)
        yield EXPONENT, e.base ** (e.exp / 2)
    elif isinstance(e, atan2):
        yield SWAPPED, atan2(*reversed(e.args), evaluate=False)
        yield SIGN, atan2(-e.args[0], e.args[1], evaluate=False)
        yield SIGN, atan2(e.args[0], -e.args[1], evaluate=False)
    elif isinstance(e, sin | cos):
        yield FUNCTION, (cos if isinstance(e, sin) else sin)(*e.args)
        yield SIGN, -e
    elif isinstance(e, sign):
        yield NO_SIGN, Integer(1)
    elif isinstance(e, Abs):
        yield NO_SIGN, e.args[0]
    elif isinstance(e, Indexed | Symbol) and e != t:
        yield from _of_atom(model, e)


def _of_sum(e: Add) -> Iterator[tuple[str, Expr]]:
    for n, term in enumerate(e.args):
        rest = [*e.args[:n], *e.args[n + 1 :]]
        yield SIGN, Add(*rest, -term)
        yield TERM, Add(*rest)
        yield TWO, Add(*rest, 2 * term)
        yield TWO, Add(*rest, term / 2)


def _of_product(e: Mul) -> Iterator[tuple[str, Expr]]:
    for n, factor in enumerate(e.args):
        rest = [*e.args[:n], *e.args[n + 1 :]]
        # What is lost with a factor -1 or sign(x) is not a quantity that somebody forgot.
        words = SIGN if factor == -1 else NO_SIGN if isinstance(factor, sign) else FACTOR
        yield words, Mul(*rest)
        if factor != -1:
            yield INVERSE, Mul(*rest, 1 / factor)


def _of_atom(model: Recurrence, e: Indexed | Symbol) -> Iterator[tuple[str, Expr]]:
    yield SIGN, -e
    yield TERM, Integer(0)
    yield FACTOR, Integer(1)
    if isinstance(e, Indexed):
        back = int(lag(e))
        for other in (back + 1, back - 1):
            if other >= 0:
                yield LAG, e.base[t - other]


def _others(model: Recurrence, e: Basic) -> Iterator[tuple[str, Expr]]:
    """Another quantity of the same unit in the place of one."""
    if isinstance(e, Indexed):
        for name in _of_unit(model, str(e.base.label), model.table):
            yield OTHER, model[name][e.indices[0]]
    elif isinstance(e, Symbol) and e != t:
        for name in _of_unit(model, e.name, {**model.parameters, **model.derived_scalars}):
            yield OTHER, model[name]


def _of_unit(model: Recurrence, name: str, others: dict) -> list[str]:
    units = model.units()
    return [o for o in others if o != name and units[o] == units[name]][:30]


def _all_lags(key: Expr) -> Iterator[tuple[str, Expr]]:
    cells = key.atoms(Indexed)
    for shift in (1, -1):
        if cells and all(int(lag(c)) + shift >= 0 for c in cells):
            yield LAG, key.xreplace({c: c.base[t - int(lag(c)) - shift] for c in cells})
