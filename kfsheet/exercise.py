"""An exercise bundles what belongs together: model, charts, questions, words."""

from __future__ import annotations

from dataclasses import dataclass, field

from kfsheet.charts import Chart
from kfsheet.errors import ModelError
from kfsheet.recurrence import Recurrence


@dataclass(frozen=True)
class Question:
    """A column or derived scalar that students fill in: its name, points and a hint."""

    name: str
    points: int
    hint: str


@dataclass(frozen=True)
class Exercise:
    """A model with all that a workbook, a notebook and a coursework need beside it.

    Parameters
    ----------
    model : Recurrence
        The filter; its name is the name of the exercise and of its workbook.
    about : tuple of str
        Paragraphs for the sheet "Read me": the story, and what to try.
    source : str
        Where the exercise comes from.
    charts : tuple of Chart
        In the order in which they appear.
    questions : tuple of Question
        What coursework asks for.
    notebook : str
        File name of the notebook that walks through it, if there is one.
    sections : dict
        What each worksheet holds, by its name.
    greyed : str
        A column that is 0 in rows that no longer count; they are shown in grey.

    Raises
    ------
    ModelError
        If the model is not complete, or a chart or a question names what is not there.
    """

    model: Recurrence
    about: tuple[str, ...]
    source: str
    charts: tuple[Chart, ...] = ()
    questions: tuple[Question, ...] = ()
    notebook: str = ""
    sections: dict[str, str] = field(default_factory=dict)
    greyed: str = ""

    def __post_init__(self) -> None:
        for name, kind in (("about", str), ("charts", Chart), ("questions", Question)):
            given = getattr(self, name)
            if not isinstance(given, tuple) or not all(isinstance(item, kind) for item in given):
                raise ModelError(
                    f"{self.name}: {name} is {given!r:.60}; give a tuple of {kind.__name__}, "
                    "with a comma even after a single one"
                )
        self.model.validate()
        for chart in self.charts:
            chart.check(self.model)
        for question in self.questions:
            self._check_question(question)
        if self.greyed:
            self.model.column(self.greyed)
        if unknown := set(self.sections) - set(self.model.sections):
            raise ModelError(f"{self.name} has no section {unknown.pop()!r}")

    def _check_question(self, question: Question) -> None:
        if not isinstance(question.points, int) or question.points <= 0:
            raise ModelError(
                f"question {question.name} has {question.points!r} points; give 1, 2, 3, ..."
            )
        if question.name in self.model.derived_scalars:
            return
        if self.model.column(question.name).is_data:
            raise ModelError(f"question {question.name}: the column is data, not a formula")

    @property
    def name(self) -> str:
        """Identifier: on the command line, and of the workbook."""
        return self.model.name

    @property
    def title(self) -> str:
        """One line for people."""
        return self.model.title
