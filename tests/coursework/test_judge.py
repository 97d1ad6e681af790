"""Marks and messages for what students do, for every exercise that asks questions."""

import re
from pathlib import Path

import openpyxl
import pytest
import students as do
from students import ADA, SECRET, Paper

import kfsheet.exercises
from kfsheet import load_exercise
from kfsheet.coursework.handout.handout_workbook import handout_bytes
from kfsheet.coursework.reading.roster import Student
from kfsheet.coursework.reports.assessment import assess
from kfsheet.coursework.reports.grading import _judged
from kfsheet.exercises import exercise_names
from kfsheet.workbook.engines.libreoffice import convert, libreoffice

FULL = {"status": "right", "remark": ""}


@pytest.fixture(scope="module")
def handouts():
    """One handout of each exercise, made when it is first asked for."""
    made = {}

    def handout(name):
        if name not in made:
            made[name] = handout_bytes(load_exercise(name), ADA, SECRET)
        return made[name]

    return handout


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """A cannon-ball of 60 sweeps, as a lecturer's own file."""
    folder = tmp_path_factory.mktemp("short")
    draws = Path(kfsheet.exercises.__file__).parent / "cannonball/data/cannonball_draws.csv"
    (folder / "draws.csv").write_text("\n".join(draws.read_text().splitlines()[:61]) + "\n")
    (folder / "short.py").write_text(
        "from dataclasses import replace\n"
        "from kfsheet.exercises.cannonball import build_model, exercise as long\n"
        f"exercise = replace(long, model=build_model({str(folder / 'draws.csv')!r}))\n"
    )
    return str(folder / "short.py")


@pytest.fixture
def football(handouts, tmp_path):
    return Paper(load_exercise("football"), ADA, handouts("football")).open(tmp_path / "a.xlsx")


def judged(paper):
    """Status of the file, and marks by answer."""
    found = assess(paper.exercise.name, SECRET, paper.save())
    return found, {mark.name: mark for mark in found.marks}


def one(paper, name):
    """The mark of one answer, all others being right."""
    found, marks = judged(paper)
    assert found.status == "graded", found
    others = {n: m.status for n, m in marks.items() if n != name and m.status != "right"}
    assert others == {}, "a mistake costs its own column only"
    return marks[name]


SMALL = [name for name in exercise_names() if load_exercise(name).model.rows < 200]


def asked_columns(exercise):
    return [q.name for q in exercise.questions if q.name in exercise.model.table]


# -- every exercise ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SMALL)
def test_the_solution_of_every_short_exercise_scores_full(name, handouts, tmp_path):
    paper = Paper(load_exercise(name), ADA, handouts(name)).open(tmp_path / "a.xlsx").answer_all()
    found, marks = judged(paper)
    assert (found.status, found.remark, found.student) == ("graded", "", ADA.id)
    assert {m.status for m in marks.values()} == {"right"}
    assert sum(m.score for m in marks.values()) == sum(q.points for q in paper.exercise.questions)


@pytest.mark.parametrize("name", exercise_names())
def test_every_exercise_tells_mistakes_apart_in_one_file(name, handouts, tmp_path):
    """One file, many mistakes: each costs its own answer only."""
    paper = Paper(load_exercise(name), ADA, handouts(name)).open(tmp_path / "a.xlsx").answer_all()
    columns = [n for n in asked_columns(paper.exercise) if do.first_relative(paper.cells(n)[-1][1])]
    with_parameter = [n for n in columns if has_parameter(paper, n)]
    hard = with_parameter[0]
    columns.remove(hard)
    sign, slip, typed, broken, *rest = columns
    paper.answer(sign, do.negated)
    do.absolute_slip(paper, slip)
    do.values_pasted(paper, typed)
    do.hard_coded(paper, hard)
    do.broken_fill_down(paper, broken)
    for n, answer in enumerate(rest):
        do.helper_columns(paper, answer) if n % 2 else paper.answer(answer, do.rearranged)
    found, marks = judged(paper)
    told = {n: (m.status, m.score / m.points) for n, m in marks.items()}
    assert told.pop(sign) == ("wrong", 0)
    assert "sign is wrong" in marks[sign].remark
    assert told.pop(slip)[0] in ("wrong", "partly right")
    assert "refers to $" in marks[slip].remark
    assert told.pop(typed) == ("typed", 0)
    assert told.pop(hard) == ("hard-coded", 0.5)
    assert do.parameter_in(paper, hard) in marks[hard].remark
    assert told.pop(broken) == ("partly right", 0.5)
    assert re.search(r"right in rows \d+-\d+.*row \d+ refers to \$", marks[broken].remark)
    assert set(told.values()) == {("right", 1.0)}, told


def has_parameter(paper, name):
    try:
        do.parameter_in(paper, name)
    except StopIteration:
        return False
    return True


@pytest.mark.parametrize("name", exercise_names())
def test_an_untouched_handout_scores_nothing_and_is_called_so(name, handouts, tmp_path):
    paper = Paper(load_exercise(name), ADA, handouts(name))
    (tmp_path / "a.xlsx").write_bytes(handouts(name))
    found = assess(paper.exercise.name, SECRET, tmp_path / "a.xlsx")
    assert found.status == "untouched"
    assert {(m.score, m.status, m.remark) for m in found.marks} == {(0.0, "empty", "")}


@pytest.mark.parametrize("name", exercise_names())
def test_every_exercise_survives_what_spreadsheet_users_do(name, short, tmp_path):
    """Rows and columns inserted, a sheet renamed and moved, a gap, locked cells edited, and saved.

    openpyxl saves the file, and after it LibreOffice where it is installed.
    """
    spec = short if name == "cannonball" else name
    paper = Paper(load_exercise(spec)).open(tmp_path / "a.xlsx").answer_all()
    columns = asked_columns(paper.exercise)
    gap, sign = columns[0], columns[-1]
    paper.answer(sign, do.negated)
    rows = [cell.row for cell, _ in paper.cells(gap)]
    emptied = paper.cells(gap)[len(rows) // 2][0]
    emptied.value = None
    parameter = next(iter(paper.model.parameters))
    sheet, row, column = paper.layout.scalars[parameter]
    paper.book[sheet].cell(row, column).value *= 1.5
    section = paper.layout.home(gap)[0]
    do.inserted(paper.book, paper.model.sections)
    do.renamed(paper.book, section, "My own filter")
    path = paper.save()
    if libreoffice():
        path = convert(path, tmp_path / "saved", "xlsx:Calc MS Excel 2007 XML")
    found = assess(spec, SECRET, path)
    assert (found.status, found.student) == ("graded", ADA.id)
    assert f"locked cells were changed ({parameter})" in found.remark
    marks = {m.name: m for m in found.marks}
    assert marks[gap].status == "partly right"
    assert marks[gap].remark.endswith(f"not in row {emptied.row + 2}: empty")
    assert (marks[sign].status, marks[sign].score) == ("wrong", 0)
    others = {n: m.status for n, m in marks.items() if n not in (gap, sign)}
    assert set(others.values()) <= {"right"}, others


# -- right, whatever it looks like ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "formula"),
    [
        ("K_x", "=b_x*a/(a*a*b_x+r_i)"),
        ("K_x", "=1/(a+r_i/(a*b_x))"),
        ("K_x", "=POWER(r_i/(a*b_x)+a,-1)"),
        ("K_z", "=-b_z*a/SUMSQ(a*SQRT(b_z),SQRT(r_j))"),
        ("x_f", "=K{p}+dt*(E{r}-h*f*SIGN(E{r})*E{r}*E{r}*dt^(p-1))"),
        ("x_f", "=SUM(K{p},E{r}*dt)-h*f*ABS(E{r})*E{r}*POWER(dt,p)"),
        ("x_f", "=K{p}+SUMPRODUCT(E{r},dt)-h*f*SIGN(E{r})*E{r}^2*dt^p"),
        ("d_i", '=IF(C{r}="","",C{r}-G{r}*a)'),
        ("d_i", '=IF(NOT(ISNUMBER($C{r})),"",-($G{r}*Parameters!$B$8-$C{r}))'),
        ("d_j", '=IF(COUNT(D{r})=1,D{r}-(j_0-a*H{r}),"")'),
        ("x_a", "=G{r}+IF(ISNUMBER(C{r}),(C{r}-a*G{r})*K_x,0)"),
        ("x_a", "=IF(ISNUMBER(I{r}),(1-K_x*a)*G{r}+K_x*C{r},G{r})"),
        ("x_a", '=IF(I{r}<>"",G{r}+K_x*I{r},G{r})'),
    ],
)
def test_an_algebraically_equal_formula_is_right(football, name, formula):
    football.answer_all()
    starts = len(football.model.column(name).start) if name in football.model.table else 0
    cells = football.cells(name)
    for cell, _ in cells[0 if name[0] in "Kd" else starts :]:
        cell.value = formula.format(r=cell.row, p=cell.row - 1)
    mark = one(football, name)
    assert (mark.status, mark.score) == ("right", mark.points), mark


def test_a_formula_split_over_several_helper_columns_and_names_is_right(football):
    football.answer_all()
    sheet = football.book["Reanalysis"]
    for row in range(5, 20):
        sheet[f"P{row}"] = f"=SIGN(E{row})*E{row}^2"
        sheet[f"Q{row}"] = f"=h*drag*P{row}*dt^p"
        sheet[f"G{row}"] = f"=K{row - 1}+E{row}*dt-Q{row}"
    name = openpyxl.workbook.defined_name.DefinedName("drag", attr_text="Parameters!$B$7")
    football.book.defined_names["drag"] = name
    assert one(football, "x_f").status == "right"


# -- wrong, and in which way ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "formula", "status", "words"),
    [
        ("K_x", "=a*b_x/(r_i-a^2*b_x)", "wrong", "sign"),
        ("K_x", "=b_x/(r_i+a^2*b_x)", "wrong", "factor is missing"),
        ("K_x", "=a*b_z/(r_i+a^2*b_z)", "wrong", "value than"),
        ("K_z", "=a*b_z/(r_j+a^2*b_z)", "wrong", "sign"),
        ("K_x", "=a*b_x/(9+a^2*b_x)", "hard-coded", "r_i"),
        ("x_f", "=K{p}+E{p}*dt-h*f*SIGN(E{p})*E{p}^2*dt^p", "wrong", "value than"),
        ("x_f", "=G{p}+E{r}*dt-h*f*SIGN(E{r})*E{r}^2*dt^p", "wrong", "same unit"),
        ("x_f", "=K{r}+E{r}*dt-h*f*SIGN(E{r})*E{r}^2*dt^p", "wrong", "wrong row"),
        ("x_f", "=K{p}+E{r}*dt-h*f*E{r}^2*dt^p", "wrong", "sign of a velocity"),
        ("x_f", "=K{p}+E{r}*dt", "wrong", "term is missing"),
        ("x_f", "=K{p}+E{r}*dt-h*f*SIGN(E{r})*E{r}^2*dt", "hard-coded", " p "),
        ("x_f", "=G{r}", "wrong", "own cell"),
        ("x_f", "=K{r}-IF(ISNUMBER(I{r}),K_x*I{r},0)", "wrong", "circle"),
        ("d_i", "=C{r}-a*G{r}", "gaps forgotten", "missing"),
        ("x_f", "=K{p}+1.001*E{r}*dt-h*f*SIGN(E{r})*E{r}^2*dt^p", "nearly right", "within 0.3 %"),
        ("x_f", "=ROUND(K{p}+E{r}*dt-h*f*SIGN(E{r})*E{r}^2*dt^p,2)", "nearly right", "within"),
        ("K_z", "=-2*a*b_z/(r_j+a^2*b_z)", "wrong", "factor 2 or 1/2"),
        ("K_z", "=-a*b_z/(r_j+a^2*b_z)/2", "wrong", "factor 2 or 1/2"),
        ("x_f", "=K{p}+2*E{r}*dt-h*f*SIGN(E{r})*E{r}^2*dt^p", "wrong", "factor 2 or 1/2"),
        ("x_a", "=G{r}+K_x*I{r}", "gaps forgotten", "missing"),
        ("x_a", "=IF(ISNUMBER(I{r}),G{r}+K_z*I{r},G{r})", "wrong", "same unit"),
        ("x_a", "=IF(ISNUMBER(I{r}),G{r}-K_x*I{r},G{r})", "wrong", "sign"),
        ("x_a", "=0*G{r}", "wrong", "value than"),
        ("x_a", "=C{r}/a", "wrong", "value than"),
        ("x_a", '=WEBSERVICE("http://localhost/"&G{r})', "refused", "WEBSERVICE"),
        ("x_a", '=INDIRECT("G{r}")', "refused", "INDIRECT"),
        ("x_a", '=indirect \n ("G{r}")', "refused", "INDIRECT"),
        ("x_a", "=cmd|'/c calc'!A1", "refused", "DDE"),
        ("x_a", "=12.5", "typed", "number"),
        ("x_a", "=P{r}", "wrong", "value than"),
        ("x_a", "=#REF!+1", "wrong", "shows #REF!"),
        ("x_a", "=nothing+1", "wrong", "shows #NAME?"),
        ("x_a", "=9^9^9^9^9*G{r}", "wrong", "shows #NUM!"),
        ("K_x", "=(b_x*a)/sigma_d_i^2", "wrong", "sigma_d_i repeats the answer"),
    ],
)
def test_a_mistake_is_named_and_the_key_is_not(football, name, formula, status, words):
    football.answer_all()
    starts = len(football.model.column(name).start) if name in football.model.table else 0
    for cell, _ in football.cells(name)[0 if name[0] in "Kd" else starts :]:
        cell.value = formula.format(r=cell.row, p=cell.row - 1)
    mark = one(football, name)
    allowed = {status, "partly right"} if name == "x_a" else {status}
    assert mark.status in allowed, mark
    assert words in mark.remark
    assert mark.score < mark.points
    key = football.cells(name)[-1][1][1:]
    assert key not in mark.remark


@pytest.mark.parametrize(
    ("name", "pattern", "number", "value"),
    [("w", r"\bg\b", "9.81", "9.80665"), ("z_f", r"\bg\b", "9.8", "9.80665")],
)
def test_a_rounded_number_in_the_place_of_a_parameter_is_named(
    football, name, pattern, number, value
):
    football.answer_all()
    football.answer(name, lambda text, _: re.sub(pattern, number, text))
    mark = one(football, name)
    assert (mark.status, mark.score) == ("hard-coded", mark.points / 2)
    assert f"{number} stands in the place of g, which is {value}" in mark.remark


def test_a_number_far_from_a_parameter_does_not_stand_for_it(football):
    football.answer_all()
    football.answer("w", lambda text, _: re.sub(r"\bg\b", "9.5", text))
    assert one(football, "w").score == 0


def test_half_of_a_rounded_number_is_found_too(short, tmp_path):
    """-g*dt^2/2, typed as -4.905*dt^2."""
    paper = Paper(load_exercise(short)).open(tmp_path / "a.xlsx").answer_all()
    paper.answer("y_f", lambda text, _: re.sub(r"\bg\b", "9.81", text))
    found = {m.name: m for m in assess(short, SECRET, paper.save()).marks}
    assert found["y_f"].status == "hard-coded"
    assert "9.81 stands in the place of g, which is 9.80665" in found["y_f"].remark


def test_a_swapped_atan2_is_named(short, tmp_path):
    paper = Paper(load_exercise(short)).open(tmp_path / "a.xlsx").answer_all()

    def swapped(text, _):
        return re.sub(r"ATAN2\(([^,()]+),([^,()]+)\)", r"ATAN2(\2,\1)", text)

    paper.answer("d_theta", swapped)
    found = assess(short, SECRET, paper.save())
    marks = {m.name: m for m in found.marks}
    mark = marks.pop("d_theta")
    assert {m.status for m in marks.values()} == {"right"}
    assert (mark.status, mark.score) == ("wrong", 0)
    assert "ATAN2" in mark.remark


def test_a_gap_in_the_rows_is_located(football):
    football.answer_all()
    football.book["Reanalysis"]["G12"] = None
    football.book["Reanalysis"]["G13"] = None
    mark = one(football, "x_f")
    assert (mark.status, mark.score) == ("partly right", 1)
    assert mark.remark == "right in rows 4-11, 14-19; not in rows 12-13: empty"


def test_an_iferror_around_a_formula_changes_no_mark(football):
    """It is no mathematics, but its values tell whether it is right, and what is wrong."""
    football.answer_all()
    football.answer("u", lambda text, _: f"=IFERROR({text[1:]},0)")
    football.answer("w", lambda text, _: f"=IFERROR(-({text[1:]}),0)")
    found, marks = judged(football)
    assert (marks["u"].status, marks["u"].score) == ("right", 2)
    assert (marks["w"].status, marks["w"].score) == ("wrong", 0)
    assert "a sign is wrong" in marks["w"].remark


def test_stored_values_are_never_believed(football, tmp_path):
    """A file whose formulas are wrong and whose stored values are right."""
    football.answer_all()
    football.answer("x_a", lambda *_: "=1+1")
    path = football.save()
    import zipfile

    with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / "b.xlsx", "w") as new:
        for name in old.namelist():
            text = old.read(name)
            new.writestr(
                name,
                text.replace(b"<f>1+1</f><v></v>", b"<f>1+1</f><v>23.4</v>").replace(
                    b"<f>1+1</f><v />", b"<f>1+1</f><v>23.4</v>"
                ),
            )
    found = assess("football", SECRET, tmp_path / "b.xlsx")
    marks = {m.name: m for m in found.marks}
    assert (marks["x_a"].status, marks["x_a"].score) == ("typed", 0)


def test_locked_cells_that_were_edited_are_named_and_change_no_mark(football):
    football.answer_all()
    football.book["Parameters"]["B5"] = 0.2
    football.book["Reanalysis"]["C6"] = 800
    football.book["Errors"]["C9"] = "=A1"
    found, marks = judged(football)
    assert {m.status for m in marks.values()} == {"right"}
    for name in ("dt", "i", "locked cells were changed"):
        assert name in found.remark


@pytest.mark.parametrize(
    "change",
    [
        {"x_f": " x_f "},
        {"x_f": "forecast"},
        {"x_f": None},
        {"photo": "number", "time": "t"},
        {"i": "pixel"},
        {"x_f": "f", "z_f": "g", "z_a": "analysis"},
    ],
)
def test_a_header_that_was_changed_costs_no_answer(football, change):
    """The column is still where it was, beside the others of its table."""
    sheet = football.answer_all().book["Reanalysis"]
    places = {cell.value: cell for cell in sheet[1]}
    for name, words in change.items():
        places[name].value = words
    found, marks = judged(football)
    assert (found.status, found.remark) == ("graded", "")
    assert {m.status for m in marks.values()} == {"right"}


def test_a_header_that_was_changed_is_found_among_inserted_columns(football):
    do.inserted(football.answer_all().book, football.model.sections, columns=2)
    football.book["Reanalysis"].cell(3, 9).value = "mine"  # x_f
    _, marks = judged(football)
    assert {m.status for m in marks.values()} == {"right"}


def test_a_table_without_most_of_its_headers_is_gone(football):
    sheet = football.answer_all().book["Reanalysis"]
    for cell in sheet[1][3:]:
        cell.value = None
    found, marks = judged(football)
    on_the_sheet = {n: m.status for n, m in marks.items() if n not in ("K_x", "K_z")}
    assert set(on_the_sheet.values()) == {"gone"}


def test_a_cell_that_reads_its_own_consequences_goes_in_a_circle(football):
    """x_f from x_a, which follows from x_f: an identity, but no answer."""
    football.answer_all()
    for cell, _ in football.cells("x_f")[1:]:
        cell.value = f"=K{cell.row}-N(0)-IF(ISNUMBER(I{cell.row}),K_x*I{cell.row},0)"
    mark = one(football, "x_f")
    assert mark.score < mark.points


def test_another_students_numbers_typed_in_are_not_taken_for_hard_coded(handouts, tmp_path):
    paper = Paper(load_exercise("football"), ADA, handouts("football")).open(tmp_path / "a.xlsx")
    other = Paper(load_exercise("football"), Student("s002", "Bob"))
    paper.answer_all()
    value = dict(other.own.parameters)["a"]
    assert value != dict(paper.own.parameters)["a"]
    paper.answer("K_x", lambda *_: f"={value}*b_x/(r_i+{value}^2*b_x)")
    mark = one(paper, "K_x")
    assert (mark.status, mark.score) == ("wrong", 0)


# -- found by readers who tried to fool it --------------------------------------------------------


@pytest.mark.parametrize(
    "condition", ["$A{r}=7", "$B{r}>1.25", "ROUND(10*$B{r},0)=7", "$A{r}>12", "MOD($A{r},5)=3"]
)
def test_a_formula_that_is_wrong_in_some_rows_is_not_right(football, condition):
    """The row's own number decides, so that every row is another function."""
    football.answer_all()
    for cell, text in football.cells("u"):
        cell.value = f"=IF({condition.format(r=cell.row)},0,{text[1:]})"
    mark = one(football, "u")
    assert mark.score < mark.points


def test_another_number_in_every_row_is_worth_nothing(football):
    """Values in disguise: the first row alone looks like a parameter's value."""
    football.answer_all()
    for n, (cell, value) in enumerate(
        zip((c for c, _ in football.cells("u")), football.values("u"), strict=True)
    ):
        cell.value = f"={value - 0.25 * n!r}+{n}*dt+0*K{max(cell.row - 1, 4)}"
    for (cell, _), value in zip(football.cells("x_f"), football.values("x_f"), strict=True):
        cell.value = f"={value!r}+0*E{cell.row}"
    _, marks = judged(football)
    assert (marks["u"].score, marks["x_f"].score) == (0, 0)
    assert {marks["u"].status, marks["x_f"].status} <= {"typed", "wrong"}


def test_a_lost_sign_is_not_called_a_number(football):
    football.answer_all()
    football.answer("w", lambda text, _: re.sub(r"SIGN\(F\d+\)\*", "", text))
    mark = one(football, "w")
    assert (mark.status, mark.score) == ("wrong", 0)
    assert "sign of a velocity" in mark.remark


def test_a_wrong_sign_filled_down_from_the_first_row_is_named(football):
    """The first row has a start rule of its own; the kind of mistake is that of all the others."""
    football.answer_all()
    for cell, _ in football.cells("x_a"):
        cell.value = f"=IF(ISNUMBER(I{cell.row}),G{cell.row}-K_x*I{cell.row},G{cell.row})"
    mark = one(football, "x_a")
    assert "a sign is wrong" in mark.remark


@pytest.mark.parametrize(
    "formula", ['=INDIRECT("G6")', '=WEBSERVICE("http://localhost")', "=[1]S!A1"]
)
def test_what_is_not_allowed_is_not_allowed_in_a_helper_cell(football, formula):
    football.answer_all()
    football.book["Reanalysis"]["Z6"] = formula
    football.book["Reanalysis"]["G6"] = "=Z6"
    mark = one(football, "x_f")
    assert mark.score < mark.points
    assert "not allowed" in mark.remark


def test_circular_answers_are_told(football):
    football.answer_all()
    for cell, _ in football.cells("x_f")[1:]:
        cell.value = f"=K{cell.row}-IF(ISNUMBER(I{cell.row}),K_x*I{cell.row},0)"
    mark = one(football, "x_f")
    assert "goes in a circle" in mark.remark


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (("K_z_z", "=BI{r}*X{r}/Y{r}"), ("K_vz_z", "=BH{r}*Y{r}/X{r}")),
        (("z_f", "=BK{p}+dt*(BL{p}+J{r})/2"), ("vz_f", "=2*(I{r}-BK{p})/dt-BL{p}")),
        (("p_z_raw", "=(Q{r}-S{r}*F{r})/E{r}"), ("v_z_raw", "=(Q{r}-R{r}*E{r})/F{r}")),
    ],
)
def test_two_answers_that_lean_on_each_other_are_both_wrong(handouts, tmp_path, first, second):
    """Each is true if the other is; in the sheet neither has a value."""
    paper = Paper(load_exercise("shuttlecock"), ADA, handouts("shuttlecock"))
    paper.open(tmp_path / "a.xlsx").answer_all()
    for name, text in (first, second):
        starts = len(paper.model.column(name).start)
        for cell, _ in paper.cells(name)[starts:]:
            cell.value = text.format(r=cell.row, p=cell.row - 1)
    _, marks = judged(paper)
    for name, other in ((first[0], second[0]), (second[0], first[0])):
        assert (marks[name].status, marks[name].score) == ("wrong", 0)
        assert f"circle with {other}" in marks[name].remark


@pytest.mark.parametrize(
    "nothing",
    ["0*COUNT(K{r})", "IFERROR(0*K{r},0)", "0*COUNT(K$4:K$19)", "0*COUNTA(I{r})",
     "0*ISERROR(K{r})", '0*COUNTIF(I:I,">0")', "0*AGGREGATE(9,6,K$4:K$19)"],
)  # fmt: skip
def test_a_circle_that_a_function_swallows_is_one(football, nothing):
    football.answer_all()
    for cell, text in football.cells("x_f")[1:]:
        cell.value = f"{text}+{nothing.format(r=cell.row)}"
    mark = one(football, "x_f")
    assert (mark.status, mark.score) == ("wrong", 0)
    assert "circle" in mark.remark


@pytest.mark.parametrize("form", ['NUMBERVALUE("0,5",",")*2', "BITAND(1,1)", 'ARABIC("I")'])
def test_a_newer_function_that_an_engine_knows_is_judged_by_it(football, form):
    if not libreoffice():
        pytest.skip("LibreOffice is not installed")
    football.answer_all()
    football.answer("K_x", lambda text, _: f"=_xlfn.{form}*{text[1:]}")
    assert one(football, "K_x").status == "right"


def test_rows_that_are_right_are_named_beside_empty_ones(football):
    football.answer_all()
    for cell, _ in football.cells("d_i")[5:]:
        cell.value = None
    mark = one(football, "d_i")
    assert mark.remark.startswith("right in rows ")
    assert mark.remark.endswith("empty")


def test_a_formula_that_takes_for_ever_costs_its_own_answer_only(football, monkeypatch):
    """Whole columns inside SUMPRODUCT: a million rows in every cell."""
    monkeypatch.setattr("kfsheet.coursework.judging.recalculated_answers.SECONDS", 6)
    football.answer_all()
    for cell, _ in football.cells("u")[1:]:
        cell.value = f"=SUMPRODUCT((A:A=A{cell.row}-1)*(K:K))+IFERROR(0,1)"
    mark = one(football, "u")
    assert mark.score == 0


def test_an_answer_for_which_there_was_no_time_is_not_kept(football, monkeypatch, tmp_path):
    """A machine was busy: grading again judges what it could not."""
    football.answer_all()
    football.answer("u", lambda text, _: f"={text[1:]}+0*BESSELJ(1,1)")
    path = football.save()

    def graded(seconds):
        monkeypatch.setattr("kfsheet.coursework.judging.recalculated_answers.SECONDS", seconds)
        judging = (((None, None, path, None), assess("football", SECRET, path)) for _ in (1,))
        keys = {path: "key"}
        run = (keys, "football", SECRET, tmp_path, lambda tasks: judging if tasks else ())
        return _judged(*run, lambda found, _: found)["key"]

    late = graded(0.01)
    assert {mark.status for mark in late.marks} == {"right", "unreadable"}
    assert "grade again" in late.remark
    for _ in range(2):  # judged, then kept
        done = graded(60)
        assert {mark.status for mark in done.marks} == {"right"}
        assert done.remark == ""
    assert graded(0.01) == done
