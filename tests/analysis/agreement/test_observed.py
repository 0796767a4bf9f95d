"""What observers said, by every task: scores, errors, and pairs told apart, as elsewhere in the analysis."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from analysis.agreement import observed_groups
from analysis.agreement.observed_means import differing_means
from analysis.bootstrap import resample
from analysis.comparisons import from_sessions
from analysis.errors import ResultsError
from analysis.kinds import Trial
from analysis.records import SessionLog, new_header
from analysis.report.summary import summarise
from tests.answers import new_answer
from tests.kept import known

NAMES = ("a", "b", "c", "d")
STRENGTH = {"a": 1.5, "b": 0.5, "c": -0.5, "d": -1.5}


def session(observer: int, *trials: Trial, scenes: bool = False) -> SessionLog:
    factors = {name: {"scene": "one" if name in "ab" else "two"} if scenes else {} for name in NAMES}
    stimuli = tuple({"name": name, "factors": factors[name]} for name in NAMES)
    header = new_header("plates", f"{observer:02d}", "s", "2026-01-31T09:30:00Z", seed=1, stimuli=stimuli)
    return SessionLog(Path(f"{observer}.jsonl"), header, trials, complete=True)


def compared(observer: int, repeats: int = 3) -> SessionLog:
    random = np.random.default_rng(observer)
    trials = []
    for number, (first, second) in enumerate(
        [(one, two) for _ in range(repeats) for one in NAMES for two in NAMES if one < two]
    ):
        wins = random.random() < 1 / (1 + np.exp(STRENGTH[second] - STRENGTH[first]))
        chosen, rejected = (first, second) if wins else (second, first)
        data = {"first": first, "second": second, "chosen": chosen, "rejected": rejected}
        trials.append(new_answer(0, number, "all_pairs", (), 1.0, data=data))
    return session(observer, *trials)


def test_pairs_have_the_scores_and_classes_of_the_report() -> None:
    logs = [compared(observer) for observer in range(9)]
    (group,), notes = observed_groups(logs)
    summary = summarise(logs)
    classes = known(summary.scores.classes)
    assert group.scores == pytest.approx(summary.scores.fit.theta)
    assert np.array_equal(group.differs, classes.p <= 0.05)
    assert (group.unit, group.observers, notes) == ("nats", 9, ())
    assert group.drawn is not None
    drawn = resample(from_sessions(logs))
    assert np.array_equal(group.drawn.scores, drawn.theta)
    assert group.drawn.errors == pytest.approx(drawn.theta - drawn.fit.theta)
    # A pair that observers tell apart is told apart in most draws, and one that they do not in few.
    shares = group.drawn.differs.mean(axis=0)
    assert shares[group.differs].min() > 0.5
    assert group.drawn.differs.shape == (1000, 4, 4)


def rating(observer: int, scale: str = "depth") -> SessionLog:
    random = np.random.default_rng(observer)
    return session(
        observer,
        *(
            new_answer(
                0,
                number,
                "rating",
                (),
                1.0,
                data={"stimulus": name, "ratings": {scale: round(10 * (STRENGTH[name] + random.normal()))}},
            )
            for number, name in enumerate(NAMES * 2)
        ),
    )


def test_ratings_are_means_tested_by_student() -> None:
    logs = [rating(observer) for observer in range(8)]
    (group,), _ = observed_groups(logs)
    each = np.array(
        [
            [
                np.mean([t.details()["ratings"]["depth"] for t in log.trials if t.details()["stimulus"] == name])
                for name in NAMES
            ]
            for log in logs
        ]
    )
    assert (group.name, group.task) == ("depth", "ratings")
    assert group.scores == pytest.approx(each.mean(axis=0))
    p = np.array([stats.ttest_rel(each[:, i], each[:, j]).pvalue for i, j in zip(*np.triu_indices(4, 1), strict=True)])
    adjusted = np.maximum.accumulate(np.sort(p) * np.arange(6, 0, -1))[np.argsort(np.argsort(p))]
    assert np.array_equal(group.differs[np.triu_indices(4, 1)], adjusted <= 0.05)
    assert group.drawn is not None
    # The bootstrap's error is that of a mean of 8, but for the factor 7/8 in the variance.
    expected = each.std(axis=0, ddof=1) / np.sqrt(8) * np.sqrt(7 / 8)
    assert group.drawn.errors.std(axis=0) == pytest.approx(expected, rel=0.12)


def test_means_of_draws_are_tested_as_the_draw_s_own_observers() -> None:
    """Slow twin: each draw's rows repeated, and the tests of the whole."""
    random = np.random.default_rng(4)
    total = random.normal([3.0, 2.0, 0.5], 1.0, (6, 3))
    count = np.ones_like(total)
    weights = random.multinomial(6, np.full(6, 1 / 6), 20).astype(np.float64)
    fast = differing_means(total, count, weights, alpha=0.05, adjust="holm")
    for row, weight in zip(fast, weights, strict=True):
        rows = np.repeat(total, weight.astype(int), axis=0)
        slow = differing_means(rows, np.ones_like(rows), np.ones((1, 6)), alpha=0.05, adjust="holm")[0]
        assert np.array_equal(row, slow)


def test_choices_from_series_are_shares() -> None:
    picked = ["a", "a", "b", "a", "c"]
    logs = []
    for observer, chosen in enumerate(picked):
        index = NAMES.index(chosen)
        data = {
            "series": "blur",
            "stimuli": list(NAMES),
            "start": 0,
            "chosen": chosen,
            "chosen_index": index,
            "path": [[place, 0.0] for place in range(4)],
            "dwell_s": [1.0] * 4,
            "ratings": {},
            "rating_times_s": {},
        }
        logs.append(session(observer, new_answer(0, 0, "best_of_series", (), 1.0, data=data)))
    (group,), _ = observed_groups(logs)
    assert (group.name, group.stimuli) == ("blur", NAMES)
    assert group.scores == pytest.approx([0.6, 0.2, 0.2, 0.0])


def test_a_task_is_chosen_and_others_are_named() -> None:
    logs = []
    for observer in range(5):
        both = compared(observer)
        rated = [
            new_answer(1, t.trial, t.kind, (), 1.0, "2026-01-02T03:04:05Z", t.details())
            for t in rating(observer).trials
        ]
        logs.append(session(observer, *both.trials, *rated))
    groups, notes = observed_groups(logs)
    assert groups[0].task == "paired comparisons"
    assert any("--task ratings:depth" in note for note in notes)
    (by_rating,), _ = observed_groups(logs, task="ratings")
    assert by_rating.unit == "points"
    assert by_rating.scores == pytest.approx(observed_groups(logs, task="ratings:depth")[0][0].scores)
    with pytest.raises(ResultsError, match="the results have no series"):
        observed_groups(logs, task="series")
    with pytest.raises(ResultsError, match="there is no task 'pear'"):
        observed_groups(logs, task="pear")


def test_no_answers_at_all() -> None:
    with pytest.raises(ResultsError, match="no comparison, choice or rating"):
        observed_groups([session(1)])
