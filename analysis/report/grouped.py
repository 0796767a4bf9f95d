"""The scores of an experiment whose pairs were compared within groups, such as scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from analysis.choices import Adjust, CovarianceChoice
from analysis.comparisons.comparisons import Comparisons, split_groups
from analysis.comparisons.session_groups import SessionGroups, factors_of
from analysis.records.lines import Header
from analysis.records.session_record import SessionLog
from analysis.report.notes import notes_on_groups
from analysis.report.summary import (
    ReportSummary,
    Summary,
    analysis_options,
    compared_times,
    median_time_s,
    scale_of,
    smallest_of,
)
from analysis.scaling.grouped import GroupedScores, common_items, score_groups

POOLED = "all groups together"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class GroupedSummary(ReportSummary):
    """The scores of an experiment, one scale for each group.

    Attributes
    ----------
    all_comparisons
        The answers of all groups.
    session_groups
        The groups, and the factor that tells them apart.
    groups
        The scores of each group, by its name.
    pooled
        One scale for all groups, of what their stimuli have in common; None if they have nothing in common.
    scored
        The scores of the groups and the pooled ones, the test whether they agree, and notes.
    common
        For each stimulus the name that it has in common with those of other groups; empty without a pooled scale.
    """

    all_comparisons: Comparisons
    session_groups: SessionGroups
    groups: tuple[tuple[str, Summary], ...]
    pooled: Summary | None
    scored: GroupedScores
    common: Mapping[str, str]

    @property
    def comparisons(self) -> Comparisons:
        """The answers of all groups."""
        return self.all_comparisons

    @property
    def factor(self) -> str:
        """What tells the groups apart, in a word: the name of a factor, or "group"."""
        return self.session_groups.factor or "group"

    @property
    def scales(self) -> tuple[tuple[str, Summary], ...]:
        """The scales with their names: the pooled one if there is one, then that of each group."""
        pooled = ((POOLED, self.pooled),) if self.pooled else ()
        return (*pooled, *self.groups)

    @property
    def sentence(self) -> str:
        """The numbers of observers, comparisons, groups and classes, in a sentence."""
        counts = [len(part.scores.classes.members) for _, part in self.groups if part.scores.classes]
        words = f"{self.numbers} in {len(self.groups)} groups"
        words += f" by {self.factor}" if self.session_groups.factor else ""
        if counts:
            some = f"{min(counts)} to {max(counts)}" if min(counts) < max(counts) else f"{counts[0]}"
            words += f"; {some} perceptual class{'' if max(counts) == 1 else 'es'} in a group"
        if self.pooled and self.pooled.scores.classes:
            words += f", {len(self.pooled.scores.classes.members)} over all groups"
        return f"{words}."

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON: each group as the whole has it without groups, and those of the experiment."""
        return {
            **self.scored.to_json(),
            "groups": [{"name": name, **part.scale_json()} for name, part in self.groups],
            "pooled": self.pooled.scale_json() if self.pooled else None,
            "group_factor": self.session_groups.factor,
            **self.answered_json(),
        }


def summarise_groups(
    sessions: Sequence[SessionLog],
    comparisons: Comparisons,
    groups: SessionGroups,
    alpha: float | None = None,
    adjust: Adjust | None = None,
    covariance: CovarianceChoice | None = None,
) -> GroupedSummary:
    """Fit and classify the comparisons of each group, and of all together where stimuli have something in common.

    ``comparisons`` and ``groups`` are those of the sessions; the options are as for
    `analysis.report.summary.summarise`.

    Raises
    ------
    ResultsError
        If an analysis option in the header is unknown.
    """
    options = analysis_options(sessions, alpha, adjust, covariance)
    common = common_names(sessions[0].header, groups)
    scored = score_groups(comparisons, common=common, alpha=options["alpha"], adjust=options["adjust"])
    times = compared_times(sessions)
    parts = []
    for name, part in split_groups(comparisons):
        own = [(item, time_s) for item, time_s in times if groups.group_of[item] == name]
        parts.append((name, scale_of(sessions, part, own, options)))
    pooled = None if scored.pooled is None else scale_of(sessions, scored.pooled.comparisons, times, options)
    scored = replace(
        scored,
        groups=tuple((name, part.scores) for name, part in parts),
        pooled=None if pooled is None else pooled.scores,
    )
    scales = [*parts, *([(POOLED, pooled)] if pooled else [])]
    estimates = [(name, scale.estimate) for name, scale in scales]
    caveats = [(name, scale.one_scale.caveat) for name, scale in scales if scale.one_scale and scale.one_scale.caveat]
    name, largest = max(parts, key=lambda part: len(part[1].comparisons.items))
    smallest = smallest_of(largest.comparisons, options, name)
    further = [*(smallest.warnings if smallest else ()), *scored.notes]
    return GroupedSummary(
        all_comparisons=comparisons,
        session_groups=groups,
        groups=tuple(parts),
        pooled=pooled,
        scored=scored,
        common=common if pooled else {},
        notes=notes_on_groups(sessions, comparisons, groups.sentence, estimates, caveats, further),
        smallest=smallest,
        sessions=tuple(sessions),
        alpha=options["alpha"],
        adjust=options["adjust"],
        response_time_s=median_time_s(times),
    )


def common_names(header: Header, groups: SessionGroups) -> dict[str, str]:
    """Return for each stimulus the name that it has in common with stimuli of other groups: its other factors' levels.

    A factor counts if some level of it occurs in several groups, and if it is not the same for all stimuli. A level
    that is a number has the factor's name before it, such as "exposure_s 1.3".

    Parameters
    ----------
    header
        A session's header, with the stimuli's factors.
    groups
        The groups, as `analysis.comparisons.grouped_comparisons` returns them.

    Returns
    -------
    dict[str, str]
        The ``common`` of `analysis.scaling.score_groups`. Empty if two stimuli of a group would have the same name, or
        if no name recurs.

    Examples
    --------
    >>> from analysis.comparisons import SessionGroups
    >>> from analysis.records import Header, new_header
    >>> codecs = [(scene, codec) for scene in ("church", "beach") for codec in ("jpeg", "avif")]
    >>> stimuli = tuple({"name": f"{s}-{c}", "factors": {"scene": s, "codec": c}} for s, c in codecs)
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=stimuli)
    >>> common_names(header, SessionGroups({f"{s}-{c}": s for s, c in codecs}, "scene", ""))["beach-avif"]
    'avif'
    """
    factors = {item: own for item, own in factors_of(header).items() if item in groups.group_of}
    where: dict[tuple[str, str], set[str]] = {}
    levels: dict[str, set[str]] = {}
    for item, own in factors.items():
        for factor, level in own.items():
            where.setdefault((factor, level), set()).add(groups.group_of[item])
            levels.setdefault(factor, set()).add(level)
    recurring = {factor for (factor, _), found_in in where.items() if len(found_in) > 1 and len(levels[factor]) > 1}
    recurring.discard(groups.factor or "")
    numbers = {key for levels in header.factors.values() for key, level in levels.items() if level != str(level)}
    kept = {
        item: {key: f"{key} {level}" if key in numbers else level for key, level in own.items() if key in recurring}
        for item, own in factors.items()
    }
    names = common_items(kept, groups.factor or "")
    places = [(groups.group_of[item], name) for item, name in names.items()]
    unique = len(set(places)) == len(places)
    recurs = len({name for _, name in places}) < len(places)
    return names if unique and recurs else {}
