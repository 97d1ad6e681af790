"""Given quantities and formulas that would be answers: all pairs and triples of them are tried."""

import itertools
from functools import cache

import numpy as np
import pytest
from students import SECRET, Paper

from kfsheet import exercise_names, load_exercise
from kfsheet.coursework.handout.empty_answers import with_empty_answers
from kfsheet.coursework.handout.shown_answers import shape, shown_answers
from kfsheet.coursework.judging.model_runs import ModelRuns
from kfsheet.coursework.judging.rearrangements import STEP, Rearrangements
from kfsheet.coursework.reports.assessment import assess
from kfsheet.workbook.write.layout import Layout
from kfsheet.workbook.write.run import Run

OURS = [name for name in exercise_names() if name != "tennis_toss"]


@cache
def known(name):
    return Rearrangements(ModelRuns(load_exercise(name)))


def questions():
    return [(name, q.name) for name in OURS for q in load_exercise(name).questions]


# -- all pairs and triples -----------------------------------------------------------------------


def figures(of, answer):
    """Values of all that a student sees, in rows of several runs: a mapping by name and lag."""
    model, worlds = of.model, of.runs.worlds[:3]
    column = model.table.get(answer)
    rows = [3, model.rows // 3, model.rows // 2]
    at = [(w, r) for w in worlds for r in rows]
    if column:
        at = [(w, r) for w, r in at if abs(w.columns[answer][r]) > 0]
    here = of.consequences(answer)

    def value(name, lag):
        if name in model.table:
            return np.array([w.columns[name][r - lag] for w, r in at])
        return np.array([w.scalars[name] for w, _ in at])

    seen = {}
    for name in of.names:
        if name not in here and (name in model.table or name in worlds[0].scalars):
            seen[name, 0] = value(name, 0)
        if column and name in model.table:
            seen[name, 1] = value(name, 1)
    return value(answer, 0), {k: v for k, v in seen.items() if np.isfinite(v).all() and v.all()}


def keys(vectors):
    """Equal for vectors that differ by a factor, to 7 figures."""
    with np.errstate(all="ignore"):
        found = np.round(np.log(np.abs(vectors[:, 1:] / vectors[:, :1])), 7) + 0.0
    spread = np.abs(vectors - vectors[:, :1]).max(axis=1) > 1e-7 * np.abs(vectors[:, 0])
    good = np.isfinite(found).all(axis=1) & spread
    return [line.tobytes() if ok else None for line, ok in zip(found, good, strict=True)]


OPERATIONS = (np.multiply, np.divide, np.add, np.subtract)


def pairs_like(wanted, first, second):
    """Places of pairs that an operation makes a multiple of what is wanted."""
    with np.errstate(all="ignore"):
        for operation in OPERATIONS:
            found = operation(first[:, None, :2], second[None, :, :2])
            near = np.abs(found[..., 1] * wanted[0] / (found[..., 0] * wanted[1]) - 1) < 1e-6
            for n, k in np.argwhere(near):
                whole = operation(first[n], second[k])
                if keys(whole[None]) == keys(wanted[None]):
                    yield n, k


@pytest.mark.parametrize(("name", "answer"), questions())
def test_no_given_quantity_gives_an_answer_away_by_itself_or_with_one_other(name, answer):
    """Every visible quantity, or its square, times, over, plus or minus every other one."""
    of = known(name)
    wanted, seen = figures(of, answer)
    if len(wanted) < 3:
        pytest.skip("too few values to tell anything")
    forbidden = of.forbidden(answer)
    usual = [k for k in seen if k[0] in of.asked | of.ancestors(answer) or not of.reads(k[0])]
    same = set(keys(np.array([seen[k] for k in usual])))
    others = [k for k in seen if k not in usual and k[0] not in forbidden]
    others = [k for k in others if keys(seen[k][None])[0] not in same]
    assert not [k for k in others if keys(seen[k][None]) == keys(wanted[None])]
    given = [k for k in others if of.steps(k[0], answer) > STEP]
    if not given:
        return
    # Beside what is the answer itself anything does, and that is forbidden anyway.
    partners = [k for k in seen if k[0] not in forbidden]
    first, second = (np.array([seen[k] for k in names]) for names in (given, partners))
    for form in (first, first**2):
        found = [(given[n], partners[k]) for n, k in pairs_like(wanted, form, second)]
        assert not [pair for pair in found if pair[0] != pair[1]]


TRIPLES = ("a*b/c", "a*b*c", "a/b/c", "(a-b)/c", "(a-b)*c", "a/c-b", "a*c-b")


@pytest.mark.parametrize(("name", "answer"), [("football", "K_x"), ("football", "K_z")])
def test_no_three_scalars_give_a_gain_away(name, answer):
    of = known(name)
    wanted, seen = figures(of, answer)
    seen = {k[0]: v for k, v in seen.items() if of.leaves(k[0]) <= of.leaves(answer)}
    forbidden, (sought,) = of.forbidden(answer), keys(wanted[None])
    found = set()
    for (n1, a), (n2, b), (n3, c) in itertools.permutations(seen.items(), 3):
        forms = (a, a**2, np.sqrt(np.abs(a)))
        tried = [eval(f, {"a": x, "b": b, "c": c}) for x in forms for f in TRIPLES]
        if sought in keys(np.array(tried)):
            found.add((n1, n2, n3))
    assert found
    assert all(set(names) & forbidden for names in found), found


# -- what may be read ----------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "answer"), questions())
def test_no_answer_loses_what_it_is_made_of(name, answer):
    of = known(name)
    assert not of.forbidden(answer) & (of.ancestors(answer) | of.asked)


def marked(paper, answer):
    found = assess(paper.exercise.name, SECRET, paper.save())
    assert found.status == "graded", found.remark
    return next(mark for mark in found.marks if mark.name == answer)


def paper_of(name, tmp_path):
    return Paper(load_exercise(name)).open(tmp_path / "a.xlsx").answer_all()


FOOTBALL = (
    ("K_x", "=a*b_x/sigma_d_i^2", False),
    ("K_x", "=a*p_x/r_i", False),
    ("K_x", "=(1-p_x/b_x)/a", False),
    ("K_x", "=4*a*b_x/'Pixel frame'!I9^2", False),
    ("K_x", "=4*a*b_x/('Pixel frame'!I9*'Pixel frame'!J9)*-1", False),
    ("K_x", "=a*b_x/MAX('Pixel frame'!J4:J19)^2*4", False),
    ("K_x", "=IFERROR(a*p_x/r_i,0)", False),
    ("K_x", "=IMREAL(p_x)*a/r_i", False),
    ("K_x", '=CONVERT(1/(a+r_i/(a*b_x)),"m","m")', True),
    ("K_z", "=-a*b_z/sigma_d_j^2", False),
    ("K_z", "=-a*p_z/r_j", False),
    ("u", "='Goal line'!C{p}", False),
    ("u", "=IFERROR('Goal line'!C{p},0)", False),
    ("u", "=IF(ROW()<9,(K{p}-K{q})/dt-f*ABS(E{p})*E{p}*dt,'Goal line'!C{p})", False),
    ("w", "='Goal line'!D{p}", False),
    ("K_x", "=1/(a+r_i/(a*b_x))", True),
    ("d_i", "=IF(ISBLANK(C{r}),\"\",C{r}-'Pixel frame'!C{r})", True),
    ("d_j", "=IF(ISBLANK(D{r}),\"\",D{r}-'Pixel frame'!D{r})", True),
    ("u", "=((Errors!G{p}+Errors!C{p})-K{q})/dt-f*SIGN(E{p})*E{p}^2*dt", True),
)


@pytest.mark.parametrize(("answer", "formula", "right"), FOOTBALL)
def test_an_answer_of_the_football_in_other_words_is_none(answer, formula, right, tmp_path):
    paper = paper_of("football", tmp_path)
    rows = 2 if answer in "uw" else 0
    for cell, _ in paper.cells(answer)[rows:]:
        cell.value = formula.format(r=cell.row, p=cell.row - 1, q=cell.row - 2)
    mark = marked(paper, answer)
    assert (mark.status == "right") == right, mark
    if not right:
        assert "repeats the answer; derive it" in mark.remark


def column(paper, name):
    sheet, number = paper.layout.home(name)
    letter = paper.book[sheet].cell(1, number).column_letter
    return f"'{sheet}'!{letter}{{r}}"


SHUTTLECOCK = (
    ("K_z_z", "={K_x_x}", False),
    ("S_z", "={S_y}", False),
    ("P_zz_a", "={P_xx_a}", False),
    ("x_fall_raw", "={p_x_raw}+{v_x_raw}*({y_fall_raw}-{p_y_raw})/{v_y_raw}", False),
    ("x_fall_raw", "={p_x_raw}+{v_x_raw}*(1-EXP(-{c_raw}-{W_4_raw}))/k_fit", True),
    ("K_z_z", "={P_xx_f}/{S_z}", True),
    ("P_zz_a", "={K_z_z}*r_obs", True),
    ("v_z_raw", "=({sum_Xz_raw}-{p_z_raw}*{sum_X})/{sum_XX}", True),
)


@pytest.mark.parametrize(("answer", "formula", "right"), SHUTTLECOCK)
def test_an_answer_of_the_shuttlecock_in_other_words_is_none(answer, formula, right, tmp_path):
    paper = paper_of("shuttlecock", tmp_path)
    names = {n: column(paper, n) for n in paper.model.table}
    cells = paper.cells(answer)
    first = cells[0][0].row
    for cell, text in cells:
        # Where a track stays below z_fall there is no fall, and the first row has no gain.
        new = formula.format(**names).format(r=cell.row)
        guarded = text.startswith("=IF(ISNUMBER(") and answer == "x_fall_raw"
        cell.value = f'=IFERROR({new[1:]},"")' if guarded else new
        if cell.row == first and answer == "P_zz_a":
            cell.value = text
    mark = marked(paper, answer)
    assert (mark.status == "right") == right, mark
    if not right:
        assert "repeats the answer; derive it" in mark.remark


# -- formulas that are hidden --------------------------------------------------------------------

NAMED = {
    "football": ["u_next", "w_next", "sigma_d_i", "sigma_d_j", "p_x", "p_z", "j_f", "j_true"],
    "cannonball": ["x_true", "vy_true", "K_vx_theta"],
    "shuttlecock": ["K_az_z", "vz_a", "az_a", "ax_f", "K_x_x", "P_yy_a", "W_3_raw", "y_fall_raw"],
    "tennis": ["eps", "q1", "s2"],
}


@pytest.mark.parametrize("name", OURS)
def test_formulas_that_show_an_answer_are_live_and_not_shown(name):
    exercise = load_exercise(name)
    layout, now = Layout.standard(exercise.model), Run.of(exercise.model)
    pages = {p.title: p for p in with_empty_answers(exercise, layout, now)}
    for hidden in NAMED[name]:
        if hidden in layout.scalars:
            sheet, *place = layout.scalars[hidden]
            assert pages[sheet].cell_at(*place).kind == "veiled", hidden
        else:
            sheet, at = layout.home(hidden)
            assert pages[sheet].columns[at].kind == "veiled", hidden
            assert pages[sheet].columns[at].rules, hidden


def test_formulas_that_show_no_answer_stay_visible():
    assert not {"d_i_low", "wait", "e_x_a"} & shown_answers(load_exercise("football"))
    assert not {"theta_obs", "r_obs", "x_obs"} & shown_answers(load_exercise("cannonball"))
    assert not {"X", "sum_X", "c_raw", "e_z_a"} & shown_answers(load_exercise("shuttlecock"))


def test_a_shape_knows_no_names_but_kinds_places_and_rows():
    m = load_exercise("football").model
    from kfsheet.model.expressions import t

    i, j, a, f = m["i"], m["j"], m["a"], m["f"]
    assert shape(i[t] - a * j[t]) == shape(j[t] - f * i[t])
    assert shape(i[t] - a * j[t]) != shape(i[t] - a * i[t])
    assert shape(i[t] - a * j[t]) != shape(i[t] - a * j[t - 1])
    assert shape(i[t] - a * j[t]) != shape(i[t] - a * f)
