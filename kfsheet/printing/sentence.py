"""Sentences with the numbers of a run: as the formula of a cell, and as plain text.

A sentence is a sequence of pieces: words, numbers and choices between words. Formats hold in every
country: FIXED and ROUND know no decimal point, as TEXT's patterns do.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import ROUND_HALF_UP, Context, Decimal
from string import Formatter

from sympy import Basic, Expr, Symbol
from sympy.logic.boolalg import Boolean

from kfsheet.errors import ModelError, PrintError
from kfsheet.printing.excel import HARD_LIMIT, Names, excel_code

NO_VALUE = "(no value)"
"""Stands where a number has none: a gap, or an error."""
DOUBLE = Context(prec=15)  # what spreadsheets count of a number
FORMAT = re.compile(r"\.(\d)([fg%])")


@dataclass(frozen=True)
class Number:
    """A number in a sentence.

    Attributes
    ----------
    expression : Expr
        Of scalars.
    digits : int
        After the point; of ``significant`` numbers, the figures that count.
    percent, significant : bool
        Whether 0.05 is written as 5 %; whether digits are counted from the first one that is not 0.
    """

    expression: Expr
    digits: int
    percent: bool = False
    significant: bool = False


@dataclass(frozen=True)
class Choice:
    """Words by condition: those of the first one that holds, or else the others."""

    cases: tuple[tuple[Boolean, str], ...]
    otherwise: str


Piece = str | Number | Choice


def excel_sentence(pieces: Sequence[Piece], names: Names | None = None) -> str:
    """The formula of a sentence, ``=`` included.

    Raises
    ------
    PrintError
        If it is longer than 255 characters: write two sentences.

    Examples
    --------
    >>> from sympy import Symbol
    >>> excel_sentence(["off by ", Number(Symbol("e"), 2), " m"])
    '="off by "&IFERROR(FIXED(e,2,TRUE),"(no value)")&" m"'
    """
    text = "=" + "&".join(_excel_piece(piece, names) for piece in pieces)
    if len(text) > HARD_LIMIT:
        raise PrintError(f"the sentence is longer than {HARD_LIMIT} as a formula: {text}")
    return text


def _excel_piece(piece: Piece, names: Names | None) -> str:
    if isinstance(piece, str):
        return _quoted(piece)
    if isinstance(piece, Number):
        value, end = excel_code(piece.expression, names), ""
        if piece.percent:
            value, end = excel_code(100 * piece.expression, names), f"&{_quoted(' %')}"
        shown = f"FIXED({value},{piece.digits},TRUE)"
        if piece.significant:
            places = f"{piece.digits - 1}-INT(LOG10(ABS({value})))"
            shown = f"IF({value}=0,0,ROUND({value},MAX(0,{places})))"
        return f'IFERROR({shown},"{NO_VALUE}"){end}'
    text = _quoted(piece.otherwise)
    for condition, words in reversed(piece.cases):
        text = f"IF({excel_code(condition, names)},{_quoted(words)},{text})"
    return text


def _quoted(words: str) -> str:
    return '"' + words.replace('"', '""') + '"'


def plain_sentence(pieces: Sequence[Piece], values: Mapping[str, float]) -> str:
    """The same sentence with the values of scalars by name; NaN is no value.

    Examples
    --------
    >>> from sympy import Symbol
    >>> plain_sentence(["off by ", Number(Symbol("e"), 2), " m"], {"e": 0.12499})
    'off by 0.12 m'
    """
    return "".join(_plain_piece(piece, values) for piece in pieces)


def _plain_piece(piece: Piece, values: Mapping[str, float]) -> str:
    if isinstance(piece, str):
        return piece
    if isinstance(piece, Number):
        end = " %" if piece.percent else ""
        return _shown(piece, _value(piece.expression, values)) + end
    return next(
        (words for condition, words in piece.cases if _value(condition, values)), piece.otherwise
    )


def _value(expression: Basic, values: Mapping[str, float]) -> float | bool:
    found = expression.subs({s: values[s.name] for s in expression.free_symbols})
    return bool(found) if isinstance(found, Boolean) else float(found)


def _shown(number: Number, value: float) -> str:
    if not math.isfinite(value):
        return NO_VALUE
    exact = DOUBLE.create_decimal_from_float(100 * value if number.percent else value)
    digits = number.digits
    if number.significant:
        digits = max(0, digits - 1 - exact.adjusted()) if exact else 0
    # Half away from zero, as spreadsheets round.
    rounded = exact.quantize(Decimal(1).scaleb(-digits), ROUND_HALF_UP)
    if number.significant:
        rounded = rounded.normalize()
    return f"{rounded:f}"


@dataclass(frozen=True)
class Verdict:
    """A sentence with the numbers of the run that is seen, and words that depend on them.

    Parameters
    ----------
    text : str
        The sentence; ``{rms_e_x:.2f}`` is a scalar of the model (a parameter, a derived scalar, a
        summary) with two digits, ``{share:.0%}`` one in per cent, ``{p_x:.3g}`` one with three
        figures; a name of ``numbers`` or ``choices`` may stand there too.
    numbers : mapping, optional
        Expressions of scalars by name, for what is no scalar of its own.
    choices : mapping, optional
        Words by name: pairs of a condition and words, and at last the words where none holds, as in
        ``{"better": ((e_x < e_camera, "less than"), "no less than")}``.

    Raises
    ------
    ModelError
        From ``check``: a name that the model has not, a format that is none of these.

    Examples
    --------
    >>> verdict = Verdict("The analysis errs by {e:.2f} m.")
    >>> verdict.words({"e": 0.0449})
    'The analysis errs by 0.04 m.'
    """

    text: str
    numbers: Mapping[str, Expr] = field(default_factory=dict)
    choices: Mapping[str, tuple] = field(default_factory=dict)

    def pieces(self) -> list[Piece]:
        """What a printer is handed."""
        return list(self._pieces())

    def words(self, values: Mapping[str, float]) -> str:
        """The sentence with the values of scalars by name."""
        return plain_sentence(self.pieces(), values)

    def check(self, scalars: Collection[str], model: str) -> None:
        """Refuse what is none of the scalars of a model."""
        for piece in self.pieces():
            for expression in _expressions(piece):
                if missing := {s.name for s in expression.free_symbols}.difference(scalars):
                    raise ModelError(
                        f"the sentence {self.text[:40]!r}: {missing.pop()} is no scalar of "
                        f"{model}; make it a summary()"
                    )

    def _pieces(self) -> Iterator[Piece]:
        try:
            parts = list(Formatter().parse(self.text))
        except ValueError as error:
            raise ModelError(f"the sentence {self.text[:40]!r}: {error}") from None
        for words, name, shape, _ in parts:
            if words:
                yield words
            if name in self.choices:
                *cases, otherwise = self.choices[name]
                yield Choice(tuple(cases), otherwise)
            elif name is not None:
                yield self._number(name, shape or "")

    def _number(self, name: str, shape: str) -> Number:
        match = FORMAT.fullmatch(shape)
        if not match or not name.isidentifier():
            raise ModelError(
                f"the sentence {self.text[:40]!r}: write {{{name}:.2f}}, {{{name}:.3g}} or "
                f"{{{name}:.0%}}"
            )
        expression = self.numbers.get(name, Symbol(name, real=True))
        return Number(expression, int(match[1]), match[2] == "%", match[2] == "g")


def _expressions(piece: Piece) -> Iterator[Expr | Boolean]:
    if isinstance(piece, Number):
        yield piece.expression
    elif isinstance(piece, Choice):
        yield from (condition for condition, _ in piece.cases)


def words_of(sentence: str | Verdict, values: Mapping[str, float]) -> str:
    """A sentence as it reads in a run, whether it has numbers or not."""
    return sentence.words(values) if isinstance(sentence, Verdict) else sentence
