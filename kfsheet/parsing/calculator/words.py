"""Functions of texts, and those that say what kind of value something is."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from decimal import ROUND_HALF_UP, Decimal
from typing import Any

from kfsheet.parsing.calculator.broadcasting import (
    MANY,
    Compiler,
    Entry,
    argument,
    each,
    intersect,
    whole,
)
from kfsheet.parsing.calculator.criteria import wildcard
from kfsheet.parsing.calculator.values import (
    EMPTY,
    Area,
    Context,
    Error,
    FailedError,
    Program,
    Scalar,
    UnsupportedError,
    Value,
    cells_of,
    is_number,
    is_reference,
    number,
    shown,
    text,
)

Number = Any
LONGEST = 32_767
"""Characters of a text in a cell."""


def _joined(c: Context, parts: Iterator[Scalar], between: str = "") -> str:
    found = []
    for part in parts:
        words = text(c, part)
        if type(words) is Error:
            raise FailedError(words)
        found.append(words)
    result = between.join(found)
    c.spend(len(result) // 64)
    if len(result) > LONGEST:
        raise FailedError(Error.VALUE)
    return result


def _concatenate(c: Context, *values: Value) -> str:
    return _joined(c, (intersect(c, value) for value in values))


def _concat(c: Context, *values: Value) -> str:
    return _joined(c, (cell for value in values for cell in cells_of(c, value)))


def _text_join(c: Context, between: Value, skip: Value, *values: Value) -> str:
    skipping = argument("b", c, skip)
    cells = (cell for value in values for cell in cells_of(c, value))
    kept = (cell for cell in cells if not (skipping and cell in (EMPTY, "")))
    return _joined(c, kept, argument("t", c, between))


def _left(c: Context, words: str, count: int = 1) -> str:
    if count < 0:
        raise FailedError(Error.VALUE)
    return words[:count]


def _right(c: Context, words: str, count: int = 1) -> str:
    if count < 0:
        raise FailedError(Error.VALUE)
    return words[max(len(words) - count, 0) :]


def _middle(c: Context, words: str, start: int, count: int) -> str:
    if start < 1 or count < 0:
        raise FailedError(Error.VALUE)
    return words[start - 1 : start - 1 + count]


def _replace(c: Context, words: str, start: int, count: int, other: str) -> str:
    if start < 1 or count < 0:
        raise FailedError(Error.VALUE)
    return words[: start - 1] + other + words[start - 1 + count :]


def _substitute(c: Context, words: str, old: str, new: str, which: int | None = None) -> str:
    if which is not None and which < 1:
        raise FailedError(Error.VALUE)
    if not old:
        return words
    parts = words.split(old)
    if len(parts) * len(new) > LONGEST + len(words):
        raise FailedError(Error.VALUE)
    if which is None:
        return new.join(parts)
    if which >= len(parts):
        return words
    return old.join(parts[:which]) + new + old.join(parts[which:])


def _repeat(c: Context, words: str, times: int) -> str:
    if times < 0 or len(words) * times > LONGEST:
        raise FailedError(Error.VALUE)
    c.spend(len(words) * times // 64)
    return words * times


def _find(c: Context, what: str, words: str, start: int = 1) -> Number:
    found = words.find(what, start - 1) if start >= 1 else -1
    if found < 0:
        raise FailedError(Error.VALUE)
    return c.arithmetic.from_float(float(found + 1))


def _search(c: Context, what: str, words: str, start: int = 1) -> Number:
    """Like FIND, but * and ? stand for anything, and capitals do not count."""
    if not 1 <= start <= len(words) + 1:
        raise FailedError(Error.VALUE)
    c.spend(len(what) * len(words) // 64)
    found = wildcard(what.lower()).find(words.lower(), start - 1)
    if found < 0:
        raise FailedError(Error.VALUE)
    return c.arithmetic.from_float(float(found + 1))


def _character(c: Context, code: int) -> str:
    if not 1 <= code <= 255:
        raise FailedError(Error.VALUE)
    return bytes([code]).decode("cp1252", errors="replace")


def _code(c: Context, words: str) -> Number:
    if not words:
        raise FailedError(Error.VALUE)
    return c.arithmetic.from_float(float(words[0].encode("cp1252", errors="replace")[0]))


def _value(c: Context, value: Scalar) -> Number:
    """VALUE takes a truth value for none of the numbers, unlike arithmetic."""
    if type(value) is bool:
        raise FailedError(Error.VALUE)
    return number(c, value)


FIXED = re.compile(r'((?:"[^"]*")?)(#,##)?([0#]*)(?:\.([0#]+))?(E\+0+)?(%?)((?:"[^"]*")?)')


def _formatted(c: Context, value: Scalar, form: str) -> str:
    """TEXT with a plain number format: 0.00, #,##0, 0.0E+00, 0%; others depend on the country."""
    if type(value) is str or type(value) is bool:
        return text(c, value)
    x = c.arithmetic.to_float(number(c, value))
    if form in ("", "@") or form.lower() == "general":
        return shown(x) if form else ""
    match = FIXED.fullmatch(form)
    if not match or not (match[3] or match[4]):
        raise UnsupportedError(f"the number format {form[:40]!r} is not calculated")
    before, commas, whole_part, fraction, exponent, percent, after = match.groups(default="")
    places, size = len(fraction), Decimal(f"{abs(x):.14e}") * (100 if percent else 1)
    if exponent:
        return _scientific(x, places, len(exponent) - 2)
    if len(whole_part) > 1 and whole_part.count("#") not in (0, len(whole_part)):
        raise UnsupportedError(f"the number format {form[:40]!r} is not calculated")
    digits = f"{size.quantize(Decimal(1).scaleb(-places), rounding=ROUND_HALF_UP):f}"
    units, _, rest = digits.partition(".")
    units = units.lstrip("0").rjust(whole_part.count("0"), "0")
    units = f"{int(units or '0'):,}" if commas and units else units
    rest = rest.rstrip("0").ljust(fraction.count("0"), "0") if rest else rest
    sign = "-" if x < 0 and any(d in "123456789" for d in digits) else ""
    return sign + before.strip('"') + units + ("." + rest if fraction else "") + percent \
        + after.strip('"')  # fmt: skip


def _fixed(c: Context, value: Number, places: int = 2, plain: int = 0) -> str:
    """A number with so many places, and a comma at the thousands unless ``plain``."""
    if places < 0:
        raise UnsupportedError("FIXED with fewer than 0 places is not calculated")
    units = "0" if plain else "#,##0"
    return _formatted(c, value, f"{units}.{'0' * places}" if places else units)


def _scientific(x: float, places: int, width: int) -> str:
    digits, _, power = f"{x:.{places}E}".partition("E")
    return f"{digits}E{power[0]}{abs(int(power)):0{width}d}"


# -- what kind of value ----------------------------------------------------------------------------


def _test(holds: Callable[[Context, Scalar], bool]) -> Entry:
    return each("V", holds)


def _parity(odd: bool) -> Callable[[Context, Number], bool]:
    def holds(c: Context, x: Number) -> bool:
        return int(abs(x)) % 2 == odd

    return holds


KINDS = {str: 2.0, bool: 4.0, Error: 16.0, tuple: 64.0}
NUMBERS_OF_ERRORS = {
    error: float(place)
    for place, error in enumerate(
        (Error.NULL, Error.DIV0, Error.VALUE, Error.REF, Error.NAME, Error.NUM, Error.NA), 1
    )
} | {Error.SPILL: 9.0, Error.CALC: 14.0}


def _type(c: Context, value: Value) -> Number:
    found = intersect(c, value) if is_reference(value) else value
    return c.arithmetic.from_float(KINDS.get(type(found), 1.0))


def _error_number(c: Context, value: Scalar) -> Scalar:
    if type(value) is not Error or value not in NUMBERS_OF_ERRORS:
        return Error.NA
    return c.arithmetic.from_float(NUMBERS_OF_ERRORS[value])


def _as_number(c: Context, value: Value) -> Scalar:
    """N: a number stays one, TRUE is 1, anything else 0; of a range its first cell counts."""
    cell = _first(c, value)
    if type(cell) is Error or is_number(c, cell):
        return cell
    return c.arithmetic.from_float(float(cell is True))


def _as_text(c: Context, value: Value) -> Scalar:
    cell = _first(c, value)
    return cell if type(cell) is str or type(cell) is Error else ""


def _first(c: Context, value: Value) -> Scalar:
    if type(value) is Area:
        return c.cell(*value[:3])
    return value[0][0] if type(value) is tuple else value


def _is_formula(c: Context, value: Value) -> bool:
    if type(value) is not Area:
        raise FailedError(Error.VALUE)
    return c.formula_at(*value[:3])


def _is_reference(compiler: Compiler, tree: tuple) -> Program:
    run = compiler.raw(tree)
    return lambda c: is_reference(run(c))


TESTS: dict[str, Callable[[Context, Scalar], bool]] = {
    "ISNUMBER": is_number,
    "ISBLANK": lambda c, v: v is EMPTY,
    "ISTEXT": lambda c, v: type(v) is str,
    "ISNONTEXT": lambda c, v: type(v) is not str,
    "ISLOGICAL": lambda c, v: type(v) is bool,
    "ISERROR": lambda c, v: type(v) is Error,
    "ISERR": lambda c, v: type(v) is Error and v is not Error.NA,
    "ISNA": lambda c, v: v is Error.NA,
}

FUNCTIONS: dict[str, Entry] = {name: _test(holds) for name, holds in TESTS.items()} | {
    "ISEVEN": each("n", _parity(False)),
    "ISODD": each("n", _parity(True)),
    "ISREF": (1, 1, _is_reference),
    "ISFORMULA": whole(1, 1, _is_formula),
    "N": whole(1, 1, _as_number),
    "T": whole(1, 1, _as_text),
    "NA": whole(0, 0, lambda c: Error.NA),
    "TYPE": whole(1, 1, _type),
    "ERROR.TYPE": each("V", _error_number),
    "VALUE": each("v", _value),
    "TEXT": each("vt", _formatted),
    "FIXED": each("nii", _fixed, 1),
    "CONCATENATE": whole(1, MANY, _concatenate),
    "CONCAT": whole(1, MANY, _concat),
    "TEXTJOIN": whole(3, MANY, _text_join),
    "LEFT": each("ti", _left, 1),
    "RIGHT": each("ti", _right, 1),
    "MID": each("tii", _middle),
    "REPLACE": each("tiit", _replace),
    "LEN": each("t", lambda c, t: c.arithmetic.from_float(float(len(t)))),
    "LOWER": each("t", lambda c, t: t.lower()),
    "UPPER": each("t", lambda c, t: t.upper()),
    "PROPER": each("t", lambda c, t: t.title()),
    "TRIM": each("t", lambda c, t: re.sub(" +", " ", t.strip(" "))),
    "CLEAN": each("t", lambda c, t: re.sub(r"[\x00-\x1f]", "", t)),
    "EXACT": each("tt", lambda c, a, b: a == b),
    "SUBSTITUTE": each("ttti", _substitute, 3),
    "REPT": each("ti", _repeat),
    "FIND": each("tti", _find, 2),
    "SEARCH": each("tti", _search, 2),
    "CHAR": each("i", _character),
    "CODE": each("t", _code),
}
