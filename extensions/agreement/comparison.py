"""Compare measures with observers: correlations, pairs, limits, and whether a measure agrees at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.classes import holm
from documents.arrays import Floats
from extensions.agreement.chance import Orders, Statistic, chance_of_agreement, least_p
from extensions.agreement.correlations import KINDS, TIED, CorrelationKind, correlation, mean_ranks
from extensions.agreement.interval import Observed, mean_interval
from extensions.agreement.limits import calibrate
from extensions.agreement.observed import ObservedGroup, check_sizes
from extensions.agreement.pairs import pair_accuracy
from extensions.agreement.result import Agreement, Correlation, Decision, GroupResult, MeasureResult, Predicted

FEWEST = 3
VERDICT_BY: CorrelationKind = "spearman"


@dataclass(frozen=True, slots=True, eq=False)
class _Photographed:
    """A group with its place among all, the index of its photograph if it is there, and the others' indices."""

    place: int
    group: ObservedGroup
    rest: ObservedGroup
    others: NDArray[np.intp]
    photograph: int | None


def agree(
    groups: Sequence[ObservedGroup],
    photographs: Sequence[str],
    measures: Sequence[Predicted],
    *,
    alpha: float = 0.05,
    notes: Sequence[str] = (),
) -> Agreement:
    """Compare what measures say of stimuli with what observers say.

    The photographs themselves take no part in correlations and pairs: that a picture is like itself is no news. They
    count for the classes, where observers compared them.

    Parameters
    ----------
    groups
        What observers said.
    photographs
        For each group, the name of the photograph that its stimuli are measured against.
    measures
        What the measures say, of each stimulus of each group.
    alpha
        The level at which a measure is said to agree.
    notes
        Sentences to put before the others.

    Returns
    -------
    Agreement
        The results of each measure, by group and over all.

    Raises
    ------
    ResultsError
        If no group has three stimuli beside its photograph.

    Examples
    --------
    >>> scores, differs = np.array([2.0, 1.0, 0.0, -1.0, -2.0]), ~np.eye(5, dtype=bool)
    >>> group = ObservedGroup("", "ratings", "points", ("photo", *"abcd"), scores, differs, 1, None)
    >>> blur = Predicted("blur", "Blur", "px", "lower", (np.array([0.0, 1.0, 2.0, 3.0, 4.0]),))
    >>> result = agree([group], ["photo"], [blur]).measures[0]
    >>> result.decision, round(result.whole.correlations["spearman"].value, 6)
    ('agrees', 1.0)
    """
    rests = [group.only(name for name in group.stimuli if name != one) for group, one in _pairs(groups, photographs)]
    _, small = check_sizes(rests, FEWEST)
    parts = [_part(place, groups[place], rest, photographs[place]) for place, rest in enumerate(rests)]
    parts = [part for part in parts if len(part.others) >= FEWEST]
    sizes = [len(part.others) for part in parts]
    kept = [part.place for part in parts]
    measures = [_only(measure, kept) for measure in measures]
    parts = [_part(number, part.group, part.rest, photographs[part.place]) for number, part in enumerate(parts)]
    found = [(one, [_result([part], one) for part in parts], _result(parts, one)) for one in measures]
    chances = [whole.correlations[VERDICT_BY].p for _, _, whole in found]
    tested = [p for p in chances if p is not None]
    corrected = iter(holm(np.array(tested)).tolist() if tested else [])
    adjusted = [None if p is None else float(next(corrected)) for p in chances]
    reached = least_p(sizes)
    results = tuple(
        MeasureResult(one, tuple(each), whole, p, _decision(p, reached * len(tested), alpha))
        for (one, each, whole), p in zip(found, adjusted, strict=True)
    )
    return Agreement(
        groups=tuple(part.group for part in parts),
        photographs=tuple(photographs[place] for place in kept),
        measures=results,
        alpha=alpha,
        least_p=reached,
        notes=tuple(dict.fromkeys([*notes, *small, *_notes(parts)])),
    )


def _pairs(groups: Sequence[ObservedGroup], photographs: Sequence[str]) -> list[tuple[ObservedGroup, str]]:
    return list(zip(groups, photographs, strict=True))


def _part(place: int, group: ObservedGroup, rest: ObservedGroup, photograph: str) -> _Photographed:
    others = np.array([at for at, name in enumerate(group.stimuli) if name != photograph], dtype=np.intp)
    index = group.stimuli.index(photograph) if photograph in group.stimuli else None
    return _Photographed(place, group, rest, others, index)


def _only(measure: Predicted, kept: Sequence[int]) -> Predicted:
    values = tuple(measure.values[place] for place in kept)
    return Predicted(measure.name, measure.title, measure.unit, measure.better, values, measure.limit, measure.remarks)


def _decision(p: float | None, reached: float, alpha: float) -> Decision:
    if p is None:
        return "cannot be said"
    if p <= alpha:
        return "agrees"
    return "cannot be said" if reached > alpha else "not shown"


def _result(parts: Sequence[_Photographed], measure: Predicted) -> GroupResult:
    values = [measure.sign * measure.values[part.place][part.others] for part in parts]
    rests = [part.rest for part in parts]
    compared = [part for part in parts if part.photograph is not None]
    calibration = None
    if compared:
        calibration = calibrate(
            [part.group for part in compared],
            [measure.values[part.place] for part in compared],
            [part.photograph for part in compared if part.photograph is not None],
            measure.limit,
            higher_is_better=measure.better == "higher",
        )
    return GroupResult(_correlations(rests, values), pair_accuracy(rests, values), calibration)


def _correlations(groups: Sequence[ObservedGroup], values: Sequence[Floats]) -> Mapping[CorrelationKind, Correlation]:
    return {kind: _correlation(groups, values, kind) for kind in KINDS}


def _correlation(groups: Sequence[ObservedGroup], values: Sequence[Floats], kind: CorrelationKind) -> Correlation:
    both = list(zip(groups, values, strict=True))
    usable = [
        (group, own)
        for group, own in both
        if _varies(group.scores) and _varies(own) and (kind != "pearson" or np.isfinite(own).all())
    ]
    if len(usable) < len(both):
        return Correlation(None, None, None, None)
    value = float(np.mean([correlation(group.scores, own, kind) for group, own in both]))
    p = chance_of_agreement([len(own) for own in values], [_with(group.scores, own, kind) for group, own in both])
    low = high = None
    said = [Observed(group.scores, group.drawn.errors, group.observers) for group, _ in both if group.drawn]
    if len(said) == len(both):
        low, high = mean_interval(said, [own for _, own in both], kind)
    return Correlation(value, low, high, p)


def _varies(values: Floats) -> bool:
    """Return whether not all values are the same but for rounding."""
    if not np.isfinite(values).all():
        return len(np.unique(values)) > 1
    return bool(np.ptp(values) > TIED * np.abs(values).max(initial=0.0))


def _with(scores: Floats, values: Floats, kind: CorrelationKind) -> Statistic:
    """Return the statistic of the permutation test: the scores take other orders, which is the same."""
    if kind == "spearman":  # ranks once, not in every order
        scores, values, kind = mean_ranks(scores), mean_ranks(values), "pearson"

    def statistic(orders: Orders) -> Floats:
        return correlation(scores[orders], values, kind)

    return statistic


def _notes(parts: Sequence[_Photographed]) -> list[str]:
    notes = []
    alone = [part.group for part in parts if part.group.observers < 2]
    if alone:
        notes.append("There is one observer: nothing is known of how others would differ, and there is no interval.")
    elif any(part.group.drawn is None for part in parts):
        notes.append("There are more stimuli than a bootstrap over observers is made for: there is no interval.")
    names = [name for part in parts for name in part.rest.stimuli]
    if len(set(names)) < len(names):
        notes.append("Some stimuli are in several groups; p over all groups takes the groups for independent.")
    without = [part.group.name for part in parts if part.photograph is None]
    if without:
        where = "" if len(parts) == len(without) else f" of {', '.join(without)}"
        notes.append(
            f"Observers did not compare the photograph{where} with the stimuli: no limit can be compared with its "
            "class. A photograph among the stimuli of all_pairs would have one."
        )
    return notes
