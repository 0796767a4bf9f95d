"""Intervals, replicates, influence and stability: beside slow twins, SciPy, and simulated studies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import stats

from analysis.bootstrap import class_stability, intervals, resample, resample_groups, tails
from analysis.bootstrap.confidence_intervals import KINDS, Kind
from analysis.bootstrap.influence import influences, standard_errors
from analysis.bootstrap.replicates import NAMES, Name, Quantity, Replicates, counts_by_observer
from analysis.choices import Adjust, CovarianceChoice
from analysis.classes import classify
from analysis.comparisons import Answer, Comparisons, from_answers, split_groups
from analysis.covariance import contrast_variances, shrink
from analysis.covariance.laplacian import differences_of
from analysis.errors import ResultsError
from analysis.scaling import Counts, CovarianceKind, are_connected, fit, maximise, probabilities
from analysis.scaling.jeffreys import Jeffreys
from analysis.scaling.penalty import FIRTH
from analysis.scaling.profile import Profiles
from benchmarks.simulated_studies import Design, coverage, decisions
from documents.arrays import Floats
from tests.choice import nightly

# Small studies with answers of many observers.

Study = Callable[..., Comparisons]


@pytest.fixture(scope="session")
def study() -> Study:
    """Make every observer answer every pair once, each with strengths of their own about ``theta``."""

    def make(theta: Sequence[float], observers: int = 12, *, seed: int = 0, observer_sd: float = 0.5) -> Comparisons:
        random = np.random.default_rng(seed)
        answers = []
        for number in range(observers):
            own = np.asarray(theta) + random.normal(0, observer_sd, len(theta))
            for first in range(len(own)):
                for second in range(first):
                    ahead = random.random() < 1 / (1 + np.exp(own[second] - own[first]))
                    winner, loser = (first, second) if ahead else (second, first)
                    answers.append(Answer(f"item {winner}", f"item {loser}", observer=f"{number:02d}"))
        return from_answers(answers, [f"item {item}" for item in range(len(theta))])

    return make


# Intervals, replicates, influence and stability: beside slow twins, SciPy, and simulated studies.

STRENGTHS = (-0.8, -0.2, 0.1, 0.9)


@pytest.mark.promise("believable-scores")
def test_bca_is_that_of_scipy(study: Study) -> None:
    """The same replicates handed to scipy; its quantiles interpolate otherwise, by less than a rank."""
    found = resample(study(STRENGTHS, observers=20), replicates=4000)
    for item in (0, 3):

        def statistic(drawn: Floats, axis: int = -1) -> Floats:
            picked = drawn.astype(int)
            rows = picked.reshape(-1, picked.shape[-1])
            thetas = [fit(found.by_observer[row].sum(axis=0)).theta[item] for row in rows]  # noqa: B023 called at once
            return np.array(thetas).reshape(picked.shape[:-1])

        known = stats.bootstrap((np.arange(20.0),), statistic, n_resamples=600, vectorized=True, rng=5, method="BCa")
        ours = intervals(found, kind="bca")
        width = ours.high[item] - ours.low[item]
        assert ours.low[item] == pytest.approx(known.confidence_interval.low, abs=0.1 * width)
        assert ours.high[item] == pytest.approx(known.confidence_interval.high, abs=0.1 * width)


def test_bca_levels_by_hand() -> None:
    """No bias, no acceleration: nothing moves. Bias of 0.1 in z: 2 · 0.1 − 1.96 and 2 · 0.1 + 1.96."""
    none, some = np.array([0.0]), np.array([0.1])
    even, above = np.array([0.5]), np.asarray(stats.norm.cdf([0.1]))
    assert tails.bias_corrected(0.025, even, none) == pytest.approx([0.025])
    assert tails.bias_corrected(0.025, above, none) == pytest.approx(stats.norm.cdf([0.2 + stats.norm.ppf(0.025)]))
    z = stats.norm.ppf(0.975)
    assert tails.bias_corrected(0.975, even, some) == pytest.approx([stats.norm.cdf(z / (1 - 0.1 * z))])
    assert tails.bias_corrected(0.975, even, np.array([0.6])).tolist() == [1.0]
    assert tails.acceleration(np.array([[1.0, 0], [2, 0], [6, 0]])) == pytest.approx([(8 + 1 - 27) / 6 / 14**1.5, 0])


def test_widened_levels_make_up_for_few_observers() -> None:
    assert tails.widened(0.025, 15) == pytest.approx(stats.norm.cdf(np.sqrt(15 / 14) * stats.t.ppf(0.025, 14)))
    assert tails.widened(0.025, 10**6) == pytest.approx(0.025, abs=1e-5)


def test_replicates_without_a_value_lie_on_both_sides() -> None:
    values = np.arange(1.0, 90.0)[:, None]  # 89 values and 10 without: ranks of 99
    level = np.array([0.25])
    assert tails.lower(values, level, 10).tolist() == [15]  # rank 25, of which 10 lie below all
    assert tails.upper(values, 1 - level, 10).tolist() == [75]
    assert tails.lower(values, np.array([0.05]), 10).tolist() == [-np.inf]
    assert tails.upper(values, np.array([0.95]), 10).tolist() == [np.inf]
    assert tails.lower(values, np.array([0.001]), 0).tolist() == [1]
    assert tails.upper(values, np.array([0.999]), 0).tolist() == [89]
    assert tails.lower(np.empty((0, 1)), level, 5).tolist() == [-np.inf]
    endless = np.array([[-np.inf], [-np.inf], [0], [np.inf]])
    for rank, expected in ((1.5, -np.inf), (3, 0), (3.5, np.inf), (4, np.inf)):
        assert tails.upper(endless, np.array([rank / 5]), 0).tolist() == [expected]


def test_a_weak_link_leaves_intervals_open() -> None:
    """One draw in eight does not link c to the others: more than an interval of 95 % leaves outside on a side."""
    answers = [Answer("a", "b", observer="1"), Answer("b", "a", observer="2")]
    answers += [Answer("b", "c", observer="3"), Answer("c", "b", observer="4")]
    found = resample(from_answers(answers), replicates=400)
    for kind in ("percentile", "expanded", "bca", "expanded-bca", "studentised"):
        open_ended = intervals(found, "difference", kind=kind)
        assert np.isneginf(open_ended.low).all()
        assert np.isposinf(open_ended.high).all()
    assert intervals(found).without_fit > 0
    assert intervals(found).to_json()["intervals"][0]["low"] is None
    assert intervals(found, "score").low.tolist() == [0, 0, 0]


def test_separated_answers_reach_as_far_as_the_models_interval() -> None:
    """Item a wins every comparison of every observer: no draw tells how far ahead it is."""
    answers = [Answer("a", other, observer=str(person)) for person in range(8) for other in "bc"]
    answers += [Answer("b", "c", observer=str(person)) for person in range(0, 8, 2)]
    answers += [Answer("c", "b", observer=str(person)) for person in range(1, 8, 2)]
    found = resample(from_answers(answers), method="firth")
    assert found.whole_separated
    assert found.separated.all()
    model = intervals(found, kind="model")
    for kind in KINDS:
        ours = intervals(found, kind=kind)
        assert (ours.low <= model.low).all()
        assert (ours.high >= model.high).all()
        assert ours.whole_separated


@pytest.mark.parametrize(
    ("kind", "quantity"),
    [
        both if "score" in both or "expanded-bca" in both else pytest.param(*both, marks=pytest.mark.nightly)
        for both in product(KINDS, NAMES)
    ],
)
def test_what_must_hold_of_every_interval(
    study: Study, kind: Kind, quantity: Name, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = resample(study(STRENGTHS, observers=20), replicates=300)
    narrow, wide = (intervals(found, quantity, kind=kind, level=level) for level in (0.5, 0.95))
    monkeypatch.setattr("analysis.bootstrap.confidence_intervals.BLOCK_NUMBERS", 1)
    blocks = intervals(found, quantity, kind=kind)
    assert (wide.low <= narrow.low).all()
    assert (narrow.low < narrow.high).all()
    assert (narrow.high <= wide.high).all()
    assert blocks.low == pytest.approx(wide.low, abs=1e-12)
    assert len(wide.names) == len(wide.low) == (6 if quantity == "difference" else 4)
    if quantity == "score":
        assert (wide.low >= 0).all()
        assert (wide.high <= 1).all()
    assert [row["items"] for row in wide.to_json()["intervals"]] == [list(names) for names in wide.names]


@given(st.sampled_from(NAMES), st.lists(st.floats(-3, 3), min_size=3, max_size=5))
def test_slopes_are_those_of_the_values(name: Name, strengths: list[float]) -> None:
    theta = np.array(strengths)
    quantity = Quantity.of_items(name, len(theta))
    steps = np.eye(len(theta))
    found = quantity.slopes(theta[None], steps[None])[0]
    for step, slope in zip(steps, found, strict=True):
        numeric = (quantity.values(theta + 1e-5 * step) - quantity.values(theta - 1e-5 * step)) / 2e-5
        assert slope == pytest.approx(numeric, abs=1e-8)


def test_studentised_by_hand(study: Study) -> None:
    found = resample(study(STRENGTHS, observers=20), replicates=199)
    error = standard_errors(influences(found.by_observer, np.ones((1, 20)), found.fit.theta[None]), np.ones((1, 20)))[0]
    t = []
    for weights, theta in zip(found.weights, found.theta, strict=True):
        own = standard_errors(influences(found.by_observer, weights[None], theta[None]), weights[None])[0]
        t.append((theta - found.fit.theta) / own)
    ranked = np.sort(t, axis=0)
    ours = intervals(found, kind="studentised", level=0.9)
    assert ours.low == pytest.approx(found.fit.theta - ranked[189] * error, abs=1e-9)  # ranks 10 and 190 of 199
    assert ours.high == pytest.approx(found.fit.theta - ranked[9] * error, abs=1e-9)


def test_wrong_input_is_refused(study: Study) -> None:
    found = resample(study(STRENGTHS), replicates=10)
    with pytest.raises(ResultsError, match="no kind of interval 'wald'"):
        intervals(found, kind="wald")  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(ResultsError, match="no quantity 'worth'"):
        intervals(found, "worth")  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(ResultsError, match="level is 95"):
        intervals(found, level=95)


# The batched bootstrap against its slow twin, one replicate at a time, and against the binomial law.


def one_by_one(comparisons: Comparisons, weights: Floats) -> list[Floats]:
    """Count and fit each replicate on its own, answer by answer."""
    found = []
    for drawn in weights:
        wins = np.zeros_like(comparisons.wins)
        for line, person in enumerate(comparisons.observer):
            wins[comparisons.winner[line], comparisons.loser[line]] += comparisons.count[line] * drawn[person]
        plain = fit(wins)
        found.append(fit(wins, method="firth").theta if plain.separated else plain.theta)
    return found


def test_each_replicate_is_what_fitting_it_alone_gives(study: Study) -> None:
    comparisons = study((-2.0, -0.5, 0.2, 2.3), observers=9, seed=4)
    found = resample(comparisons, replicates=60)
    assert found.separated.any()
    assert not found.separated.all()
    assert found.theta == pytest.approx(np.array(one_by_one(comparisons, found.weights)), abs=1e-9)
    assert found.theta.sum(axis=1) == pytest.approx(np.zeros(60), abs=1e-9)


def test_the_left_out_are_the_fits_to_the_other_observers(study: Study) -> None:
    comparisons = study(STRENGTHS)
    found = resample(comparisons, replicates=1)
    assert found.left_out.theta == pytest.approx(np.array(one_by_one(comparisons, 1 - np.eye(12))), abs=1e-9)


def test_draws_that_no_memory_holds_are_refused(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    comparisons = study(STRENGTHS)
    monkeypatch.setattr("analysis.comparisons.comparisons.MOST_NUMBERS", 12 * 16 - 1)
    with pytest.raises(ResultsError, match="12 observers of 4 items"):
        resample(comparisons)
    assert comparisons.wins_by_observer(slice(0, 11)).shape == (11, 4, 4)


def test_blocks_change_nothing_and_a_seed_gives_the_same_again(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    comparisons = study(STRENGTHS)
    whole = resample(comparisons, replicates=100)
    with monkeypatch.context() as patch:
        patch.setattr("analysis.bootstrap.replicates.BLOCK_NUMBERS", 16 * 7)
        blocks = resample(comparisons, replicates=100)
    other = resample(comparisons, replicates=100, seed=1)
    assert (whole.weights == blocks.weights).all()
    assert blocks.left_out.theta == pytest.approx(whole.left_out.theta, abs=1e-12)
    assert whole.theta == pytest.approx(blocks.theta, abs=1e-12)
    assert (whole.weights != other.weights).any()
    assert (whole.weights.sum(axis=1) == 12).all()


@settings(max_examples=10, deadline=None)
@given(st.integers(2, 6), st.floats(-3, 9), st.integers(0, 2**32 - 1))
@example(3, 9.0, 3)  # separated: only rounding moves it at the end, by 1e-9
def test_batched_firth_is_firth(n: int, log10_count: float, seed: int) -> None:
    wins = 10**log10_count * np.random.default_rng(seed).integers(0, 3, (5, n, n)).astype(float)
    wins[:, np.arange(n), np.arange(n)] = 0
    wins[:, np.arange(n - 1), np.arange(1, n)] += 10**log10_count  # links all
    top = maximise(Counts.from_wins(wins), penalty=FIRTH)
    for theta, converged, counts in zip(top.theta, top.converged, wins, strict=True):
        assert converged
        assert theta == pytest.approx(fit(counts, method="firth").theta, abs=1e-7)


def test_draws_that_link_no_items_have_no_fit() -> None:
    """Two observers compared a with b and two b with c: one draw in eight leaves out either link."""
    answers = [Answer("a", "b", observer="1"), Answer("b", "a", observer="2")]
    answers += [Answer("b", "c", observer="3"), Answer("c", "b", observer="4")]
    found = resample(from_answers(answers), replicates=400)
    wins = np.tensordot(found.weights, found.by_observer, 1)
    assert (found.without_fit == ~are_connected(wins + wins.transpose(0, 2, 1))).all()
    assert found.without_fit.mean() == pytest.approx(1 / 8, abs=0.08)
    assert np.isnan(found.theta[found.without_fit]).all()
    assert np.isfinite(found.theta[~found.without_fit]).all()
    assert not (found.separated & found.without_fit).any()


def refused(comparisons: Comparisons, match: str, **options: int) -> Replicates | None:
    with pytest.raises(ResultsError, match=match):
        return resample(comparisons, **options)  # type: ignore[arg-type]  # only numbers are tried
    return None


def test_replicates_wrong_input_is_refused(study: Study) -> None:
    refused(study(STRENGTHS, observers=1), "one observer")
    refused(from_answers([Answer("a", "b"), Answer("b", "a")]), "no observer named")
    refused(study((-30.0, 0.0, 30.0), observers=3, observer_sd=0.0), "separated")
    refused(study(STRENGTHS), "0 replicates", replicates=0)


# The bootstrap of pairs within groups: the same observers are drawn for all of them.

PAIRS = ("ab", "ab", "ba", "bc", "bc", "cb", "ac", "ac", "ca")
ANSWERS = [
    Answer(
        pair[0 if (place + observer) % 4 else 1],
        pair[1 if (place + observer) % 4 else 0],
        observer=f"{observer:02}",
        group=group,
    )
    for observer in range(8)
    for group in ("church", "beach")
    for place, pair in enumerate(PAIRS)
]


def test_each_group_has_the_draws_of_its_own_answers() -> None:
    comparisons = from_answers(ANSWERS)
    drawn = resample_groups(comparisons, replicates=50, seed=3)
    assert [name for name, _ in drawn] == ["church", "beach"]
    for (_, part), (_, replicates) in zip(split_groups(comparisons), drawn, strict=True):
        alone = resample(part, replicates=50, seed=3)
        assert np.array_equal(replicates.theta, alone.theta, equal_nan=True)
        ends, own = (intervals(one, "theta") for one in (replicates, alone))
        assert np.array_equal(ends.low, own.low)
        assert class_stability(replicates).to_json() == class_stability(alone).to_json()


def test_observers_of_some_groups_are_drawn_with_all_others() -> None:
    some = from_answers([answer for answer in ANSWERS if answer.group == "church" or answer.observer > "01"])
    church, beach = (part for _, part in resample_groups(some, replicates=40, seed=4))
    assert beach.observers == church.observers[2:]
    assert np.array_equal(church.weights[:, 2:], beach.weights)


def test_a_group_without_a_fit_is_named() -> None:
    answers = [answer for answer in ANSWERS if answer.group == "church" or answer.loser != "a"]
    with pytest.raises(ResultsError, match="'beach': the items are separated"):
        resample_groups(from_answers(answers), replicates=5)


# Influence and sandwich against sums written out, and against leaving observers out.


def test_the_sandwich_is_bread_meat_bread(study: Study) -> None:
    by_observer, _ = counts_by_observer(study(STRENGTHS))
    weights = np.random.default_rng(1).integers(0, 3, 12).astype(float)
    wins = np.tensordot(weights, by_observer, 1)
    fitted = fit(wins)
    meat = np.zeros((4, 4))
    for counts, weight in zip(by_observer, weights, strict=True):
        slope = (counts - (counts + counts.T) * probabilities(fitted.theta)).sum(axis=1)
        meat += weight * np.outer(slope, slope)
    people = weights.sum()
    expected = people / (people - 1) * fitted.covariance @ meat @ fitted.covariance
    pulled = influences(by_observer, weights[None], fitted.theta[None])
    drawn = pulled[0] * np.sqrt(weights * people / (people - 1))[:, None]
    assert drawn.T @ drawn == pytest.approx(expected, abs=1e-12)
    assert standard_errors(pulled, weights[None])[0] == pytest.approx(np.sqrt(np.diag(expected)), abs=1e-12)


def test_an_influence_is_what_an_observer_more_or_less_changes(study: Study) -> None:
    by_observer, _ = counts_by_observer(study(STRENGTHS))
    total = by_observer.sum(axis=0)
    fitted = fit(total)
    pulled = influences(by_observer, np.ones((1, 12)), fitted.theta[None])[0]
    assert pulled.sum(axis=0) == pytest.approx(np.zeros(4), abs=1e-12)
    for counts, moved in zip(by_observer, pulled, strict=True):
        nudged = (fit(total + 1e-5 * counts).theta - fit(total - 1e-5 * counts).theta) / 2e-5
        assert moved == pytest.approx(nudged, abs=1e-6)


def test_observers_who_all_saw_other_pairs(study: Study) -> None:
    """Each observer answers one pair only: the expected part differs between observers."""
    by_observer = np.zeros((6, 3, 3))
    for person, (winner, loser) in enumerate([(0, 1), (1, 0), (1, 2), (2, 1), (0, 2), (2, 0)]):
        by_observer[person, winner, loser] = 1
    pulled = influences(by_observer, np.ones((1, 6)), np.zeros((1, 3)))
    # Two answers for each pair, all items equal: H is 1.5 times the identity on what sums to zero, and the slope ±1/2.
    assert pulled[0, 0] == pytest.approx([1 / 3, -1 / 3, 0])
    assert pulled[0, 3] == pytest.approx([0, -1 / 3, 1 / 3])


def test_observers_who_all_answer_alike_pull_nowhere() -> None:
    """After a penalised fit each alone has a slope; what is left of them about their mean is rounding, and is 0."""
    own = np.triu(np.ones((5, 5)), 1)
    theta = fit(13 * own, method="firth").theta
    assert not influences(np.tile(own, (13, 1, 1)), np.ones((1, 13)), theta[None]).any()


# Class stability against classifying each replicate on its own.

STABILITY_STRENGTHS = (-1.2, -0.9, 0.1, 0.5, 1.5)


@pytest.mark.parametrize(
    ("covariance", "adjust"),
    [("sandwich", "holm"), ("model", "bh"), *nightly(*product(("model", "scaled", "shrinkage"), ("none", "holm")))],
)
def test_it_is_what_classifying_each_replicate_gives(study: Study, covariance: CovarianceKind, adjust: Adjust) -> None:
    found = resample(study(STABILITY_STRENGTHS, observers=20), replicates=60)
    stability = class_stability(found, alpha=0.1, adjust=adjust, covariance=covariance)
    shared, labels = np.zeros((5, 5)), [Counter[str]() for _ in range(5)]
    counts = Counter[int]()
    for weights, theta, separated in zip(found.weights, found.theta, found.separated, strict=True):
        wins = np.tensordot(weights, found.by_observer, 1)
        spread, df = fit(wins, method="firth" if separated else "ml").covariance, None
        if covariance != "model":
            moved = influences(found.by_observer, weights[None], theta[None])[0]
            each = np.repeat(moved, weights.astype(int), axis=0) * np.sqrt(20 / 19)  # as often as they were drawn
            kind = "scaled" if separated else covariance
            own = shrink(spread[None], each[None], kind, freedom=19, at_least_model=kind == "scaled")
            spread, df = own.covariance[0], own.degrees_of_freedom()[0]
        pairs, counted = np.triu_indices(5, 1), Counts.from_wins(wins[None])
        model = contrast_variances(fit(wins, method="firth" if separated else "ml").covariance)[pairs]
        profiles = Profiles(
            Jeffreys(counted), theta, differences_of(5, *pairs), contrast_variances(spread)[pairs] / model, df
        )
        classes = classify(theta, spread, alpha=0.1, adjust=adjust, df=df, profiles=profiles)
        shared += [[bool(set(a.split("+")) & set(b.split("+"))) for b in classes.labels] for a in classes.labels]
        counts[len(classes.members)] += 1
        for label, met in zip(classes.labels, labels, strict=True):
            met[label] += 1
    assert stability.shared == pytest.approx(shared / 60)
    for label, share, met in zip(stability.labels, stability.label_shares, labels, strict=True):
        assert met[label] == max(met.values()) == pytest.approx(60 * share)
    assert stability.class_counts == dict(sorted(counts.items()))


def test_draws_without_a_fit_are_counted_and_left_out() -> None:
    answers = [Answer("a", "b", observer="1"), Answer("b", "a", observer="2")]
    answers += [Answer("b", "c", observer="3"), Answer("c", "b", observer="4")]
    stability = class_stability(resample(from_answers(answers), replicates=100))
    assert stability.without_fit > 0
    assert stability.shared[0, 0] == 1
    assert sum(stability.class_counts.values()) == 100 - stability.without_fit
    told = stability.to_json()
    assert told["without_fit"] == stability.without_fit
    assert [item["name"] for item in told["items"]] == ["a", "b", "c"]


def test_stability_wrong_input_is_refused(study: Study) -> None:
    found = resample(study(STABILITY_STRENGTHS), replicates=5)
    with pytest.raises(ResultsError, match="alpha"):
        class_stability(found, alpha=5)
    with pytest.raises(ResultsError, match="tukey"):
        class_stability(found, adjust="tukey")  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(ResultsError, match="robust"):
        class_stability(found, covariance="robust")  # type: ignore[arg-type]  # wrong on purpose


# Simulated studies: their truth, and a small calibration whose bounds fit its size.

# Medina 2016, Table 4.4.
THETA = np.log([0.0718, 0.0432, 0.0762, 0.2036, 0.0740, 0.2574, 0.0543, 0.0296, 0.0751, 0.1149])
CENTRED = THETA - THETA.mean()


def test_observers_who_are_alike_have_the_strengths_they_were_given() -> None:
    assert Design(CENTRED, 30).truth() == pytest.approx(CENTRED, abs=1e-9)


@pytest.mark.promise("level")
def test_the_default_interval_holds_the_truth_as_often_as_it_says_and_the_models_does_not() -> None:
    """Sixty studies of observers who differ: four standard errors, between studies, are about 3 %."""
    design = Design(CENTRED, 15, observer_sd=0.7)
    found = coverage(design, ["expanded-bca", "model"], ["difference"], studies=60, replicates=400)
    ours, model = found
    assert ours.standard_error < 0.01
    assert 0.92 < ours.covered < 0.98
    assert model.covered < 0.91
    assert ours.too_high + ours.too_low == pytest.approx(1 - ours.covered)
    assert ours.worst <= ours.covered


@pytest.mark.promise("level")
@pytest.mark.parametrize(
    ("covariance", "observer_sd", "least", "most"),
    # Four standard deviations of 5 % of 150 studies are 7 %.
    [
        ("auto", 0.7, 0.0, 0.12),
        ("model", 0.7, 0.14, 1.0),
        *nightly(("auto", 0.0, 0.0, 0.12), ("model", 0.0, 0.0, 0.12)),
    ],
)
def test_equal_items_are_seldom_told_apart(
    covariance: CovarianceChoice, observer_sd: float, least: float, most: float
) -> None:
    found = decisions(Design(np.zeros(10), 6, observer_sd), studies=150, covariance=covariance)
    assert least <= found.false_difference <= most
    if covariance == "auto":
        assert 0.92 < found.differences < 0.98


def test_camps_and_items_that_divide_observers_have_their_truth() -> None:
    design = Design(CENTRED, 20_000, np.r_[1.5, np.zeros(9)], camps=np.r_[0, 0.7, -0.7, np.zeros(7)])
    (by_observer,) = design.studies(1, seed=3)
    found = fit(by_observer.sum(axis=0))
    assert np.abs(found.theta - design.truth()).max() < 0.03
