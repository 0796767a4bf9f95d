"""All results from choices in series, computed once for the report, the terminal and JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from analysis.classes.conclusions import Conclusion
from analysis.records.answered_by import WhoAnswered, who_answered
from analysis.records.session_record import SessionLog
from analysis.series.agreement import SeriesAgreement, series_agreement
from analysis.series.choice_tests import (
    KindsTest,
    LevelTest,
    NeighboursTest,
    kinds_tests,
    level_tests,
    neighbours_tests,
)
from analysis.series.choices import Choices, gather
from analysis.series.just_noticeable import StepSize, step_size
from analysis.series.paired_tests import DRAWS, RatingTest, rating_test
from analysis.series.picture_scores import (
    WEIGHTS,
    CellMean,
    PictureScore,
    path_lengths,
    picture_scores,
    rating_means,
    response_times_s,
    weight_of,
)
from documents.arrays import Floats
from documents.text import JsonResult, counted


@dataclass(frozen=True, slots=True)
class SeriesSummary(JsonResult):
    """The scores, ratings, steps, agreement and tests of the choices from series in one experiment.

    Attributes
    ----------
    choices
        The choices, with the series and their levels.
    who
        Who answered: people, simulated observers, or both.
    weight
        The rating scale by which choices are weighted in the scores; None where there are no scores.
    levels
        Score and share of each level of each kind of series, over all paints: Figure 4.14.
    pictures
        The same of each picture.
    ratings
        Mean ratings by scale, of each kind and paint: Figures 4.15 (``similarity``) and 4.16 (``difficulty``).
    response_times_s, path_lengths
        Time to a choice, and number of pictures shown.
    steps
        The just noticeable step of each kind of series.
    neighbours
        Whether neighbouring levels are chosen equally often.
    agreement
        Agreement between the observers who chose from every series.
    kind_tests, paint_tests
        By scale, whether ratings differ between kinds of series and between paints, of the same observers.
    choice_tests, level_tests
        Whether choices differ between kinds of series: overall, and level by level.
    notes
        Sentences that a reader needs before the numbers.
    """

    choices: Choices
    experiment: str
    who: WhoAnswered
    weight: str | None
    levels: tuple[PictureScore, ...]
    pictures: tuple[PictureScore, ...]
    ratings: dict[str, tuple[CellMean, ...]]
    response_times_s: tuple[CellMean, ...]
    path_lengths: tuple[CellMean, ...]
    steps: tuple[StepSize, ...]
    neighbours: tuple[NeighboursTest, ...]
    agreement: SeriesAgreement
    kind_tests: dict[str, RatingTest]
    paint_tests: dict[str, RatingTest]
    choice_tests: tuple[KindsTest, ...]
    level_tests: tuple[LevelTest, ...]
    notes: tuple[str, ...]
    json_keys: ClassVar = {"who.all_simulated": "simulated", "count": "choices", "choices.design.series": "series"}
    json_names: ClassVar = (
        "experiment who.all_simulated weight choices.observers count choices.design.by choices.design.across "
        "choices.design.along choices.design.series levels pictures ratings response_times_s path_lengths steps "
        "neighbours agreement kind_tests paint_tests choice_tests level_tests notes"
    )

    @property
    def conclusions(self) -> tuple[Conclusion, ...]:
        """What is concluded of every two kinds of series and every two paints."""
        return conclusions_of_tests(self.kind_tests, self.paint_tests, self.choice_tests)

    @property
    def sentence(self) -> str:
        """The numbers of observers, choices and series, in words."""
        plan, who = self.choices.design, self.who.words(self.choices.observers)
        count, series = len(self.choices.choices), len(plan.series)
        return f"{who}, {count:,} choice{'' if count == 1 else 's'} from {series} series."

    @property
    def count(self) -> int:
        """How many choices there are."""
        return len(self.choices.choices)


def summarise_series(
    sessions: Sequence[SessionLog],
    *,
    by: str | None = None,
    across: str | None = None,
    along: str | None = None,
    weights: Sequence[str] = WEIGHTS,
) -> SeriesSummary:
    """Score, describe and test the choices from series in one experiment's sessions.

    Parameters
    ----------
    sessions
        Sessions of one experiment, such as `analysis.records.results.read_results` gives.
    by, across, along
        The stimuli's factors that distinguish kinds of series and paints, and that rise along a series; None chooses
        them from the stimuli (`analysis.series.choices.design`).
    weights
        Rating scales that may weight choices in the scores: the first on which every choice was rated.

    Returns
    -------
    SeriesSummary
        Scores, means and tests for each series.

    Raises
    ------
    ResultsError
        As `analysis.series.choices.gather`.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import new_header
    >>> pair = ({"name": "a"}, {"name": "b"})
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1, stimuli=pair)
    >>> data = {"series": "s", "stimuli": ["a", "b"], "chosen": "b", "chosen_index": 1, "start": 0}
    >>> data |= {"path": [[0, 1.0], [1, 1.5]], "dwell_s": [1.0, 1.5], "ratings": {"similarity": 4}}
    >>> data |= {"rating_times_s": {"similarity": 1.0}}
    >>> trial = new_trial(0, 0, "best_of_series", (), 2.5, "2026-01-31T09:31:00Z", data)
    >>> log = SessionLog(Path("session.jsonl"), header, (trial,), complete=True)
    >>> [(level.level, level.share.value) for level in summarise_series([log]).levels]
    [(1.0, 0.0), (2.0, 1.0)]
    """
    choices = gather(sessions, by=by, across=across, along=along)
    plan = choices.design
    weight = weight_of(choices, weights)
    levels = picture_scores(choices, pooled=True, weight=weight)
    kind_tests, paint_tests, choice_tests = all_tests(choices)
    return SeriesSummary(
        choices=choices,
        experiment=sessions[0].header.experiment,
        who=who_answered(sessions),
        weight=weight,
        levels=levels,
        pictures=picture_scores(choices, pooled=False, weight=weight),
        ratings={scale: rating_means(choices, scale) for scale in choices.scales},
        response_times_s=response_times_s(choices),
        path_lengths=path_lengths(choices),
        steps=tuple(step_size(choices, kind) for kind in plan.kinds),
        neighbours=neighbours_tests(choices),
        agreement=series_agreement(choices),
        kind_tests=kind_tests,
        paint_tests=paint_tests,
        choice_tests=choice_tests,
        level_tests=level_tests(choices),
        notes=_notes(sessions, choices, weight, weights),
    )


Tests: TypeAlias = tuple[dict[str, RatingTest], dict[str, RatingTest], tuple[KindsTest, ...]]


def all_tests(choices: Choices, draws: int = DRAWS) -> Tests:
    """Return the tests between ratings of kinds and of paints, by scale, and between choices from kinds.

    Each is by so many random ``draws``, above 16 observers.
    """
    plan = choices.design
    matrices = {scale: choices.rating_matrix(scale) for scale in choices.scales}
    kinds, paints = [series.kind for series in plan.series], [series.paint for series in plan.series]
    of_kinds = _tests(matrices, kinds, plan.kinds, draws)
    return of_kinds, _tests(matrices, paints, plan.paints, draws), kinds_tests(choices, draws)


def conclusions_of_tests(
    kind_tests: Mapping[str, RatingTest], paint_tests: Mapping[str, RatingTest], choice_tests: Sequence[KindsTest]
) -> tuple[Conclusion, ...]:
    """Return what is concluded of choices from two kinds of series, and of ratings of two kinds and two paints."""
    rated = [test for tests in (kind_tests, paint_tests) for test in tests.values()]
    return (
        *(test.conclusion for test in choice_tests),
        *(one for test in rated for one in test.conclusions),
    )


def _tests(
    matrices: dict[str, Floats], groups: list[str], conditions: tuple[str, ...], draws: int
) -> dict[str, RatingTest]:
    """Return the tests between ``conditions`` by scale, over the observers who rated every series."""
    tests: dict[str, RatingTest] = {}
    for scale, matrix in matrices.items():
        whole = matrix[np.isfinite(matrix).all(axis=1)]
        parts = [whole[:, [group == condition for group in groups]].mean(axis=1) for condition in conditions]
        test = rating_test(scale, conditions, np.stack(parts, axis=1), draws)
        if test is not None:
            tests[scale] = test
    return tests


def _notes(
    sessions: Sequence[SessionLog], choices: Choices, weight: str | None, weights: Sequence[str]
) -> tuple[str, ...]:
    notes = []
    if simulated := who_answered(sessions).simulated_sessions:
        were = "is" if simulated == 1 else "are"
        notes.append(f"{simulated} of {counted(len(sessions), 'session', 'sessions')} {were} by simulated observers.")
    people, complete = len(choices.observers), len(choices.complete)
    if complete < people:
        notes.append(
            f"{people - complete} of {people} observers did not choose from every series: agreement and tests between "
            "ratings leave them out."
        )
    if people < 2:
        notes.append("With one observer there are no intervals and no tests.")
    if weight is None and weights:
        scales = " or ".join(weights)
        notes.append(f"There are no scores: not every choice has a rating of {scales} of 0 or more to be weighted by.")
    if choices.design.along is None:
        notes.append("No factor of the stimuli rises along every series: levels are positions from 1.")
    return tuple(notes)
