"""The numbers of one run of a model, as the cells of a workbook show them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from kfsheet.evaluation.evaluate import run
from kfsheet.model.recurrence import Recurrence


@dataclass(frozen=True)
class Run:
    """Numbers of one run: columns, scalars (parameters, derived, summaries)."""

    columns: dict[str, list[float]]
    scalars: dict[str, float]
    _figures: dict[tuple[Callable, str], float] = field(default_factory=dict, repr=False)

    def figure(self, function: Callable[[list[float]], float], name: str) -> float:
        """A figure of a column, such as its root mean square, computed once."""
        key = (function, name)
        if key not in self._figures:
            self._figures[key] = function(self.columns[name])
        return self._figures[key]

    @classmethod
    def of(
        cls,
        model: Recurrence,
        data: Mapping[str, Sequence[float]] | None = None,
        parameters: Mapping[str, float] | None = None,
    ) -> Run:
        """Evaluate a model once."""
        columns, scalars, values = run(model, data, parameters)
        return cls(columns, {**values, **scalars})
