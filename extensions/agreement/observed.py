"""What observers said of a group of stimuli, in the form that measures are compared with: scores, errors, differences.

Whatever the task, a group has a score for each stimulus, larger for better, what the bootstrap over observers makes of
it, and the pairs of stimuli that observers tell apart: those whose difference is significant, as in a report.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.bootstrap import differing, resample
from analysis.comparisons import Comparisons, grouped_comparisons, is_comparison, split_groups
from analysis.errors import ResultsError
from analysis.records import SessionLog
from analysis.report import MOST_ITEMS_DRAWN, AnalysisOptions, estimate_scores
from documents import Finding
from documents.arrays import Flags, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """What R bootstrap samples of the observers gave of n stimuli.

    ``scores``, shape (R, n); ``errors``, the same minus the scores that they scatter about; ``differs``, shape
    (R, n, n): which stimuli each sample tells apart.
    """

    scores: Floats
    errors: Floats
    differs: Flags


@dataclass(frozen=True, slots=True, eq=False)
class ObservedGroup:
    """What observers said of n stimuli on one scale.

    Attributes
    ----------
    name
        The group's name, such as a scene; empty where there is one.
    task, unit
        What observers did, and what the scores are in, such as nats.
    stimuli
        Their names.
    scores
        Shape (n,): larger for better.
    differs
        Shape (n, n), symmetric: which stimuli observers tell apart, by the tests that the classes follow from.
    observers
        How many there are.
    drawn
        The bootstrap over observers; None with one observer, or too many stimuli.
    """

    name: str
    task: str
    unit: str
    stimuli: tuple[str, ...]
    scores: Floats
    differs: Flags
    observers: int
    drawn: Drawn | None

    def only(self, stimuli: Iterable[str], name: str | None = None) -> ObservedGroup:
        """Return the group with these of its stimuli alone, in its own order."""
        wanted = set(stimuli)
        at = [place for place, stimulus in enumerate(self.stimuli) if stimulus in wanted]
        both = np.ix_(at, at)
        drawn = self.drawn
        if drawn is not None:
            drawn = Drawn(drawn.scores[:, at], drawn.errors[:, at], drawn.differs[:, at][:, :, at])
        return replace(
            self,
            name=self.name if name is None else name,
            stimuli=tuple(self.stimuli[place] for place in at),
            scores=self.scores[at],
            differs=self.differs[both],
            drawn=drawn,
        )


def observed_pairs(
    sessions: Sequence[SessionLog], options: AnalysisOptions
) -> tuple[tuple[ObservedGroup, ...], tuple[str, ...]]:
    """Return the groups of paired comparisons, none without any, and notes on those that have no scores."""
    if not any(is_comparison(trial) for session in sessions for trial in session.trials):
        return (), ()
    comparisons, groups = grouped_comparisons(sessions)
    parts = [("", comparisons)] if groups is None else list(split_groups(comparisons))
    found, notes = [], []
    for name, part in parts:
        group = of_comparisons(name, part, options)
        if isinstance(group, str):
            notes.append(group)
        else:
            found.append(group)
    return tuple(found), tuple(notes)


def of_comparisons(name: str, comparisons: Comparisons, options: AnalysisOptions) -> ObservedGroup | str:
    """Return what observers said of the stimuli of comparisons, or why there is nothing, in a sentence."""
    where = f" of '{name}'" if name else ""
    estimate = estimate_scores(comparisons, **options, draw=False)
    fitted, classes = estimate.scores.fit, estimate.scores.classes
    if not np.isfinite(fitted.theta).all():
        return f"The comparisons{where} do not link all stimuli: there is no scale of them, and they are left out."
    if classes is None:
        return f"The stimuli{where} overlap in too many classes to list: they are left out."
    drawn = None
    if len(comparisons.observers) > 1 and len(comparisons.items) <= MOST_ITEMS_DRAWN:
        replicates = resample(comparisons, method="firth" if estimate.plain.separated else "ml")
        sound = ~replicates.without_fit
        if sound.any():
            differs = differing(
                replicates, alpha=options["alpha"], adjust=options["adjust"], covariance=estimate.covariance
            )
            scores = replicates.theta[sound]
            drawn = Drawn(scores, scores - replicates.fit.theta, np.array(list(differs)))
    return ObservedGroup(
        name=name,
        task="paired comparisons",
        unit="nats",
        stimuli=comparisons.items,
        scores=fitted.theta,
        differs=classes.p <= options["alpha"],
        observers=len(comparisons.observers),
        drawn=drawn,
    )


def check_sizes(groups: Sequence[ObservedGroup], fewest: int) -> tuple[tuple[ObservedGroup, ...], tuple[str, ...]]:
    """Return the groups with at least ``fewest`` stimuli, and a note on each of the others.

    Raises
    ------
    ResultsError
        If no group is left.
    """
    kept = tuple(group for group in groups if len(group.stimuli) >= fewest)
    if not kept:
        most = max((len(group.stimuli) for group in groups), default=0)
        what = (
            f"beside the photograph, observers compared {most} stimul{'us' if most == 1 else 'i'}"
            f"{' at most in a group' if len(groups) > 1 else ''}: a correlation needs {fewest} or more"
        )
        raise ResultsError(Finding(what, remedy="show observers more stimuli, such as more steps of each degradation"))
    notes = tuple(
        f"The group '{group.name}' has {len(group.stimuli)} stimuli beside the photograph; a correlation needs "
        f"{fewest}: it is left out."
        for group in groups
        if len(group.stimuli) < fewest
    )
    return kept, notes
