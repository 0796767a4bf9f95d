"""Scores within groups: one scale for each scene or content, one for all of them, and whether the groups agree."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np

from analysis.choices import Adjust
from analysis.comparisons.comparisons import (
    Comparisons,
    rename_items,
    select_answers,
    split_groups,
    without_groups,
)
from analysis.errors import ResultsError, naming
from analysis.scaling.group_agreement import GroupAgreement, group_agreement
from analysis.scaling.laws import LAWS, Model
from analysis.scaling.scores import FittingOptions, Scores, score
from analysis.scaling.separation import compared_groups
from documents import Finding
from documents.text import counted

MOST_NAMED = 5


class ScoreOptions(FittingOptions, total=False):
    """The options of `analysis.scaling.scores.score`, whose defaults stand there."""

    alpha: float
    adjust: Adjust
    quasi_variances: bool


@dataclass(frozen=True, slots=True, eq=False)
class GroupedScores:
    """Scores within groups.

    Attributes
    ----------
    groups
        The name and the scores of each group, in the order of the comparisons' groups: each on a scale of its own, with
        classes of its own. Strengths of different groups cannot be compared.
    pooled
        One scale for all answers; None where no item occurs in several groups.
    agreement
        Whether that scale serves all groups; None where there is none, groups share too few items, or pairs do not
        link all items of a group.
    notes
        What to bear in mind, in sentences.
    """

    groups: tuple[tuple[str, Scores], ...]
    pooled: Scores | None
    agreement: GroupAgreement | None
    notes: tuple[str, ...]

    def to_json(self, further: Callable[[Scores], dict[str, Any]] | None = None) -> dict[str, Any]:
        """Return what `cyclopean scores --json` prints: no NaN, null where there is no finite value.

        ``further`` gives more values of each table.
        """
        more = further or (lambda scores: {})
        return {
            "groups": [{"name": name, **scores.to_json(), **more(scores)} for name, scores in self.groups],
            "pooled": self.pooled.to_json() | more(self.pooled) if self.pooled else None,
            "agreement": self.agreement.to_json() if self.agreement else None,
            "notes": list(self.notes),
        }


def score_groups(
    comparisons: Comparisons,
    model: Model = "bradley-terry",
    *,
    common: Mapping[str, str] | None = None,
    **options: Unpack[ScoreOptions],
) -> GroupedScores:
    """Fit a scale to each group of ``comparisons``, one to all of them where items recur, and test whether they agree.

    Parameters
    ----------
    comparisons
        Answers within groups. Answers that belong to no group, such as pairs across scenes, count on the pooled scale
        alone.
    model
        As for `analysis.scaling.scores.score`.
    common
        For items whose names differ between groups, the name that they have in common, such as
        ``{"church jpeg": "jpeg", "beach jpeg": "jpeg"}``. Items that are not in it have their own names in common.
    **options
        As for `analysis.scaling.scores.score`, to which they go for each group and for the pooled scale. A correction
        for multiple comparisons covers the pairs of one group.

    Returns
    -------
    GroupedScores
        The scores of each group, the pooled ones, and the test of their agreement, by [Dempster1958].

    Raises
    ------
    ResultsError
        If there are no groups; one or a few items occur in several groups although most do not, as by a slip; two items
        of a group have the same common name, ``common`` names no item; or as `score`, with the group's name.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> answers = [
    ...     Answer(*pair, observer=str(observer), group=group)
    ...     for observer in range(4)
    ...     for group, wins in {"church": "ababba", "beach": "abbaab"}.items()
    ...     for pair in (wins[:2], wins[2:4], wins[4:])
    ... ]
    >>> grouped = score_groups(from_answers(answers))
    >>> [(name, [item.name for item in scores.items]) for name, scores in grouped.groups]
    [('church', ['a', 'b']), ('beach', ['a', 'b'])]
    >>> [round(item.score, 3) for item in grouped.pooled.items]
    [0.667, 0.333]
    """
    if not comparisons.groups:
        raise ResultsError(Finding("the comparisons have no groups", remedy="name them in the column 'group'"))
    parts = split_groups(comparisons)
    if common is None:
        _refuse_strays(parts)
    names = _common_names(comparisons, parts, common or {})
    scored = tuple((name, _scored(f"the group '{name}'", part, model, options)) for name, part in parts)
    notes = _notes(parts)
    recurring = len({names[item] for _, part in parts for item in part.items}) < sum(
        len(part.items) for _, part in parts
    )
    across = bool((comparisons.group < 0).any() or (comparisons.tied.group < 0).any())
    if not recurring and (common is not None or not across):
        return GroupedScores(scored, None, None, notes)
    within = rename_items(_within_groups(comparisons) if across else without_groups(comparisons), names)
    pooled = fitted = _scored("all groups together", within, model, options)
    if across and common is None:
        pooled = _scored("all groups together", without_groups(comparisons), model, options)
    elif across:
        notes = (*notes, "Pairs across groups count in no score: their items have common names.")
    agreement = _agreement(fitted, [part for _, part in parts], names) if recurring else None
    return GroupedScores(scored, pooled, agreement, notes)


def common_items(factors: Mapping[str, Mapping[str, object]], group: str) -> dict[str, str]:
    """Return for each stimulus the name that it has in common with those of other groups: its other factors' values.

    Parameters
    ----------
    factors
        The factors of each stimulus by its name.
    group
        The factor whose values are the groups, such as ``scene``.

    Returns
    -------
    dict[str, str]
        The ``common`` of `score_groups`; stimuli without another factor are left out.

    Examples
    --------
    >>> views = {"church jpeg": {"scene": "church", "codec": "jpeg", "quality": 20}, "church": {"scene": "church"}}
    >>> common_items(views, "scene")
    {'church jpeg': 'jpeg, 20'}
    """
    others = {
        item: [f"{value:g}" if isinstance(value, float) else str(value) for name, value in own.items() if name != group]
        for item, own in factors.items()
    }
    return {item: ", ".join(values) for item, values in others.items() if values}


def _scored(where: str, comparisons: Comparisons, model: Model, options: ScoreOptions) -> Scores:
    with naming(where):
        return score(comparisons, model, **options)


def _refuse_strays(parts: Sequence[tuple[str, Comparisons]]) -> None:
    """Refuse items in several groups where most occur in one only: they look like slips of the pen.

    An item in every one of three or more groups is taken for an anchor.
    """
    places: dict[str, list[tuple[float, str]]] = {}
    for name, part in parts:
        for item, times in zip(part.items, (part.compared + part.tied_with).tolist(), strict=True):
            places.setdefault(item, []).append((times, name))
    recurring = {item: where for item, where in places.items() if len(where) > 1}
    strays = {item: where for item, where in recurring.items() if len(where) < max(3, len(parts))}
    if not strays or 2 * len(recurring) >= len(places):
        return
    remedy = (
        "correct the group of those answers; if it is meant, give the item a name of its own in each group, or name it "
        "in the argument 'common'"
    )
    others = f"most items occur in one group only ({len(places) - len(recurring)} of {len(places)})"
    raise ResultsError(
        [
            Finding(f"'{item}' is in {_with_answers(where)}; {others}", remedy=remedy)
            for item, where in list(strays.items())[:MOST_NAMED]
        ]
    )


def _with_answers(where: list[tuple[float, str]]) -> str:
    """Name groups with how many answers an item has in each, the fewest last: that is the likely slip."""
    *most, last = [f"'{name}' ({counted(times, 'answer', 'answers')})" for times, name in sorted(where, reverse=True)]
    return f"the groups {', '.join(most)} and {last}"


def _common_names(
    comparisons: Comparisons, parts: Sequence[tuple[str, Comparisons]], common: Mapping[str, str]
) -> dict[str, str]:
    """Return each item's name on the pooled scale."""
    for item in common:
        if item not in comparisons.items:
            remedy = "leave it out of 'common', or correct the name"
            raise ResultsError(Finding(f"there is no item '{item}'", remedy=remedy))
    names = {item: common.get(item, item) for item in comparisons.items}
    for group, part in parts:
        met: dict[str, str] = {}
        for item in part.items:
            other = met.setdefault(names[item], item)
            if other != item:
                what = f"'{other}' and '{item}' of the group '{group}' have the same common name '{names[item]}'"
                raise ResultsError(Finding(what, remedy="give each item of a group a common name of its own"))
    return names


def _within_groups(comparisons: Comparisons) -> Comparisons:
    """Return the answers that belong to a group."""
    return select_answers(
        comparisons, np.flatnonzero(comparisons.group >= 0), np.flatnonzero(comparisons.tied.group >= 0)
    )


def _agreement(pooled: Scores, parts: Sequence[Comparisons], names: Mapping[str, str]) -> GroupAgreement | None:
    """Return the test of one scale for all groups; None where there is no pooled scale, or a group has none."""
    fit = pooled.fit
    ties = LAWS[fit.model].parameter is not None
    every = (*parts, pooled.comparisons)
    linked = (len(compared_groups(part.wins + part.tie_counts if ties else part.wins)) == 1 for part in every)
    if fit.separation or not fit.converged or not all(linked):
        return None
    place = {item: number for number, item in enumerate(pooled.comparisons.items)}
    return group_agreement(fit, parts, [[place[names[item]] for item in part.items] for part in parts])


def _notes(parts: Sequence[tuple[str, Comparisons]]) -> tuple[str, ...]:
    """Say where observers did not judge the same groups: differences of groups may then be those of observers."""
    judged = Counter(name for _, part in parts for name in part.observers)
    once = [name for name, times in judged.items() if times == 1]
    if len(parts) < 2 or not once or set(judged) == {""}:
        return ()
    why = "differences between groups may be differences between their observers"
    remedy = "let every observer judge every group"
    if len(once) == len(judged):
        return (f"No observer judged more than one group: {why}. To compare groups, {remedy}.",)
    who = ", ".join(once[:MOST_NAMED]) + (", ..." if len(once) > MOST_NAMED else "")
    some = counted(len(once), "observer", "observers")
    return (f"{some} of {len(judged)} judged one group only ({who}): {why}. To compare groups, {remedy}.",)
