"""What every way to score comparisons gives, and where each is: found by name (`docs/extend.md`)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from analysis.comparisons import Comparisons
from documents.extensions import Registry
from documents.pages import Block
from runner.reports.options import ScoresOptions


@dataclass(frozen=True, slots=True, eq=False)
class Scored(ABC):
    """Scores by some ``options``, and all that is told of them: the base of each way to score.

    Attributes
    ----------
    value
        The scores, as `scales`, `told` and `to_json` know them.
    options
        How the items were scored.
    refused
        Names of the options that do not go with it: they are refused where they are given. Of the base, what else is
        asked of a plain fit, and how that is made.
    model
        The one model of answers that it is for; empty where there are several.
    """

    value: Any
    options: ScoresOptions
    refused: ClassVar[tuple[str, ...]] = (
        *("checks", "multiverse", "pairs", "margin"),
        *("prior_sd", "order_effect", "covariance", "quasi_variances"),
    )
    model: ClassVar[str] = ""

    @classmethod
    @abstractmethod
    def of(cls, comparisons: Comparisons, options: ScoresOptions, common: Mapping[str, str] | None) -> Scored:
        """Score ``comparisons``; parameters and errors are those of `score_table`."""

    @property
    def problems(self) -> Sequence[str]:
        """Why there are no scores, in lines; none where there are."""
        return ()

    @property
    @abstractmethod
    def title(self) -> str:
        """What the rows are, in a line."""

    @property
    def whose(self) -> str:
        """The package and its version that scored; empty where it is ours."""
        return METHODS.whose(self.options.way)

    @abstractmethod
    def scales(self) -> Sequence[tuple[str | None, list[dict[str, Any]]]]:
        """Return the name of each group, if it has one, and a row for each of its items, best first."""

    @abstractmethod
    def told(self) -> list[Block]:
        """Return all of it, for the terminal, a page or a notebook."""

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return dict(self.value.to_json(), **self.beside())

    def beside(self) -> dict[str, Any]:
        """Return what stands in JSON beside the value."""
        return {}

    def all_further(self) -> dict[str, Any]:
        """Return what else was asked for; within groups, of each by its name."""
        return {}

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each item, best first; within groups with the name of its ``group``."""
        scales = self.scales()
        named = len(scales) > 1 or any(name for name, _ in scales)
        return [({"group": name} if named else {}) | item for name, items in scales for item in items]


# By the name of ``--method``; that of ``--observers`` stands behind a point.
METHODS: Registry[type[Scored]] = Registry(
    "cyclopean.methods",
    {name: "runner.reports.scores:ScoredScale" for name in ("auto", "ml", "firth", "map")},
    lambda name, kind: None if isinstance(kind, type) and issubclass(kind, Scored) else "is no Scored",
)
