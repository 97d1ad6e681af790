"""Assignments for every student, and their grading.

Here belongs what makes the files (``handout``), finds the answers in what comes back (``reading``),
says what each is worth (``judging``) and writes the tables (``reports``); each imports from those
before it in the order ``reading | judging | handout | reports``. Nothing here may define an
exercise. Begin with
:mod:`kfsheet.coursework.handout.handouts` and :mod:`kfsheet.coursework.reports.assessment`.
"""

from importlib.util import find_spec

from kfsheet.errors import EngineError

# Asked for here, once: a class must not be half graded when the first plot is drawn.
if missing := [name for name in ("ironcalc", "matplotlib") if find_spec(name) is None]:
    raise EngineError(
        f'handouts and grading need {", ".join(missing)}: pip install "kfsheet[grading]"'
    )
