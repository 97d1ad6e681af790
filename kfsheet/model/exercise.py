"""An exercise bundles what belongs together: model, charts, questions, words."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from kfsheet.errors import ModelError
from kfsheet.model.chart import Chart
from kfsheet.model.expressions import Missing, columns_read, scalars
from kfsheet.model.recurrence import Recurrence
from kfsheet.printing.sentence import Verdict

if TYPE_CHECKING:
    from numpy.random import RandomState

Draw = Callable[["RandomState", Mapping[str, float]], Mapping[str, list[float]]]
"""Draws data columns by name, from a generator and the values of all parameters."""


@dataclass(frozen=True)
class Question:
    """A column or derived scalar that students fill in.

    Parameters
    ----------
    name : str
        Of the column or the derived scalar.
    points : int
        What it is worth: 1, 2, 3, ...
    hint : str
        A sentence that helps to begin.
    """

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
        Paragraphs for the sheet "Read me": the story, and what to try. ``{r_i}`` stands for the
        value of a parameter, which in a handout is the student's own.
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
    alarm : tuple of str
        Summaries that are 0 if results are not what they seem; such a one is then red.
    vary : dict
        Parameters that differ from student to student: lowest and highest value by name.
    noise : tuple of str
        Data columns that hold standard-normal draws; every student gets other ones.
    frozen : tuple of str
        Worksheets whose formulas would give answers away; handouts hold their values only.
    task : tuple of str
        What a student must know to answer the questions, such as the model's equations in words.
    veiled : tuple of str
        Columns and derived scalars that stay live in handouts, but hide their formulas, and from
        which an answer may not be computed, unless it builds on them. What is plainly an answer in
        other words, or shows its formula, is found without being named here.
    sealed : tuple of str
        Worksheets whose given formulas stay live in handouts, but are hidden: they look like an
        answer's, for another axis or camera. An answer may read them.
    draw : function of (generator, parameters), optional
        Draws other data columns anew, as lists by name; None in a list is a missing value.
    ranges : dict
        Data columns whose values lie between two numbers whatever happens, such as pixels: lowest
        and highest value by name. Answers are not judged beyond.

    Raises
    ------
    ModelError
        If the model is not complete, or a chart or a question names what is not there.
    """

    model: Recurrence
    about: tuple[str | Verdict, ...]
    source: str
    charts: tuple[Chart, ...] = ()
    questions: tuple[Question, ...] = ()
    notebook: str = ""
    sections: dict[str, str] = field(default_factory=dict)
    greyed: str = ""
    alarm: tuple[str, ...] = ()
    vary: dict[str, tuple[float, float]] = field(default_factory=dict)
    noise: tuple[str, ...] = ()
    frozen: tuple[str, ...] = ()
    task: tuple[str, ...] = ()
    veiled: tuple[str, ...] = ()
    sealed: tuple[str, ...] = ()
    draw: Draw | None = None
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, kind in (
            ("about", str | Verdict),
            ("task", str),
            ("alarm", str),
            ("charts", Chart),
            ("questions", Question),
        ):
            given = getattr(self, name)
            if not isinstance(given, tuple) or not all(isinstance(item, kind) for item in given):
                raise ModelError(
                    f"{self.name}: {name} is {given!r:.60}; give a tuple of "
                    f"{getattr(kind, '__name__', 'str')}, with a comma even after a single one"
                )
        # What charts and questions name can be looked up only in a model that is complete.
        self.model.validate()
        for chart in self.charts:
            chart.check(self.model)
        for sentence in self.about:
            if isinstance(sentence, Verdict):
                sentence.check(self.model.scalars(), self.name)
        for question in self.questions:
            self._check_question(question)
        if self.greyed:
            self.model.column(self.greyed)
        for name in set(self.alarm) - set(self.model.summaries):
            raise ModelError(f"{self.name}: alarm names {name}, which is no summary")
        if unknown := {*self.sections, *self.frozen, *self.sealed} - set(self.model.sections):
            raise ModelError(f"{self.name} has no section {unknown.pop()!r}")
        for name in set(self.veiled) - set(self.model.derived_scalars):
            self.model.column(name)
        self._check_variation()

    def _check_variation(self) -> None:
        for name, limits in self.vary.items():
            if name not in self.model.parameters:
                raise ModelError(f"{self.name}: vary names {name}, which is no parameter")
            low, high = (self.model.parameters[name].checked(limit) for limit in limits)
            if not low < high:
                raise ModelError(f"{self.name}: vary {name} needs a lower and a higher value")
        for words, names in (("noise", self.noise), ("ranges", self.ranges)):
            for name in names:
                if not self.model.column(name).is_data:
                    raise ModelError(f"{self.name}: {words} names {name}, which is no data column")

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

    def story(self, values: Mapping[str, float]) -> tuple[str | Verdict, ...]:
        """The paragraphs of ``about`` with the values of a run's parameters in them."""

        def value(match: re.Match[str]) -> str:
            name = match[1]
            return f"{values[name]:.10g}" if name in self.model.parameters else match[0]

        return tuple(
            sentence if isinstance(sentence, Verdict) else re.sub(r"\{(\w+)\}", value, sentence)
            for sentence in self.about
        )

    @cached_property
    def waiting(self) -> frozenset[str]:
        """What has no value in a handout before answers are there: they, and what needs them."""
        model = self.model
        fixed = {c.name for c in model.table.values() if c.is_data or c.section in self.frozen}
        rules = {c.name: c.rules for c in model.all_columns() if c.name not in fixed}
        rules |= {s.name: s.rules for s in (model.derived_scalars | model.summaries).values()}
        reads = {
            name: {r for rule in those for r in (*columns_read(rule), *map(str, scalars(rule)))}
            for name, those in rules.items()
        }
        found: set[str] = set()
        new = {question.name for question in self.questions}
        while new:
            found |= new
            new = {n for n, read in reads.items() if read & found} - found
        return frozenset(found)


def asked_steps(model: Recurrence, name: str) -> list[int]:
    """Steps in which an answer is asked for; a derived scalar has the one step 0.

    A start that is a plain number is given: there is no formula to find.
    """
    if name in model.derived_scalars:
        return [0]
    column = model.column(name)
    given = [rule is Missing or rule.is_Number for rule in column.start]
    return [k for k in range(model.rows) if not (k < len(given) and given[k])]
