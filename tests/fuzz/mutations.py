"""Mistakes: changes of a formula's tree that probably change a value in some row or world."""

from openpyxl.utils import get_column_letter

from fuzz.question import REFERENCE
from fuzz.rewritings import ONE, TWO, ZERO
from fuzz.trees import binary, call, number, places, replaced

EMPTY = ("text", "")
SWAPS = {
    "SIN": "COS", "COS": "SIN", "EXP": "LN", "SQRT": "ABS", "SIGN": "ABS", "MOD": "QUOTIENT",
    "AND": "OR", "ISNUMBER": "ISTEXT", "LN": "LOG", "ATAN2": "POWER",
}  # fmt: skip


def mutated(line, tree):
    """A tree with one mistake, most of them anywhere in it."""
    for _ in range(60):
        change, anywhere = line.dice.choice(CHANGES)
        spots = [*places(tree)] if anywhere else [((), tree, False)]
        path, part, counts = spots[int(line.dice.random() * len(spots))]
        new = change(line, part, counts)
        if new is not None and new != part:
            line.touched = change.__name__
            return replaced(tree, path, new)
    line.touched = "factor"
    return binary("*", tree, ("number", 1.5))


def other_sign(line, part, counts):
    if part[0] == "binary" and part[1] in "+-*/":
        return binary(line.dice.choice("+-*/".replace(part[1], "")), part[2], part[3])


def minus(line, part, counts):
    if counts:
        return ("unary", "-", part)


def term_lost(line, part, counts):
    if part[0] == "binary" and part[1] in "+-*/^":
        return line.dice.choice([part[2], part[3]])


def factor(line, part, counts):
    if counts:
        by = line.dice.choice([2.0, 0.5, 1.0001, 1.01, 10.0, 1.00001])
        return binary("*", number(by), part)


def offset_added(line, part, counts):
    if counts:
        return binary("+", part, number(line.dice.choice([0.001, 1.0, -0.01])))


def swapped(line, part, counts):
    if part[0] == "binary" and part[1] in "-/^":
        return binary(part[1], part[3], part[2])
    if part[0] == "call" and part[1] == "ATAN2":
        return call("ATAN2", part[3], part[2])


def other_function(line, part, counts):
    if part[0] == "call" and part[1] in SWAPS:
        return call(SWAPS[part[1]], *part[2:])


def other_number(line, part, counts):
    if part[0] == "number":
        return number(part[1] + line.dice.choice([1, -1, 0.5]))


def other_row(line, part, counts):
    if part[0] == "ref" and (match := REFERENCE.fullmatch(part[1])):
        row = max(4, int(match[5]) + line.dice.choice([-2, -1, -1, 1, 1, 2]))
        return ("ref", f"{match[1] or ''}{match[2]}{match[3]}{match[4]}{row}")


def other_column(line, part, counts):
    if part[0] == "ref" and (match := REFERENCE.fullmatch(part[1])):
        _, row, column = line.place(part[1])
        new = get_column_letter(max(2, column + line.dice.choice([-2, -1, -1, 1, 1, 2])))
        return ("ref", f"{match[1] or ''}{match[2]}{new}{match[4]}{row}")


def fixed_row(line, part, counts):
    if part[0] == "ref" and (match := REFERENCE.fullmatch(part[1])):
        return ("ref", f"{match[1] or ''}{match[3]}${line.dice.choice([4, 5, 6])}")


def other_name(line, part, counts):
    if part[0] == "ref" and part[1] in line.course.scalars:
        kept = [n for n in line.course.free_names if n != line.question.name]
        return ("ref", line.dice.choice(kept))


def typed_parameter(line, part, counts):
    """Its own value, or a rounded one, stands for it: here, or in a helper cell."""
    if part[0] == "ref" and part[1] in line.course.exercise.model.parameters:
        value = line.value_at(part[1])
        value = line.dice.choice([value, value, float(f"{value:.3g}"), float(f"{value:.2g}")])
        return helper_or(line, number(value))


def helper_or(line, tree):
    """As it is, or behind one to three helper cells."""
    kind = line.dice.random()
    if kind < 0.5 or len(line.helpers) > 1:
        return tree
    found = line.helper(tree, kind < 0.7)
    if kind > 0.85:
        found = line.helper(found, False)
    return found


def typed_datum(line, part, counts):
    if part[0] == "ref" and REFERENCE.fullmatch(part[1]):
        value = line.value_at(part[1])
        if isinstance(value, float):
            return helper_or(line, number(value))


def typed_result(line, part, counts):
    """The number itself, a list of all of them, or a sum of two."""
    values = line.course.key_values[line.question.name]
    value = values[line.question.rows.index(line.row)]
    own = number(value) if isinstance(value, float) else EMPTY
    forms = [own, binary("+", own, ZERO) if isinstance(value, float) else own]
    if len(values) < 60 and len(values) > 1:
        items = [number(v) if isinstance(v, float) else EMPTY for v in values]
        at = ("raw", f"ROW()-{line.question.rows[0] - 1}")
        forms += [call("INDEX", ("array", ("row", *items)), at), call("CHOOSE", at, *items)]
    return line.dice.choice(forms)


def guard_lost(line, part, counts):
    if part[0] == "call" and part[1] == "IF" and len(part) == 5:
        return line.dice.choice([
            part[3], part[4], call("IFERROR", part[3], part[4]), call("IFERROR", part[3], EMPTY),
            call("IFERROR", part[3], ZERO), call("IF", part[2], part[4], part[3]),
        ])  # fmt: skip


def guard_elsewhere(line, part, counts):
    """It asks another row, or the next column."""
    if part[0] == "call" and part[1] in ("ISNUMBER", "COUNT") and part[2][0] == "ref":
        ask = line.dice.choice([other_row, other_row, other_column])
        new = ask(line, part[2], False)
        return new and call(part[1], new)


def gap_filled(line, part, counts):
    """0 where "" belongs, or the other way round."""
    if part == EMPTY:
        return line.dice.choice([ZERO, ("raw", "NA()"), ("text", "-"), ("text", " ")])
    if part[0] == "call" and part[1] == "IF" and len(part) == 5:
        return call("IF", part[2], part[3], line.dice.choice([ZERO, EMPTY, ("raw", "NA()"), ONE]))


def gap_ignored(line, part, counts):
    if part[0] == "ref" and REFERENCE.fullmatch(part[1]):
        return call(line.dice.choice(["N", "SUM", "MAX"]), part)


def rounded(line, part, counts):
    digits = number(line.dice.choice([1, 2, 3, 3, 4]))
    return call(line.dice.choice(["ROUND", "ROUND", "TRUNC", "ROUNDUP"]), part, digits)


def significant(line, part, counts):
    """Three figures, as a person writes a number down."""
    if counts:
        text = call("TEXT", part, ("text", "0.00E+00"))
        return line.dice.choice([call("VALUE", text), ("unary", "-", ("unary", "-", text))])


def cancelled(line, part, counts):
    if counts:
        big = line.dice.choice([1e16, 1e15, 1e17])
        if line.dice.random() < 0.5:
            return binary("-", binary("+", ("number", big), part), ("number", big))
        return binary("-", binary("+", part, ("number", big)), ("number", big))


def domain(line, part, counts):
    """Algebra says that it is the same; a sheet shows errors, or another sign."""
    if not counts:
        return None
    x = part
    return line.dice.choice([
        binary("^", call("SQRT", x), TWO), call("SQRT", binary("^", x, TWO)),
        call("LN", call("EXP", x)), call("EXP", call("LN", x)), call("SIN", call("ASIN", x)),
        call("COS", call("ACOS", x)), call("ABS", x), call("INT", x), call("MAX", x, ZERO),
        call("ASIN", call("SIN", x)), call("MIN", x, ZERO),
        binary("/", binary("*", x, x), x), binary("^", binary("^", x, TWO), ("number", 0.5)),
    ])  # fmt: skip


def over_itself(line, part, counts):
    """Times a cell over itself: an error where that cell is 0, empty or a text."""
    cell = _some_cell(line)
    return binary("*", part, binary("/", cell, cell))


def times_nothing(line, part, counts):
    """Plus 0 times a cell, or 0 over a difference that is 0 in one row."""
    row = line.dice.choice(line.question.rows)
    label = ("ref", f"$A{line.row}") if not line.question.is_scalar else ("ref", "$B$6")
    forms = [binary("*", ZERO, _some_cell(line)), binary("*", ZERO, ("text", "a"))]
    if not line.question.is_scalar:
        forms.append(binary("/", ZERO, binary("-", label, number(row - 4))))
    return binary(line.dice.choice("+-"), part, line.dice.choice(forms))


def _some_cell(line):
    refs = [p[1] for _, p, _ in places(line.question.keys[line.row]) if p[0] == "ref"]
    cells = [r for r in refs if REFERENCE.fullmatch(r)] or refs or ["$A$1"]
    return ("ref", line.dice.choice(cells))


def itself(line, part, counts):
    """A circle that algebra would take away."""
    question = line.question
    own = ("ref", f"{question.letter}{line.row}")
    if question.is_scalar and line.dice.random() < 0.5:
        own = ("ref", question.name)
    forms = [
        binary("+", part, binary("*", ZERO, own)), binary("-", binary("+", part, own), own),
        call("IF", binary("=", own, own), part, ZERO), binary("+", binary("-", own, own), part),
        call("IFERROR", own, part),
        call("IF", call("ISNUMBER", own), part, part),
    ]  # fmt: skip
    return line.dice.choice(forms)


def only_here(line, part, counts):
    """Right only as long as a parameter or a datum keeps its value, or the other way round."""
    name = line.dice.choice(sorted(line.course.exercise.model.parameters))
    value = line.value_at(name)
    test = line.dice.choice([
        binary("=", ("ref", name), number(value)),
        binary("<", call("ABS", binary("-", ("ref", name), number(value))), ("number", 1e-9)),
    ])  # fmt: skip
    bad = line.dice.choice([ZERO, binary("*", TWO, part), EMPTY, ("unary", "-", part)])
    pair = (part, bad) if line.dice.random() < 0.7 else (bad, part)
    return call("IF", test, *pair)


def only_this_datum(line, part, counts):
    cells = [
        p[1] for _, p, _ in places(line.question.keys[line.row])
        if p[0] == "ref" and REFERENCE.fullmatch(p[1]) and isinstance(line.value_at(p[1]), float)
    ]  # fmt: skip
    if cells:
        cell = line.dice.choice(cells)
        value = line.value_at(cell)
        near = binary("<", call("ABS", binary("-", ("ref", cell), number(value))), ("number", 1e-6))
        test = line.dice.choice([
            near, binary("=", ("ref", cell), call("ROUND", ("ref", cell), ("number", 3.0))),
        ])  # fmt: skip
        return call("IF", test, part, line.dice.choice([ZERO, binary("*", TWO, part)]))


def text_instead(line, part, counts):
    return line.dice.choice([
        binary("&", part, EMPTY), call("TEXT", part, ("text", "0.000")),
        call("FIXED", part, ("number", 4.0)), binary("&", EMPTY, part),
    ])  # fmt: skip


def one_row(line, part, counts):
    """Another value in one row."""
    if line.question.is_scalar:
        return None
    row = line.question.rows[line.dice.randrange(len(line.question.rows))]
    test = binary("=", ("ref", f"$A{line.row}"), number(row - 4))
    bad = line.dice.choice([ZERO, ("raw", "1/0"), EMPTY, binary("*", TWO, part), ("raw", "NA()")])
    return call("IF", test, bad, part)


def at_a_threshold(line, part, counts):
    """Another value where a cell is large: seen only if some row or world goes there."""
    cell = _some_cell(line)
    return call("IF", binary(">", cell, _some_cell(line)), part, binary("*", part, TWO))


ANYWHERE = [
    other_sign, other_sign, minus, term_lost, term_lost, factor, offset_added, swapped,
    other_function, other_number, other_row, other_row, other_column, other_column, fixed_row,
    other_name, typed_parameter, typed_parameter, typed_parameter, typed_datum, guard_lost,
    guard_lost, guard_elsewhere, guard_elsewhere, gap_filled, gap_filled, gap_ignored, rounded,
    significant, cancelled, domain, domain, domain, over_itself, times_nothing, itself, only_here,
    only_this_datum,
]  # fmt: skip
WHOLE = [
    rounded, significant, cancelled, domain, over_itself, times_nothing, itself, only_here,
    only_here, only_this_datum, text_instead, one_row, one_row, typed_result, at_a_threshold,
]  # fmt: skip
CHANGES = [(change, True) for change in ANYWHERE] + [(change, False) for change in WHOLE]
