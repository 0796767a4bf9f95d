"""How each observer answers: their preference for a position, their agreement with themselves, their speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.comparisons.comparisons import Comparisons
from analysis.comparisons.session_comparisons import is_comparison
from analysis.records.session_record import SessionLog, Trial

TOO_FAST_S = 0.2
FEWEST_ANSWERS = 8  # of a trend


@dataclass(frozen=True, slots=True)
class SideBias:
    """How often an observer chose the position shown first.

    ``first`` of ``answers`` went there, a share of ``first / answers`` with Wilson's 95 % limits ``low`` and ``high``
    [Wilson1927]; ``p`` is the exact two-sided chance of a share as unlikely, if neither place is preferred.
    """

    first: int
    answers: int
    low: float
    high: float
    p: float

    @property
    def share(self) -> float:
        """Share of answers that went to the first position, 0 to 1."""
        return self.first / self.answers

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        limits = [self.low, self.high]
        return {"first": self.first, "answers": self.answers, "share": self.share, "interval": limits, "p": self.p}


def side_biases(comparisons: Comparisons) -> tuple[SideBias | None, ...]:
    """Return each observer's side bias, in the order of ``comparisons.observers``; None where no place was noted.

    A line that counts several times is taken for so many answers, rounded. Where each item stands first as often as
    second, preferences cancel out and the share varies less than the binomial law says: p errs towards caution.
    """
    known = comparisons.winner_was_first >= 0
    observer, count = comparisons.observer[known], comparisons.count[known]
    people = len(comparisons.observers)
    answers = np.bincount(observer, count, people)
    first = np.bincount(observer, count * comparisons.winner_was_first[known], people)
    return tuple(_bias(*line) for line in zip(first.tolist(), answers.tolist(), strict=True))


def _bias(first: float, answers: float) -> SideBias | None:
    from scipy.stats import binomtest

    total = round(answers)
    if not total:
        return None
    chosen = min(total, round(first))
    test = binomtest(chosen, total)
    limits = test.proportion_ci(method="wilson")
    return SideBias(chosen, total, float(limits.low), float(limits.high), float(test.pvalue))


@dataclass(frozen=True, slots=True)
class SelfAgreement:
    """Of ``repeated`` pairs that an observer answered more than once, how much the answers agree.

    Every two answers to the same pair are held against each other: ``alike`` of ``twos`` are the same. Answers that
    prefer neither are the same as each other and unlike a preference. Coin tosses agree half of the time.
    """

    repeated: int
    alike: float
    twos: float

    @property
    def share(self) -> float:
        """Share of answers that are the same again, 0 to 1."""
        return self.alike / self.twos

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {"repeated_pairs": self.repeated, "alike": self.alike, "twos": self.twos, "share": self.share}


def self_agreements(comparisons: Comparisons) -> tuple[SelfAgreement | None, ...]:
    """Return each observer's agreement with themselves, as `comparisons.observers` stand; None without repeated pairs.

    Lines whose counts are weights rather than numbers of answers tell nothing about repetitions: they are passed over.
    """
    tied = comparisons.tied
    n = len(comparisons.items)
    winner, loser = np.concatenate([comparisons.winner, tied.one]), np.concatenate([comparisons.loser, tied.other])
    observer = np.concatenate([comparisons.observer, tied.observer])
    count = np.concatenate([comparisons.count, tied.count])
    is_tie = np.arange(len(winner)) >= len(comparisons.winner)
    low, high = np.minimum(winner, loser), np.maximum(winner, loser)
    outcome = np.where(is_tie, 2, winner == high)
    pairs, pair = np.unique((observer * n + low) * n + high, return_inverse=True)
    answers = np.bincount(pair * 3 + outcome, count, len(pairs) * 3).reshape(-1, 3)
    whole = (answers == np.rint(answers)).all(axis=1)
    totals = answers.sum(axis=1)
    again = whole & (totals > 1)
    people, person = len(comparisons.observers), pairs[again] // (n * n)
    repeated = np.bincount(person, minlength=people)
    alike = np.bincount(person, (answers[again] * (answers[again] - 1)).sum(axis=1) / 2, people)
    twos = np.bincount(person, totals[again] * (totals[again] - 1) / 2, people)
    lines = zip(repeated.tolist(), alike.tolist(), twos.tolist(), strict=True)
    return tuple(SelfAgreement(*line) if line[0] else None for line in lines)


@dataclass(frozen=True, slots=True)
class Trend:
    """How response times go with the difference in scores of the two stimuli.

    Attributes
    ----------
    answers
        How many answers it rests on.
    slope, slope_se
        Change of the natural logarithm of the time for each nat of difference, by least squares, with its standard
        error; a judgement that is easier where scores are far apart gives a slope below zero.
    spearman, p
        Spearman's rank correlation and the two-sided chance of one as strong, from −1 to 1 and 0 to 1.
    """

    answers: int
    slope: float
    slope_se: float
    spearman: float
    p: float


@dataclass(frozen=True, slots=True)
class ResponseTimes:
    """Response times of one observer's comparisons, in seconds.

    ``too_fast`` of ``answers`` took less than ``limit_s``. ``trend`` is None below 8 answers, without scores, or where
    times or differences are all the same.
    """

    answers: int
    median_s: float
    too_fast: int
    limit_s: float
    trend: Trend | None

    @property
    def too_fast_share(self) -> float:
        """Share of answers that were too fast, 0 to 1."""
        return self.too_fast / self.answers

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        trend = self.trend
        return {
            "answers": self.answers,
            "median_s": self.median_s,
            "too_fast": self.too_fast,
            "too_fast_limit_s": self.limit_s,
            "slope_per_nat": trend.slope if trend else None,
            "slope_se": trend.slope_se if trend else None,
            "spearman": trend.spearman if trend else None,
            "spearman_p": trend.p if trend else None,
        }


def response_times(
    sessions: Sequence[SessionLog], theta: Mapping[str, float], too_fast_s: float = TOO_FAST_S
) -> ResponseTimes | None:
    """Return the response times of one observer's ``sessions``; None without a comparison.

    Parameters
    ----------
    theta
        Strength of each stimulus in nats; those that have none, or NaN, are left out of the trend.
    too_fast_s
        Below this, nobody can have seen and judged: 0.2 s is about the fastest reaction to any picture at all.
    """
    trials = [trial for session in sessions for trial in session.trials if is_comparison(trial)]
    if not trials:
        return None
    times = np.array([trial.response_time_s for trial in trials])
    too_fast = int((times < too_fast_s).sum())
    return ResponseTimes(len(trials), float(np.median(times)), too_fast, too_fast_s, _trend(trials, theta))


def _trend(trials: Sequence[Trial], theta: Mapping[str, float]) -> Trend | None:
    from scipy.stats import linregress, spearmanr

    nan = float("nan")
    strengths = [[theta.get(str(trial.data.get(place)), nan) for place in ("first", "second")] for trial in trials]
    difference = np.abs(np.diff(np.array(strengths), axis=1)[:, 0])
    times = np.array([trial.response_time_s for trial in trials])
    known = np.isfinite(difference) & (times > 0)
    difference, times = difference[known], times[known]
    if len(times) < FEWEST_ANSWERS or np.ptp(times) == 0 or np.ptp(difference) <= 1e-9 * difference.max():
        return None
    line = linregress(difference, np.log(times))
    ranks = spearmanr(difference, times)
    return Trend(len(times), float(line.slope), float(line.stderr), float(ranks.statistic), float(ranks.pvalue))
