"""``kfsheet check`` can fail: every kind of damage is reported, at exactly the damaged cell."""

import re

import openpyxl
import pytest

from kfsheet import DataError, EngineError, WorkbookError, check_workbook, recalculate
from kfsheet.coursework.handout.handout_workbook import solution_bytes
from kfsheet.coursework.handout.own_numbers import own_numbers
from kfsheet.exercises import exercise_names, load_exercise
from kfsheet.exercises.football import exercise
from kfsheet.workbook.check.opened_workbook import OpenedWorkbook
from kfsheet.workbook.reading.open_workbook import open_workbook
from kfsheet.workbook.write.check_sheet import TABLE_ROW


def changing(original, path):
    """Write a copy in which cells have been changed: ``damaged({"Reanalysis!G9": "=K8"})``."""

    def make(changes):
        book = openpyxl.load_workbook(original)
        for place, content in changes.items():
            sheet, cell = place.split("!")
            book[sheet][cell] = content(book[sheet][cell].value) if callable(content) else content
        book.save(path)
        return path

    return make


@pytest.fixture
def damaged(football_file, tmp_path):
    return changing(football_file, tmp_path / "damaged.xlsx")


def write_solution(exercise, path):
    """The workbook of a student's own numbers, with the answers."""
    own = own_numbers(exercise, b"the secret of the tests, 32 byte", "s001")
    path.write_bytes(solution_bytes(exercise, own))
    return path


@pytest.fixture(scope="module")
def solution_file(tmp_path_factory):
    return write_solution(exercise, tmp_path_factory.mktemp("solved") / "football.xlsx")


@pytest.fixture
def damaged_solution(solution_file, tmp_path):
    return changing(solution_file, tmp_path / "damaged.xlsx")


def places(report):
    return [str(problem).split(": ")[0] for problem in report.problems]


def quoted(place):
    """A place as reports have it: 'Pixel frame'!I4."""
    sheet, _, cell = place.partition("!")
    return f"'{sheet}'!{cell}" if " " in sheet else place


def test_an_untouched_workbook_holds(engine, football_file):
    report = check_workbook(football_file, exercise, engine)
    assert report.holds
    assert report.cells > 1000
    assert report.largest < (1e-12 if engine == "ironcalc" else 1e-11)
    assert report.changed == []


def test_changed_parameters_and_photos_are_told_and_still_hold(engine, damaged):
    path = damaged({"Parameters!B12": 900, "Parameters!B18": 0, "Reanalysis!C9": None})
    report = check_workbook(path, exercise, engine)
    assert report.holds
    assert report.changed == ["r_i 9 -> 900", "h 0.5 -> 0", "1 value of i"]


@pytest.mark.parametrize("name", exercise_names())
def test_a_students_solution_holds_and_nothing_in_it_was_changed(name, tmp_path):
    """It was built from the student's numbers, and its sheet "Check" knows those."""
    own = load_exercise(name)
    report = check_workbook(write_solution(own, tmp_path / "solution.xlsx"), own)
    assert report.lines() == []
    assert report.changed == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"Parameters!B12": 900}, [r"r_i [\d.]+ -> 900"]),
        ({"Reanalysis!C9": 300}, ["values of i"]),
        ({"Parameters!B12": 900, "Reanalysis!C9": 300}, ["values of i", r"r_i [\d.]+ -> 900"]),
    ],
)
def test_what_was_changed_in_a_solution_is_told_and_it_still_holds(
    damaged_solution, changes, words
):
    report = check_workbook(damaged_solution(changes), exercise)
    assert report.lines() == []
    assert len(report.changed) == len(words)
    assert all(map(re.fullmatch, words, report.changed))


@pytest.mark.parametrize("kind", ["parameter", "data", "result"])
@pytest.mark.parametrize("where", ["damaged", "damaged_solution"])
def test_a_changed_frozen_figure_is_found(request, football_file, where, kind):
    sheet = openpyxl.load_workbook(football_file)["Check"]
    kinds = [sheet.cell(row, 2).value for row in range(1, sheet.max_row + 1)]
    row = kinds.index(kind, TABLE_ROW) + 1
    change = request.getfixturevalue(where)
    report = check_workbook(change({f"Check!E{row}": lambda frozen: frozen + 1}), exercise)
    assert f"Check!G{row}" in places(report)
    assert {p.address[0] for p in report.problems} == {"Check"}


def test_answers_still_to_be_filled_in_are_named_in_order_and_nothing_else(damaged):
    """A half-filled coursework: what follows from an empty cell is not called wrong."""
    emptied = {f"Reanalysis!{c}{r}": None for c in "GK" for r in range(4, 20)}
    report = check_workbook(damaged({"Parameters!B24": None, **emptied}), exercise)
    assert report.lines() == [
        "Parameters!B24: is empty where a formula belongs",
        "Reanalysis!G4 to Reanalysis!G19: each is empty where a formula belongs",
        "Reanalysis!K4 to Reanalysis!K19: each is empty where a formula belongs",
    ]
    assert report.followers > 100


@pytest.mark.parametrize("row", [4, 19], ids=["first", "last"])
def test_a_photo_may_be_missing_anywhere(damaged, row):
    report = check_workbook(damaged({f"Reanalysis!{c}{row}": None for c in "CD"}), exercise)
    assert report.holds, list(map(str, report.problems))


def test_all_photos_may_be_missing(engine, damaged):
    path = damaged({f"Reanalysis!{c}{row}": None for c in "CD" for row in range(4, 20)})
    report = check_workbook(path, exercise, engine)
    assert report.holds, list(map(str, report.problems))


@pytest.mark.parametrize(
    ("place", "damage"),
    [
        ("Reanalysis!G9", lambda f: f.replace("+dt*", "-dt*")),  # a changed sign
        ("Reanalysis!G9", lambda f: f.replace("-dt^p", "+dt^p")),
        ("Reanalysis!L12", lambda f: f.replace("+K_z", "-K_z")),
        ("Reanalysis!E10", lambda f: f.replace("E9", "E8")),  # one row off by one
        ("Reanalysis!G9", lambda f: f.replace("K8", "K7")),
        ("Reanalysis!K9", lambda f: f.replace("G9", "G8")),
        ("Free run!E11", lambda f: f.replace("E10", "E9")),
        ("Goal line!G12", lambda f: f.replace("/2", "")),
        ("Reanalysis!G9", 14.722150819752194),  # a number typed over the formula, still right
        ("Reanalysis!G9", lambda f: f.replace("dt*", "0.1*", 1)),  # ... or into it
        ("Reanalysis!K9", lambda f: f.replace("K_x", "0.01548898950112839")),
        ("Parameters!B23", lambda f: f.replace("r_i", "9")),
        ("Parameters!G5", lambda f: f.replace("$19", "$18")),
        ("Pixel frame!C9", None),  # a formula deleted
        ("Charts!AA9", "=Reanalysis!I9*0"),
        ("Check!D50", lambda f: f + "+1"),
        ("Reanalysis!A9", 99),  # the step index
        ("Reanalysis!I4", 5),  # a value where there is none
        ("Reanalysis!K9", "=G9+K_x*I9"),  # no longer asks whether there is an innovation
        ("Reanalysis!I12", "=C12-a*G12"),  # ... or a photo
    ],
)
def test_one_damaged_cell_is_reported_and_no_other(damaged, place, damage):
    report = check_workbook(damaged({place: damage}), exercise)
    assert [p.replace("'", "") for p in places(report)] == [place]


def test_libreoffice_finds_the_same_culprit(engine, damaged):
    path = damaged({"Reanalysis!G9": lambda f: f.replace("+dt*", "-dt*")})
    report = check_workbook(path, exercise, engine)
    assert places(report) == ["Reanalysis!G9"]
    assert report.followers > 100


def test_the_rule_is_not_blind_any_changed_sign_or_reference_is_found(damaged, football_file):
    """One mutation for every formula of a row in the middle, over all sections."""
    book = openpyxl.load_workbook(football_file)
    missed, tried = [], 0
    for section in exercise.model.sections:
        for cell in book[section][10][2:]:
            if not isinstance(cell.value, str):
                continue
            mutant = _mutant(cell.value)
            if mutant is None:
                continue
            place = f"{section}!{cell.coordinate}"
            tried += 1
            report = check_workbook(damaged({place: mutant}), exercise)
            found = [p.replace("'", "") for p in places(report)]
            missed += [] if found == [place] else [(place, mutant, found)]
    assert missed == []
    assert tried > 30


def _mutant(formula):
    """Flip the first sign between two terms; where there is none, double the whole."""
    flipped = re.sub(r"(?<=[\w)])[+-](?=[\w(])", lambda m: "+-"[m[0] == "+"], formula, count=1)
    return flipped if flipped != formula else f"=2*({formula[1:]})"


@pytest.mark.parametrize(
    ("place", "formula"),
    [
        ("Pixel frame!I4", '=(-2*sigma_d_i)&""'),  # the right number, as a text
        ("Reanalysis!G8", '=(1/3)&""'),
        ("Reanalysis!G8", '="nan"'),
        ("Reanalysis!G8", '="1_0"'),
    ],
)
def test_a_text_that_reads_like_a_number_is_named(damaged, place, formula):
    """A sum or a mean of the column passes over it, and Python would take it for a number."""
    report = check_workbook(damaged({place: formula}), exercise)
    assert quoted(place) in places(report)


def test_a_number_that_looks_like_a_date_is_a_number(engine, football_file, tmp_path):
    book = openpyxl.load_workbook(football_file)
    for row, look in ((8, "yyyy-mm-dd"), (9, "hh:mm"), (10, "[h]:mm")):
        book["Reanalysis"].cell(row, 7).number_format = look
    book.save(tmp_path / "dates.xlsx")
    report = check_workbook(tmp_path / "dates.xlsx", exercise, engine)
    assert report.holds, report.lines()


def test_two_damaged_cells_are_both_reported(damaged):
    path = damaged({"Reanalysis!G9": "=K8", "Free run!F12": "=0"})
    assert places(check_workbook(path, exercise)) == ["Reanalysis!G9", "'Free run'!F12"]


def test_stored_values_are_never_believed(engine, football_file, tmp_path):
    """A formula is damaged inside the zip and the right value stays stored beside it."""
    import zipfile

    path = tmp_path / "liar.xlsx"
    with zipfile.ZipFile(football_file) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "xl/worksheets/sheet3.xml":
                shared = rb'(<c r="G9" s="\d+">)<f t="shared" si="\d+"/>(<v>14\.722)'
                wrong = rb"\1<f>K8-dt*E9-dt^p*f*h*SIGN(E9)*E9^2</f>\2"
                content, count = re.subn(shared, wrong, content)
                assert count == 1
            new.writestr(name, content)
    kept = openpyxl.load_workbook(path, data_only=True)["Reanalysis"]["G9"].value
    assert kept == pytest.approx(14.722, abs=1e-3)
    assert recalculate(path, engine)["Reanalysis"][9, 7] == pytest.approx(17.994, abs=1e-3)
    assert places(check_workbook(path, exercise, engine)) == ["Reanalysis!G9"]


def test_inserted_columns_and_helper_cells_do_not_disturb(damaged):
    path = damaged({"Reanalysis!N5": "=K5*2", "Reanalysis!M1": "my notes", "Parameters!K3": 5})
    assert check_workbook(path, exercise).holds


def test_a_workbook_saved_by_libreoffice_still_holds(football_file, tmp_path):
    from conftest import need

    from kfsheet.workbook.engines.libreoffice import convert

    need("libreoffice")
    again = convert(football_file, tmp_path, "xlsx:Calc MS Excel 2007 XML")
    report = check_workbook(again, exercise)
    assert report.holds, list(map(str, report.problems))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"Parameters!B5": 0}, r"dt in Parameters!B5 of damaged.xlsx is 0.*greater than 0"),
        ({"Parameters!B10": -1}, r"b_x in Parameters!B10.*0 or greater"),
        ({"Parameters!B5": "soon"}, "Parameters!B5.*'soon'; it must be a number"),
        ({"Parameters!B5": None}, "Parameters!B5.*None; it must be a number"),
        ({"Reanalysis!C9": "blurred"}, "i in Reanalysis!C9.*'blurred'; it must be a number"),
        ({"Reanalysis!C9": True}, "i in Reanalysis!C9.*True; it must be a number"),
        ({"Errors!C9": None}, "x_true in Errors!C9.*empty; it must be a number"),
    ],
)
def test_inputs_that_cannot_be_used_are_named_by_cell(damaged, changes, message):
    with pytest.raises(DataError, match=message):
        check_workbook(damaged(changes), exercise)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"Reanalysis!C20": 5}, "C20 lies below the table"),
        ({"Reanalysis!G1": "forecast"}, "no column 'x_f' in row 1"),
    ],
)
def test_a_workbook_that_lost_its_shape_is_refused(damaged, changes, message):
    with pytest.raises(WorkbookError, match=message):
        check_workbook(damaged(changes), exercise)


def test_a_name_that_leads_elsewhere_and_a_second_header_are_refused(football_file, tmp_path):
    path = tmp_path / "moved.xlsx"
    book = openpyxl.load_workbook(football_file)
    book.defined_names["r_i"].attr_text = "Parameters!$B$13"
    book.save(path)
    with pytest.raises(WorkbookError, match="r_i leads to Parameters!B13, which is not labelled"):
        check_workbook(path, exercise)
    book = openpyxl.load_workbook(football_file)
    book["Reanalysis"]["N1"] = "x_f"
    book.save(path)
    with pytest.raises(WorkbookError, match="two columns 'x_f'"):
        check_workbook(path, exercise)


def test_a_comment_in_a_cell_does_not_disturb(football_file, tmp_path):
    book = openpyxl.load_workbook(football_file)
    book["Reanalysis"]["K9"].comment = openpyxl.comments.Comment("why?", "a student")
    book.save(tmp_path / "comment.xlsx")
    assert check_workbook(tmp_path / "comment.xlsx", exercise).holds


def test_a_workbook_with_a_damaged_stream_is_refused(football_file, tmp_path):
    content = bytearray(football_file.read_bytes())
    content[2000:6000] = bytes(4000)
    (tmp_path / "torn.xlsx").write_bytes(content)
    for call in (open_workbook, recalculate):
        with pytest.raises(WorkbookError, match="not a workbook"):
            call(tmp_path / "torn.xlsx")


def test_a_sheet_or_a_name_that_is_gone_is_named(football_file, tmp_path):
    book = openpyxl.load_workbook(football_file)
    book["Free run"].title = "Flight"
    book.save(tmp_path / "renamed.xlsx")
    with pytest.raises(WorkbookError, match="'Free run' is gone or renamed"):
        check_workbook(tmp_path / "renamed.xlsx", exercise)
    book = openpyxl.load_workbook(football_file)
    del book.defined_names["K_x"]
    book.save(tmp_path / "labelled.xlsx")
    assert check_workbook(tmp_path / "labelled.xlsx", exercise).problems  # formulas miss the name
    label = next(cell for cell in book["Parameters"]["A"] if cell.value == "K_x")
    label.value = "gain"
    book.save(tmp_path / "nameless.xlsx")
    with pytest.raises(WorkbookError, match="no cell is named K_x"):
        check_workbook(tmp_path / "nameless.xlsx", exercise)


def test_what_is_no_workbook_and_what_is_not_ours_is_refused(tmp_path):
    text = tmp_path / "text.xlsx"
    text.write_text("photo,t,i,j")
    for call in (open_workbook, recalculate):
        with pytest.raises(WorkbookError, match="not a workbook"):
            call(text)
        with pytest.raises(WorkbookError, match="cannot be read"):
            call(tmp_path / "nowhere.xlsx")
    foreign = tmp_path / "foreign.xlsx"
    openpyxl.Workbook().save(foreign)
    with pytest.raises(WorkbookError, match="not one of ours"):
        OpenedWorkbook(foreign).exercise_name()


def test_an_unknown_engine_is_refused(football_file):
    with pytest.raises(EngineError, match="no engine 'excel'; there is ironcalc, libreoffice"):
        recalculate(football_file, "excel")
