"""Random answers that keep the key's value are right; random ones that change it are not.

LibreOffice says which is which: its values with the student's own numbers and three other sets.
``fuzz_marks.py`` is the command that runs more of them.
"""

import pytest
from conftest import need
from fuzz_marks import SHARES, fuzzed

COUNT = 2_000  # right ones, and as many wrong ones


@pytest.mark.parametrize("spec", SHARES, ids=lambda spec: spec.rpartition("/")[2])
def test_marks_are_deserved(spec):
    need("libreoffice")
    count = -(-COUNT * SHARES[spec] // sum(SHARES.values()))
    found = fuzzed(spec, count, seed="suite")
    assert found.lost == [], "right answers that lost points"
    assert found.undeserved == [], "wrong answers with full points"
    assert min(found.counts["right"], found.counts["wrong"]) >= count
