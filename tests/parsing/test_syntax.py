"""parse_formula: the tree of a formula, by Excel's precedence, and openpyxl's own tokens."""

import openpyxl
import pytest
from openpyxl.formula import Tokenizer

from kfsheet.errors import FormulaError
from kfsheet.parsing.syntax import parse_formula, tokens


def shown(tree):
    """A tree as text with all parentheses; references as they are found, by row and column."""
    kind, *parts = tree
    if kind == "reference":
        (reference,) = parts
        ends = [f"r{c.row}c{c.column}" for c in (reference.first, reference.last) if c]
        return f"{reference.sheet}!" * bool(reference.sheet) + (reference.name or ":".join(ends))
    if kind == "unary":
        return f"({parts[0]}{shown(parts[1])})"
    if kind == "binary":
        return f"({shown(parts[1])}{parts[0]}{shown(parts[2])})"
    if kind in ("call", "array", "row"):
        name = parts.pop(0) if kind == "call" else kind
        return f"{name}({'|'.join(map(shown, parts))})"
    return "omitted" if kind == "omitted" else f"{parts[0]:g}" if kind == "number" else f"{parts}"


@pytest.mark.parametrize(
    ("formula", "tree"),
    [
        ("=-2^2", "((-2)^2)"),
        ("=2^3^2", "((2^3)^2)"),
        ("=2^-3^2", "((2^(-3))^2)"),
        ("=1-2-3*4/5", "((1-2)-((3*4)/5))"),
        ("=-5%^2", "((-(%5))^2)"),
        ("=1+2&3=4", "(((1+2)&3)=4)"),
        ("=A1:B2 B1:C3", "(r1c1:r2c2 r1c2:r3c3)"),
        ("=SUM((A1,B1) C1, 2 )", "SUM(((r1c1,r1c2) r1c3)|2)"),
        ("=A1 -B1", "(r1c1-r1c2)"),
        ("=A1:INDEX(B1:B9,3)", "(r1c1:INDEX(r1c2:r9c2|3))"),
        ("=@A1:A9+A1#", "((@r1c1:r9c1)+(#r1c1))"),
        ("=IF(A1,,)", "IF(r1c1|omitted|omitted)"),
        ("={-1,2;3,4}", "array(row((-1)|2)|row(3|4))"),
        ("='it''s'!B$2+Data!x", "(it's!r2c2+Data!x)"),
        ("=LOG10(A1)+LOG10+x_A1", "((LOG10(r1c1)+r10c8509)+x_A1)"),
        ("=Table1[[#All],[x]]+[@x]", "(['Table1[[#All],[x]]']+['[@x]'])"),
        ("=[1]Data!A1+Jan:May!A1+A:A+2:3", "(((['[1]Data!A1']+['Jan:May!A1'])+['A:A'])+['2:3'])"),
        ("=Data!#REF!+#N/A", "(['#REF!']+['#N/A'])"),
        ('="a ""b"" +1"&TRUE', "(['a \"b\" +1']&[True])"),
        ("=1.5E+3+.5+2.", "((1500+0.5)+2)"),
        ("=_xlfn.STDEV.S(a)", "STDEV.S(a)"),
    ],
)
def test_a_tree_has_excels_precedence_and_every_kind_of_operand(formula, tree):
    assert shown(parse_formula(formula)) == tree
    assert hash(parse_formula(formula)) == hash(parse_formula(formula[1:]))


@pytest.mark.parametrize(
    ("formula", "place"),
    [("=A1+", 5), ("=A1**B1", 5), ("=(A1", 5), ("=A1)", 4), ('="a', 2), ("=2x", 2), ("=", 2),
     ("=SUM(A1;2)", 8), ("=A1,B1", 4), ("=LAMBDA(x,x)(2)", 13), ("=A1~B1", 4), ("={1,", 5)],
)  # fmt: skip
def test_what_is_no_formula_is_refused_at_its_character(formula, place):
    with pytest.raises(FormulaError, match=f"cannot be read near its character {place}$"):
        parse_formula(formula)


@pytest.mark.parametrize(
    "text",
    ["(" * 1999, "-" * 1999, "SIN(" * 499, "1" + "%" * 1998, "1" + "^1" * 999, "1+" * 999 + "1",
     "1=1&1+1*1^(" * 59 + "1" + ")" * 59],
)  # fmt: skip
def test_no_depth_reaches_the_end_of_pythons_stack(text):
    with pytest.raises(FormulaError, match="nested deeper"):
        parse_formula(text)


@pytest.mark.parametrize("name", ["football", "tennis"])
def test_our_workbooks_formulas_fall_into_the_pieces_that_openpyxl_finds(name):
    kinds = {"WHITE-SPACE", "PAREN", "SEP"}
    found = 0
    for sheet in openpyxl.load_workbook(f"workbooks/{name}.xlsx"):
        for (cell,) in zip(c for row in sheet.iter_rows(max_row=12) for c in row):
            if cell.data_type == "f":
                theirs = [t.value for t in Tokenizer(cell.value).items if t.type not in kinds]
                ours = [t.text for t in tokens(cell.value) if t.text not in {*" ,()", ""}]
                assert ours == [text for text in theirs if text != ")"], cell.value
                found += 1
    assert found > 100
