"""Scores of a table of comparisons, whichever way they are asked for: the same for a command and a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from typing import Any

from analysis.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.hierarchical import HierarchicalFit, fit_blocks, fit_observers, observer_table
from analysis.inference import ReviewAnswer, answer_blocks, neighbour_conclusions, parse_margin, review
from analysis.jod import JodScales, jod_blocks, scale_jod, unsettled_lines
from analysis.scaling import (
    DEFAULT_PRIOR_SD,
    LAWS,
    GroupedScores,
    ScoreOptions,
    Scores,
    group_blocks,
    group_problem_lines,
    problem_lines,
    score,
    score_blocks,
    score_groups,
)
from documents import Finding
from documents.files import write_whole
from documents.pages import Block, Paragraph
from runner.reports.options import ScoresOptions

_REVIEWED = ("checks", "multiverse", "pairs", "margin")
_OF_ONE_FIT = (*_REVIEWED, "prior_sd", "order_effect", "covariance", "quasi_variances")


@dataclass(frozen=True, slots=True, eq=False)
class Scored:
    """Scores by some ``options``: those of one scale, within groups, of observers who differ, or JOD as pwcmp's."""

    value: Scores | GroupedScores | HierarchicalFit | JodScales
    options: ScoresOptions

    @property
    def problems(self) -> Sequence[str]:
        """Why there are no scores, in lines; none where there are."""
        if isinstance(self.value, JodScales):
            return unsettled_lines(self.value)
        if isinstance(self.value, GroupedScores):
            return group_problem_lines(self.value)
        return problem_lines(self.value) if isinstance(self.value, Scores) else ()

    def further(self, scores: Scores) -> Mapping[str, ReviewAnswer]:
        """Return what else was asked for of one scale, by its key in JSON; nothing where it has no scores."""
        asked = self.options
        if problem_lines(scores):
            return {}
        return review(scores, pairs=asked.pairs, margin=asked.margin, checks=asked.checks, choices=asked.multiverse)

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each item, best first; within groups with the name of its ``group``."""
        if isinstance(self.value, Scores):
            return self.value.item_rows()
        if isinstance(self.value, JodScales):
            scales: Sequence[tuple[str | None, list[dict[str, Any]]]] = [
                (name, [item.to_json() for item in scale.items]) for name, scale in self.value.scales
            ]
        elif isinstance(self.value, HierarchicalFit):
            scales = [(one.get("name") or None, one["items"]) for one in self.value.to_json()["groups"]]
        else:
            scales = [(name, part.item_rows()) for name, part in self.value.groups]
            scales = [*scales, *([(None, self.value.pooled.item_rows())] if self.value.pooled else [])]
        named = len(scales) > 1 or any(name for name, _ in scales)
        return [({"group": name} if named else {}) | item for name, items in scales for item in items]

    @property
    def title(self) -> str:
        """What the rows are, in a line."""
        model = self.options.model or "bradley-terry"
        if isinstance(self.value, JodScales):
            groups = len(self.value.scales)
            return f"JOD{f' within {groups} groups' if groups > 1 else ''} as pwcmp has them, best first"
        if isinstance(self.value, HierarchicalFit):
            return f"Scores of the typical observer by {model}, best first"
        if isinstance(self.value, GroupedScores):
            return f"Scores within {len(self.value.groups)} groups by {model}, best first"
        items = len(self.value.order)
        if self.value.fit.separation:
            return f"No finite estimate: complete separation of {items} items; try method='firth'"
        return f"Scores of {items} items by {model}, method {self.value.fit.method}, best first"

    def all_further(self) -> dict[str, Any]:
        """Return what else was asked for; within groups, of each by its name."""
        if isinstance(self.value, GroupedScores):
            return {name: self.further(part) for name, part in self.value.groups}
        return dict(self.further(self.value)) if isinstance(self.value, Scores) else {}

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        if isinstance(self.value, GroupedScores):
            return self.value.to_json(self._told)
        return self.value.to_json() | (self._told(self.value) if isinstance(self.value, Scores) else {})

    def told(self) -> list[Block]:
        """Return all of it, for the terminal, a page or a notebook."""
        if isinstance(self.value, JodScales):
            return jod_blocks(self.value)
        if isinstance(self.value, HierarchicalFit):
            return fit_blocks(self.value)
        if isinstance(self.value, GroupedScores):
            return group_blocks(self.value, self._further_blocks)
        return [*score_blocks(self.value), *self._further_blocks(self.value)]

    def _told(self, scores: Scores) -> dict[str, Any]:
        if problem_lines(scores):
            return {}
        further = self.further(scores)
        concluded = [one.to_json() for one in neighbour_conclusions(scores, further)]
        return {"conclusions": concluded} | {name: answer.to_json() for name, answer in further.items()}

    def _further_blocks(self, scores: Scores) -> list[Block]:
        if problem_lines(scores):
            return []
        further = self.further(scores)
        best = neighbour_conclusions(scores, further, most=1)  # the best item and the next
        blocks: list[Block] = [Paragraph(one.sentence) for one in best]
        return [*blocks, *(block for answer in further.values() for block in answer_blocks(answer))]


def refuse_together(options: ScoresOptions) -> None:
    """Raise ResultsError if options were given that do not go together."""
    by_pwcmp, at_random = options.method == "pwcmp", options.observers == "random"
    LAWS.wanted(options.model or "bradley-terry", "model", ResultsError)
    if options.margin is not None:
        parse_margin(options.margin, options.model or "bradley-terry")
    if options.prior_sd is not None and options.method != "map":
        _refuse("prior_sd goes with the method map")
    if not by_pwcmp and (options.jod_zero is not None or options.distance_prior is not None):
        _refuse("jod_zero and distance_prior go with the method pwcmp")
    if by_pwcmp and options.model not in (None, "thurstone"):
        _refuse("the method pwcmp is for the model thurstone")
    if not at_random and options.observer_scores is not None:
        _refuse("observer_scores goes with observers random")
    others = (*_OF_ONE_FIT, "method") if at_random else (*_OF_ONE_FIT, "observers") if by_pwcmp else ()
    for field in fields(options):
        if field.name in others and field.default is not MISSING and getattr(options, field.name) != field.default:
            _refuse(f"{field.name} does not go with {'observers random' if at_random else 'the method pwcmp'}")


def _refuse(what: str) -> None:
    raise ResultsError(Finding(what, remedy="leave one of them out"))


def score_table(comparisons: Comparisons, options: ScoresOptions, *, common: Mapping[str, str] | None = None) -> Scored:
    """Score paired comparisons by ``options``; those on reading a table are for who reads it.

    Parameters
    ----------
    comparisons
        Who was preferred over whom.
    options
        How the items are scored.
    common
        What stimuli of different groups have in common, by name; None if names say.

    Returns
    -------
    Scored
        The scores, and what else was asked for.

    Raises
    ------
    ResultsError
        If options do not go together or are out of range, or there is nothing to score.
    OSError
        If the file of observers' scores cannot be written.

    Examples
    --------
    >>> from analysis.comparisons import parse_table
    >>> table = parse_table(["winner,loser,count", "a,b,9", "b,a,3"], "table.csv")
    >>> scored = score_table(table, ScoresOptions(pairs=True))
    >>> round(scored.to_json()["items"][0]["score"], 2), scored.problems
    (0.75, [])
    """
    refuse_together(options)
    with LAWS.blamed(options.model or "bradley-terry"):
        return _scored(comparisons, options, common)


def _scored(comparisons: Comparisons, options: ScoresOptions, common: Mapping[str, str] | None) -> Scored:
    if options.observers == "random":
        fitted = fit_observers(
            comparisons, options.model or "bradley-terry", alpha=options.alpha, adjust=options.adjust or "holm"
        )
        if options.observer_scores is not None:
            write_whole(options.observer_scores, observer_table(fitted), private=True)
        return Scored(fitted, options)
    if options.method == "pwcmp":
        scales = scale_jod(
            comparisons,
            zero=options.jod_zero,
            prior=options.distance_prior or "gaussian",
            alpha=options.alpha,
            adjust=options.adjust or "none",
        )
        return Scored(scales, options)
    how = ScoreOptions(
        alpha=options.alpha,
        adjust=options.adjust or "holm",
        method=options.method,
        prior_sd=DEFAULT_PRIOR_SD if options.prior_sd is None else options.prior_sd,
        order_effect=options.order_effect,
        covariance=options.covariance,
        quasi_variances=options.quasi_variances,
    )
    model = options.model or "bradley-terry"
    if comparisons.groups:
        return Scored(score_groups(comparisons, model, common=common, **how), options)
    return Scored(score(comparisons, model, **how), options)
