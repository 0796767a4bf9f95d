"""How each observer responds: side bias, agreement with their own repetitions, response times, catch trials.

Catch trials are pairs with an obvious answer, and pairs of a stimulus with itself, where nothing is to prefer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.classes.classes import levels
from analysis.comparisons.comparisons import Comparisons
from analysis.comparisons.session_comparisons import is_comparison
from analysis.kinds.all_pairs import AllPairsRecord
from analysis.kinds.pair import PairRecord
from analysis.observers.fast_answers import TOO_FAST_S
from analysis.records.results import sessions_by_observer
from analysis.records.session_record import SessionLog
from documents.arrays import Floats
from documents.text import JsonResult

FEWEST_ANSWERS = 8  # of a trend


@dataclass(frozen=True, slots=True)
class SideBias(JsonResult):
    """How often an observer chose the first position.

    The share ``first / answers`` has Wilson's 95 % limits ``low`` and ``high`` [Wilson1927]; ``p`` is of the exact
    two-sided binomial test against one half.
    """

    first: int
    answers: int
    low: float
    high: float
    p: float
    json_names: ClassVar = "first answers share interval p"

    @property
    def share(self) -> float:
        """Share of answers that chose the first position, 0 to 1."""
        return self.first / self.answers

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the share."""
        return self.low, self.high


def side_biases(comparisons: Comparisons) -> tuple[SideBias | None, ...]:
    """Return each observer's side bias, in the order of ``comparisons.observers``; None where no position was recorded.

    A line with a count stands for that many answers, rounded. Where each item is first as often as second, the share
    varies less than the binomial distribution: the test is conservative.
    """
    first, answers = first_choices(comparisons)
    total = np.rint(answers)
    chosen = np.minimum(total, np.rint(first))
    columns = (chosen.astype(int), total.astype(int), *_wilson(chosen, total), _binomial_p(chosen, total))
    lines = zip(*(column.tolist() for column in columns), strict=True)
    return tuple(SideBias(*line) if line[1] else None for line in lines)


def _wilson(chosen: Floats, total: Floats) -> tuple[Floats, Floats]:
    """Return Wilson's 95 % limits of shares, as `scipy.stats.binomtest` has them one by one."""
    from scipy.special import ndtri

    total = np.maximum(total, 1)
    share, z = chosen / total, ndtri(0.975)
    middle = 2 * total * share + z**2
    half = z * np.sqrt(z**2 + 4 * total * share * (1 - share))
    low, high = (middle - half) / (2 * (total + z**2)), (middle + half) / (2 * (total + z**2))
    return np.where(chosen == 0, 0.0, low), np.where(chosen == total, 1.0, high)


def _binomial_p(chosen: Floats, total: Floats) -> Floats:
    """Return p of the exact two-sided binomial test against one half, whose law is symmetric."""
    from scipy.special import bdtr

    fewer, of = np.minimum(chosen, total - chosen), np.maximum(total, 1).astype(np.int64)
    return np.asarray(np.where(2 * fewer == total, 1.0, np.minimum(1.0, 2 * bdtr(fewer, of, 0.5))))


def first_choices(comparisons: Comparisons) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how often each observer chose the first position, and of how many answers with a known one."""
    known = comparisons.winner_was_first >= 0
    observer, count = comparisons.observer[known], comparisons.count[known]
    people = len(comparisons.observers)
    first = np.bincount(observer, count * comparisons.winner_was_first[known], people)
    return first.astype(np.float64), np.bincount(observer, count, people).astype(np.float64)


@dataclass(frozen=True, slots=True)
class SelfAgreement(JsonResult):
    """How often an observer repeats their answer, over the ``repeated`` pairs that they answered more than once.

    Every two answers to the same pair are compared: ``alike`` of ``twos`` are the same. Two ties are the same; a tie
    differs from a preference. Random answers agree half of the time.
    """

    repeated: int
    alike: float
    twos: float
    json_keys: ClassVar = {"repeated": "repeated_pairs"}
    json_also: ClassVar = ("share",)

    @property
    def share(self) -> float:
        """Share of repeated answers that are the same, 0 to 1."""
        return self.alike / self.twos


def self_agreements(comparisons: Comparisons) -> tuple[SelfAgreement | None, ...]:
    """Return each observer's self-agreement, in the order of `comparisons.observers`; None without repeated pairs.

    The same two items in two groups are two pairs. Lines whose counts are not whole numbers are weights, not
    repetitions, and are ignored.
    """
    tied = comparisons.tied
    n, places = len(comparisons.items), len(comparisons.groups) + 2  # from no group, -1, on
    group = np.concatenate([comparisons.group, tied.group]) + 1
    winner, loser = np.concatenate([comparisons.winner, tied.item_a]), np.concatenate([comparisons.loser, tied.item_b])
    observer = np.concatenate([comparisons.observer, tied.observer])
    count = np.concatenate([comparisons.count, tied.count])
    is_tie = np.arange(len(winner)) >= len(comparisons.winner)
    low, high = np.minimum(winner, loser), np.maximum(winner, loser)
    outcome = np.where(is_tie, 2, winner == high)
    kind = ((observer * places + group) * n + low) * n + high
    pairs, pair = np.unique(kind, return_inverse=True)
    answers = np.bincount(pair * 3 + outcome, count, len(pairs) * 3).reshape(-1, 3)
    whole = (answers == np.rint(answers)).all(axis=1)
    totals = answers.sum(axis=1)
    again = whole & (totals > 1)
    people, person = len(comparisons.observers), pairs[again] // (n * n * places)
    repeated = np.bincount(person, minlength=people)
    alike = np.bincount(person, (answers[again] * (answers[again] - 1)).sum(axis=1) / 2, people)
    twos = np.bincount(person, totals[again] * (totals[again] - 1) / 2, people)
    lines = zip(repeated.tolist(), alike.tolist(), twos.tolist(), strict=True)
    return tuple(SelfAgreement(*line) if line[0] else None for line in lines)


@dataclass(frozen=True, slots=True)
class Trend:
    """Regression of response time on the difference between the two stimuli's scores.

    Attributes
    ----------
    answers
        Number of answers.
    slope, slope_se
        Change of the natural logarithm of the time per nat of difference, by least squares, with its standard error;
        below zero if answers are faster where scores are far apart.
    spearman, p
        Spearman's rank correlation, −1 to 1, and its two-sided p value.
    """

    answers: int
    slope: float
    slope_se: float
    spearman: float
    p: float


@dataclass(frozen=True, slots=True)
class ResponseTimes(JsonResult):
    """Response times of one observer's comparisons, in seconds.

    ``too_fast`` of ``answers`` took less than ``limit_s``. ``trend`` is None below 8 answers, without scores, or where
    times or differences are all the same.
    """

    answers: int
    median_s: float
    too_fast: int
    limit_s: float
    trend: Trend | None
    json_keys: ClassVar = {"limit_s": "too_fast_limit_s", "trend.slope": "slope_per_nat", "trend.p": "spearman_p"}
    json_names: ClassVar = "answers median_s too_fast limit_s trend.slope trend.slope_se trend.spearman trend.p"


def response_times(
    sessions: Sequence[SessionLog], theta: Mapping[str, float], too_fast_s: float = TOO_FAST_S
) -> ResponseTimes | None:
    """Return the response times of one observer's ``sessions``; None without a comparison.

    Parameters
    ----------
    theta
        Log score of each stimulus in nats; stimuli without a finite score are left out of the trend.
    too_fast_s
        Answers faster than this, in seconds, are counted: 0.2 s is about the fastest reaction to any picture.
    """
    trials = [trial for session in sessions for trial in session.trials if is_comparison(trial)]
    if not trials:
        return None
    times = np.array([trial.response_time_s for trial in trials])
    too_fast = int((times < too_fast_s).sum())
    return ResponseTimes(len(trials), float(np.median(times)), too_fast, too_fast_s, _trend(trials, theta))


def _trend(trials: Sequence[PairRecord], theta: Mapping[str, float]) -> Trend | None:
    nan = float("nan")
    strengths = [[theta.get(place, nan) for place in (trial.first, trial.second)] for trial in trials]
    difference = np.abs(np.diff(np.array(strengths), axis=1)[:, 0])
    times = np.array([trial.response_time_s for trial in trials])
    known = np.isfinite(difference) & (times > 0)
    difference, times = difference[known], times[known]
    if len(times) < FEWEST_ANSWERS or np.ptp(times) == 0 or np.ptp(difference) <= 1e-9 * difference.max():
        return None
    slope, error = _line(difference, np.log(times))
    return Trend(len(times), slope, error, *_spearman(levels(difference), times))


def _line(x: Floats, y: Floats) -> tuple[float, float]:
    """Return the slope by least squares and its standard error, as `scipy.stats.linregress` in a tenth of its time."""
    x, y = x - x.mean(), y - y.mean()
    squares, across, rest = float(x @ x), float(x @ y), float(y @ y)
    left = max(0.0, 1 - across**2 / (squares * rest))
    return across / squares, float(np.sqrt(left * rest / squares / (len(x) - 2)))


def _spearman(x: NDArray[Any], y: NDArray[Any]) -> tuple[float, float]:
    """Return Spearman's correlation and its two-sided p, as `scipy.stats.spearmanr` in a tenth of its time."""
    from scipy.special import stdtr

    one, other = (ranks - ranks.mean() for ranks in (_ranks(x), _ranks(y)))
    rho = float(np.clip((one @ other) / np.sqrt((one @ one) * (other @ other)), -1.0, 1.0))
    free = len(x) - 2
    with np.errstate(divide="ignore"):
        t = rho * np.sqrt(free / np.float64((1 + rho) * (1 - rho)))
    return rho, float(2 * stdtr(free, -abs(t)))


def _ranks(values: NDArray[Any]) -> Floats:
    """Return ranks from 1, of equal values their mean."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(count) - (count - 1) / 2)[place])


@dataclass(frozen=True, slots=True)
class IdenticalPairs(JsonResult):
    """Trials with a stimulus beside itself: those answered with the ``first`` position, the ``second``, and ties."""

    trials: int
    first: int
    second: int


@dataclass(frozen=True, slots=True)
class CatchAnswers(JsonResult):
    """One observer's catch trials: ``right`` of ``obvious`` pairs were answered correctly."""

    obvious: int
    right: int
    identical: IdenticalPairs

    @property
    def missed(self) -> int:
        """How many obvious pairs were answered wrongly."""
        return self.obvious - self.right


@dataclass(frozen=True, slots=True)
class CatchResults(JsonResult):
    """The catch trials of several observers."""

    by_observer: Mapping[str, CatchAnswers]
    json_names: ClassVar = "obvious missed identical"

    @property
    def missed(self) -> dict[str, tuple[int, int]]:
        """For each observer who missed any obvious pair: how many they missed, and how many they answered."""
        return {name: (own.missed, own.obvious) for name, own in self.by_observer.items() if own.missed}

    @property
    def obvious(self) -> int:
        """How many obvious pairs there were."""
        return sum(own.obvious for own in self.by_observer.values())

    @property
    def identical(self) -> IdenticalPairs:
        """The trials with a stimulus beside itself of all of them."""
        each = [(own.trials, own.first, own.second) for own in (one.identical for one in self.by_observer.values())]
        return IdenticalPairs(*map(sum, zip((0, 0, 0), *each, strict=True)))


def catch_answers(sessions: Sequence[SessionLog]) -> CatchAnswers:
    """Count the catch trials of one observer's ``sessions``: the last attempt at each trial, without practice."""
    trials = [trial for session in sessions for trial in session.of(AllPairsRecord)]
    obvious = [trial for trial in trials if trial.catch == "obvious"]
    same = [trial.answer for trial in trials if trial.catch == "identical"]
    right = sum(trial.correct is True for trial in obvious)
    return CatchAnswers(len(obvious), right, IdenticalPairs(len(same), same.count("first"), same.count("second")))


def catch_results(sessions: Sequence[SessionLog]) -> CatchResults:
    """Count the catch trials of each observer of ``sessions``, as `catch_answers` does."""
    return CatchResults({name: catch_answers(own) for name, own in sessions_by_observer(sessions).items()})
