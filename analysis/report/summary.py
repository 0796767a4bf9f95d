"""The scores of paired comparisons in an experiment, for the page, the terminal and JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.classes.multiplicity import ADJUSTMENTS, Adjust
from analysis.comparisons.session_comparisons import from_sessions, is_comparison
from analysis.errors import ResultsError
from analysis.observers.responses import catch_results
from analysis.ratings.preferences import preferences
from analysis.records.session_record import Header, SessionLog
from analysis.report.estimate import COVARIANCE_CHOICES, TWO_SIDED_95, CovarianceChoice, Estimate, estimate_scores
from analysis.report.notes import notes_on
from analysis.scaling.scores import Scores
from documents import Finding


@dataclass(frozen=True, slots=True, eq=False)
class Summary:
    """The scores of an experiment, with goodness of fit, side bias and response times.

    Attributes
    ----------
    header
        Header of the first session; the sessions agree on experiment and stimuli.
    sessions
        The sessions, in the order given.
    scores
        Items best first, with fit and classes.
    estimate
        How the scores were estimated: method, standard errors, intervals, stability of classes.
    first_share
        Share (0 to 1) of answers that chose the first position, or None; ``first_share_interval``: Wilson's 95 %.
    response_time_s
        Median response time in seconds.
    fit_p
        p value of the deviance; None without degrees of freedom or without a fit.
    notes
        Sentences that a reader needs before the numbers.
    """

    header: Header
    sessions: tuple[SessionLog, ...]
    scores: Scores
    alpha: float
    adjust: Adjust
    estimate: Estimate
    first_share: float | None
    first_share_interval: tuple[float, float] | None
    response_time_s: float
    fit_p: float | None
    notes: tuple[str, ...]

    @property
    def log10_interval(self) -> NDArray[np.float64]:
        """Shape (items, 2): 95 % limits of log10 score, in the order of ``scores.items``; NaN where there is none."""
        return self.estimate.log10_interval

    @property
    def observers(self) -> tuple[str, ...]:
        """The observers' codes, each once."""
        return self.scores.comparisons.observers

    @property
    def trials(self) -> int:
        """How many comparisons were answered."""
        return int(self.scores.comparisons.count.sum())

    @property
    def simulated(self) -> bool:
        """Whether any observer is simulated."""
        return any(session.header.simulated for session in self.sessions)

    @property
    def incomplete(self) -> tuple[SessionLog, ...]:
        """The sessions that were not completed."""
        return tuple(session for session in self.sessions if not session.complete)

    @property
    def sentence(self) -> str:
        """The numbers of observers, comparisons and classes, in a sentence."""
        who = f"{len(self.observers)} {'simulated ' if self.simulated else ''}observer"
        who += "" if len(self.observers) == 1 else "s"
        what = f"{self.trials:,} comparisons of {len(self.scores.items)} stimuli"
        classes = self.scores.classes
        classes_text = (
            f"; {len(classes.members)} perceptual class{'' if len(classes.members) == 1 else 'es'}" if classes else ""
        )
        return f"{who}, {what}{classes_text}."

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON: the keys of `cyclopean scores --json`, and those of the experiment."""
        return {
            **self.scores.to_json(),
            "experiment": self.header.experiment,
            "question": self.header.question,
            "sessions": len(self.sessions),
            "incomplete_sessions": len(self.incomplete),
            "simulated": self.simulated,
            "observers": list(self.observers),
            "trials": self.trials,
            "ties": self.scores.comparisons.ties,
            "catch": catch_results(self.sessions).to_json(),
            "preferences": preferences(self.sessions).to_json(),
            "alpha": self.alpha,
            "adjust": self.adjust,
            "method": self.estimate.method,
            "covariance": self.estimate.covariance,
            "intervals": {
                "kind": self.estimate.interval_kind,
                "log10_score": [
                    {"name": item.name, "low": _finite(low), "high": _finite(high)}
                    for item, (low, high) in zip(self.scores.items, self.log10_interval.tolist(), strict=True)
                ],
            },
            "stability": self.estimate.stability.to_json() if self.estimate.stability else None,
            "first_share": self.first_share,
            "fit_p": self.fit_p,
            "notes": list(self.notes),
        }


def summarise(
    sessions: Sequence[SessionLog],
    alpha: float | None = None,
    adjust: Adjust | None = None,
    covariance: CovarianceChoice | None = None,
) -> Summary:
    """Fit and classify the comparisons of an experiment's sessions.

    ``alpha``, ``adjust`` and ``covariance`` are those of the first session's header where None. In case
    of complete separation, if comparisons link all stimuli, Firth's penalised fit is used and reported in a note.

    Raises
    ------
    ResultsError
        As `analysis.comparisons.session_comparisons.from_sessions`, or if an analysis option in the header is unknown.
    """
    comparisons = from_sessions(sessions)
    header = sessions[0].header
    alpha = _level(header, sessions[0]) if alpha is None else alpha
    adjust = _adjustment(header, sessions[0]) if adjust is None else adjust
    covariance = _covariance(header, sessions[0]) if covariance is None else covariance
    chosen = any(trial.kind == "active_pairs" for session in sessions for trial in session.trials)
    estimate = estimate_scores(comparisons, alpha=alpha, adjust=adjust, covariance=covariance, chosen=chosen)
    scores = estimate.scores
    times = [trial.response_time_s for session in sessions for trial in session.trials if is_comparison(trial)]
    share = comparisons.first_share()
    positions = int((comparisons.winner_was_first >= 0).sum())
    return Summary(
        header=header,
        sessions=tuple(sessions),
        scores=scores,
        alpha=alpha,
        adjust=adjust,
        estimate=estimate,
        first_share=share,
        first_share_interval=None if share is None else wilson_interval(share, positions),
        response_time_s=median(times),
        fit_p=_fit_p(scores),
        notes=notes_on(sessions, estimate),
    )


def _level(header: Header, session: SessionLog) -> float:
    alpha = header.analysis.get("alpha", 0.05)
    if isinstance(alpha, bool) or not isinstance(alpha, int | float):
        raise ResultsError(Finding(f"the header's alpha is {alpha!r}", str(session.file), 1, 1, "give --alpha"))
    return float(alpha)


def _adjustment(header: Header, session: SessionLog) -> Adjust:
    choice = header.analysis.get("adjust", "holm")
    for known in ADJUSTMENTS:
        if choice == known:
            return known
    raise ResultsError(Finding(f"the header's adjustment is {choice!r}", str(session.file), 1, 1, "give --adjust"))


def _covariance(header: Header, session: SessionLog) -> CovarianceChoice:
    choice = header.analysis.get("covariance", "auto")
    for known in COVARIANCE_CHOICES:
        if choice == known:
            return known
    what = f"the header's covariance is {choice!r}"
    raise ResultsError(Finding(what, str(session.file), 1, 1, "give --covariance"))


def _fit_p(scores: Scores) -> float | None:
    from scipy.special import gammaincc

    fit = scores.fit
    return float(gammaincc(fit.df / 2, fit.deviance / 2)) if fit.df > 0 and not fit.separated else None


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def wilson_interval(share: float, count: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share (0 to 1) observed in ``count`` answers [Wilson1927]."""
    z2 = TWO_SIDED_95**2
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = TWO_SIDED_95 * np.sqrt(share * (1 - share) / count + z2 / (4 * count**2)) / (1 + z2 / count)
    return float(middle - half), float(middle + half)
