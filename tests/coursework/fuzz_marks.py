"""Random answers and the marks they get, LibreOffice being asked which of them are right.

    python tests/coursework/fuzz_marks.py --count 10000 --seed 1 [--only football] [--jobs 2]

``--count`` answers that keep the key's value and as many that change it, over all exercises. Every
right answer that loses points and every wrong one that gets all of them is printed.
"""

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1])]

MINI = str(HERE / "cases/submissions/mini.py")
SHORT_CANNONBALL = str(HERE.parent / "fuzz/short_cannonball.py")
SHARES = {"football": 40, MINI: 60, "shuttlecock": 6, SHORT_CANNONBALL: 2, "tennis": 1}
"""How many of the answers are for which exercise: short tables are quick."""

KEEP = os.environ.get("KEEP_FILES") and Path(os.environ["KEEP_FILES"])
"""Where files go whose marks are not deserved."""

BATCH = 60  # answers to one question in one workbook


@dataclass
class Tally:
    """What became of the answers to one exercise, or to all of them."""

    counts: Counter = field(default_factory=Counter)
    lost: list[str] = field(default_factory=list)
    undeserved: list[str] = field(default_factory=list)

    def add(self, other):
        self.counts += other.counts
        self.lost += other.lost
        self.undeserved += other.undeserved


def fuzzed(spec, count, seed):
    """``count`` right and ``count`` wrong answers to an exercise, and what they got."""
    from fuzz.course import Course

    course, tally = Course(spec), Tally()
    start = 0
    while min(tally.counts["right"], tally.counts["wrong"]) < count:
        missing = {k: count - tally.counts[k] for k in ("right", "wrong")}
        answers = list(_drawn(course, missing, f"{seed}/{start}"))
        verdicts = course.verdicts(answers)
        _grade(course, list(_counted(answers, verdicts, missing)), tally)
        start += 1
    return tally


def _drawn(course, missing, seed):
    questions = len(course.questions)
    for kind, told in (("rewritten", "right"), ("mutated", "wrong")):
        # Some turn out to be neither.
        each = min(BATCH, 1 + int(1.2 * max(0, missing[told]) / questions))
        for name in course.questions:
            for n in range(each if missing[told] > 0 else 0):
                yield course.answer(name, f"{seed}/{n}", kind)


def _counted(answers, verdicts, missing):
    """Answers of which it is clear what they deserve, as many as are wanted."""
    left = dict(missing)
    for answer, told in zip(answers, verdicts, strict=True):
        # A mistake that shows nowhere may be one all the same.
        if told == "unclear" or (told == "right" and answer.kind == "mutated"):
            continue
        if left[told] > 0:
            left[told] -= 1
            yield answer, told


def _grade(course, answers, tally):
    """Files with one answer to every question, until there are no more."""
    columns = [[a for a in answers if a[0].question.name == name] for name in course.questions]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "answers.xlsx"
        for row in zip_longest(*columns):
            given = [pair for pair in row if pair]
            marks = course.marks([answer for answer, _ in given], path)
            found = [_judged(course, a, told, marks[a.question.name], tally) for a, told in given]
            if KEEP and any(found):
                shutil.copy(
                    path, KEEP / f"{course.exercise.name}_{sum(tally.counts.values())}.xlsx"
                )


def _judged(course, answer, told, mark, tally):
    tally.counts[told] += 1
    tally.counts[f"{told}: {mark.status}"] += 1
    full = getattr(mark, "points", None) == mark.score
    words = f"{course.exercise.name} {answer.kind} {answer} -> {mark.status} {mark.remark}"
    words += f" [{answer.seen}]" if answer.seen and told == "wrong" else ""
    if (told == "right") == full:
        return False
    (tally.undeserved if full else tally.lost).append(words)
    print(f"{told}, and {mark.status}: {words}", flush=True)
    return True


def everywhere(count, seed, jobs=1, only=""):
    """``count`` right and wrong answers over all exercises."""
    shares = {s: n for s, n in SHARES.items() if only in s}
    whole, tally = sum(shares.values()), Tally()
    tasks = [(spec, -(-count * share // whole), seed) for spec, share in shares.items()]
    if jobs == 1:
        found = [fuzzed(*task) for task in tasks]
    else:
        with ProcessPoolExecutor(jobs) as pool:
            found = list(pool.map(fuzzed, *zip(*tasks, strict=True)))
    for each in found:
        tally.add(each)
    return tally


def main():
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("--count", type=int, default=2_000)
    options.add_argument("--seed", default="1")
    options.add_argument("--jobs", type=int, default=1)
    options.add_argument("--only", default="", help="part of an exercise's name")
    given = options.parse_args()
    began = time.monotonic()
    tally = everywhere(given.count, given.seed, given.jobs, given.only)
    print(f"{len(tally.lost):7d} right, but lost points")
    print(f"{len(tally.undeserved):7d} wrong, but full points")
    for name, number in sorted(tally.counts.items()):
        print(f"{number:7d} {name}")
    print(f"{time.monotonic() - began:.0f} s")
    return 1 if tally.lost or tally.undeserved else 0


if __name__ == "__main__":
    sys.exit(main())
