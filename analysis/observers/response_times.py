"""How long each observer took, and whether answers took longer where the scores are close."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.comparisons.session_comparisons import is_comparison
from analysis.records.session_record import SessionLog, Trial

TOO_FAST_S = 0.2
FEWEST_ANSWERS = 8


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
