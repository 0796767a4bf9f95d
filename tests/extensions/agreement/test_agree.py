"""Measures beside observers who are known: what observers said, pairs told apart, limits against classes."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from analysis.bootstrap import resample
from analysis.comparisons import from_sessions
from analysis.errors import ResultsError
from analysis.kinds import Trial
from analysis.records import SessionLog, new_header
from analysis.report.summary import summarise
from documents.arrays import Floats
from documents.pages import Heading, Paragraph
from extensions.agreement import (
    Drawn,
    ObservedGroup,
    Predicted,
    agree,
    agreement_blocks,
    calibrate,
    observed_groups,
    pair_accuracy,
    write_agreement_csv,
    write_agreement_page,
)
from extensions.agreement.gather import differing_means, of_means
from extensions.agreement.limits import best_limits
from tests.answers import new_answer
from tests.kept import known
from tests.pages import policy_of

# Measures beside observers who are known: what is said, and what is left out.

HEADER = new_header("plates <b>", "01", "s1", "2026-01-31T09:30:00Z", seed=1)


def rated(quality: Floats, name: str = "", observers: int = 12, seed: int = 1) -> ObservedGroup:
    """Return what observers gave whose ratings scatter by 0.5 about ``quality``; stimulus 0 is the photograph."""
    each = quality + np.random.default_rng(seed).normal(0, 0.5, (observers, len(quality)))
    names = [f"{name}photo", *(f"{name}{letter}" for letter in "abcdefgh"[: len(quality) - 1])]
    return of_means(name, "ratings", "points", names, each, np.ones_like(each), alpha=0.05, adjust="holm")


def measure(*values: Floats, name: str = "blur", better: str = "lower", limit: float | None = None) -> Predicted:
    return Predicted(name, name.title(), "px", better, values, limit)  # type: ignore[arg-type]


QUALITY = np.array([4.0, 3.9, 3.4, 2.5, 1.5, 0.5])
BLUR = np.array([0.0, 0.2, 0.8, 1.5, 2.4, 3.1])


def test_a_measure_that_agrees() -> None:
    found = agree([rated(QUALITY)], ["photo"], [measure(BLUR, limit=0.5)])
    (result,) = found.measures
    rho = result.whole.correlations["spearman"]
    assert result.decision == "agrees"
    assert rho.value == pytest.approx(1)
    assert rho.p == pytest.approx(1 / 120)  # of five stimuli: the photograph takes no part
    assert known(rho.low) > 0.5
    assert result.whole.accuracy.share == 1
    calibration = known(result.whole.calibration)
    # 0.1 points below the photograph are not seen, 0.6 are, by 12 observers who scatter by 0.5.
    assert (calibration.same, known(calibration.table).hits, known(calibration.table).false_alarms) == (1, 1, 0)
    assert 0.2 < known(calibration.best) < 0.8


def test_noise_and_a_reversed_measure_do_not_agree() -> None:
    noise = np.array([0.0, 0.5, 0.1, 0.9, 0.2, 0.4])
    found = agree([rated(QUALITY)], ["photo"], [measure(noise, name="noise"), measure(-BLUR, name="reversed")])
    assert [result.decision for result in found.measures] == ["not shown", "not shown"]
    assert found.measures[1].adjusted_p == 1
    assert found.measures[1].whole.accuracy.share == 0


def test_many_measures_are_corrected_for() -> None:
    random = np.random.default_rng(5)
    group = rated(QUALITY)
    alone = agree([group], ["photo"], [measure(BLUR)]).measures[0].adjusted_p
    others = [measure(random.normal(size=6), name=f"noise {number}") for number in range(2)]
    together = agree([group], ["photo"], [measure(BLUR), *others]).measures[0].adjusted_p
    assert alone == pytest.approx(1 / 120)
    assert together == pytest.approx(3 / 120)


def test_a_measure_that_is_the_same_for_all() -> None:
    found = agree([rated(QUALITY)], ["photo"], [measure(np.zeros(6)), measure(BLUR, name="other")])
    assert found.measures[0].decision == "cannot be said"
    assert found.measures[0].whole.correlations["pearson"].value is None
    assert found.measures[1].adjusted_p == pytest.approx(1 / 120)  # what cannot be tested is not corrected for


def test_groups_have_results_of_their_own_and_one_over_all() -> None:
    groups = [rated(QUALITY, "church "), rated(QUALITY[:5], "beach ", seed=2)]
    found = agree(groups, ["church photo", "beach photo"], [measure(BLUR, BLUR[:5])])
    (result,) = found.measures
    each = [group.correlations["pearson"].value for group in result.groups]
    assert None not in each
    assert result.whole.correlations["pearson"].value == pytest.approx(np.mean(np.array(each, dtype=float)))
    mean = result.whole.correlations["spearman"]
    assert mean.p == pytest.approx(1 / (120 * 24))
    # Of two groups more is known than of one.
    assert known(mean.low) > min(group.correlations["spearman"].low or 0.0 for group in result.groups) - 1e-9
    assert known(mean.high) == pytest.approx(1)
    assert result.whole.accuracy.of == sum(group.accuracy.of for group in result.groups)


def test_every_pair_has_each_measure_s_prediction() -> None:
    group = rated(QUALITY)
    turned = np.array([0.0, 0.2, 1.5, 0.8, 2.4, 2.4])
    found = agree([group], ["photo"], [measure(BLUR), measure(turned, name="turned")])
    pairs = {(pair.better, pair.worse): pair for pair in found.pairs(0)}
    assert len(pairs) == 10  # of five stimuli
    assert all(pair.difference >= 0 and pair.predicted["blur"] == 1 for pair in pairs.values())
    assert (pairs["b", "c"].predicted["turned"], pairs["d", "e"].predicted["turned"]) == (-1, 0)
    apart = [pair for pair in pairs.values() if pair.told_apart]
    result = found.measures[1].whole.accuracy
    assert result.of == len(apart)
    assert result.right == sum((1 + pair.predicted["turned"]) / 2 for pair in apart)
    assert len(found.to_json()["groups"][0]["pairs"]) == 10


def test_a_small_group_is_left_out_with_a_note() -> None:
    groups = [rated(QUALITY, "church "), rated(QUALITY[:3], "beach ")]
    found = agree(groups, ["church photo", "beach photo"], [measure(BLUR, BLUR[:3])])
    assert [group.name for group in found.groups] == ["church "]
    assert any("'beach '" in note for note in found.notes)
    assert len(found.measures[0].predicted.values) == 1


def test_fewer_than_three_stimuli_are_refused() -> None:
    with pytest.raises(ResultsError, match="compared 2 stimuli"):
        agree([rated(QUALITY[:3])], ["photo"], [measure(BLUR[:3])])


def test_a_photograph_that_was_not_compared_gives_no_limit() -> None:
    group = rated(QUALITY).only("abcde")
    found = agree([group], ["photo"], [measure(BLUR[1:], limit=1.0)])
    assert found.measures[0].whole.calibration is None
    assert any("did not compare the photograph" in note for note in found.notes)
    assert found.to_json()["groups"][0]["stimuli"][0]["same_class_as_photograph"] is None


@pytest.mark.usefixtures("undrawn")
def test_the_terminal_the_page_and_the_tables(tmp_path: Path) -> None:
    quality = np.array([4.0, 3.9, 3.4, 2.5, 1.5, 0.5])
    groups = [rated(quality, "church <i>"), rated(quality, "beach ", seed=3)]
    blur = measure(BLUR, BLUR, limit=0.5)
    ratio = measure(*[np.array([np.inf, 50.0, 40, 30, 20, 10])] * 2, name="ratio", better="higher")
    found = agree(groups, ["church <i>photo", "beach photo"], [blur, ratio], notes=["Observers are <simulated>."])
    said = [block.text for block in agreement_blocks(found) if isinstance(block, Heading | Paragraph)]
    assert any("Blur agrees with observers" in text for text in said)
    assert any("Within the limit of 0.5 px" in text for text in said)
    write_agreement_page(found, HEADER, tmp_path / "page.html", (("Pictures", "<as shown>"),))
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert policy_of(page)
    assert page.count("<svg") == 8  # wide and narrow, of scores and limits, of two measures
    for text in ("plates &lt;b&gt;", "&lt;simulated&gt;", "&lt;as shown&gt;", "church &lt;i&gt;"):
        assert text in page
    for text in ("<simulated>", "<as shown>", "church <i>", "nan", "NaN"):
        assert text not in page
    files = write_agreement_csv(found, tmp_path / "tables")
    assert [file.name for file in files] == ["agreement.csv", "scores.csv", "pairs.csv", "limits.csv"]
    assert len((tmp_path / "tables/scores.csv").read_text(encoding="utf-8").splitlines()) == 13


# What observers said, by every task: scores, errors, and pairs told apart, as elsewhere in the analysis.

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
    # The bootstrap's error is that of a mean of 8, but for the factor 7/8 in the variance.
    expected = each.std(axis=0, ddof=1) / np.sqrt(8) * np.sqrt(7 / 8)
    assert known(group.drawn).errors.std(axis=0) == pytest.approx(expected, rel=0.12)


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


# Pairs that observers tell apart, counted one by one.
def random_group(seed: int, n: int = 6, draws: int | None = None) -> ObservedGroup:
    random = np.random.default_rng(seed)
    scores = random.normal(size=n)
    differs = np.triu(random.random((n, n)) < 0.6, 1)
    differs |= differs.T
    drawn = None
    if draws is not None:
        errors = random.normal(0, 0.3, (draws, n))
        drawn = Drawn(scores + errors, errors, np.repeat(differs[None], draws, axis=0))
    return ObservedGroup("", "ratings", "points", tuple("abcdef"[:n]), scores, differs, 12, drawn)


def test_pairs_are_counted_as_one_by_one() -> None:
    groups = [random_group(1), random_group(2, 5)]
    values = [np.rint(np.random.default_rng(seed).normal(0, 1, len(group.scores))) for seed, group in enumerate(groups)]
    right, of = 0.0, 0
    for group, value in zip(groups, values, strict=True):
        for i, j in combinations(range(len(value)), 2):
            if group.differs[i, j]:
                of += 1
                way = (group.scores[i] - group.scores[j]) * (value[i] - value[j])
                right += 1.0 if way > 0 else 0.5 if way == 0 else 0.0
    found = pair_accuracy(groups, values)
    assert (found.right, found.of) == (right, of)
    assert found.share == pytest.approx(right / of)


def test_the_order_of_observers_is_all_right_and_the_reverse_all_wrong() -> None:
    group = random_group(3, draws=200)
    assert pair_accuracy([group], [group.scores]).share == 1
    wrong = pair_accuracy([group], [-group.scores])
    assert (wrong.share, wrong.p) == (0, 1)
    right = pair_accuracy([group], [group.scores])
    assert known(right.p) < 0.05
    assert 0.5 < known(right.low) < 1  # observers whose draws turn a pair


def test_observers_who_tell_no_pair_apart() -> None:
    group = random_group(4)
    none = ObservedGroup("", "", "", group.stimuli, group.scores, np.zeros((6, 6), dtype=np.bool_), 12, None)
    found = pair_accuracy([none], [group.scores])
    assert (found.of, found.share, found.p) == (0, None, None)


# Limits against classes, counted by hand, and against the plain way.
def group(same: list[bool], drawn: list[list[bool]] | None = None, observers: int = 10) -> ObservedGroup:
    """Return a group whose first stimulus is the photograph; ``same`` says which others are in its class."""
    n = len(same) + 1

    def square(alike: list[bool]) -> NDArray[np.bool_]:
        differs = np.zeros((n, n), dtype=np.bool_)
        differs[0, 1:] = differs[1:, 0] = ~np.array(alike)
        return differs

    samples = None
    if drawn is not None:
        zeros = np.zeros((len(drawn), n))
        samples = Drawn(zeros, zeros, np.array([square(row) for row in drawn]))
    names = tuple(f"s{place}" for place in range(n))
    return ObservedGroup("", "ratings", "points", names, np.zeros(n), square(same), observers, samples)


def test_a_limit_is_counted_by_hand() -> None:
    found = calibrate([group([True, True, True, False, False])], [np.array([0, 0.5, 1.0, 2.0, 1.4, 3.0])], [0], 1.4)
    assert found.table is not None
    counts = found.table.hits, found.table.misses, found.table.false_alarms, found.table.correct_rejections
    assert counts == (2, 1, 1, 1)  # a stimulus at the limit is within it
    assert found.table.hit_rate.share == pytest.approx(2 / 3)
    assert found.table.false_alarm_rate.share == 0.5
    assert (found.stimuli, found.same, found.table.right.times) == (5, 3, 3)


def test_a_measure_of_which_more_is_better() -> None:
    """Decibels: within the limit is at or above it."""
    found = calibrate(
        [group([True, True, False])], [np.array([np.inf, 50.0, 40.0, 20.0])], [0], 45.0, higher_is_better=True
    )
    assert found.table is not None
    assert (found.table.hits, found.table.misses, found.table.correct_rejections) == (1, 1, 1)
    assert found.area == 1
    assert known(found.best) == pytest.approx(30)
    assert (found.best_from, found.best_to) == (20, 40)


def test_the_area_is_that_of_mann_and_whitney() -> None:
    random = np.random.default_rng(1)
    values = np.rint(random.normal(0, 3, 21))
    same = (random.random(20) < 0.4).tolist()
    found = calibrate([group(same)], [values], [0], None)
    near, far = values[1:][np.array(same)], values[1:][~np.array(same)]
    expected = stats.mannwhitneyu(far, near).statistic / (len(near) * len(far))
    assert found.area == pytest.approx(expected, abs=1e-12)


def test_the_best_limit_is_that_of_all_that_could_be_tried() -> None:
    random = np.random.default_rng(7)
    for _ in range(50):
        far = np.rint(random.normal(0, 3, 9))
        same = random.random(9) < 0.5
        best = best_limits(far, same)
        if best is None:
            assert same.all() or not same.any()
            continue
        middle = np.clip(np.mean(np.clip(best, -100, 100)), -100, 100)

        def youden(limit: float, far: Floats = far, same: NDArray[np.bool_] = same) -> float:
            return float((far <= limit)[same].mean() - (far <= limit)[~same].mean())

        assert youden(float(middle)) == pytest.approx(max(youden(limit) for limit in np.arange(-20, 20, 0.5)))


def test_all_in_one_class_say_nothing_of_a_limit() -> None:
    found = calibrate([group([True, True, True])], [np.array([0, 1.0, 2.0, 3.0])], [0], 1.4)
    assert (found.area, found.best, found.curve) == (None, None, ())
    assert known(found.table).false_alarm_rate.share is None
    assert found.to_json()["area"] is None


def test_the_interval_of_the_best_limit_is_that_of_the_draws() -> None:
    values = np.array([0, 1.0, 2.0, 3.0, 4.0])
    same = [True, True, False, False]
    drawn = [same] * 60 + [[True, True, True, False]] * 40
    found = calibrate([group(same, drawn, observers=1000)], [values], [0], None)
    assert (found.best, found.best_low, found.best_high) == (2.5, 2.5, 3.5)
    assert (found.area_low, found.area_high) == (1, 1)
    # Where most draws put all in one class, there is no interval.
    rarely = calibrate([group(same, [same] * 60 + [[True] * 4] * 40)], [values], [0], None)
    assert (rarely.best, rarely.best_low) == (2.5, None)
