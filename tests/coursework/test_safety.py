"""Hostile, broken and odd submissions: each ends as a status, none stops the others."""

import io
import random
import re
import socket
import struct
import zipfile

import openpyxl
import pytest
import students as do
from students import ADA, SECRET, Paper

from kfsheet import load_exercise
from kfsheet.coursework.handout.handout_workbook import handout_bytes
from kfsheet.coursework.reading import submission
from kfsheet.coursework.reading.submission import read_submission
from kfsheet.coursework.reports.assessment import assess
from kfsheet.coursework.reports.grading import STATUSES
from kfsheet.coursework.worker_pool import Failed, Pool
from kfsheet.parsing.calculator import Formula
from kfsheet.workbook.reading import archive

FUZZED = 2_000
EXERCISE = load_exercise("football")


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """A correct submission, as bytes."""
    path = tmp_path_factory.mktemp("good") / "a.xlsx"
    return Paper(EXERCISE, ADA, handout_bytes(EXERCISE, ADA, SECRET)).open(path).answer_all().save()


def rezipped(path, changes, extra=()):
    """The bytes of a workbook with parts replaced or added."""
    result = io.BytesIO()
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            text = old.read(name)
            new.writestr(name, changes[name](text) if name in changes else text)
        for name, text in extra:
            new.writestr(name, text)
    return result.getvalue()


SHEET = "xl/worksheets/sheet4.xml"
LAUGHS = b"""<?xml version="1.0"?><!DOCTYPE lolz [<!ENTITY a "ha">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;">]>"""


def with_doctype(text):
    return LAUGHS + text.partition(b"?>")[2] if text.startswith(b"<?xml") else LAUGHS + text


def zeros(name, size):
    return (name, b" " * size)


HOSTILE = {
    "empty": (lambda p: b"", "empty file"),
    "text": (lambda p: b"id;name\n1;2\n", "wrong kind"),
    "old xls": (lambda p: archive.OLE + bytes(600), "wrong kind"),
    "encrypted": (lambda p: archive.OLE + bytes(9) + archive.ENCRYPTED, "encrypted"),
    "cut": (lambda p: p.read_bytes()[:9000], "damaged"),
    "zip of something": (lambda p: made_zip({"readme.txt": b"x"}), "wrong kind"),
    "bomb": (lambda p: rezipped(p, {}, [zeros("xl/bomb.xml", 60 * 2**20)]), "too large"),
    "large": (lambda p: bytes(31 * 2**20), "too large"),
    "many parts": (lambda p: made_zip({f"{n}": b"" for n in range(600)}), "too large"),
    "leaves its folder": (lambda p: rezipped(p, {}, [("../../evil.xml", b"x")]), "refused"),
    "macros": (lambda p: rezipped(p, {}, [("xl/vbaProject.bin", b"x")]), "refused"),
    "laughs in a sheet": (lambda p: rezipped(p, {SHEET: with_doctype}), "refused"),
    "laughs in the book": (lambda p: rezipped(p, {"xl/workbook.xml": with_doctype}), "refused"),
    "broken xml": (lambda p: rezipped(p, {SHEET: lambda t: t[:3000]}), "damaged"),
    "absurd cell": (
        lambda p: rezipped(p, {SHEET: lambda t: t.replace(b'r="A4"', b'r="ZZZ9999999"')}),
        "damaged",
    ),
    "no token": (lambda p: openpyxl_bytes(), "no token"),
    "changed token": (
        lambda p: rezipped(
            p,
            {
                name: lambda t: t.replace(b"|s001|", b"|s002|")
                for name in zipfile.ZipFile(p).namelist()
            },
        ),
        "no token",
    ),
}


def made_zip(parts):
    result = io.BytesIO()
    with zipfile.ZipFile(result, "w") as new:
        for name, text in parts.items():
            new.writestr(name, text)
    return result.getvalue()


def openpyxl_bytes():
    result = io.BytesIO()
    openpyxl.Workbook().save(result)
    return result.getvalue()


@pytest.fixture
def no_network(monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("a connection was opened")

    monkeypatch.setattr(socket.socket, "connect", refuse)


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_file_ends_as_a_status(kind, good, tmp_path, no_network):
    make, status = HOSTILE[kind]
    path = tmp_path / "sub" / "a.xlsx"
    path.parent.mkdir()
    path.write_bytes(make(good))
    found = assess("football", SECRET, path, tmp_path / "copy.xlsx")
    assert (found.status, found.marks) == (status, []), found
    assert found.remark
    assert status in STATUSES
    assert [p.name for p in tmp_path.iterdir()] == ["sub"]


def test_too_many_cells_are_refused_before_they_fill_the_memory(good, tmp_path, monkeypatch):
    monkeypatch.setattr(submission, "MOST_CELLS", 100)
    assert assess("football", SECRET, good).status == "too large"


def test_a_part_that_lies_about_its_size_is_read_no_further(good, tmp_path):
    """The directory says 10 bytes; the data unpack to 60 MB."""
    content = bytearray(rezipped(good, {}, [zeros("xl/b.xml", 60 * 2**20)]))
    for place in (content.rfind(b"xl/b.xml") - 22, content.find(b"xl/b.xml") - 8):
        content[place : place + 4] = struct.pack("<I", 10)
    (tmp_path / "a.xlsx").write_bytes(content)
    assert assess("football", SECRET, tmp_path / "a.xlsx").status in {"graded", "damaged"}


def test_links_to_other_files_are_not_followed_and_are_named(good, tmp_path, no_network):
    content = rezipped(good, {}, [("xl/externalLinks/externalLink1.xml", b"<x/>")])
    (tmp_path / "a.xlsx").write_bytes(content)
    found = assess("football", SECRET, tmp_path / "a.xlsx")
    assert found.status == "graded"
    assert "links to other files" in found.remark


@pytest.mark.parametrize(
    "formula",
    [
        "=9^9^9^9^9",
        "=(((" * 30 + "1" + ")))" * 30,
        "=" + "1+" * 900 + "K5",
        "=SUM(A1:XFD1048576)",
        "=FACT(170)^FACT(170)",
        '=REPT("9",32767)+0',
        "=P5",
        "=x_f",
        "=[1]Sheet1!A1",
        "={1,2,3}",
        "=LET(a,1,a)",
        "=A1:A2:A3",
        "=",
        "=+",
        "=\x01",
        "=SIN(1E300)*TAN(1E300)",
        "=MOD(1E300,1E-300)",
        "=EXP(EXP(EXP(9)))",
        "=1/0",
    ],
)
def test_an_odd_formula_costs_its_own_answer_only(formula, good, tmp_path):
    book = openpyxl.load_workbook(good)
    sheet = book["Reanalysis"]
    for row in range(4, 20):
        sheet[f"G{row}"].data_type = "f"
        sheet[f"G{row}"]._value = formula.replace("\x01", "?")
    book.save(tmp_path / "a.xlsx")
    found = assess("football", SECRET, tmp_path / "a.xlsx")
    assert found.status == "graded"
    marks = {m.name: m for m in found.marks}
    assert marks.pop("x_f").score == 0
    assert {m.status for m in marks.values()} == {"right"}


def test_helper_cells_that_double_forever_and_circles_end(good, tmp_path):
    """P5 = P6*P6, P6 = P7*P7, ...: a formula of 2^60 leaves; and a circle."""
    book = openpyxl.load_workbook(good)
    sheet = book["Reanalysis"]
    for row in range(30, 90):
        sheet[f"P{row}"] = f"=P{row + 1}*P{row + 1}"
    sheet["Q5"], sheet["Q6"] = "=Q6+1", "=Q5+1"
    for row in range(4, 20):
        sheet[f"G{row}"], sheet[f"H{row}"] = "=P30", "=Q5"
    book.save(tmp_path / "a.xlsx")
    marks = {m.name: m for m in assess("football", SECRET, tmp_path / "a.xlsx").marks}
    assert (marks["x_f"].score, marks["z_f"].score) == (0, 0)


# -- processes -----------------------------------------------------------------------------------


def sleepy(seconds):
    import time

    time.sleep(seconds)
    return "done"


def greedy(megabytes):
    return len(bytearray(megabytes * 2**20))


def deadly(code):
    import os

    os._exit(code)


def erring(words):
    raise RuntimeError(words)


def task(name, argument):
    return globals()[name](argument)


def test_a_task_that_hangs_crashes_or_eats_memory_does_not_stop_the_others():
    tasks = [("sleepy", 60), ("deadly", 3), ("greedy", 4_000), ("erring", "no"), ("sleepy", 0)]
    found = dict(Pool(task, 2, seconds=6, memory=2 * 2**30).run(tasks))
    assert found["sleepy", 60] == Failed("timed out")
    assert found["deadly", 3] == Failed("crashed")
    assert found["erring", "no"] == Failed("RuntimeError: no")
    assert found["sleepy", 0] == "done"
    if __import__("sys").platform == "linux":
        assert "MemoryError" in found["greedy", 4_000].reason


# -- fuzz ----------------------------------------------------------------------------------------


def damaged(dice, content):
    """Bytes changed, cut out, doubled, or cut off."""
    content = bytearray(content)
    for _ in range(dice.randint(1, 8)):
        place = dice.randrange(len(content) or 1)
        if not content:
            break
        match dice.randrange(4):
            case 0:
                content[place] = dice.randrange(256)
            case 1:
                del content[place : place + dice.randint(1, 200)]
            case 2:
                content[place:place] = content[place : place + dice.randint(1, 200)]
            case 3 if dice.random() < 0.2:
                del content[place:]
    return bytes(content)


def mutated(dice, parts):
    """One part changed inside, and zipped again: the damage gets past the checksum."""
    name = dice.choice([n for n in parts if n.endswith((".xml", ".rels"))])
    text = damaged(dice, parts[name])
    return made_zip({**parts, name: text})


def wrong_formula(dice, parts):
    """One character of one answer's formula changed: it may read as anything."""
    text = parts[SHEET].decode()
    place = dice.choice(list(re.finditer(r'<c r="[E-L]\d+"[^>]*><f>([^<]+)</f>', text)))
    at = dice.randrange(place.start(1), place.end(1))
    new = text[:at] + dice.choice("0123456789+-*/^(),.$KGEabx ") + text[at + 1 :]
    return made_zip({**parts, SHEET: new.encode()}), text != new, place[1]


def test_2000_damaged_workbooks_crash_nothing(good, tmp_path, no_network):
    dice = random.Random(20_260_101)
    content = good.read_bytes()
    with zipfile.ZipFile(good) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    path, seen = tmp_path / "a.xlsx", {}
    for n in range(FUZZED):
        path.write_bytes(damaged(dice, content) if n % 3 else mutated(dice, parts))
        found = assess("football", SECRET, path)
        seen[found.status] = seen.get(found.status, 0) + 1
        assert found.status in STATUSES, found
    assert sum(seen.values()) == FUZZED
    assert {"graded", "damaged"} <= set(seen), seen


def test_a_changed_formula_gets_full_marks_only_if_an_engine_agrees(good, tmp_path):
    """No wrong full marks: where all answers are called right, the values must be the old ones."""
    from kfsheet.workbook.engines.recalculate import recalculate

    dice = random.Random(7)
    with zipfile.ZipFile(good) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    before = recalculate(good)["Reanalysis"]
    path, full = tmp_path / "a.xlsx", 0
    for _ in range(80):
        content, changed, old = wrong_formula(dice, parts)
        path.write_bytes(content)
        found = assess("football", SECRET, path)
        if found.marks and all(m.status == "right" for m in found.marks):
            full += 1
            after = recalculate(path)["Reanalysis"]
            for cell, value in before.items():
                if isinstance(value, float):
                    assert after[cell] == pytest.approx(value, rel=1e-9, abs=1e-9), (old, cell)
    assert 0 < full < 60


def test_the_reader_keeps_no_stored_value(good):
    book = read_submission(good)
    answers = {book.sheets["Reanalysis"][row, 7] for row in range(4, 20)}
    assert all(isinstance(a, Formula) for a in answers)
    assert do.SECRET
