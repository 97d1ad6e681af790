"""Random expressions over every node that excel_code prints, and what they are worth.

The oracle is mpmath at 40 digits behind SymPy's own mpmath printer: it shares neither our printers
nor double arithmetic.
"""

import random
from collections import Counter

import mpmath
import openpyxl
import sympy as sp

from kfsheet.workbook.engines.recalculate import recalculate

VARIABLES = sp.symbols("x y z", real=True)
FUNCTIONS = (
    "sqrt exp log sin cos tan cot sec csc asin acos atan acot asec acsc sinh cosh tanh coth sech "
    "csch asinh acosh atanh acoth asech acsch sign Abs floor ceiling"
).split()
KINDS = ["add", "mul", "divide", "negate", "integer power", "rational power", "power", "atan2"]
KINDS += ["Min", "Max", "Mod", "Piecewise", *FUNCTIONS]
DIGITS = 40


class Maker:
    """Draws expressions and values from one seed, and counts what it drew."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.drawn = Counter()

    def leaf(self):
        r = self.random
        return r.choice(
            [
                *VARIABLES,
                *VARIABLES,
                sp.Integer(r.randint(-3, 5)),
                sp.Rational(r.randint(-7, 7), r.randint(2, 9)),
                sp.Float(r.randint(-300, 300) / 100, 15),
                sp.pi,
                sp.E,
            ]
        )

    def tree(self, depth):
        if depth == 0 or self.random.random() < 0.1:
            return self.leaf()
        kind = self.random.choice(KINDS + KINDS[:7] * 3)
        self.drawn[kind] += 1
        a, b = self.tree(depth - 1), self.tree(depth - 1)
        # Half of the trees stay as drawn: SymPy would otherwise tidy the hard cases away.
        plain = {"evaluate": self.random.random() < 0.5}
        return self.node(kind, a, b, plain)

    def node(self, kind, a, b, plain):
        r = self.random
        if kind == "Piecewise":
            return sp.Piecewise((a, self.condition(b)), (b, True))
        if kind in FUNCTIONS:
            return getattr(sp, kind)(a)
        if kind in ("Min", "Max", "Mod", "atan2"):
            return getattr(sp, kind)(a, b)
        return {
            "add": lambda: sp.Add(a, b, **plain),
            "mul": lambda: sp.Mul(a, b, **plain),
            "divide": lambda: sp.Mul(a, sp.Pow(b, -1, **plain), **plain),
            "negate": lambda: sp.Mul(-1, a, **plain),
            "integer power": lambda: sp.Pow(a, r.choice([2, 3, -1, -2]), **plain),
            "rational power": lambda: sp.Pow(a, sp.Rational(r.randint(-5, 5), 3), **plain),
            "power": lambda: sp.Pow(a, b, **plain),
        }[kind]()

    def condition(self, other):
        x, y, z = VARIABLES
        relation = self.random.choice([sp.Lt, sp.Le, sp.Gt, sp.Ge, sp.Eq, sp.Ne])
        first, second = relation(x, other), sp.Gt(y, z)
        return self.random.choice(
            [first, sp.And(first, second), sp.Or(first, second), sp.Not(sp.And(first, second))]
        )

    def values(self):
        return [self.random.choice([-1, 1, 1]) * self.random.uniform(0.05, 3) for _ in VARIABLES]


def samples(count, seed):
    """``count`` triples (expression, values, worth), and how often each kind was used."""
    maker, found, used = Maker(seed), [], Counter()
    while len(found) < count:
        maker.drawn.clear()
        try:
            expression, values = maker.tree(maker.random.randint(1, 4)), maker.values()
        except (ArithmeticError, ValueError, TypeError, RecursionError):
            # SymPy refuses Min of complex numbers, Mod by 0, ...
            continue
        # SymPy folds decimal numbers into longer ones, which excel_code refuses; see its own test.
        if any(float(f"{float(n):.15g}") != float(n) for n in expression.atoms(sp.Float)):
            continue
        if expression.has(sp.zoo, sp.nan, sp.oo, -sp.oo, sp.I, sp.re, sp.im, sp.arg):
            continue
        worth = exact(expression, values)
        if worth is not None and expression.free_symbols:
            found.append((expression, values, worth))
            used.update(maker.drawn)
    return found, used


def exact(expression, values):
    """The value as a float, or None where there is none or doubles cannot be asked for it."""
    try:
        with mpmath.workdps(DIGITS):
            numbers = [mpmath.mpf(v) for v in values]
            worth = value(expression, dict(zip(VARIABLES, numbers, strict=True)))
            # What moves by more than 1e-10 when an input moves by 1e-15 is no fair question.
            moved = [v * (1 + mpmath.mpf(10) ** -15) for v in numbers]
            near = value(expression, dict(zip(VARIABLES, moved, strict=True)))
    except (ArithmeticError, ValueError):
        return None
    fair = abs(worth) < 1e9 and (worth == 0 or abs(worth) > 1e-6)
    return float(worth) if fair and abs(near - worth) <= 1e-10 * abs(worth) else None


def value(e, at):
    """Real value of a node in mpmath; ValueError where it is not real or not finite."""
    if e.is_Symbol:
        return at[e]
    if e.is_Float:
        return mpmath.mpf(float(e))
    if e.is_Rational:
        return mpmath.mpf(e.p) / e.q
    if isinstance(e, sp.Piecewise):
        return value(next(branch for branch, test in e.args if truth(test, at)), at)
    name = type(e).__name__
    if name not in MEANINGS and not hasattr(mpmath, name):
        raise ValueError(f"no meaning for {name}")
    result = MEANINGS.get(name, getattr(mpmath, name, None))(*(value(a, at) for a in e.args))
    if not isinstance(result, mpmath.mpf | int) or not mpmath.isfinite(result):
        raise ValueError(f"{e} is not real")
    return mpmath.mpf(result)


def power(base, exponent):
    """Base to an exponent; 0 to the 0 is an error in Excel and 1 in mathematics, so not asked."""
    if base == 0 and exponent <= 0:
        raise ValueError("a power of zero")
    return mpmath.power(base, exponent)


MEANINGS = {
    "Add": lambda *terms: mpmath.fsum(terms),
    "Mul": lambda *factors: mpmath.fprod(factors),
    "Pow": power,
    "Pi": lambda: +mpmath.pi,
    "Exp1": lambda: +mpmath.e,
    "Abs": abs,
    "Min": min,
    "Max": max,
    "ceiling": mpmath.ceil,
    "Mod": lambda a, b: a - b * mpmath.floor(a / b),
}


def truth(e, at):
    """Truth of a condition; all parts must have a value, as AND and OR ask in a sheet."""
    if isinstance(e, sp.And | sp.Or):
        return (all if isinstance(e, sp.And) else any)([truth(a, at) for a in e.args])
    if isinstance(e, sp.ITE):
        return truth(e.args[1] if truth(e.args[0], at) else e.args[2], at)
    if isinstance(e, sp.Not):
        return not truth(e.args[0], at)
    if e.is_Relational:
        return e.func(*(sp.Float(value(a, at), DIGITS) for a in e.args)) == True  # noqa: E712
    return bool(e)


def calculate(formulas, engine, path, inputs=()):
    """Values of formulas in column D, beside their inputs in A to C."""
    book = openpyxl.Workbook()
    for row, formula in enumerate(formulas, 1):
        for column, number in enumerate(inputs[row - 1] if inputs else (), 1):
            book.active.cell(row, column, number)
        book.active.cell(row, 4, formula)
    book.active["F1"] = 3
    book.save(path)
    values = recalculate(path, engine)[book.active.title]
    return [values.get((row, 4)) for row in range(1, len(formulas) + 1)]
