"""kfsheet without Numba and matplotlib: what needs them names the extra, in one line."""

import subprocess
import sys

import pytest

from kfsheet import ModelError, evaluate, load_exercise, study

CALLS = {
    "kf.study(m, 2, compiled=True)": r"kfsheet[fast]",
    "kf.evaluate(m, compiled=True)": r"kfsheet[fast]",
    "kf.draw(kf.load_exercise('football').charts[0], kf.evaluate(m))": r"kfsheet[plots]",
}
PROGRAM = """
import sys
for name in ("numba", "llvmlite", "matplotlib"):
    sys.modules[name] = None
import kfsheet as kf
m = kf.load_exercise("football").model
kf.study(m, 2)
try:
    CALL
except kf.EngineError as error:
    print(error)
"""


@pytest.mark.parametrize("call", CALLS)
def test_what_an_extra_is_missing_for_names_it(call):
    program = PROGRAM.replace("CALL", call)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert CALLS[call] in done.stdout


def test_what_is_no_recurrence_is_refused_with_the_remedy():
    for run in (evaluate, lambda thing: study(thing, 2)):
        with pytest.raises(ModelError, match="give a Recurrence"):
            run("football")
        with pytest.raises(ModelError, match=r"give a Recurrence: exercise\.model"):
            run(load_exercise("football"))
