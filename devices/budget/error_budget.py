"""The error budget: what each step costs each eye, what all cost together, and what is not known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from devices.budget.path import Step
from devices.display.model import EYES, Eye
from documents.arrays import Floats
from documents.text import JsonResult


@dataclass(frozen=True, slots=True)
class Cost:
    """Mean, 95th percentile and largest ΔE00 of one step for one eye.

    Examples
    --------
    >>> Cost.of(np.array([0.0, 0.1, 0.2])).max
    0.2
    """

    mean: float
    p95: float
    max: float

    @classmethod
    def of(cls, differences: Floats) -> Cost:
        """Return the cost of ΔE00 (n,), n at least 1."""
        return cls(float(differences.mean()), float(np.percentile(differences, 95)), float(differences.max()))

    def to_json(self) -> dict[str, float]:
        """Return four digits of each."""
        return {name: float(f"{getattr(self, name):.4g}") for name in self.__slots__}


@dataclass(frozen=True, slots=True)
class BudgetRow(JsonResult):
    """One step in ``words``; ``eyes`` is None where what it costs is not known, and the words say why.

    Examples
    --------
    >>> BudgetRow(Step.CROSSTALK, "not measured", None).to_json()
    {'step': 'crosstalk_left', 'words': 'not measured', 'left': None, 'right': None}
    """

    step: Step
    words: str
    eyes: Mapping[Eye, Cost] | None
    json_keys: ClassVar = {"costs": "*"}
    json_names: ClassVar = "step words costs"

    @property
    def costs(self) -> Mapping[Eye, Cost | None]:
        """What it costs each eye, None where that is not known."""
        return self.eyes or dict.fromkeys(EYES)


@dataclass(frozen=True, slots=True)
class ErrorBudget(JsonResult):
    """The steps in the order of the way, all together last; ``colours`` says what they were computed of.

    Examples
    --------
    >>> budget = ErrorBudget("two greys", (BudgetRow(Step.CROSSTALK, "not measured", None),))
    >>> budget.row(Step.CROSSTALK).words
    'not measured'
    """

    colours: str
    rows: tuple[BudgetRow, ...]
    json_keys: ClassVar = {"rows": "steps"}

    @classmethod
    def of(
        cls,
        colours: str,
        differences: Mapping[Step, Mapping[Eye, Floats]],
        words: Mapping[Step, str],
        stated: Mapping[Step, Mapping[Eye, Cost]],
    ) -> ErrorBudget:
        """Return the rows of every step that there are ``words`` for: computed, ``stated`` elsewhere, or not known."""
        rows = []
        for step in Step:
            if step in words:
                computed = differences.get(step)
                found = stated.get(step) if computed is None else {eye: Cost.of(computed[eye]) for eye in EYES}
                rows.append(BudgetRow(step, words[step], found))
        return cls(colours, tuple(rows))

    def row(self, step: Step) -> BudgetRow:
        """Return the row of ``step``; KeyError if there is none."""
        return {row.step: row for row in self.rows}[step]
