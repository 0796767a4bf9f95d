"""The observer table: a line for each observer with all measures; nobody is left out.

How well the others' scores predict each observer's answers, who is an outlier, and who changes the scores most: for
each observer s the strengths are fitted to all other observers' answers, by Firth's penalised likelihood [Firth1993]:
it has a maximum for any answers, and little of the bias that puts strengths from few answers too far apart. With d the
differences of these strengths, p their probabilities and W the observer's own counts out of N,

    l = Σ W log p,   l − E l = Σ d (W − N p)   over the pairs

If s follows the same strengths, the variance of l has a term from s's own answers, Σ N p (1 − p) d², and one from the
estimated strengths: θᵀ I Σ I θ, with I the information in s's answers and Σ the covariance of the strengths. The errors
of the strengths also lower the mean of l; that is corrected to second order. z is the deviation from the mean over the
standard deviation. Sums of few answers are skewed, so the p value comes from `tails.lower_tail`, with the third moment
of s's answers. Holm's correction [Holm1979] over the observers controls the family-wise error rate: the probability of
flagging any observer, if all follow the same strengths.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from analysis.bootstrap.fits import fit_each
from analysis.classes import multiplicity
from analysis.comparisons.comparisons import Comparisons, split_scales
from analysis.comparisons.session_comparisons import from_sessions, is_comparison
from analysis.covariance.laplacian import contrast_variances, pseudo_inverse
from analysis.kinds.trial import OutcomeRecord
from analysis.observers.concordance import SHUFFLES, Concordance, kendall_u
from analysis.observers.consistency import Consistency, consistencies
from analysis.observers.fast_answers import TOO_FAST_S
from analysis.observers.filters import passed_screening
from analysis.observers.responses import (
    CatchAnswers,
    ResponseTimes,
    SelfAgreement,
    SideBias,
    catch_answers,
    response_times,
    self_agreements,
    side_biases,
)
from analysis.observers.tails import lower_tail
from analysis.records.results import refuse_mixtures, sessions_by_observer
from analysis.records.session_record import SessionLog
from analysis.scaling.fitting import fit
from analysis.scaling.laws import probabilities
from analysis.scaling.result import Fit
from documents.arrays import Floats
from documents.text import JsonResult, counted

LEVEL = 0.05
MOST_ITEMS = 300
# Strengths that differ by less, in nats, are equal: the difference is what the fit's last step and rounding left.
_EQUAL_NATS = 1e-8
_MOST_NUMBERS = 4_000_000


@dataclass(frozen=True, slots=True)
class FitToRest(JsonResult):
    """One observer's answers under the others' scores.

    Attributes
    ----------
    mean_log_likelihood
        In nats per answer; log ½ = −0.693 is guessing.
    expected
        Its expectation for an observer who follows the others' scores.
    z
        Deviation from that expectation in standard deviations; below zero, the answers fit worse.
    p
        Probability of answers that fit as badly or worse; ``adjusted_p`` is Holm's over all observers.
    outlier
        Whether ``adjusted_p`` is at most the level.
    influence
        The largest change of any item's strength, in nats, when the observer is left out; ``most_moved`` names
        the item, with its group if it has one, whose strength is lower without them if ``influence`` is below zero.
    """

    mean_log_likelihood: float
    expected: float
    z: float
    p: float
    adjusted_p: float
    outlier: bool
    influence: float
    most_moved: str
    json_keys: ClassVar = {"influence": "influence_nats"}


def fits_to_rest(comparisons: Comparisons, level: float = LEVEL) -> tuple[FitToRest | None, ...]:
    """Return each observer's fit to the rest, in the order of ``comparisons.observers``.

    Where there are groups, each has a scale of its own, and the fit is over all groups. A group is left out for an
    observer without a decided answer in it; where the others' answers do not link all items, so that there is no
    common scale; and where all items that the observer saw have equal strengths by the others' answers. None for an
    observer for whom no group is left, and for all observers above 300 items: time grows with observers times the cube
    of the items, memory with the square. Counts are numbers of answers: with weights, z is too large or too small.
    """
    people = len(comparisons.observers)
    sums, answers = np.zeros((people, 4)), np.zeros(people)
    influence, moved = np.zeros(people), [""] * people
    for name, part in split_scales(comparisons):
        if len(part.items) > MOST_ITEMS:
            return (None,) * people
        parts, change, given = _one_scale(part)
        differ = parts[:, 2] > given * _EQUAL_NATS**2
        usable = np.isfinite(parts).all(axis=1) & differ & np.isfinite(change).all(axis=1)
        sums[usable] += parts[usable]
        answers[usable] += given[usable]
        for person in np.flatnonzero(usable):
            size = np.abs(change[person])
            # The first of those that moved most: equal but for rounding is equal.
            most = int((size >= size.max() * (1 - 1e-9)).argmax())
            if not moved[person] or size[most] > abs(influence[person]) * (1 + 1e-9):
                influence[person] = change[person, most]
                moved[person] = f"{part.items[most]} ({name})" if name else part.items[most]
    judged = np.flatnonzero(answers > 0)
    deviation, expected, variance, third = sums[judged].T
    p = lower_tail(deviation, variance, third)
    adjusted = multiplicity.holm(p)
    lines: list[FitToRest | None] = [None] * people
    for line, person in enumerate(judged):
        lines[person] = FitToRest(
            mean_log_likelihood=float((deviation[line] + expected[line]) / answers[person]),
            expected=float(expected[line] / answers[person]),
            z=float(deviation[line] / np.sqrt(variance[line])),
            p=float(p[line]),
            adjusted_p=float(adjusted[line]),
            outlier=bool(adjusted[line] <= level),
            influence=float(influence[person]),
            most_moved=moved[person],
        )
    return tuple(lines)


def _one_scale(comparisons: Comparisons) -> tuple[Floats, Floats, Floats]:
    """Return each observer's `_parts` (S, 4), change of the strengths (S, n), NaN if none, and answers (S,)."""
    people, n = len(comparisons.observers), len(comparisons.items)
    wins = comparisons.wins
    together = fit_each(wins[None], "firth").theta[0]
    theta = np.full((people, n), np.nan)
    parts = np.full((people, 4), np.nan)
    block = max(1, _MOST_NUMBERS // (n * n))
    for start in range(0, people, block):
        own = comparisons.wins_by_observer(slice(start, start + block))
        rest = wins - own
        fitted = fit_each(rest, "firth").theta
        usable_fit = np.isfinite(fitted).all(axis=1) & own.any(axis=(1, 2))
        theta[start : start + block][usable_fit] = fitted[usable_fit]
        if usable_fit.any():
            parts[start : start + block][usable_fit] = _parts(own[usable_fit], rest[usable_fit], fitted[usable_fit])
    answers = np.bincount(comparisons.observer, comparisons.count, people).astype(np.float64)
    return parts, together - theta, answers


def _parts(own: Floats, rest: Floats, theta: Floats) -> Floats:
    """Return l minus its mean, its mean, its variance and its third central moment, shape (S, 4)."""
    from scipy.special import log_expit

    d = theta[:, :, None] - theta[:, None, :]
    p = probabilities(theta)
    q = p.transpose(0, 2, 1)
    answers, others = own + own.transpose(0, 2, 1), rest + rest.transpose(0, 2, 1)
    weight = answers * p * q
    covariance = pseudo_inverse(others * p * q)
    # Sums over ordered pairs count each pair twice where both directions are equal.
    bias = -(weight * contrast_variances(covariance) * (1 - (p - q) * d / 2)).sum(axis=(1, 2)) / 2
    mean = (answers * p * log_expit(d)).sum(axis=(1, 2)) + bias
    pull = (weight * d).sum(axis=2)
    variance = (weight * d**2).sum(axis=(1, 2)) / 2 + np.einsum("si,sij,sj->s", pull, covariance, pull)
    third = (weight * d**3 * (q - p)).sum(axis=(1, 2)) / 2
    total = (own * log_expit(d)).sum(axis=(1, 2))
    return np.stack([total - mean, mean, variance, third], axis=1)


@dataclass(frozen=True, slots=True)
class ObserverLine(JsonResult):
    """One observer.

    Attributes
    ----------
    name
        The observer's code; empty where a table of comparisons names none.
    answers, ties
        How many comparisons prefer one of the two, and how many neither.
    sessions, complete
        How many sessions there are, and how many of them were completed; 0 from a table of comparisons.
    consistency, fit, side, repeats
        None where the answers do not determine them.
    times, catch, screening, screening_passed
        From sessions only; ``screening_passed`` is None without a vision test.
    """

    name: str
    answers: float = 0.0
    ties: float = 0.0
    sessions: int = 0
    complete: int = 0
    consistency: Consistency | None = None
    fit: FitToRest | None = None
    side: SideBias | None = None
    repeats: SelfAgreement | None = None
    times: ResponseTimes | None = None
    catch: CatchAnswers | None = None
    screening: tuple[OutcomeRecord, ...] = ()
    screening_passed: bool | None = None
    json_keys: ClassVar = {"name": "observer", "tests": "screening"}
    json_names: ClassVar = (
        "name answers ties sessions complete consistency fit side repeats times catch screening_passed tests flags"
    )

    @property
    def flags(self) -> tuple[str, ...]:
        """What needs attention, in words; a reason to look at the session, not to leave the observer out."""
        words = []
        if self.fit and self.fit.outlier:
            words.append("answers unlike the others")
        test = self.consistency.test if self.consistency else None
        if test and test.mid_p > 0.5 and test.least_p <= LEVEL:
            words.append("no more consistent than chance")
        if self.catch and self.catch.missed:
            words.append(f"missed {self.catch.missed} of {self.catch.obvious} catch trials")
        if self.times and self.times.too_fast:
            words.append(f"{counted(self.times.too_fast, 'answer', 'answers')} below {self.times.limit_s:g} s")
        if self.screening_passed is False:
            words.append("failed the vision screening")
        if self.complete < self.sessions:
            words.append("not completed")
        return tuple(words)

    @property
    def tests(self) -> list[dict[str, Any]]:
        """Which tests of vision were passed."""
        return [{"test": outcome.test, "passed": outcome.passed} for outcome in self.screening]


@dataclass(frozen=True, slots=True)
class ObserverTable(JsonResult):
    """The ``lines`` of all observers, in the order of their first session, and their ``concordance`` if there is any.

    ``level`` is the family-wise error rate of the test for outliers.
    """

    lines: tuple[ObserverLine, ...]
    concordance: Concordance | None
    level: float
    json_keys: ClassVar = {"lines": "observers", "level": "outlier_level"}
    json_also: ClassVar = ("outliers",)

    @property
    def outliers(self) -> tuple[str, ...]:
        """Observers whose answers are unlike the others'."""
        return tuple(line.name for line in self.lines if line.fit and line.fit.outlier)


def observers_in_sessions(
    sessions: Sequence[SessionLog],
    *,
    level: float = LEVEL,
    too_fast_s: float = TOO_FAST_S,
    shuffles: int = SHUFFLES,
    comparisons: Comparisons | None = None,
) -> ObserverTable:
    """Describe the observers of an experiment's sessions; the sessions of an observer are taken together.

    Without paired comparisons, such as in sessions of series or of screening alone, the lines have the other measures.

    Parameters
    ----------
    sessions
        Sessions of one experiment, such as `analysis.records.results.read_results` gives.
    level
        Family-wise error rate (0 to 1): the probability of any outlier if all observers follow the same scores.
    too_fast_s
        Response times below this many seconds are counted as too fast.
    shuffles
        Number of permutations, as for `analysis.observers.concordance.kendall_u`.
    comparisons
        Those of the sessions, as `analysis.comparisons.from_sessions` returns them; None gathers them.

    Returns
    -------
    ObserverTable
        A line for each observer, also one who answered nothing, and the agreement between them.

    Raises
    ------
    ResultsError
        As `analysis.records.results.refuse_mixtures`, or if a record is damaged.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.records import new_header
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> log = SessionLog(Path("session.jsonl"), header, (), complete=False)
    >>> [(line.name, line.answers, line.flags) for line in observers_in_sessions([log]).lines]
    [('01', 0.0, ('not completed',))]
    """
    refuse_mixtures(sessions)
    if comparisons is None:
        compared = any(is_comparison(trial) and not trial.is_tie for session in sessions for trial in session.trials)
        comparisons = from_sessions(sessions) if compared else None
    theta: dict[str, float] = {}
    described: dict[str, ObserverLine] = {}
    if comparisons:
        for _, part in split_scales(comparisons):  # a stimulus belongs to one group
            theta |= dict(zip(part.items, _strengths(part).theta.tolist(), strict=True))
        described = {line.name: line for line in _lines(comparisons, level)}
    lines = []
    for name, own in sessions_by_observer(sessions).items():
        lines.append(
            replace(
                described.get(name, ObserverLine(name)),
                ties=float(sum(is_comparison(trial) and trial.is_tie for log in own for trial in log.trials)),
                sessions=len(own),
                complete=sum(session.complete for session in own),
                times=response_times(own, theta, too_fast_s),
                catch=catch_answers(own),
                screening=tuple(outcome for session in own for outcome in session.of(OutcomeRecord)),
                screening_passed=passed_screening(own),
            )
        )
    return ObserverTable(tuple(lines), kendall_u(comparisons, shuffles) if comparisons else None, level)


def observers_in_comparisons(
    comparisons: Comparisons, *, level: float = LEVEL, shuffles: int = SHUFFLES
) -> ObserverTable:
    """Describe the observers of a table of comparisons.

    Parameters
    ----------
    comparisons
        The answers, such as `analysis.comparisons.table.read_table` gives; without observers, they are one observer.
    level, shuffles
        As for `observers_in_sessions`.

    Returns
    -------
    A line for each observer, without response times, catch trials and vision tests, and the agreement between them.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.observers import observers_in_comparisons
    >>> pairs = [("a", "b"), ("b", "c"), ("a", "c")]
    >>> answers = [Answer(winner, loser, observer=name) for name in ("01", "02") for winner, loser in pairs]
    >>> table = observers_in_comparisons(from_answers(answers))
    >>> [(line.name, line.answers, line.consistency.zeta) for line in table.lines]
    [('01', 3.0, 1.0), ('02', 3.0, 1.0)]
    >>> table.concordance.u
    1.0
    """
    return ObserverTable(tuple(_lines(comparisons, level)), kendall_u(comparisons, shuffles), level)


def _lines(comparisons: Comparisons, level: float) -> list[ObserverLine]:
    people = len(comparisons.observers)
    answers = np.bincount(comparisons.observer, comparisons.count, people).tolist()
    ties = np.bincount(comparisons.tied.observer, comparisons.tied.count, people).tolist()
    columns = zip(
        comparisons.observers,
        answers,
        ties,
        consistencies(comparisons),
        fits_to_rest(comparisons, level),
        side_biases(comparisons),
        self_agreements(comparisons),
        strict=True,
    )
    return [
        ObserverLine(name, given, tied, consistency=consistent, fit=fitted, side=side, repeats=again)
        for name, given, tied, consistent, fitted, side, again in columns
    ]


def _strengths(comparisons: Comparisons) -> Fit:
    """Return the scores; Firth's in case of complete separation; NaN where comparisons do not link all items."""
    plain = fit(comparisons.wins)
    return fit(comparisons.wins, method="firth") if plain.separated else plain
