"""What a check found, in words."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kfsheet.parsing.references import Address
from kfsheet.workbook.check.opened_workbook import place
from kfsheet.workbook.engines.recalculate import ENGINES


@dataclass(frozen=True)
class Problem:
    """One cell that is wrong in itself, and why."""

    address: Address
    reason: str

    def __str__(self) -> str:
        return f"{place(self.address)}: {self.reason}"

    def follows(self, other: Problem) -> bool:
        """Whether this is the cell below, with the same reason."""
        sheet, row, column = other.address
        return self.address == (sheet, row + 1, column) and self.reason == other.reason


@dataclass
class Report:
    """What a check found."""

    path: Path
    engine: str
    cells: int
    largest: float
    """Largest relative difference, by the rule of the comparison, with the inputs as they stand."""
    changed: list[str]
    problems: list[Problem]
    followers: int
    """How many more cells differ only because they follow from one that is wrong."""

    unknown: list[str] = field(default_factory=list)
    """Cells about which the engine did not know what to say; their problems may be its own."""

    instead: str = ""
    """Why the engine that was asked for has not calculated, if another one has."""

    def lines(self) -> list[str]:
        """The problems in words, neighbours in a column with the same reason as one line."""
        groups: list[list[Problem]] = []
        for problem in self.problems:
            if groups and problem.follows(groups[-1][-1]):
                groups[-1].append(problem)
            else:
                groups.append([problem])
        return [
            str(g[0])
            if len(g) == 1
            else f"{place(g[0].address)} to {place(g[-1].address)}: each {g[0].reason}"
            for g in groups
        ]

    @property
    def holds(self) -> bool:
        """Whether every formula cell agrees."""
        return not self.problems

    def as_dict(self) -> dict[str, Any]:
        """For a file of results; keys as in docs/checking.md."""
        return {
            "workbook": str(self.path),
            "holds": self.holds,
            "engine": self.engine,
            "instead": self.instead,
            "formulas": self.cells,
            "largest": self.largest,
            "changed": self.changed,
            "problems": [{"cell": place(p.address), "reason": p.reason} for p in self.problems],
            "followers": self.followers,
            "verdict": self.verdict,
        }

    @property
    def verdict(self) -> str:
        """The last line of a check."""
        engine = ENGINES[self.engine]
        if self.holds:
            return (
                f"{self.cells} formulas agree with NumPy in {engine} "
                f"(largest relative difference {self.largest:.1e})"
            )
        wrong = len(self.problems)
        words = f"{wrong} cell{'s are' if wrong > 1 else ' is'} wrong in {engine}"
        return words + (f", {self.followers} more follow from that" if self.followers else "")
