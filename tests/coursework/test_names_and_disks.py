"""File names of any bytes, and disks without room: nobody's grade hangs on them."""

import csv
import errno
import json
import os
import resource
import shutil
import subprocess
import sys

import pytest
from students import ADA, SECRET, Paper

from kfsheet import files, load_exercise
from kfsheet.cli import commands as cli
from kfsheet.coursework.handout.course_secret import read_secret
from kfsheet.coursework.reading.roster import Student
from kfsheet.errors import DataError, UnwrittenError

BOB = Student("s002", "Bob Ray")
NAMES = [
    b"\xe9t\xe9.xlsx",
    b"new\nline\r.xlsx",
    b'tab\there "q";=1+1.xlsx',
    b"=cmd\x1b[2J\xff.xlsx",
]


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Two complete submissions and their course."""
    home = tmp_path_factory.mktemp("course")
    (home / "r.csv").write_text("id,name\ns001,Ada Lovelace\ns002,Bob Ray\n")
    (home / "s").write_bytes(SECRET)
    for student in (ADA, BOB):
        Paper(load_exercise("football"), student).open(
            home / f"{student.id}.xlsx"
        ).answer_all().save()
    return home


def call(home, submissions, out):
    ask = ["--roster", home / "r.csv", "--secret", home / "s", "--out", out]
    return ["grade", "football", *map(str, [submissions, *ask])]


def grades(out):
    with (out / "grades.csv").open(encoding="utf-8-sig") as file:
        return {line["id"]: line for line in csv.DictReader(file)}


# -- names ---------------------------------------------------------------------------------------


@pytest.fixture
def odd_names(good, tmp_path):
    """A folder of odd names: files, folders, a file of nobody, one that cannot be opened."""
    folder = os.fsencode(tmp_path / "in")
    os.makedirs(folder + b"/\xfc\xfc\nfolder")
    for n, name in enumerate(NAMES):
        shutil.copy(good / f"{ADA.id}.xlsx", folder + b"/" + name)
        os.utime(folder + b"/" + name, (n, n))
    shutil.copy(good / f"{BOB.id}.xlsx", folder + b"/\xfc\xfc\nfolder/\xfe.xlsx")
    for name, content in ((b"\xf6.docx", b"no"), (b"\xf6\n.txt", b"note"), (b"\xff.xlsx", b"PK")):
        with open(folder + b"/" + name, "wb") as file:
            file.write(content)
    return tmp_path / "in"


def all_is_well(out):
    found = grades(out)
    assert {line["status"] for line in found.values()} == {"graded"}
    assert "4 files came back" in found["s001"]["remark"]
    assert r"(\xe9t\xe9.xlsx: graded, 18 points)" in found["s001"]["remark"]
    page = (out / "class.html").read_text(encoding="utf-8")
    assert r"<td>\xf6.docx</td>" in page
    for name in ("moodle.csv", "canvas.csv", "feedback/s001.html", "feedback/s001.xlsx"):
        assert (out / name).is_file()
    for text in (*found["s001"].values(), *found["s002"].values()):
        assert text.isprintable()


def test_names_that_are_no_utf8_stop_nobodys_grades(good, odd_names, tmp_path, capsys):
    for _ in range(2):
        assert cli.main(call(good, odd_names, tmp_path / "g")) == 0
        all_is_well(tmp_path / "g")
    said = capsys.readouterr()
    assert r"files passed over: 1 (\xf6\n.txt)" in said.out
    assert r"\xf6.docx, wrong kind" in said.err
    assert all(line.isprintable() for line in (said.out + said.err).splitlines())


@pytest.mark.parametrize("locale", [{"LC_ALL": "C", "PYTHONIOENCODING": "ascii"}])
def test_a_terminal_that_knows_ascii_only_stops_nobodys_grades(good, odd_names, tmp_path, locale):
    lines = (good / "r.csv").read_text().replace("Ray", "Räy\u2028")
    (tmp_path / "r.csv").write_text(lines, encoding="utf-8")
    shutil.copy(good / "s", tmp_path / "s")
    program = [sys.executable, "-m", "kfsheet", *call(tmp_path, odd_names, tmp_path / "ö\udcff")]
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("LC_", "LANG", "PYTHONUTF8"))}
    done = subprocess.run(program, capture_output=True, env={**clean, **locale})
    assert done.returncode == 0, done.stderr
    all_is_well(tmp_path / "ö\udcff")


def test_an_answer_that_an_engine_must_calculate_is_right_under_any_name(good, tmp_path):
    paper = Paper(load_exercise("football"), ADA).open(tmp_path / "a.xlsx").answer_all()
    paper.answer("K_x", lambda text, _: f"=LET(k,{text[1:]},k)")
    os.makedirs(tmp_path / "in")
    os.rename(paper.save(), os.fsencode(tmp_path / "in") + b"/\xff\n.xlsx")
    assert cli.main(call(good, tmp_path / "in", tmp_path / "g")) == 0
    assert grades(tmp_path / "g")["s001"]["status"] == "graded"


# -- disks ---------------------------------------------------------------------------------------


def leftovers(folder):
    return [p for p in folder.rglob(".*") if p.is_file()]


def whole(out):
    found = grades(out)
    assert {line["score"] for line in found.values()} == {"18"}
    for student in ("s001", "s002"):
        assert (out / f"feedback/{student}.xlsx").is_file()
        assert (out / f"feedback/{student}.html").is_file()
    assert len([*(out / "work").glob("*.json")]) == 2
    assert not leftovers(out)


@pytest.fixture
def submissions(good, tmp_path):
    (tmp_path / "in").mkdir()
    for student in ("s001", "s002"):
        shutil.copy(good / f"{student}.xlsx", tmp_path / f"in/{student}.xlsx")
    return tmp_path / "in"


@pytest.mark.parametrize(("first", "count"), [(1, 99), (3, 1), (4, 99), (9, 1)])
def test_what_a_full_disk_kept_from_being_written_is_written_at_the_next_call(
    first, count, good, submissions, tmp_path, monkeypatch, capsys
):
    """The n-th file that our process writes meets a full disk; or that and all later ones."""
    calls, replace = [], os.replace

    def full(old, new):
        calls.append(new)
        if first <= len(calls) < first + count:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        replace(old, new)

    monkeypatch.setattr(files.os, "replace", full)
    assert cli.main(call(good, submissions, tmp_path / "g")) == 1
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert "cannot be written (No space left on device); make room" in said
    assert any(str(path) in said for path in calls[first - 1 :])
    assert not leftovers(tmp_path / "g")
    monkeypatch.undo()
    assert cli.main(call(good, submissions, tmp_path / "g")) == 0
    whole(tmp_path / "g")


LIMITED = """
import resource, sys
from kfsheet.cli.commands import main
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.parametrize("size", [0, 4_000, 20_000])
def test_where_large_files_find_no_room_the_next_call_writes_them(
    size, good, submissions, tmp_path
):
    """The limit holds in the processes that judge and mark, too."""
    arguments = call(good, submissions, tmp_path / "g")
    program = [sys.executable, "-c", LIMITED, str(size), *arguments]
    done = subprocess.run(program, capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    assert "cannot be written (File too large); make room on the disk" in done.stderr
    assert "Traceback" not in done.stderr
    if size == 20_000:  # marks are known, only the marked copies are not there
        assert {line["score"] for line in grades(tmp_path / "g").values()} == {"18"}
        assert not [*(tmp_path / "g/feedback").glob("*.xlsx")]
    assert not leftovers(tmp_path / "g")
    assert cli.main(arguments) == 0
    whole(tmp_path / "g")


def test_a_marked_copy_that_was_lost_is_made_anew(good, submissions, tmp_path):
    arguments = call(good, submissions, tmp_path / "g")
    assert cli.main(arguments) == 0
    for path in (tmp_path / "g/work").glob("*.xlsx"):
        path.unlink()
    for path in (tmp_path / "g/work").glob("*.json"):
        assert json.loads(path.read_text())["feedback"]
    assert cli.main(arguments) == 0
    whole(tmp_path / "g")


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "full"), KeyboardInterrupt()])
@pytest.mark.parametrize("name", ["chmod", "replace", "fdopen"])
def test_no_temporary_file_stays(name, error, tmp_path, monkeypatch):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr(files.os, name, fail)
    wanted = UnwrittenError if isinstance(error, OSError) else KeyboardInterrupt
    with pytest.raises(wanted):
        files.write_file(tmp_path / "a", b"1")
    assert not [*tmp_path.iterdir()]


def test_a_secret_is_whole_or_not_there(tmp_path):
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10, limit[1]))
    try:
        with pytest.raises(DataError, match="File too large"):
            read_secret(tmp_path / "s", make=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert not [*tmp_path.iterdir()]
