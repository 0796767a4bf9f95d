"""The scores of paired comparisons in an experiment, for the page, the terminal and JSON."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from analysis.choices import Adjust, CovarianceChoice
from analysis.comparisons.comparisons import Comparisons
from analysis.comparisons.session_comparisons import from_sessions, is_comparison
from analysis.observers.responses import catch_results, first_choices
from analysis.ratings.ratings import preferences
from analysis.records.answered_by import WhoAnswered, who_answered
from analysis.records.lines import Header
from analysis.records.session_record import SessionLog
from analysis.report.estimate import Estimate, estimate_scores
from analysis.report.notes import notes_on
from analysis.scaling.lack_of_fit import OneScale, one_scale
from analysis.scaling.result import TWO_SIDED_95
from analysis.scaling.scores import Scores, score
from analysis.series.observer_means import shares
from analysis.simulation.smallest import SmallestDifference, smallest_in
from documents.text import finite


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ReportSummary(ABC):
    """Who compared what in the sessions of an experiment, with side bias and response times.

    Attributes
    ----------
    sessions
        The sessions, in the order given; they agree on experiment and stimuli.
    alpha, adjust
        Level of the tests that the classes follow from, and their correction for multiple comparisons.
    response_time_s
        Median response time in seconds.
    notes
        Sentences that a reader needs before the numbers.
    smallest
        The smallest difference that the design finds, in the largest group where there are groups; None where pairs
        were chosen by the answers, and as `analysis.simulation.smallest_difference`.
    """

    sessions: tuple[SessionLog, ...]
    alpha: float
    adjust: Adjust
    response_time_s: float
    notes: tuple[str, ...]
    smallest: SmallestDifference | None = None

    @property
    @abstractmethod
    def comparisons(self) -> Comparisons:
        """The answers."""

    @property
    def header(self) -> Header:
        """The header of the first session."""
        return self.sessions[0].header

    @property
    def first_share(self) -> float | None:
        """Share (0 to 1) of answers that chose the first position; None where that was not noted."""
        return self.comparisons.first_share()

    @property
    def first_share_interval(self) -> tuple[float, float] | None:
        """Wilson's 95 % interval of that share, which allows for observers who differ [Kish1965]."""
        return None if self.first_share is None else _first_share_interval(self.comparisons)

    @property
    def observers(self) -> tuple[str, ...]:
        """The observers' codes, each once."""
        return self.comparisons.observers

    @property
    def trials(self) -> int:
        """How many comparisons were answered."""
        return int(self.comparisons.count.sum())

    @property
    def who(self) -> WhoAnswered:
        """Who answered: people, simulated observers, or both."""
        return who_answered(self.sessions)

    @property
    def incomplete(self) -> tuple[SessionLog, ...]:
        """The sessions that were not completed."""
        return tuple(session for session in self.sessions if not session.complete)

    @property
    def numbers(self) -> str:
        """The numbers of observers and comparisons, in words."""
        return f"{self.who.words(self.observers)}, {self.trials:,} comparisons of {len(self.comparisons.items)} stimuli"

    def answered_json(self) -> dict[str, Any]:
        """Return plain values for JSON: those of the experiment."""
        return {
            "experiment": self.header.experiment,
            "question": self.header.question,
            "sessions": len(self.sessions),
            "incomplete_sessions": len(self.incomplete),
            "simulated": self.who.all_simulated,
            "simulated_observers": list(self.who.simulated),
            "observers": list(self.observers),
            "trials": self.trials,
            "ties": self.comparisons.ties,
            "catch": catch_results(self.sessions).to_json(),
            "preferences": preferences(self.sessions).to_json(),
            "alpha": self.alpha,
            "adjust": self.adjust,
            "first_share": self.first_share,
            "smallest_difference": self.smallest.to_json() if self.smallest else None,
            "notes": list(self.notes),
        }


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Summary(ReportSummary):
    """The scores of an experiment on one scale, with goodness of fit.

    Attributes
    ----------
    scores
        Items best first, with fit and classes.
    estimate
        How the scores were estimated: method, standard errors, intervals, stability of classes.
    beside
        The same answers by the settings that the experiment names beside its own; None without any.
    one_scale
        Test whether one scale fits; None without degrees of freedom, without a fit, or with a prior.
    """

    scores: Scores
    estimate: Estimate
    one_scale: OneScale | None
    beside: Scores | None = None

    @property
    def comparisons(self) -> Comparisons:
        """The answers on this scale."""
        return self.scores.comparisons

    @property
    def fit_p(self) -> float | None:
        """The p value of the test whether one scale fits; None where there is none."""
        return self.one_scale.p if self.one_scale else None

    @property
    def log10_interval(self) -> NDArray[np.float64]:
        """Shape (items, 2): 95 % limits of log10 score, in the order of ``scores.items``; NaN where there is none."""
        return self.estimate.log10_interval

    @property
    def sentence(self) -> str:
        """The numbers of observers, comparisons and classes, in a sentence."""
        classes = self.scores.classes
        classes_text = (
            f"; {len(classes.members)} perceptual class{'' if len(classes.members) == 1 else 'es'}" if classes else ""
        )
        return f"{self.numbers}{classes_text}."

    def scale_json(self) -> dict[str, Any]:
        """Return plain values for JSON: the keys of `cyclopean scores --json`, and how the scores were estimated."""
        return {
            **self.scores.to_json(),
            "method": self.estimate.method,
            "covariance": self.estimate.covariance,
            "intervals": {
                "kind": self.estimate.covariance,
                "log10_score": [
                    {"name": item.name, "low": finite(low), "high": finite(high)}
                    for item, (low, high) in zip(self.scores.items, self.log10_interval.tolist(), strict=True)
                ],
            },
            "stability": self.estimate.stability.to_json() if self.estimate.stability else None,
            "fit_p": self.fit_p,
            "beside": self.beside.to_json() if self.beside else None,
        }

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON: the keys of `cyclopean scores --json`, and those of the experiment."""
        return {**self.scale_json(), **self.answered_json()}


def summarise(
    sessions: Sequence[SessionLog],
    alpha: float | None = None,
    adjust: Adjust | None = None,
    covariance: CovarianceChoice | None = None,
    comparisons: Comparisons | None = None,
) -> Summary:
    """Fit and classify the comparisons of an experiment's sessions, on one scale.

    ``alpha``, ``adjust`` and ``covariance`` are those of the first session's header where None, and ``comparisons``
    those of the sessions. In case of complete separation, if comparisons link all stimuli, Firth's penalised fit is
    used and reported in a note.

    Raises
    ------
    ResultsError
        As `analysis.comparisons.session_comparisons.from_sessions`.
    """
    if comparisons is None:
        comparisons = from_sessions(sessions)
    options = analysis_options(sessions, alpha, adjust, covariance)
    scale = scale_of(sessions, comparisons, compared_times(sessions), options)
    smallest = smallest_of(comparisons, options)
    notes = notes_on(sessions, scale.estimate, scale.one_scale, smallest)
    return replace(scale, notes=notes, smallest=smallest, beside=_beside(sessions[0], scale))


def _beside(session: SessionLog, scale: Summary) -> Scores | None:
    """Return the scores by the settings that the header names beside its own; None without any, or under a prior."""
    own, method = session.header.analysis.beside, scale.estimate.method
    if own is None or method == "learnt_prior":
        return None
    options: Any = {"alpha": own.alpha, "adjust": own.adjust, "covariance": own.covariance}
    return score(scale.comparisons, method=method, **options)


class AnalysisOptions(TypedDict):
    """How scores are tested, and whether pairs were chosen by earlier answers."""

    alpha: float
    adjust: Adjust
    covariance: CovarianceChoice
    chosen: bool


def analysis_options(
    sessions: Sequence[SessionLog],
    alpha: float | None,
    adjust: Adjust | None,
    covariance: CovarianceChoice | None,
) -> AnalysisOptions:
    """Return the options; those of the first session's header where None."""
    own = sessions[0].header.analysis
    return {
        "alpha": own.alpha if alpha is None else alpha,
        "adjust": adjust or own.adjust,
        "covariance": covariance or own.covariance,
        "chosen": any(is_comparison(trial) and trial.by_answers for session in sessions for trial in session.trials),
    }


def smallest_of(comparisons: Comparisons, options: AnalysisOptions, group: str = "") -> SmallestDifference | None:
    """Return the smallest difference that the design of ``comparisons`` finds; None as `ReportSummary` says."""
    if options["chosen"]:
        return None
    alpha, adjust, covariance = options["alpha"], options["adjust"], options["covariance"]
    found = smallest_in(comparisons, alpha=alpha, adjust=adjust, covariance=covariance)
    return replace(found, group=group) if found else None


def compared_times(sessions: Sequence[SessionLog]) -> list[tuple[str, float]]:
    """Return a stimulus of each comparison and its response time in seconds."""
    return [
        (trial.chosen or trial.first, trial.response_time_s)
        for session in sessions
        for trial in session.trials
        if is_comparison(trial)
    ]


def scale_of(
    sessions: Sequence[SessionLog],
    comparisons: Comparisons,
    times: Sequence[tuple[str, float]],
    options: AnalysisOptions,
) -> Summary:
    """Return the scores of comparisons on one scale, without notes; ``times`` are those of the comparisons."""
    estimate = estimate_scores(comparisons, **options)
    # A penalised fit of separated answers is drawn to the middle: that answers lie further out is no departure.
    fits = one_scale(comparisons, estimate.scores.fit) if estimate.method == "ml" else None
    return Summary(
        sessions=tuple(sessions),
        alpha=options["alpha"],
        adjust=options["adjust"],
        response_time_s=median_time_s(times),
        notes=(),
        scores=estimate.scores,
        estimate=estimate,
        one_scale=fits,
    )


def median_time_s(times: Sequence[tuple[str, float]]) -> float:
    """Return the median of response times, as `compared_times` has them, in seconds."""
    return median(time_s for _, time_s in times)


def _first_share_interval(comparisons: Comparisons) -> tuple[float, float]:
    chosen, count = first_choices(comparisons)
    if np.count_nonzero(count) < 2:
        return wilson_interval(float(chosen.sum() / count.sum()), round(count.sum()))
    (estimate,) = shares(chosen[:, None], count[:, None])
    return float(estimate.low or 0.0), float(1.0 if estimate.high is None else estimate.high)


def wilson_interval(share: float, count: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share (0 to 1) observed in ``count`` answers [Wilson1927]."""
    z2 = TWO_SIDED_95**2
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = TWO_SIDED_95 * np.sqrt(share * (1 - share) / count + z2 / (4 * count**2)) / (1 + z2 / count)
    return float(middle - half), float(middle + half)
