"""Scores of a table of comparisons, whichever way they are asked for: the same for a command and a notebook."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any, Literal, cast

from analysis.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.inference import ReviewAnswer, answer_blocks, neighbour_conclusions, review
from analysis.scaling import (
    LAWS,
    GroupedScores,
    ModelMethod,
    ScoreOptions,
    Scores,
    group_blocks,
    group_problem_lines,
    parse_margin,
    problem_lines,
    score,
    score_blocks,
    score_groups,
)
from documents import Finding
from documents.pages import Block, Paragraph
from runner.reports.options import ScoresOptions
from runner.reports.scored import METHODS, Scored


class ScoredScale(Scored):
    """Scores of one scale."""

    value: Scores
    refused = ()

    @classmethod
    def of(cls, comparisons: Comparisons, options: ScoresOptions, common: Mapping[str, str] | None) -> Scored:
        """Score all items together, or those of each group where there are groups."""
        how = ScoreOptions(
            alpha=options.alpha,
            adjust=options.adjust or "holm",
            method=cast("ModelMethod | Literal['auto']", options.method),
            order_effect=options.order_effect,
            covariance=options.covariance,
            quasi_variances=options.quasi_variances,
        )
        if options.prior_sd is not None:
            how["prior_sd"] = options.prior_sd
        model = options.model or "bradley-terry"
        if comparisons.groups:
            return ScoredGroups(score_groups(comparisons, model, common=common, **how), options)
        return ScoredScale(score(comparisons, model, **how), options)

    @property
    def problems(self) -> Sequence[str]:
        """Why there are no scores."""
        return problem_lines(self.value)

    @property
    def title(self) -> str:
        """How many items, and by which model and method."""
        items = len(self.value.order)
        if self.value.fit.separation:
            return f"No finite estimate: complete separation of {items} items; try method='firth'"
        return f"Scores of {items} items by {self._by}, method {self.value.fit.method}, best first"

    @property
    def _by(self) -> str:
        return self.options.model or "bradley-terry"

    def scales(self) -> Sequence[tuple[str | None, list[dict[str, Any]]]]:
        """Return the rows of the one scale."""
        return [(None, self.value.item_rows())]

    def told(self) -> list[Block]:
        """Return the scores, and what else was asked for."""
        return [*score_blocks(self.value), *self._further_blocks(self.value)]

    def beside(self) -> dict[str, Any]:
        """Return what else was asked for."""
        return self._told(self.value)

    def all_further(self) -> dict[str, Any]:
        """Return what else was asked for."""
        return dict(self._further(self.value))

    def _further(self, scores: Scores) -> Mapping[str, ReviewAnswer]:
        """Return what else was asked for of one scale, by its key in JSON; nothing where it has no scores."""
        asked = self.options
        if problem_lines(scores):
            return {}
        return review(scores, pairs=asked.pairs, margin=asked.margin, checks=asked.checks, choices=asked.multiverse)

    def _told(self, scores: Scores) -> dict[str, Any]:
        if problem_lines(scores):
            return {}
        further = self._further(scores)
        concluded = [one.to_json() for one in neighbour_conclusions(scores, further)]
        return {"conclusions": concluded} | {name: answer.to_json() for name, answer in further.items()}

    def _further_blocks(self, scores: Scores) -> list[Block]:
        if problem_lines(scores):
            return []
        further = self._further(scores)
        best = neighbour_conclusions(scores, further, most=1)  # the best item and the next
        blocks: list[Block] = [Paragraph(one.sentence) for one in best]
        return [*blocks, *(block for answer in further.values() for block in answer_blocks(answer))]


class ScoredGroups(ScoredScale):
    """Scores within groups."""

    value: GroupedScores  # type: ignore[assignment]  # several scales in place of one

    @property
    def problems(self) -> Sequence[str]:
        """Why groups have no scores."""
        return group_problem_lines(self.value)

    @property
    def title(self) -> str:
        """Within how many groups, and by which model."""
        return f"Scores within {len(self.value.groups)} groups by {self._by}, best first"

    def scales(self) -> Sequence[tuple[str | None, list[dict[str, Any]]]]:
        """Return the rows of each group, then those of all together."""
        pooled = [self.value.pooled] if self.value.pooled else []
        return [
            *((name, part.item_rows()) for name, part in self.value.groups),
            *((None, one.item_rows()) for one in pooled),
        ]

    def told(self) -> list[Block]:
        """Return the scores of each group, and what else was asked for."""
        return group_blocks(self.value, self._further_blocks)

    def to_json(self) -> dict[str, Any]:
        """Return the scores of each group with what else was asked for."""
        return self.value.to_json(self._told)

    def all_further(self) -> dict[str, Any]:
        """Return what else was asked for of each group, by its name."""
        return {name: self._further(part) for name, part in self.value.groups}


def refuse_together(options: ScoresOptions) -> None:
    """Raise ResultsError if options were given that do not go together."""
    at_random = options.observers == "random"
    LAWS.wanted(options.model or "bradley-terry", "model", ResultsError)
    if options.margin is not None:
        parse_margin(options.margin, options.model or "bradley-terry")
    if options.prior_sd is not None and options.method != "map":
        _refuse("prior_sd goes with the method map")
    if options.method != "pwcmp" and (options.jod_zero is not None or options.distance_prior is not None):
        _refuse("jod_zero and distance_prior go with the method pwcmp")
    method, kind = _kind(options.method), _kind(options.way)
    if method.model and options.model not in (None, method.model):
        _refuse(f"the method {options.method} is for the model {method.model}")
    if not at_random and options.observer_scores is not None:
        _refuse("observer_scores goes with observers random")
    told = "observers random" if at_random else f"the method {options.method}"
    for field in fields(options):
        if (
            field.name in kind.refused
            and field.default is not MISSING
            and getattr(options, field.name) != field.default
        ):
            _refuse(f"{field.name} does not go with {told}")


def _kind(name: str) -> type[Scored]:
    if name in ("pwcmp", "observers.random") and name not in METHODS:
        remedy = f"install a package that adds to {METHODS.group}"
        raise ResultsError(Finding(f"there is no method '{name}'", remedy=remedy))
    return METHODS.wanted(name, "method", ResultsError)


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
    with LAWS.blamed(options.model or "bradley-terry"), METHODS.blamed(options.way):
        scored = METHODS[options.way].of(comparisons, options, common)
        if not isinstance(scored, Scored):
            raise TypeError(f"{type(scored).__name__} in place of Scored")
    return scored
