"""The copy that IronCalc is given shares formulas, and no number in it differs from the file's."""

import zipfile
from pathlib import Path

import ironcalc
import openpyxl
import pytest
from archives import say_it_is_ours
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from openpyxl.workbook.defined_name import DefinedName

from kfsheet.workbook.engines.copies_for_engines import copy_for_ironcalc
from kfsheet.workbook.engines.ironcalc import IronCalc
from kfsheet.workbook.engines.shared_formulas import share_formulas

WORKBOOKS = sorted((Path(__file__).parents[2] / "workbooks").glob("*.xlsx"))
OTHER = "Q 5"  # a worksheet whose name looks like a reference
MOVING = [  # each is the one above filled down
    "A{0}+B{0}",
    "S!A{0}*$B{0}",
    "SUM(A$1:A{0})+S!$B$2",
    'IF(ISNUMBER(S!A{0}),S!A{0},"")',
    "LOG10(A{0}+10)+A{0}%",
    "IF(A{0}>2,NA(),A{0})",
    "ATAN2(S!B{0},A{1})",
]
STAYING = [  # a text or a name that only looks like a reference that moves
    'IF(A{0}>2,"A{0}","B{0}")',
    "'Q 5'!A{0}+1",
    "A2+B3",
    'A{0}&"\'"',
    '"S!A{0}"&A{0}',
    "b1*2",  # the same as B1*2, which moves
    "$a1+B{0}",
    "sum(a1:b1)",
    "SUM(S!2:2)+A{0}",
    "SUM($2:3)",
    "A1048570+A{0}",
    "caf\u00e9B{0}",  # a name that ends like a reference
    'A{0}&CHAR(65)&"#"',
]


def test_there_are_workbooks_to_look_at():
    assert len(WORKBOOKS) >= 4


@pytest.mark.parametrize("path", WORKBOOKS, ids=lambda path: path.stem)
def test_our_workbooks_compute_the_same_where_their_formulas_are_shared(path):
    plain = ironcalc.load_from_xlsx(str(path), "en", "UTC")
    plain.evaluate()
    titles = [sheet["name"] for sheet in plain.get_worksheets_properties()]
    expected = {title: {} for title in titles}
    for sheet, row, column in plain.get_all_cells():
        value = plain.get_cell_value(sheet, row, column)
        if value is not None:
            expected[titles[sheet]][row, column] = value
    assert IronCalc(path).values() == expected


def written(path: Path, columns: list[list[str]]) -> None:
    book = openpyxl.Workbook()
    for title in ("T", "S", OTHER):
        sheet = book.create_sheet(title)
        for row in range(1, 8):
            sheet.cell(row, 1, row + 0.5)
            sheet.cell(row, 2, 10.0 * row + len(title))
    for at, column in enumerate(columns, 3):
        for row, rule in enumerate(column, 1):
            book["T"].cell(row, at, "=" + rule.format(row, row + 1))
    del book["Sheet"]
    for row in range(1, 9):
        place = DefinedName(f"caf\u00e9B{row}", attr_text=f"S!$A${row}")
        book.defined_names[place.name] = place
        place = DefinedName(f"YAW{row}", attr_text=f"S!$B${row}")
        book.defined_names[place.name] = place
    unsaid = path.with_name("unsaid.xlsx")
    book.save(unsaid)
    say_it_is_ours(unsaid, path)  # only in files of ours are formulas shared


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.lists(st.sampled_from(MOVING + STAYING), min_size=1, max_size=7), min_size=1, max_size=4
    )
)
def test_any_column_of_formulas_computes_the_same(tmp_path, columns):
    written(tmp_path / "a.xlsx", columns)
    plain = ironcalc.load_from_xlsx(str(tmp_path / "a.xlsx"), "en", "UTC")
    plain.evaluate()
    found = IronCalc(tmp_path / "a.xlsx").values()["T"]
    for at, column in enumerate(columns, 3):
        for row in range(1, len(column) + 1):
            assert found[row, at] == plain.get_cell_value(0, row, at)


@pytest.mark.parametrize("rule", MOVING)
def test_a_formula_that_is_filled_down_is_written_once(rule):
    column = "".join(f'<c r="C{r}"><f>{rule.format(r, r + 1)}</f></c>' for r in range(4, 9))
    copy = share_formulas(column.encode()).decode()
    assert copy.count(rule.format(4, 5)) == 1
    assert copy.count("<f t=") == 5
    assert "<f>" not in copy


@pytest.mark.parametrize("rule", STAYING)
def test_a_formula_that_is_not_filled_down_is_not_shared(rule):
    column = "".join(f'<c r="C{r}"><f>{rule.format(r, r + 1)}</f></c>' for r in range(4, 9))
    assert '"/>' not in share_formulas(column.encode()).decode()


def test_the_files_of_other_programs_are_left_alone(tmp_path):
    written(tmp_path / "ours.xlsx", [["A{0}+S!B{0}"] * 7])
    for name, groups in (("ours.xlsx", 1), ("unsaid.xlsx", 0)):
        copy_for_ironcalc(tmp_path / name, tmp_path / "copy.xlsx")
        with zipfile.ZipFile(tmp_path / "copy.xlsx") as archive:
            assert archive.read("xl/worksheets/sheet1.xml").count(b'"shared" ref=') == groups


def test_a_cell_without_an_address_is_left_as_it_is():
    row = b'<row r="5"><c r="A5"><v>1</v></c><c><f>B5</f></c></row>'
    assert share_formulas(row) == row
