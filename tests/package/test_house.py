"""The house has rooms: what a newcomer finds in kfsheet/ by its name alone."""

from collections import Counter
from pathlib import Path

import pytest

import kfsheet

HOUSE = Path(kfsheet.__file__).parent
ROOMS = sorted(path.parent for path in HOUSE.rglob("__init__.py"))
FILES = [path for room in ROOMS for path in room.glob("*.py")]
EXERCISES = HOUSE / "exercises"
# Every exercise has these of its own; each is the same job, done for another ball.
SAME_JOB = {"__init__", "model", "words", "charts"}
MOST_FILES = 12  # beside __init__


def name_of(room):
    return str(room.relative_to(HOUSE.parent))


def test_at_the_top_lie_only_what_every_package_needs():
    top = {path.stem for path in HOUSE.glob("*.py")}
    assert top == {"__init__", "__main__", "errors", "files", "processes"}


@pytest.mark.parametrize("room", ROOMS, ids=name_of)
def test_a_folder_holds_a_dozen_files_at_most(room):
    assert len([*room.glob("*.py")]) - 1 <= MOST_FILES


@pytest.mark.parametrize(
    "room", [r for r in ROOMS if r != HOUSE and EXERCISES not in r.parents], ids=name_of
)
def test_a_package_says_what_belongs_there_what_may_not_and_where_to_begin(room):
    text = " ".join((room / "__init__.py").read_text(encoding="utf-8").split())
    if "former name" not in text:
        for words in ("belong", "Nothing here may", "Begin with"):
            assert words in text, f"{name_of(room)} lacks: {words}"


def test_no_two_modules_of_one_name_do_different_jobs():
    names = Counter(path.stem for path in FILES if path.stem not in SAME_JOB)
    assert [name for name, count in names.items() if count > 1] == []


def test_every_exercise_is_a_folder_with_its_model_words_charts_and_data():
    for name in kfsheet.exercise_names():
        room = EXERCISES / name
        assert (room / "model.py").is_file(), name
        if name != "tennis_toss":  # the tennis with other photos
            assert (room / "words.py").is_file(), name
            assert (room / "charts.py").is_file(), name
            assert [*(room / "data").glob("*.csv")], name
