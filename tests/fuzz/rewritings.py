"""The same value in other words: changes of a formula's tree that algebra or a sheet allows."""

import re

from fuzz.question import REFERENCE
from fuzz.trees import binary, call, is_number, number, places, read, replaced, text_of

ONE, ZERO, TWO = ("number", 1.0), ("number", 0.0), ("number", 2.0)


def rewritten(line, tree, times):
    """A tree after some changes that keep its value, most of them anywhere."""
    for _ in range(times):
        for _ in range(30):  # most changes fit few places
            change = line.dice.choice(CHANGES)
            spots = [*places(tree)]
            path, part, counts = spots[int(line.dice.random() * len(spots))]
            new = change(line, part, counts)
            if new is not None:
                tree = replaced(tree, path, new)
                break
    return tree


def commuted(line, part, counts):
    if part[0] == "binary" and part[1] in "+*":
        return binary(part[1], part[3], part[2])


def regrouped(line, part, counts):
    if part[0] != "binary" or part[3][0] != "binary":
        return None
    _, sign, left, (_, inner, a, b) = part
    if sign == inner and sign in "+*":
        return binary(sign, binary(sign, left, a), b)
    if sign == "-" and inner in "+-":
        return binary("-" if inner == "+" else "+", binary("-", left, a), b)
    if sign == "*" and inner == "/":
        return binary("/", binary("*", left, a), b)


def subtraction(line, part, counts):
    if part[0] != "binary" or part[1] != "-":
        return None
    _, _, a, b = part
    minus = ("unary", "-", b)
    return line.dice.choice([
        ("unary", "-", binary("-", b, a)), binary("+", a, minus), call("SUM", a, minus),
        binary("+", a, binary("*", ("unary", "-", ONE), b)), binary("-", ZERO, binary("-", b, a)),
    ])  # fmt: skip


def quotient(line, part, counts):
    if part[0] != "binary" or part[1] != "/":
        return None
    _, _, a, b = part
    inverse = line.dice.choice([binary("/", ONE, b), binary("^", b, ("unary", "-", ONE))])
    return line.dice.choice([
        binary("*", a, inverse), call("PRODUCT", a, inverse), binary("*", inverse, a),
        binary("/", ONE, binary("/", b, a)), binary("/", binary("*", TWO, a), binary("*", b, TWO)),
    ])  # fmt: skip


def product(line, part, counts):
    if part[0] != "binary" or part[1] != "*":
        return None
    _, _, a, b = part
    return line.dice.choice([
        call("PRODUCT", a, b), call("SUMPRODUCT", part), binary("/", a, binary("/", ONE, b)),
        call("SUMPRODUCT", a, b), call("SUM", part),
    ])  # fmt: skip


def total(line, part, counts):
    if part[0] == "binary" and part[1] == "+":
        _, _, a, b = part
        return line.dice.choice([
            call("SUM", a, b), binary("-", a, ("unary", "-", b)),
            binary("*", TWO, call("AVERAGE", a, b)), call("SUM", call("SUM", a), b),
        ])  # fmt: skip


def power(line, part, counts):
    if part[0] != "binary" or part[1] != "^" or part[3] != TWO:
        return None
    x = part[2]
    return line.dice.choice([
        binary("*", x, x), call("POWER", x, TWO), call("SUMSQ", x), call("PRODUCT", x, x),
        binary("^", call("ABS", x), TWO), call("SUMPRODUCT", x, x), call("EXP", call("LN", part)),
    ])  # fmt: skip


def spread(line, part, counts):
    """Multiplied out, or a common factor taken out."""
    if part[0] != "binary" or part[1] not in "*/+-":
        return None
    _, sign, a, b = part
    if sign in "*/" and a[0] == "binary" and a[1] in "+-":
        return binary(a[1], binary(sign, a[2], b), binary(sign, a[3], b))
    if sign == "*" and b[0] == "binary" and b[1] in "+-":
        return binary(b[1], binary("*", a, b[2]), binary("*", a, b[3]))
    if sign in "+-" and {a[0], b[0]} == {"binary"} and a[1] == b[1] == "*":
        for x, y in ((a[2], a[3]), (a[3], a[2])):
            for u, v in ((b[2], b[3]), (b[3], b[2])):
                if x == u:
                    return binary("*", x, binary(sign, y, v))
    if sign == "*":  # (a + 1)*b - b
        return binary("-", binary("*", binary("+", a, ONE), b), b)


def wrapped_number(line, part, counts):
    if not counts:
        return None
    x = part
    return line.dice.choice([
        binary("+", x, ZERO), binary("*", ONE, x), binary("/", x, ONE), call("N", x),
        ("unary", "-", ("unary", "-", x)), call("SUM", x), call("AVERAGE", x, x),
        call("MEDIAN", x, x, x), call("MAX", x, x), call("PRODUCT", x), call("SUMPRODUCT", x),
        binary("*", call("SIGN", x), call("ABS", x)), binary("^", x, ONE),
        binary("-", binary("*", ("number", 3.0), x), binary("*", TWO, x)),
        call("IFERROR", x, ZERO), call("IF", binary("<", x, ZERO), ("unary", "-", call("ABS", x)),
                                       call("ABS", x)),
        binary("-", binary("+", x, ONE), ONE),
        call("ROUND", x, ("number", 14.0)), call("SUMPRODUCT", binary("*", x, ONE)),
        ("unary", "%", binary("*", ("number", 100.0), x)), call("TRUNC", x, ("number", 14.0)),
        call("INDEX", call("CHOOSE", ("array", ("row", ONE, TWO)), x, ZERO), ONE)
        if "IF" not in text_of(x) else binary("+", x, ZERO),
        binary("/", binary("*", x, ("number", 7.0)), ("number", 7.0)),
        call("SUM", x, ("number", 5.0), ("unary", "-", ("number", 5.0))),
    ])  # fmt: skip


def wrapped(line, part, counts):
    """Around any value, also an empty text."""
    # What IF or IFERROR make of an empty cell is another thing in every program.
    empty = part[0] == "ref" and line.course.may_be_empty(line.place(part[1]))
    if part[0] == "omitted" or empty:
        return None
    x = part
    return line.dice.choice([
        call("IF", ("truth", True), x, ZERO), call("IF", binary("=", ONE, ONE), x),
        call("IF", binary(">", ONE, TWO), ZERO, x), call("CHOOSE", ONE, x, ZERO),
        call("CHOOSE", TWO, ZERO, x), call("IFERROR", x, ("text", "error")),
        call("IFERROR", binary("/", ONE, ZERO), x), call("IFS", ("truth", True), x),
        call("SWITCH", ONE, ONE, x, ZERO), call("IF", call("NOT", ("truth", False)), x),
        call("IF", call("AND", ("truth", True), binary("=", TWO, TWO)), x, ("text", "")),
        call("IF", ONE, x, ("text", "?")), call("IFNA", x, ZERO),
        call("IF", call("ISERROR", x), ZERO, x), call("IF", call("ISTEXT", x), ("text", ""), x),
    ])  # fmt: skip


def referred(line, part, counts):
    """Another way to a cell, which reads nothing else that could need the answer."""
    if part[0] != "ref" or not (match := REFERENCE.fullmatch(part[1])):
        return None
    sheet, letters, row = match[1] or "", match[3], int(match[5])
    cell = f"{letters}{row}"
    forms = [f"{sheet}${letters}{row}", f"{sheet}{letters}${row}", f"{sheet}${letters}${row}",
             f"INDEX({sheet}{cell},1)", f"INDEX({sheet}{cell},1,1)"]  # fmt: skip
    if row > 4:
        top = f"{sheet}{letters}${max(row - 2, 4)}:{letters}{row}"
        forms += [f"INDEX({top},ROWS({top}))", f"INDEX({top},COUNTA({top}))",
                  f"LOOKUP(2,1/($A${max(row - 2, 4)}:$A{row}=$A{row}),{top})"]  # fmt: skip
    if counts:
        forms += [f"SUM({sheet}{cell})", f"SUM({sheet}{cell}:{cell})", f"MAX({sheet}{cell})",
                  f"SUMPRODUCT({sheet}{cell}:{cell})", f"AVERAGE({sheet}{cell})",
                  f"SUMIF($A{row},$A{row},{sheet}{cell})"]  # fmt: skip
        first = max(row - 1, 4)
        forms.append(
            f"SUMPRODUCT(($A{first}:$A{row}=$A{row})*{sheet}{letters}{first}:{letters}{row})"
        )
    place = line.place(part[1])
    if row == line.row and place in line.course.given and not line.question.is_scalar:
        forms += [f"{sheet}{letters}:{letters}", f"{sheet}${letters}:${letters}"] * 2
        if name := line.course.column_names.get((place[0], place[2])):
            forms += [name] * 3
    return ("raw", line.dice.choice(forms))


def named(line, part, counts):
    """The cell of a name instead of the name, or found by its label."""
    if part[0] != "ref" or part[1] not in line.course.scalars:
        return None
    _, row, _ = line.course.scalars[part[1]]
    forms = [f"Parameters!$B${row}", f"Parameters!B${row}", f"INDEX(Parameters!$B${row},1)",
             f"SUM({part[1]})", f"INDEX({part[1]},1)"]  # fmt: skip
    if part[1] in line.course.exercise.model.parameters:
        low, high = line.course.parameter_rows
        area, labels = f"Parameters!$B${low}:$B${high}", f"Parameters!$A${low}:$A${high}"
        forms += [f"INDEX({area},MATCH(\"{part[1]}\",{labels},0))",
                  f"INDEX({area},{row - low + 1})",
                  f"VLOOKUP(\"{part[1]}\",Parameters!$A${low}:$B${high},2,FALSE)"]  # fmt: skip
    if part[1] == "dt" and line.course.has_time and not line.question.is_scalar:
        forms += ["($B$5-$B$4)", "($B$8-$B$7)", "SLOPE($B$4:$B$9,$A$4:$A$9)", "($B$9-$B$5)/4",
                  f"(B{line.row + 1}-B{line.row})" if line.row < 8 else "$B$5",
                  f"(B{line.row}-B{line.row - 1})" if line.row > 4 else "$B$5"]  # fmt: skip
    text = line.dice.choice(forms)
    return ("raw", text if text[0] != "(" else f"({text})")


def sloped(line, part, counts):
    """(K5-K4)/dt as a slope in time."""
    match = part[0] == "binary" and part[1] == "/" and re.fullmatch(
        r"\(([A-Z]+)(\d+)-\1(\d+)\)/dt", text_of(part)
    )  # fmt: skip
    if match and int(match[2]) - int(match[3]) == 1 and line.course.has_time:
        rows = f"{match[1]}{match[3]}:{match[1]}{match[2]}"
        return ("raw", f"SLOPE({rows},$B{match[3]}:$B{match[2]})")


def guarded(line, part, counts):
    """Another question that has the same answer in every row."""
    if part[0] != "call" or part[1] != "IF" or len(part) != 5:
        return None
    test, a, b = part[2:]
    if test[0] != "call" or test[1] != "ISNUMBER":
        return call("IF", call("NOT", test), b, a)
    x = test[2]
    empty = ("text", "")
    return line.dice.choice([
        call("IF", call("NOT", test), b, a), call("IF", binary("=", call("COUNT", x), ONE), a, b),
        call("IF", call("COUNT", x), a, b), call("IF", binary("<>", x, empty), a, b),
        call("IF", binary("=", x, empty), b, a),
        call("IF", binary(">", call("LEN", x), ZERO), a, b),
        call("IF", call("ISBLANK", x), b, a), call("IF", call("ISTEXT", x), b, a),
        call("CHOOSE", binary("+", ONE, test), b, a), call("IFS", test, a, ("truth", True), b),
        call("SWITCH", test, ("truth", True), a, b),
        call("CHOOSE", binary("-", TWO, call("COUNT", x)), a, b),
        call("IF", call("ISERROR", binary("/", ONE, test)), b, a), call("IF", test, part, b),
        call("IF", call("AND", test, binary("=", ONE, ONE)), a, b),
        call("IF", binary("=", test, ("truth", False)), b, a),
        call("IF", call("OR", test), a, b),
        call("IF", call("ISNONTEXT", x), call("IF", test, a, b), b),
        call("IF", binary("=", call("N", test), ONE), a, b),
    ])  # fmt: skip


def pulled(line, part, counts):
    """IF(q,a+b,a) is a+IF(q,b,0), or a+b*COUNT(x); IF(q,a,0) is a*COUNT(x)."""
    if part[0] != "call" or part[1] != "IF" or len(part) != 5:
        return None
    test, a, b = part[2:]
    if a[0] == "binary" and a[1] in "+-" and a[2] == b:
        forms = [binary(a[1], b, call("IF", test, a[3], ZERO))]
        if a[3][0] == "binary" and a[3][1] == "*" and a[3][3] == (test[2] if len(test) > 2 else 0):
            forms += [binary(a[1], b, binary("*", a[3][2], call(name, a[3][3])))
                      for name in ("N", "SUM", "MAX")]  # fmt: skip
            forms.append(binary(a[1], b, call("IFERROR", a[3], ZERO)))
        return line.dice.choice(forms)
    if b == ZERO and test[0] == "call" and test[1] == "ISNUMBER":
        return line.dice.choice([binary("*", test, a), binary("*", call("COUNT", test[2]), a)])


def functions(line, part, counts):
    """One function by another."""
    if part[0] == "number":
        n = part[1]
        return line.dice.choice([
            binary("+", number(n - 1), ONE), binary("/", number(2 * n), TWO),
            binary("-", number(n + 2), TWO), call("SUM", number(n)), binary("*", ONE, part),
        ])  # fmt: skip
    if part[0] == "binary" and part[1] == "*" and part[2][:2] == ("call", "SIGN"):
        return line.dice.choice([
            call("IF", binary("<", part[2][2], ZERO), ("unary", "-", part[3]), part[3]),
            call("IF", binary(">", part[2][2], ZERO), part[3], binary("-", ZERO, part[3])),
        ])  # fmt: skip
    if part[0] != "call":
        return None
    name, args = part[1], part[2:]
    if name == "PI":
        return line.dice.choice([
            read("ACOS(-1)"), read("4*ATAN(1)"), read("RADIANS(180)"), read("2*ASIN(1)"),
        ])  # fmt: skip
    if name == "SQRT":
        return line.dice.choice([
            binary("^", args[0], ("number", 0.5)), call("POWER", args[0], binary("/", ONE, TWO)),
            binary("^", args[0], binary("/", ONE, TWO)), call("SQRT", call("ABS", args[0])),
        ])  # fmt: skip
    if name == "EXP":
        return line.dice.choice([
            binary("^", read("EXP(1)"), args[0]), call("POWER", read("EXP(1)"), args[0]),
            binary("/", ONE, call("EXP", ("unary", "-", args[0]))),
        ])  # fmt: skip
    if name == "MOD":
        a, b = args
        return binary("-", a, binary("*", b, call("INT", binary("/", a, b))))
    if name == "ATAN2":
        x, y = args
        return call("ATAN2", binary("*", TWO, x), binary("*", TWO, y))
    if name == "AND":
        tree = args[-1]
        for test in reversed(args[:-1]):
            tree = call("IF", test, tree, ("truth", False))
        return line.dice.choice([tree, binary("=", binary("*", args[0], call("AND", *args[1:])),
                                              ONE)])  # fmt: skip


def inlined(line, part, counts):
    """What another cell holds, written out."""
    if part[0] == "ref":
        return line.formula_at(part[1])


def is_whole(line, text):
    """Whether a text stands for a column, of which some cell may be empty."""
    return text in line.course.column_names.values() or re.search(r"[A-Z]:\$?[A-Z]", text)


def helped(line, part, counts):
    """A part in a helper cell, beside the table or on another sheet; or in a chain of them."""
    if part[0] in ("omitted", "number", "text", "truth") or len(line.helpers) > 3:
        return None
    # A cell that points to an empty one holds 0 in Excel, and nothing in LibreOffice.
    if not is_number(part) and (
        any(line.course.may_be_empty(line.place(ref)) for ref in _refs(part))
        or any(tree[0] == "raw" and is_whole(line, tree[1]) for _, tree, _ in places(part))
    ):
        return None
    elsewhere = line.dice.random() < 0.4
    found = line.helper(part, elsewhere)
    for _ in range(line.dice.choice([0, 0, 0, 1, 2])):
        if len(line.helpers) < 4:
            found = line.helper(found, line.dice.random() < 0.4)
    return found


def _refs(part):
    for _, tree, _ in places(part):
        if tree[0] in ("ref", "raw"):
            yield from (m[0] for m in REFERENCE.finditer(tree[1]))


def entered_as_array(line, part, counts):
    if not line.array:
        line.array = True
        return part


CHANGES = [
    commuted, commuted, regrouped, regrouped, subtraction, quotient, product, total, power, power,
    spread, spread, wrapped_number, wrapped_number, wrapped, wrapped, referred, referred, referred,
    named, named, sloped, sloped, sloped, guarded, guarded, guarded, pulled, pulled, functions,
    functions, inlined, inlined, inlined, helped, helped, helped, entered_as_array,
]  # fmt: skip
