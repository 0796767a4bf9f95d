"""Intervals, classes, factors and thresholds at their edges: calibration by simulation, tiny and huge counts."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import combinations, product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.bootstrap import class_stability, intervals
from analysis.bootstrap.confidence_intervals import KINDS
from analysis.bootstrap.replicates import resample_counts
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.scaling import fit
from benchmarks.simulated_studies import Design, decisions
from documents.arrays import Floats
from extensions.factors import factor_effects
from extensions.thresholds import FUNCTIONS, QuestPlus, Staircase, fit_threshold, simulate
from tests.kept import known
from tests.stress.answered import answered
from tests.stress.how_many import how_many
from tests.stress.memory import run_alone

pytestmark = pytest.mark.stress


# Intervals and classes at their edges: calibration by simulation, many items, tiny and huge counts, few observers.

# Medina 2016, Table 4.4.
PRINTED = np.array([0.0718, 0.0432, 0.0762, 0.2036, 0.0740, 0.2574, 0.0543, 0.0296, 0.0751, 0.1149])
THETA = np.log(PRINTED) - np.log(PRINTED).mean()


@pytest.mark.promise("level")
@pytest.mark.parametrize("observers", [5, 15])
@pytest.mark.parametrize("observer_sd", [0.0, 0.7])
def test_the_single_step_controls_the_level_with_few_observers(observers: int, observer_sd: float) -> None:
    """Three hundred studies of four items: the standard error of 5 % is 1.3 %."""
    found = decisions(Design(np.zeros(4), observers, observer_sd), studies=300, adjust="maxz")
    assert 0.005 < found.false_difference <= 0.05 + 3 * 0.013


@pytest.mark.parametrize("observers", [2, 3, 4])
@pytest.mark.parametrize("observer_sd", [0.0, 0.7, 1.5])
def test_two_to_four_observers_report_no_false_differences(observers: int, observer_sd: float) -> None:
    found = decisions(Design(np.zeros(10), observers, observer_sd), studies=1000)
    assert found.false_difference < 0.02
    assert found.differences > 0.95


def test_a_hundred_items_fit_into_bounded_memory() -> None:
    """The counts of 1000 replicates alone would take 80 MB, what fitting them together needs ten times as much."""
    program = """
import numpy as np
from tests.stress.memory import forget_peak, peak_kb
from benchmarks.simulated_studies import Design
from analysis.bootstrap.confidence_intervals import intervals
from analysis.bootstrap.replicates import resample_counts
(counts,) = Design(np.random.default_rng(1).normal(0, 0.7, 100), 30).studies(1, 1)
names = [str(place) for place in range(100)]
before = forget_peak()
drawn = resample_counts(counts, names, names[:30])
found = intervals(drawn, "difference")
assert len(found.low) == 4950 and (found.low < found.high).all()
print((peak_kb() - before) / 1024)
"""
    assert float(run_alone(program)) < 300


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e9])
@pytest.mark.parametrize("method", ["ml", "firth"])
def test_the_size_of_counts_moves_no_interval(scale: float, method: str) -> None:
    """Firth's prior counts as half an answer, whatever the answers count."""
    (counts,) = Design(THETA, 30).studies(1, 1)
    names = [str(place) for place in range(30)]
    plain, scaled = (resample_counts(size * counts, names[:10], names, replicates=200) for size in (1.0, scale))
    if method == "firth":
        scaled = resample_counts(scale * counts, names[:10], names, replicates=200, method="firth")
        assert np.isfinite(scaled.theta).all()
        return
    for kind in set(KINDS) - {"model"}:
        one, other = intervals(plain, kind=kind), intervals(scaled, kind=kind)
        assert one.low == pytest.approx(other.low, abs=1e-7)
        assert one.high == pytest.approx(other.high, abs=1e-7)


@pytest.mark.parametrize("observers", [2, 3, 1000])
def test_two_items_and_any_number_of_observers(observers: int) -> None:
    counts = np.zeros((observers, 2, 2))
    counts[::2, 0, 1] = counts[1::2, 1, 0] = 1
    drawn = resample_counts(counts, ["a", "b"], [str(place) for place in range(observers)])
    for kind in KINDS:
        found = intervals(drawn, "difference", kind=kind)
        assert found.low[0] <= found.estimate[0] <= found.high[0]
        assert found.high[0] - found.low[0] > 0
    assert class_stability(drawn).shared.min() > 0.5


def test_strengths_thirty_nats_apart() -> None:
    """Every draw is separated: intervals are Firth's model's at the least, finite, and hold the order."""
    (counts,) = Design(np.array([-15.0, 0.0, 0.3, 15.0]), 10).studies(1, 1)
    drawn = resample_counts(counts, list("abcd"), list("0123456789"), method="firth")
    assert drawn.separated.all()
    for kind in KINDS:
        found = intervals(drawn, kind=kind)
        assert np.isfinite([found.low, found.high]).all()
        assert found.high[0] < found.low[3]
        assert found.high[3] - found.low[3] > 1


def test_classes_of_forty_items_over_a_thousand_draws() -> None:
    (counts,) = Design(np.linspace(-2, 2, 40), 20).studies(1, 1)
    drawn = resample_counts(counts, [str(place) for place in range(40)], [str(place) for place in range(20)])
    stability = class_stability(drawn)
    assert stability.shared[0, 39] == 0
    assert stability.shared[0, 1] > 0.5
    assert sum(stability.class_counts.values()) == 1000


# Effects of factors: calibration by simulation, many items, strengths far apart, tiny and huge counts.

# Medina 2016, Tables 4.3 and 4.4: five images in two views; effects near those of the printed scores.
IMAGES = {"3.2": 0.0, "1.2": 0.2, "3.1": 0.5, "1.1": 0.9, "2.1": 1.05}
STEREO = 0.9
ITEMS = tuple(f"{image}-{view}" for image, view in product(IMAGES, ("flat", "stereo")))
FACTORS = {name: dict(zip(("image", "view"), name.split("-"), strict=True)) for name in ITEMS}
COLUMNS = np.array(
    [[*(float(FACTORS[n]["image"] == i) for i in list(IMAGES)[1:]), FACTORS[n]["view"] == "stereo"] for n in ITEMS],
    dtype=np.float64,
)
BETA = np.array([*list(IMAGES.values())[1:], STEREO])
PAIRS = np.array(list(combinations(range(len(ITEMS)), 2)))


def study(rng: np.random.Generator, beta: Floats, observers: int, observer_sd: float) -> Comparisons:
    """One answer of each observer to each pair; observers' own effects scatter about ``beta``."""
    own = beta + rng.normal(0, observer_sd, (observers, len(beta))) if observer_sd else np.tile(beta, (observers, 1))
    theta = own @ COLUMNS.T
    one, other = np.tile(PAIRS.T, observers)
    who = np.repeat(np.arange(observers), len(PAIRS))
    won = rng.random(len(one)) < 1 / (1 + np.exp(theta[who, other] - theta[who, one]))
    winner, loser = np.where(won, one, other), np.where(won, other, one)
    return answered(ITEMS, winner, loser, observers, observer=who)


@pytest.mark.parametrize("observers", [30, 15])
def test_intervals_hold_the_true_effects(observers: int) -> None:
    """600 studies of five effects; one effect's coverage has a standard error of 0.9 %, their mean at most that."""
    rng = np.random.default_rng(observers)
    model, robust, fits = np.zeros(5), np.zeros(5), 600
    for _ in range(fits):
        found = factor_effects(study(rng, BETA, observers, 0.0), FACTORS)
        model += [effect.low < truth < effect.high for effect, truth in zip(found.effects, BETA, strict=True)]
        robust += [
            (effect.robust_low or 0) < truth < (effect.robust_high or 0)
            for effect, truth in zip(found.effects, BETA, strict=True)
        ]
    assert 0.93 < model.mean() / fits < 0.97, model / fits
    assert 0.93 < robust.mean() / fits < 0.97, robust / fits
    assert (model / fits > 0.92).all()
    assert (robust / fits > 0.92).all()


def test_only_robust_intervals_hold_where_observers_differ() -> None:
    """Observers with effects of their own (sd 0.6 nats): small, so that the curve of the law hardly moves the mean."""
    rng = np.random.default_rng(7)
    truth = np.zeros(5)
    model, robust, fits = np.zeros(5), np.zeros(5), 400
    for _ in range(fits):
        found = factor_effects(study(rng, truth, 30, 0.6), FACTORS)
        model += [effect.low < 0 < effect.high for effect in found.effects]
        robust += [(effect.robust_low or 0) < 0 < (effect.robust_high or 0) for effect in found.effects]
    assert model.mean() / fits < 0.9, model / fits
    assert 0.93 < robust.mean() / fits < 0.97, robust / fits


def test_p_values_are_uniform_where_nothing_is_there() -> None:
    """Tests of factors without effect, of the interaction, and of lack of fit reject 5 % of 500 studies at 0.05."""
    from scipy.stats import kstest

    rng = np.random.default_rng(11)
    p = []
    for _ in range(500):
        found = factor_effects(study(rng, np.zeros(5), 30, 0.0), FACTORS)
        image, view = found.tests
        (interaction,) = found.interactions
        robust = image.robust_p, view.robust_p
        p.append([image.p, view.p, interaction.p, known(found.explained).lack_of_fit_p, *robust])
    table = np.array(p, dtype=np.float64)
    # 5 % of 500 has a standard error of 1 %.
    assert ((table < 0.05).mean(axis=0) < 0.08).all(), (table < 0.05).mean(axis=0)
    assert ((table < 0.05).mean(axis=0) > 0.02).all(), (table < 0.05).mean(axis=0)
    for column in table.T:
        assert kstest(column, "uniform").pvalue > 1e-3


def test_two_thousand_items_on_a_sparse_design() -> None:
    rng = np.random.default_rng(3)
    n, links = 2000, 20_000
    paint, view, scale = rng.integers(0, 10, n), rng.integers(0, 2, n), rng.uniform(0.1, 10, n)
    effects = rng.normal(0, 0.5, 10)
    theta = effects[paint] + 0.8 * view + 0.3 * np.log2(scale)
    one = rng.integers(0, n, links)
    other = (one + rng.integers(1, n, links)) % n
    won = rng.random(links) < 1 / (1 + np.exp(theta[other] - theta[one]))
    winner, loser = np.where(won, one, other), np.where(won, other, one)
    names = tuple(f"item {place}" for place in range(n))
    comparisons = answered(names, winner, loser, 50, observer=rng.integers(0, 50, links))
    told = {
        name: {"paint": f"{paint[i]}", "view": "stereo" if view[i] else "flat", "scale": float(scale[i])}
        for i, name in enumerate(names)
    }
    begun = time.process_time()
    found = factor_effects(comparisons, told, log=("scale",), references={"paint": "0", "view": "flat"})
    assert time.process_time() - begun < 120
    truth = {**{f"{k}": effects[k] - effects[0] for k in range(1, 10)}, "stereo": 0.8, "per doubling": 0.3}
    for effect in found.effects:
        assert abs(effect.estimate - truth[effect.level]) < 4.5 * effect.se
        assert effect.se < 0.12


def test_the_free_model_is_reached_on_random_designs() -> None:
    rng = np.random.default_rng(5)
    for n in (2, 3, 10, 60):
        for _ in range(20):
            theta = rng.normal(0, 1.5, n)
            chance = 1 / (1 + np.exp(theta[None, :] - theta[:, None]))
            wins: Floats = np.asarray(rng.poisson(40 * chance) + 1.0, dtype=np.float64)
            np.fill_diagonal(wins, 0)
            names = [f"{place}" for place in range(n)]
            answers = [Answer(names[i], names[j], wins[i, j]) for i in range(n) for j in range(n) if i != j]
            found = factor_effects(from_answers(answers, names), {name: {"own": name} for name in names}, use=("own",))
            np.testing.assert_allclose(found.theta, fit(wins).theta, rtol=0, atol=1e-10)


# Thresholds at the edges: coverage and bias by simulation, long staircases, thousands of trials.

X = np.linspace(-2, 0, 21)


def answering(right: NDArray[np.float64], rng: np.random.Generator) -> Callable[[int], bool]:
    """Return who answers right with the probability of each level, shape (levels,)."""
    return lambda level: bool(rng.random() < right[level])


@pytest.mark.parametrize(
    ("name", "slope", "guess"),
    [
        ("weibull", 3.5, 0.5),
        ("logistic", 8.0, 0.5),
        ("normal", 5.0, 0.5),
        ("weibull", 3.5, None),
        ("logistic", 8.0, None),
    ],
)
def test_intervals_cover_and_thresholds_are_unbiased(name: str, slope: float, guess: float | None) -> None:
    """Of simulated observers (fewer of yes/no, where a fit takes longer) with 100 trials by QUEST+.

    Three standard errors of a share are allowed.
    """
    studies = how_many(100, 300) if guess is None else how_many(200, 600)
    shape, rng = FUNCTIONS[name], np.random.default_rng(5)
    covered, errors, medians, means = 0, [], [], []
    for _ in range(studies):
        true = rng.uniform(-1.4, -0.6)
        right = shape.probability(X, true, slope, 0.03 if guess is None else guess, 0.02)
        quest = QuestPlus.standard(X, guess=guess, function=shape)
        told = simulate(quest, 100, answering(right, rng))
        fit = fit_threshold(
            [float(10 ** X[n]) for n, _ in told], [answer for _, answer in told], guess=guess, function=name
        )
        medians.append(quest.median[0] - true)
        means.append(quest.mean[0] - true)
        if fit.threshold is None or fit.threshold_interval is None:
            continue
        errors.append(np.log10(fit.threshold) - true)
        low, high = np.log10(fit.threshold_interval)
        covered += bool(low <= true <= high)
    print(
        f"\n{name} {slope:g}, guess {guess}: bias of the median {np.mean(medians):+.4f} (sd {np.std(medians):.3f}), "
        f"of the mean {np.mean(means):+.4f}, of the fit {np.mean(errors):+.4f}; covered {covered / len(errors):.3f}"
    )
    assert len(errors) > 0.98 * studies
    slack = 3 * np.sqrt(0.95 * 0.05 / studies)
    assert 0.93 - slack < covered / len(errors) < 0.97 + slack
    # The prior of lapses draws the fit's median below: -0.02 was measured, half of the error's standard deviation.
    assert abs(np.mean(errors)) < np.std(errors)
    assert abs(np.mean(medians)) < 0.02


@pytest.mark.parametrize(("up", "down"), [(1, 1), (3, 1), (7, 3), (1, 2)])
def test_long_staircases_come_to_their_share(up: int, down: int) -> None:
    rng, p = np.random.default_rng(2), np.linspace(0.0, 1.0, 101)
    told = simulate(Staircase(101, 50, up, down), 100_000, lambda level: bool(rng.random() < p[level]))
    assert np.mean([right for _, right in told]) == pytest.approx(up / (up + down), abs=0.005)


def test_ten_thousand_trials_narrow_the_interval() -> None:
    rng = np.random.default_rng(4)
    levels = 10 ** rng.choice(X, 10_000)
    right = rng.random(10_000) < FUNCTIONS["weibull"].probability(np.log10(levels), -1.0, 3.0, 0.5, 0.01)
    fit = fit_threshold(levels.tolist(), right.tolist())
    assert fit.threshold == pytest.approx(0.1, rel=0.06)
    assert known(fit.threshold_interval)[1] / known(fit.threshold_interval)[0] < 1.15


# The default keeps its level with few observers, alike or not, and the model's errors do not.

STUDIES = how_many(200, 600)
ERROR = (0.05 * 0.95 / STUDIES) ** 0.5  # standard error of 5 %
EQUAL = np.zeros(10)
HALVES = np.r_[np.ones(5), -np.ones(5)] / 2
POPULATIONS: dict[str, dict[str, Any]] = {
    "alike": {},
    "sd 0.7": {"observer_sd": 0.7},
    "sd 1.5": {"observer_sd": 1.5},
    "two items that divide": {"observer_sd": np.r_[1.5, 1.5, np.zeros(8)]},
    "two camps": {"camps": HALVES},
}


@pytest.mark.parametrize("share", [1.0, (0.2, 1.0)], ids=["all pairs", "some pairs"])
@pytest.mark.parametrize("observers", [5, 10, 30])
@pytest.mark.parametrize("population", POPULATIONS)
def test_the_default_seldom_reports_a_false_difference(population: str, observers: int, share: Any) -> None:
    found = decisions(Design(EQUAL, observers, share=share, **POPULATIONS[population]), studies=STUDIES)
    assert found.false_difference <= 0.05 + 3 * ERROR
    assert 0.93 <= found.differences <= 0.985
    assert 0.92 <= found.log10_scores <= 0.985
