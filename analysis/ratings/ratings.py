"""Ratings of stimuli (mean opinion scores, z within observers, BT.500's screening), and choices of stereo or flat.

A stimulus is rated ``alone``, or after a choice between two: the ``chosen`` one, or ``both``. These are never pooled: a
stimulus that was chosen is rated beside what it was better than, and only when it was. Ratings after a choice from a
series are in `analysis.series`.

Recommendation ITU-R BT.500 [ITU500] gives the mean with its interval for each stimulus, and a rule that flags
observers whose ratings lie far from the others' in both directions. Here the rule is information: nobody is left out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.kinds.preference import PreferenceRecord
from analysis.kinds.trial import Of, Trial
from analysis.records.answered_by import WhoAnswered, who_answered
from analysis.records.results import refuse_mixtures
from analysis.records.session_record import SessionLog
from analysis.records.times import in_time
from analysis.series.observer_means import bounded_means
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult

OF: tuple[Of, ...] = ("alone", "chosen", "both")
MOST_OUTLYING, MOST_ONE_SIDED = 0.05, 0.3


@dataclass(frozen=True, slots=True)
class OpinionScore(JsonResult):
    """The mean opinion score of a stimulus, over the means of ``observers``, who gave so many ``ratings``.

    ``mean`` in points of the scale and ``z`` in standard deviations of an observer's ratings, each with 95 % limits
    (None with one observer); ``sd`` is that of the observers' means. The limits of ``mean`` stay on the scale
    (`analysis.series.observer_means.bounded_means`). Those of ``z`` are Student's t's, as are those of ``mean`` where a
    log of an older version does not say where the scale ends; neither are there if all are equal.
    """

    stimulus: str
    observers: int
    ratings: int
    mean: float
    interval: tuple[float, float] | None
    sd: float | None
    z: float | None
    z_interval: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class RaterScreening(JsonResult):
    """One observer by BT.500's rule.

    Attributes
    ----------
    ratings, mean, sd
        Number, mean and standard deviation of the ratings; ``sd`` is None for one rating.
    above, below
        How many ratings lie far above and far below the others' (P and Q).
    outlying
        (P + Q) / ratings.
    one_sided
        |P − Q| / (P + Q), None where both are 0.
    flagged
        Whether the rule would leave the observer out: more than 5 % outlying, in both directions (below 0.3).
    """

    observer: str
    ratings: int
    mean: float
    sd: float | None
    above: int
    below: int
    json_also: ClassVar = ("outlying", "one_sided", "flagged")

    @property
    def outlying(self) -> float:
        """Share of ratings far from the others', 0 to 1."""
        return (self.above + self.below) / self.ratings

    @property
    def one_sided(self) -> float | None:
        """How far these lie in one direction, 0 to 1."""
        far = self.above + self.below
        return abs(self.above - self.below) / far if far else None

    @property
    def flagged(self) -> bool:
        """Whether BT.500 would leave the observer out."""
        return self.outlying > MOST_OUTLYING and self.one_sided is not None and self.one_sided < MOST_ONE_SIDED


@dataclass(frozen=True, slots=True)
class ScaleSummary(JsonResult):
    """One scale: its stimuli in the header's order, and its observers, sorted; ``of`` is which stimuli were rated.

    ``ends`` are the lowest and the highest number that could be answered; None if a log does not say.
    """

    scale: str
    of: Of
    ends: tuple[int, int] | None
    scores: tuple[OpinionScore, ...]
    observers: tuple[RaterScreening, ...]


@dataclass(frozen=True, slots=True)
class RatingSummary(JsonResult):
    """The ratings of single stimuli, by scale, and those that followed choices between two."""

    experiment: str
    scales: tuple[ScaleSummary, ...]


def summarise_ratings(sessions: Sequence[SessionLog]) -> RatingSummary:
    """Summarise the ratings of one experiment's sessions, each trial's last attempt.

    Parameters
    ----------
    sessions
        Sessions of one experiment.

    Returns
    -------
    RatingSummary
        For each scale, the ratings by stimulus with their means and intervals.

    Raises
    ------
    ResultsError
        If the sessions cannot be analysed together, have no rating, or one that is not a number or names no stimulus.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import SessionLog, new_header
    >>> stimuli = ({"name": "a"},)
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=stimuli)
    >>> data = {"stimulus": "a", "ratings": {"depth": 4}, "rating_times_s": {"depth": 1.2}}
    >>> trial = new_trial(0, 0, "rating", (), 1.2, "2026-01-31T09:31:00Z", data)
    >>> log = SessionLog(Path("session.jsonl"), header, (trial,), complete=True)
    >>> summarise_ratings([log]).scales[0].scores[0].mean
    4.0
    """
    found = ratings_in(sessions)
    if found is None:
        files = ", ".join(str(session.file) for session in sessions[:3])
        raise ResultsError(
            Finding("the results hold no rating of a stimulus", files, remedy="answer some trials first")
        )
    return found


def ratings_in(sessions: Sequence[SessionLog]) -> RatingSummary | None:
    """Return what `summarise_ratings` does; None if the sessions have no rating."""
    tables = rating_tables(sessions)
    return RatingSummary(sessions[0].header.experiment, tuple(map(_summary, tables))) if tables else None


@dataclass(frozen=True, slots=True, eq=False)
class RatingTable:
    """The ratings on one scale: ``values``, shape (observers, stimuli, repeats), NaN where there is none.

    ``observers`` are sorted, ``stimuli`` those that were rated, in the header's order; ``of`` is which were rated,
    ``ends`` are the scale's.
    """

    scale: str
    of: Of
    ends: tuple[int, int] | None
    observers: tuple[str, ...]
    stimuli: tuple[str, ...]
    values: Floats


def rating_tables(sessions: Sequence[SessionLog]) -> tuple[RatingTable, ...]:
    """Return the ratings of one experiment's sessions by what was rated and scale, each trial's last attempt.

    Which there are follows from what the records hold. Practice, catch trials, which scores leave out too, and series
    have none here.

    Raises
    ------
    ResultsError
        As `summarise_ratings`, but for sessions without any rating.
    """
    refuse_mixtures(sessions)
    stimuli = sessions[0].header.stimulus_names
    # By what was rated and scale, by observer and stimulus: the ratings in the order in which they were given.
    by_scale: dict[tuple[Of, str], dict[str, dict[str, list[float]]]] = {}
    ends: dict[tuple[Of, str], set[tuple[int, int] | None]] = {}
    for session in in_time(sessions):
        for trial in session.trials:
            for of, scale, stimulus, value in () if trial.is_practice else trial.rated():
                people = by_scale.setdefault((of, scale), {}).setdefault(session.header.observer, {})
                people.setdefault(stimulus, []).append(float(value))
                ends.setdefault((of, scale), set()).add(_ends(session, trial, scale))
    found = sorted(by_scale.items(), key=lambda item: OF.index(item[0][0]))
    return tuple(_table(scale, of, ends[of, scale], people, stimuli) for (of, scale), people in found)


def _ends(session: SessionLog, trial: Trial, scale: str) -> tuple[int, int] | None:
    """Return the ends of the scale as the session began; None if its log does not say."""
    planned = session.header.planned
    return planned[trial.block].scales.get(scale) if trial.block < len(planned) else None


def _table(
    scale: str,
    of: Of,
    stated: set[tuple[int, int] | None],
    people: Mapping[str, Mapping[str, list[float]]],
    stimuli: Sequence[str],
) -> RatingTable:
    observers = sorted(people)
    rated = [stimulus for stimulus in stimuli if any(stimulus in people[observer] for observer in observers)]
    repeats = max(len(values) for by_stimulus in people.values() for values in by_stimulus.values())
    table = np.full((len(observers), len(rated), repeats), np.nan)
    for row, observer in enumerate(observers):
        for column, stimulus in enumerate(rated):
            values = people[observer].get(stimulus, [])
            table[row, column, : len(values)] = values
    known = [ends for ends in stated if ends is not None]
    ends = (min(low for low, _ in known), max(high for _, high in known)) if len(known) == len(stated) else None
    if ends and not (ends[0] <= np.nanmin(table) and np.nanmax(table) <= ends[1]):
        ends = None  # the experiment was changed while its sessions ran
    return RatingTable(scale, of, ends, tuple(observers), tuple(rated), table)


def _summary(ratings: RatingTable) -> ScaleSummary:
    observers, rated, table = ratings.observers, ratings.stimuli, ratings.values
    flat = table.reshape(len(observers), -1)
    given = np.isfinite(flat).sum(axis=1)
    means = np.nansum(flat, axis=1) / given
    sds = [float(np.nanstd(row, ddof=1)) if count > 1 else None for row, count in zip(flat, given, strict=True)]
    spread = np.array([sd if sd else np.nan for sd in sds])
    z_table = (table - means[:, None, None]) / spread[:, None, None]
    above, below = outlying(flat)
    scores = []
    for column, stimulus in enumerate(rated):
        each, z = _observer_means(table[:, column]), _observer_means(z_table[:, column])
        mean, interval, sd = _mean(each)
        if ratings.ends is not None:
            interval = _on_scale(each, ratings.ends)
        z_mean, z_interval, _ = _mean(z)
        assert mean is not None  # someone rated it
        count = int(np.isfinite(table[:, column]).sum())
        scores.append(OpinionScore(stimulus, len(each), count, mean, interval, sd, z_mean, z_interval))
    return ScaleSummary(
        ratings.scale,
        ratings.of,
        ratings.ends,
        tuple(scores),
        tuple(
            RaterScreening(observer, int(given[row]), float(means[row]), sds[row], int(above[row]), int(below[row]))
            for row, observer in enumerate(observers)
        ),
    )


def outlying(ratings: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return P and Q of BT.500's rule: how many of each observer's ratings lie far above and far below the others'.

    Far is 2 standard deviations from the mean of a presentation if its kurtosis β₂ = m₄/m₂² is between 2 and 4, as for
    a normal distribution, else √20. A presentation with equal ratings has no far ratings.

    Parameters
    ----------
    ratings
        Shape (observers, presentations), NaN where there is none.

    Returns
    -------
    Two arrays of shape (observers,).
    """
    above, below = np.zeros(len(ratings), np.intp), np.zeros(len(ratings), np.intp)
    for column in ratings.T:
        given = np.flatnonzero(np.isfinite(column))
        values = column[given]
        off = values - values.mean() if len(values) else values
        second = float((off**2).mean()) if len(values) else 0.0
        if len(values) < 2 or second <= 0:
            continue
        kurtosis = float((off**4).mean()) / second**2
        far = (2.0 if 2 <= kurtosis <= 4 else math.sqrt(20)) * float(values.std(ddof=1))
        above[given[off >= far]] += 1
        below[given[off <= -far]] += 1
    return above, below


def _observer_means(values: Floats) -> Floats:
    """Return the mean of each row that has a number. Shapes (observers, repeats) to (k,), k observers."""
    given = np.isfinite(values)
    rows = given.any(axis=1)
    return np.asarray(np.where(given, values, 0.0).sum(axis=1)[rows] / given.sum(axis=1)[rows])


def _mean(values: Floats) -> tuple[float | None, tuple[float, float] | None, float | None]:
    """Return the mean, its 95 % limits by Student's t, which equal values have not, and the standard deviation."""
    from scipy.special import stdtrit

    if not len(values):
        return None, None, None
    mean = float(values.mean())
    if len(values) < 2:
        return mean, None, None
    sd = float(values.std(ddof=1))
    if sd <= 1e-12 * max(1.0, abs(mean)):
        return mean, None, sd
    reach = float(stdtrit(len(values) - 1, 0.975)) * sd / math.sqrt(len(values))
    return mean, (mean - reach, mean + reach), sd


def _on_scale(values: Floats, ends: tuple[int, int]) -> tuple[float, float] | None:
    """Return the 95 % limits of the mean of observers' means on a scale of whole numbers."""
    low, high = ends
    above = (values - low)[:, None]
    (mean,) = bounded_means(above, above**2, np.ones_like(above), high - low, step=1.0)
    return None if mean.low is None or mean.high is None else (low + mean.low, low + mean.high)


VIEWS = ("stereo", "flat")


@dataclass(frozen=True, slots=True)
class Preferences:
    """The trials of the kind ``preference``: by observer, how often stereo and how often flat was chosen.

    ``who`` says who answered in the sessions. The answers of an observer are correlated: the independent units are the
    observers.
    """

    by_observer: dict[str, tuple[int, int]]
    who: WhoAnswered

    @property
    def stereo(self) -> int:
        """How often the stereo version was chosen."""
        return sum(stereo for stereo, _ in self.by_observer.values())

    @property
    def flat(self) -> int:
        """How often the flat version was chosen."""
        return sum(flat for _, flat in self.by_observer.values())

    @property
    def observers_for_stereo(self) -> int:
        """How many observers chose stereo more often than flat."""
        return sum(stereo > flat for stereo, flat in self.by_observer.values())

    @property
    def observers_for_flat(self) -> int:
        """How many observers chose flat more often than stereo."""
        return sum(flat > stereo for stereo, flat in self.by_observer.values())

    @property
    def sentence(self) -> str:
        """The counts in words."""
        total, people = self.stereo + self.flat, self.who.words(self.by_observer)
        return (
            f"Of {total} preferences between stereo and flat, {self.stereo} are for stereo; of {people}, "
            f"{self.observers_for_stereo} chose stereo more often and {self.observers_for_flat} flat."
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        people = {name: dict(zip(VIEWS, counts, strict=True)) for name, counts in self.by_observer.items()}
        return {"stereo": self.stereo, "flat": self.flat, "observers": people}


def preferences(sessions: Sequence[SessionLog]) -> Preferences:
    """Count the preferences of ``sessions``, each trial's last attempt."""
    chosen: dict[str, list[str]] = {}
    for session in sessions:
        for trial in session.of(PreferenceRecord):
            chosen.setdefault(session.header.observer, []).append(trial.chosen_view)
    counts = {name: (views.count("stereo"), views.count("flat")) for name, views in chosen.items()}
    return Preferences(counts, who_answered(sessions))
