"""What a workbook promises: sheets, names, formulas, stored values, charts, the same bytes."""

import re
import zipfile

import openpyxl
import pandas as pd
import pytest
from openpyxl.formula import Tokenizer
from openpyxl.utils import FORMULAE, column_index_from_string
from openpyxl.utils.cell import coordinate_from_string

from kfsheet import (
    Exercise,
    ModelError,
    Recurrence,
    WorkbookError,
    check_workbook,
    evaluate,
    t,
    write_workbook,
)
from kfsheet.exercises import load_exercise
from kfsheet.exercises.football import exercise, football
from kfsheet.workbook.engines.libreoffice import convert
from kfsheet.workbook.engines.recalculate import open_in, recalculate
from kfsheet.workbook.write.layout import FIRST_ROW, Layout
from kfsheet.workbook.write.run import Run
from kfsheet.workbook.write.sheet import is_formula
from kfsheet.workbook.write.write_workbook import assemble, compose, workbook_bytes

SECTIONS = ["Reanalysis", "Free run", "Errors", "Pixel frame", "Goal line", "Four states"]


@pytest.fixture(scope="module")
def book(football_file):
    return openpyxl.load_workbook(football_file)


@pytest.fixture(scope="module")
def stored(football_file):
    return openpyxl.load_workbook(football_file, data_only=True)


def formulas(book):
    for sheet in book:
        for row in sheet.iter_rows():
            for cell in row:
                if is_formula(cell.value):
                    yield sheet.title, cell


def test_a_workbook_that_somebody_changed_is_not_overwritten(tmp_path, engine):
    """Whichever program saved it: openpyxl, or LibreOffice."""
    path = write_workbook(exercise, tmp_path)
    assert write_workbook(exercise, tmp_path) == path
    if engine == "libreoffice":
        convert(path, tmp_path / "saved", "xlsx:Calc MS Excel 2007 XML").replace(path)
    else:
        openpyxl.load_workbook(path).save(path)
    changed = path.read_bytes()
    with pytest.raises(WorkbookError, match="move it away to keep it"):
        write_workbook(exercise, tmp_path)
    assert path.read_bytes() == changed
    write_workbook(exercise, tmp_path, force=True)
    assert path.read_bytes() != changed


def test_sheets_stand_in_the_order_of_the_contract(book):
    assert book.sheetnames == ["Read me", "Parameters", *SECTIONS, "Charts", "Check"]


def test_every_scalar_is_a_name_equal_to_its_symbol(book):
    names = {*football.parameters, *football.derived_scalars, *football.summaries}
    assert names <= set(book.defined_names)
    for name in football.parameters:
        ((sheet, cell),) = book.defined_names[name].destinations
        assert book[sheet][cell].value == football.parameters[name].value


def test_headers_are_symbol_unit_and_words_and_are_frozen(book):
    for section in SECTIONS:
        sheet = book[section]
        symbols = [cell.value for cell in sheet[1]]
        assert symbols == ["photo", "time", *(c.name for c in football.sections[section])]
        assert sheet["B2"].value == "s"
        assert all(cell.value for cell in sheet[3])
        assert sheet.freeze_panes == "C4"
        assert [sheet.cell(FIRST_ROW + n, 1).value for n in range(16)] == list(range(16))


def test_a_printed_page_says_where_it_comes_from(book):
    """Name and number of the page, and the heading of its table; on A4."""
    for sheet in book:
        assert (sheet.oddFooter.left.text, sheet.oddFooter.right.text) == ("&A", "&P / &N")
        assert sheet.page_setup.paperSize == int(sheet.PAPERSIZE_A4)
        if sheet.freeze_panes:
            heading = int(sheet.print_title_rows.replace("$", "").split(":")[1])
            assert f"A{heading + 1}" == "A" + re.sub(r"[A-Z]+", "", sheet.freeze_panes)
    assert book["Check"].print_title_rows == "$11:$11"
    assert book["Check"]["A11"].value == "name"


@pytest.mark.parametrize("name", ["cannonball", "shuttlecock", "tennis"])
def test_a_wide_table_prints_on_pages_that_can_be_read(name):
    """Type of 11 points gets smaller as more columns share a page, but not than 7.5 points."""
    own = load_exercise(name)
    layout, run = Layout.standard(own.model), Run.of(own.model)
    pages = compose(own, layout, run, run)
    for page, sheet in zip(pages, assemble(own, layout, pages, run), strict=True):
        if not page.freeze:
            continue
        columns = column_index_from_string(coordinate_from_string(page.freeze)[0])
        kept = sum(page.widths[n] for n in range(1, columns))
        rest = sum(page.widths.values()) - kept
        centimetres = 0.19 * (kept + rest / (sheet.page_setup.fitToWidth or 1))
        assert 11 * 25.9 / centimetres > 7.5, page.title  # A4 without its margins


def test_every_computed_cell_is_a_formula(book):
    for section in SECTIONS:
        for number, column in enumerate(football.sections[section], 3):
            for row in range(len(column.start), football.rows):
                content = book[section].cell(FIRST_ROW + row, number).value
                assert is_formula(content) != column.is_data, (section, column.name, row)


def test_formulas_hold_small_numbers_and_functions_of_excel_2010_only(book):
    for title, cell in formulas(book):
        for token in Tokenizer(cell.value).items:
            if token.type == "OPERAND" and token.subtype == "NUMBER":
                assert re.fullmatch(r"\d\d?", token.value), (title, cell.coordinate, cell.value)
            if token.type == "FUNC" and token.subtype == "OPEN":
                assert token.value.rstrip("(") in FORMULAE, (title, cell.coordinate, cell.value)


def test_formulas_are_short_enough_to_audit(book):
    assert max(len(cell.value) for _, cell in formulas(book)) < 120


@pytest.mark.parametrize("name", ["football", "tennis_toss"])
def test_a_formula_that_is_filled_down_is_stored_once_and_is_the_same_in_every_row(name, tmp_path):
    """openpyxl moves the references of a shared formula; we print every row by itself."""
    other = load_exercise(name)
    layout, now = Layout.standard(other.model), Run.of(other.model)
    path = write_workbook(other, tmp_path)
    book = openpyxl.load_workbook(path)
    for page in compose(other, layout, now, now):
        for (row, column), piece in page.all_cells():
            if is_formula(piece.content):
                assert book[page.title].cell(row, column).value == piece.content
    with zipfile.ZipFile(path) as archive:
        sheets = [archive.read(n).decode() for n in archive.namelist() if "worksheets/sheet" in n]
    heads = re.findall(r'<f t="shared" ref="\w+:\w+" si="\d+">([^<]+)</f>', "".join(sheets))
    followers = "".join(sheets).count('<f t="shared" si=')
    assert len(heads) > 20
    assert followers > 5 * len(heads)
    # Excel does not move a relative reference to another worksheet in a shared formula.
    assert not any("!" in text for text in heads)


def test_an_engine_takes_changes_back_before_the_next(football_file, engine):
    book = open_in(football_file, engine)
    before = book.values()
    changed = book.values({"Parameters": {(5, 2): 0.2}, "Reanalysis": {(9, 3): None, (9, 7): 3.0}})
    assert changed["Reanalysis"][9, 7] == 3
    assert changed["Reanalysis"][8, 7] != before["Reanalysis"][8, 7]
    assert (9, 3) not in changed["Reanalysis"]
    assert book.values() == before


def test_formulas_use_names_so_that_they_read_like_mathematics(book):
    sheet = book["Reanalysis"]
    assert sheet["K9"].value == "=IF(ISNUMBER(I9),G9+K_x*I9,G9)"
    assert sheet["E9"].value == "=(K8-K7)/dt-dt*f*SIGN(E8)*E8^2"
    ((page, cell),) = book.defined_names["K_x"].destinations
    assert book[page][cell].value == "=a*b_x/(r_i+a^2*b_x)"


def test_every_formula_carries_the_value_that_independent_engines_find(
    engine, book, stored, football_file
):
    found = recalculate(football_file, engine)
    count = 0
    for title, cell in formulas(book):
        kept = stored[title][cell.coordinate].value
        value = found[title].get((cell.row, cell.column))
        if isinstance(kept, int | float):
            assert value == pytest.approx(kept, rel=1e-11, abs=1e-12), (title, cell.coordinate)
        else:
            assert (value or None) == kept, (title, cell.coordinate)
        count += 1
    assert count > 1000


def test_pandas_reads_the_numbers_without_recalculating(football_file):
    sheet = pd.read_excel(football_file, sheet_name="Reanalysis", skiprows=[1, 2])
    frame = evaluate(football)
    for name in ("u", "x_f", "d_i", "x_a"):
        pd.testing.assert_series_equal(
            sheet[name], frame[name], check_index=False, check_names=False, rtol=1e-15
        )


def test_two_builds_give_the_same_bytes(football_file):
    assert workbook_bytes(exercise) == football_file.read_bytes()


def test_the_check_sheet_says_pass_and_says_when_something_was_changed(
    engine, football_file, tmp_path
):
    def verdict(change=None):
        copy = openpyxl.load_workbook(football_file)
        if change:
            sheet, cell, value = change
            copy[sheet][cell] = value
        copy.save(tmp_path / "copy.xlsx")
        return recalculate(tmp_path / "copy.xlsx", engine)["Check"][4, 2]

    assert verdict() == "PASS"
    assert verdict(("Parameters", "B12", 900)) == "parameters changed"
    assert verdict(("Reanalysis", "C9", None)) == "data changed"
    assert verdict(("Reanalysis", "G9", "=K8")) == "FAIL"
    assert verdict(("Reanalysis", "G9", "=1/0")) == "FAIL"


def test_a_photo_that_is_deleted_leaves_the_forecast(engine, football_file, tmp_path):
    copy = openpyxl.load_workbook(football_file)
    copy["Reanalysis"]["C9"] = None
    copy.save(tmp_path / "copy.xlsx")
    values = recalculate(tmp_path / "copy.xlsx", engine)
    row = {column: values["Reanalysis"].get((9, number)) for number, column in enumerate("GHIK", 7)}
    assert row["G"] == values["Reanalysis"][9, 11]
    assert not values["Reanalysis"].get((9, 9))


def test_charts_are_native_live_and_labelled(book, football_file):
    with zipfile.ZipFile(football_file) as archive:
        charts = [n for n in archive.namelist() if re.fullmatch(r"xl/charts/chart\d+\.xml", n)]
        assert len(charts) == len(exercise.charts)
        for name in charts:
            text = archive.read(name).decode()
            assert text.count("<c:title>") + text.count("<title>") == 3  # chart and both axes
            assert "numLit" not in text  # nothing but references
        assert any('<orientation val="maxMin"' in archive.read(n).decode() for n in charts)


def test_a_value_that_may_be_missing_reaches_a_chart_as_a_gap(book):
    texts = [cell.value for _, cell in formulas(book) if "NA()" in cell.value]
    assert "=IF(ISNUMBER(Reanalysis!I4),Reanalysis!I4,NA())" in texts


def test_the_legend_of_colours_and_the_way_to_use_it_stand_on_read_me(book):
    text = " ".join(str(c.value) for row in book["Read me"].iter_rows() for c in row if c.value)
    for word in (
        "a parameter",
        "a measurement",
        "a formula",
        "change r_i",
        "football",
    ):
        assert word in text


def test_inputs_carry_messages_and_refuse_what_they_cannot_be(book):
    rules = book["Parameters"].data_validations.dataValidation
    assert len(rules) == len(football.parameters)
    (rule,) = [r for r in rules if "B5" in str(r.sqref)]
    assert (rule.operator, rule.formula1, rule.promptTitle) == ("greaterThan", "0", "dt")


def test_a_file_is_written_whole_or_not_at_all(tmp_path):
    blocker = tmp_path / "file"
    blocker.write_text("in the way")
    with pytest.raises(WorkbookError, match="cannot be written"):
        write_workbook(exercise, blocker / "football.xlsx")
    (tmp_path / "football.xlsx").mkdir()
    with pytest.raises(WorkbookError, match="cannot be written"):
        write_workbook(exercise, tmp_path / "football.xlsx")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "football.xlsx"]


def pages(steps):
    m = Recurrence("pages", title="Two pages", step="row", rows=4)
    long = m.parameter("long", 1172.9245234289695, "m", "a number of 17 digits")
    m.time(t * 1, "", "time")
    m.columns("a", section="First"), m.columns("b", section="Second")
    m.define(m["a"][t], t * long, "m", "a")
    m.define(m["b"][t], m["a"][t], "m", "b")
    for section, step in steps.items():
        m.rows_are(section, step)
    return Exercise(model=m, about=("About.",), source="none")


def test_a_sheet_may_count_other_things_than_the_clocks_steps(tmp_path):
    exercise = pages({"First": "angle"})
    path = write_workbook(exercise, tmp_path)
    book = openpyxl.load_workbook(path)
    assert [cell.value for cell in book["First"][1]] == ["angle", "a"]
    assert [cell.value for cell in book["Second"][1]] == ["row", "time", "b"]
    assert not check_workbook(path, exercise).problems


def test_a_step_needs_a_name_of_its_own():
    for taken in ("a", "time", "row", "long"):
        with pytest.raises(ModelError, match="taken"):
            pages({"First": taken})


def test_a_number_keeps_its_17_digits(tmp_path):
    """openpyxl writes 16; the parameter would come back changed."""
    path = write_workbook(pages({}), tmp_path)
    cell = openpyxl.load_workbook(path)["Parameters"]["B5"]
    assert cell.value == 1172.9245234289695
    assert float(f"{cell.value:.16g}") != cell.value
