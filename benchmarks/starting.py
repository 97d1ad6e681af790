"""What a user waits for before anything happens."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from measuring import Line, seconds

import kfsheet as kf

HERE = str(Path(__file__).parent)


def lines() -> Iterator[Line]:
    """Each in a process of its own, as a user starts it."""
    for what, goal, arguments in (
        ("kfsheet --help", "under 0.3 s", ["-m", "kfsheet", "--help"]),
        ("import kfsheet", "under 0.6 s", ["-c", "import kfsheet"]),
    ):
        yield Line(what, seconds(lambda given=arguments: python(given)), 0, goal)
    alone = [
        "-c",
        f"import sys; sys.path.insert(0, {HERE!r}); import starting as s; s.nine_states()",
    ]
    words = "under 2 s, importing SymPy included"
    yield Line("a dense 9-state model to columns", seconds(lambda: python(alone)), 0, words)


def python(arguments: list[str]) -> None:
    """Run a program."""
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)


def nine_states() -> None:
    """Nine states, all coupled, three observations."""
    from sympy import Matrix, Symbol, eye

    m = kf.Recurrence("nine", title="Nine states", rows=3)
    a = m.parameter("a", 0.1, "", "coupling")
    names = [Symbol(f"s{k}_", real=True) for k in range(9)]
    state = {s: kf.State("", f"element {k}", 0, 1) for k, s in enumerate(names)}
    x = Matrix(names)
    A = eye(9) + a * Matrix(9, 9, lambda i, j: 1 if abs(int(i) - int(j)) < 2 else 0)
    seen = [
        kf.Observation(
            f"y{k}", m.data(f"y_{k}", [0, 0, 0], "", "seen", section="D")[kf.t], s, 1, ""
        )
        for k, s in enumerate(names[:3])
    ]
    kf.add_filter(m, kf.StateSpace(state, list(A * x), eye(9) * a, seen), section="Filter")
