"""The multiverse of analyses, chances of pairs, folds, residuals, equivalence and transitivity, beside slow twins."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from itertools import combinations, permutations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student

from analysis.choices import Adjust
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.comparisons.comparisons import from_arrays
from analysis.errors import ResultsError
from analysis.inference import (
    compare_models,
    equivalence,
    multiverse,
    pair_probabilities,
    pair_residuals,
    transitivity,
)
from analysis.inference.answer_residuals import answer_residuals
from analysis.inference.chances import Chance
from analysis.scaling import LAWS, Model, fit_model, parse_margin, score
from analysis.scaling.laws import NATS_PER_JND, STANDARD_DEVIATIONS_PER_JOD
from analysis.scaling.scores import classes_of
from tests.analysis.conftest import answers_of
from tests.analysis.slow_profiles import of_pair
from tests.choice import nightly
from tests.kept import known

# Simulated answers of observers who are alike, or each have their own strengths.

Maker = Callable[..., Comparisons]


@pytest.fixture
def make() -> Maker:
    """Every observer answers every pair ``repeats`` times by a law, either item first."""

    def make_answers(
        theta: NDArray[np.float64],
        observers: int = 8,
        *,
        model: Model = "bradley-terry",
        k: float = 0.0,
        sd: float = 0.0,
        repeats: int = 1,
        gaps: float = 0.0,
        seed: int = 1,
    ) -> Comparisons:
        random = np.random.default_rng(seed)
        n = len(theta)
        first, second = (np.tile(np.repeat(side, repeats), observers) for side in np.triu_indices(n, 1))
        observer = np.repeat(np.arange(observers), len(first) // observers)
        own = theta + random.normal(0, sd, (observers, n))
        d = own[observer, first] - own[observer, second]
        chances = np.cumsum(np.stack(LAWS[model].probabilities(d, k)), axis=0)
        outcome = (random.random(len(d)) > chances[:2]).sum(axis=0)
        kept = random.random(len(d)) >= gaps
        lost = outcome == 1
        winner, loser = np.where(lost, second, first)[kept], np.where(lost, first, second)[kept]
        return from_arrays(
            tuple("abcdefghijklmnopqrstuvwxyz"[:n]),
            tuple(f"{person:02d}" for person in range(observers)),
            winner=winner,
            loser=loser,
            observer=observer[kept],
            count=np.ones(len(winner)),
            winner_was_first=random.integers(0, 2, len(winner)).astype(np.int8),
            tie=(outcome == 2)[kept],
        )

    return make_answers


# The multiverse of analyses, chances of pairs, folds, residuals, equivalence and transitivity, beside slow twins.


def without(comparisons: Comparisons, person: str) -> Comparisons:
    return from_answers([one for one in answers_of(comparisons) if one.observer != person], comparisons.items)


@pytest.mark.parametrize("ties", [False, *nightly(True)])
def test_beside_one_by_one(make: Maker, ties: bool) -> None:
    theta = np.array([1.2, 0.4, 0.0, -1.3])
    comparisons = make(theta, 5, model="davidson" if ties else "bradley-terry", k=-0.5, sd=0.4, repeats=4)
    scores = score(comparisons)
    result = multiverse(scores, adjustments=["none", "holm", "bh"])
    assert not result.skipped
    assert len(result.analyses) == (4 if ties else 2) * 4 * 3 * 6
    assert (result.fits, result.fits + result.fits_spared) == ((4 if ties else 2) * 6, len(result.analyses))
    names = [comparisons.items[item] for item in scores.order]
    agree: Counter[tuple[str, str]] = Counter()
    for analysis in result.analyses:
        rest = comparisons
        if analysis.left_out != "nobody":
            rest = without(comparisons, analysis.left_out.removeprefix("observer "))
        fit = fit_model(rest, analysis.model, covariance=analysis.covariance)
        slow = known(classes_of(fit, adjust=analysis.adjust))
        assert analysis.labels == tuple(slow.labels[item] for item in scores.order)
        assert analysis.number == len(slow.members)
        for pair in result.pairs:
            i, j = (comparisons.items.index(name) for name in (pair.first, pair.second))
            differs = slow.p[i, j] <= 0.05
            agree[pair.first, pair.second] += differs == pair.differs and (not differs or fit.theta[i] > fit.theta[j])
    for pair in result.pairs:
        i, j = (comparisons.items.index(name) for name in (pair.first, pair.second))
        assert scores.fit.theta[i] > scores.fit.theta[j]
        assert pair.differs == (known(scores.classes).p[i, j] <= 0.05)
        assert pair.stands == pytest.approx(agree[pair.first, pair.second] / len(result.analyses))
    for place, item in enumerate(result.by_item):
        same = [analysis.labels[place] == item.label for analysis in result.analyses]
        assert item.name == names[place]
        assert item.stands == pytest.approx(np.mean(same))
    assert sum(result.numbers.values()) == len(result.analyses)
    assert 0 < min(pair.stands for pair in result.pairs) < 1
    shares = [choice.stands for choice in result.choices if choice.choice == "left_out"]
    assert shares == sorted(shares)
    assert len(shares) == 6


def test_the_chosen_analysis_is_one_of_them(make: Maker) -> None:
    comparisons = make(np.array([0.9, 0.2, -0.3, -0.9]), 9, repeats=3)
    for covariance in ("model", "sandwich"):
        scores = score(comparisons, "thurstone", covariance=covariance, adjust="bh")
        result = multiverse(scores, models=["thurstone"], adjustments=["bh"])
        own = next(a for a in result.analyses if a.left_out == "nobody" and a.covariance == covariance)
        assert own.adjust == "bh"
        assert len(own.labels) == 4
        assert result.to_json()["number_of_classes"]["chosen"] == result.number


def test_separated_rows_are_skipped_and_named() -> None:
    """Only observer 2 ever prefers c."""
    lines = [Answer(w, x, 2, o) for o in "123456" for w, x in ("ab", "ba", "ac", "bc")]
    lines += [Answer("c", "a", 1, "2"), Answer("c", "b", 1, "2")]
    result = multiverse(score(from_answers(lines)))
    assert {name for name, _ in result.skipped} == {
        "bradley-terry, observer 2 left out",
        "thurstone, observer 2 left out",
    }
    assert "'c'" in result.skipped[0][1]
    assert len(result.analyses) == 2 * 4 * 4 * 6


def test_without_observers_there_is_one_fit_for_each_law() -> None:
    votes = {"ab": 30, "ba": 10, "bc": 30, "cb": 11, "ac": 35, "ca": 8}
    result = multiverse(score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()])))
    assert (result.fits, len(result.analyses), result.number_stands) == (2, 8, 1.0)
    assert all(pair.stands == 1 for pair in result.pairs)


def test_many_observers_are_left_out_in_parts(make: Maker) -> None:
    result = multiverse(score(make(np.array([0.5, 0.0, -0.5]), 101)), models=["bradley-terry"], adjustments=["none"])
    assert result.fits == 21
    assert {a.left_out for a in result.analyses} >= {"nobody", "part 20 of 20 of the observers"}


def test_refusals(make: Maker) -> None:
    scores = score(make(np.zeros(3)))
    with pytest.raises(ResultsError, match="there is no model 'logit'"):
        multiverse(scores, models=["logit"])
    with pytest.raises(ResultsError, match="there is no 'hom'"):
        multiverse(scores, adjustments=["hom"])  # type: ignore[list-item]  # wrong on purpose
    with pytest.raises(ResultsError, match="separated"):
        multiverse(score(from_answers([Answer("a", "b", 3)])))
    with pytest.raises(ResultsError, match="No answer is a tie"):
        multiverse(scores, models=["davidson"])


def test_conclusions_of_a_minority_are_named_and_those_of_all_are_not(make: Maker) -> None:
    comparisons = make(np.array([0.45, 0.1, -0.1, -0.45]), 8, sd=0.7, repeats=3)
    lone = multiverse(score(comparisons, covariance="model", adjust="none"), adjustments=["holm"])
    few = [pair for pair in lone.pairs if pair.stands < 0.5]
    assert few
    assert all(pair.differs for pair in few)
    assert f"{len(few)} of 6 verdicts on pairs" in lone.warning
    assert lone.warning in lone.sentence
    assert lone.to_json()["warning"] == lone.warning
    clear = multiverse(score(make(np.array([1.5, 0.0, -1.5]), 12, repeats=9)), adjustments=["holm"])
    assert clear.warning == ""
    assert clear.sentence.endswith(".")


# Chances of pairs, beside the same by sampling the estimates.


def ends_of(chance: Chance) -> tuple[float, float]:
    return chance.low, chance.high


THETA = np.array([0.8, 0.3, -0.1, -1.0])


def test_two_items_by_hand() -> None:
    pair = pair_probabilities(score(from_answers([Answer("a", "b", 30), Answer("b", "a", 10)]))).pairs[0]
    d, se = np.log(3), np.sqrt(1 / 30 + 1 / 10)
    assert pair.first_preferred.value == pytest.approx(0.75, abs=1e-12)
    low, high = of_pair(np.array([[0.0, 30.0], [10.0, 0.0]]), 0, 1).interval(norm.ppf(0.975))
    assert (pair.low, pair.high) == pytest.approx((low, high), abs=1e-7)
    assert pair.se == pytest.approx(se)
    assert (pair.low, pair.high) == pytest.approx((d - 1.96 * se, d + 1.96 * se), abs=0.1)
    ends = 1 / (1 + np.exp(-np.array([low, high])))
    assert ends_of(pair.first_preferred) == pytest.approx(tuple(ends), abs=1e-8)
    assert ends_of(pair.second_preferred) == pytest.approx(tuple(1 - ends[::-1]), abs=1e-8)
    assert pair.tie is None


def test_the_sandwich_has_students_law(make: Maker) -> None:
    answers = make(THETA, 6, gaps=0.1)
    scores, model = score(answers, covariance="sandwich"), score(answers, covariance="model").fit.covariance
    result = pair_probabilities(scores, level=0.9)
    names, covariance = scores.comparisons.items, scores.fit.covariance
    assert len(result.pairs) == 6
    for pair in result.pairs:
        i, j = names.index(pair.first), names.index(pair.second)
        assert scores.fit.theta[i] >= scores.fit.theta[j] - 1e-12
        own, plain = (of[i, i] + of[j, j] - 2 * of[i, j] for of in (covariance, model))
        reach = student.ppf(0.95, known(pair.df)) * np.sqrt(own / plain)
        low, high = of_pair(answers.wins, i, j).interval(reach)
        d = scores.fit.theta[i] - scores.fit.theta[j]
        assert (pair.low, pair.high) == pytest.approx((min(low, d), max(high, d)), abs=1e-6)
        assert pair.first_preferred.low == pytest.approx(1 / (1 + np.exp(-min(low, d))), abs=1e-6)


def test_thurstone_goes_through_the_normal_law(make: Maker) -> None:
    scores = score(make(THETA, 12), "thurstone")
    for pair in pair_probabilities(scores).pairs:
        assert pair.first_preferred.value == pytest.approx(norm.cdf(pair.difference), abs=1e-12)
        ends = norm.cdf(pair.low), norm.cdf(pair.high)
        assert ends_of(pair.first_preferred) == pytest.approx(ends, abs=1e-12)


@pytest.mark.parametrize("model", ["davidson", "rao-kupper"])
def test_ties_beside_sampled_estimates(make: Maker, model: Model) -> None:
    scores = score(make(THETA, 60, model=model, k=0.4, repeats=10), model)
    fit, law = scores.fit, LAWS[model]
    n = fit.counts.n
    random = np.random.default_rng(3)
    centre = np.r_[fit.theta, fit.parameters[0].estimate]
    drawn = random.multivariate_normal(centre, fit.joint_covariance, 40_000)
    for pair in pair_probabilities(scores).pairs:
        i, j = (scores.comparisons.items.index(name) for name in (pair.first, pair.second))
        sampled = law.probabilities(drawn[:, i] - drawn[:, j], drawn[:, n])
        exact = law.probabilities(np.array([pair.difference]), centre[n])
        shown = [pair.first_preferred, pair.second_preferred, known(pair.tie)]
        assert sum(chance.value for chance in shown) == pytest.approx(1, abs=1e-12)
        for chance, values, true in zip(shown, sampled, exact, strict=True):
            assert chance.value == pytest.approx(true[0], abs=1e-12)
            # Normal estimates on a scale that is not quite straight: a twentieth of the interval's length.
            slack = 0.05 * (chance.high - chance.low)
            assert ends_of(chance) == pytest.approx(tuple(np.quantile(values, [0.025, 0.975])), abs=slack)


def test_observers_who_all_agree_leave_the_chance_open() -> None:
    votes = [Answer("a", "b", 3, f"{o}") for o in range(4)] + [Answer("b", "a", 1, f"{o}") for o in range(4)]
    result = pair_probabilities(score(from_answers(votes), covariance="sandwich"))
    assert ends_of(result.pairs[0].first_preferred) == (0.0, 1.0)
    assert result.to_json()["pairs"][0]["high"] is None


def test_separated_items_have_no_chances() -> None:
    scores = score(from_answers([Answer("a", "b", 3)]))
    with pytest.raises(ResultsError, match="separated"):
        pair_probabilities(scores)
    with pytest.raises(ResultsError, match="alpha is"):
        pair_probabilities(score(from_answers([Answer("a", "b", 3), Answer("b", "a")])), level=1.5)


# Cross-validation over observers, beside fitting and predicting one by one.

FOLDS_THETA = np.array([0.9, 0.3, -0.2, -1.0])


def slowly(comparisons: Comparisons, model: Model, order_effect: bool) -> dict[str, float]:
    """Return the log probability of each observer's answers by a fit without them, answer by answer."""
    law, lines = LAWS[model], answers_of(comparisons)
    totals = {}
    for person in comparisons.observers:
        rest = [line for line in lines if line.observer != person]
        fit = fit_model(from_answers(rest, comparisons.items), model, order_effect=order_effect)
        values = {parameter.name: parameter.estimate for parameter in fit.parameters}
        share = (sum(line.tie for line in rest) + 0.5) / (len(rest) + 1)
        total = 0.0
        for line in (line for line in lines if line.observer == person):
            i, j = (comparisons.items.index(name) for name in (line.winner, line.loser))
            side = values.get("order", 0.0) * (1 if line.first == line.winner else -1)
            d = np.array([fit.theta[i] - fit.theta[j] + side])
            won, _, tied = (float(p[0]) for p in law.probabilities(d, values.get(law.parameter or "", 0.0)))
            if law.parameter or not comparisons.ties:
                total += np.log(tied if line.tie else won)
            else:
                total += np.log(share if line.tie else (1 - share) * won)
        totals[person] = total
    return totals


@pytest.mark.parametrize("ties", [False, True])
def test_folds_beside_one_by_one(make: Maker, ties: bool) -> None:
    comparisons = make(FOLDS_THETA, 6, model="davidson" if ties else "bradley-terry", k=-0.5, repeats=3)
    result = compare_models(comparisons)
    assert len(result.models) == (8 if ties else 4)
    assert (result.folds, result.penalised_folds, result.left_out) == (6, 0, ())
    slow = {(m.model, m.order_effect): slowly(comparisons, m.model, m.order_effect) for m in result.models}
    best = slow[result.models[0].model, result.models[0].order_effect]
    for column, line in enumerate(result.models):
        own = slow[line.model, line.order_effect]
        assert result.by_observer[:, column] == pytest.approx([own[o] for o in comparisons.observers], abs=1e-8)
        assert line.log_likelihood == pytest.approx(sum(own.values()), abs=1e-8)
        behind = [own[person] - best[person] for person in own]
        assert line.difference == pytest.approx(np.mean(behind), abs=1e-9)
        assert line.difference_se == pytest.approx(np.std(behind, ddof=1) / np.sqrt(6), abs=1e-9)
    assert [m.log_likelihood for m in result.models] == sorted((m.log_likelihood for m in result.models), reverse=True)


def test_an_order_effect_is_seen(make: Maker) -> None:
    plain = make(np.zeros(4), 20, repeats=2)
    lines = [
        Answer(a.winner, a.loser, 1, a.observer, a.winner if number % 5 else a.loser)
        for number, a in enumerate(answers_of(plain))
    ]
    result = compare_models(from_answers(lines, plain.items), ["bradley-terry"])
    assert result.models[0].order_effect
    assert result.models[1].difference + 2 * result.models[1].difference_se < 0
    assert "clearly worse: bradley-terry." in result.sentence
    assert result.models[0].per_answer > result.chance > result.models[1].per_answer


def test_separated_folds_are_fitted_under_a_prior() -> None:
    """Without observer 3 nobody prefers c."""
    lines = [Answer(w, x, 1, o) for o in "12345" for w, x in ("ab", "ba", "ac", "bc", "ac")]
    lines += [Answer("c", "a", 1, "3"), Answer("c", "b", 1, "3")]
    result = compare_models(from_answers(lines))
    assert result.penalised_folds == 1
    assert np.isfinite(result.by_observer).all()
    everywhere = compare_models(from_answers([line for line in lines if line.winner != "c"]))
    assert everywhere.penalised_folds == 5
    assert len(everywhere.models) == 2


def test_a_model_that_cannot_be_fitted_is_named() -> None:
    """Each pair was shown in one order only."""
    votes = {"1": "abbcac", "2": "bacbca", "3": "abcbac", "4": "babcca"}
    lines = [Answer(v[i], v[i + 1], 1, o, min(v[i], v[i + 1])) for o, v in votes.items() for i in (0, 2)]
    result = compare_models(from_answers(lines))
    assert {name for name, _ in result.left_out} == {"bradley-terry with order effect", "thurstone with order effect"}
    assert "only shown in one order" in result.left_out[0][1]


def test_folds_refusals(make: Maker) -> None:
    comparisons = make(FOLDS_THETA, 4)
    for wrong, words in (({"folds": 5}, "5 folds"), ({"models": ["logit"]}, "no model 'logit'")):
        with pytest.raises(ResultsError, match=words):
            compare_models(comparisons, **wrong)
    with pytest.raises(ResultsError, match="there are 2"):
        compare_models(make(FOLDS_THETA, 2))
    with pytest.raises(ResultsError, match="No answer is a tie"):
        compare_models(comparisons, ["davidson"])


# Residuals of pairs, beside score tests of a parameter for each pair and refitted simulations.

FIT_OF_PAIRS_THETA = np.array([0.9, 0.3, 0.0, -0.4, -0.8])


def score_statistic(comparisons: Comparisons, theta: NDArray[np.float64], first: int, second: int) -> float:
    """Rao's statistic of a parameter that belongs to one pair alone, by dense matrices."""
    n = len(theta)
    information, slope = np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    wins = comparisons.wins
    for i in range(n):
        for j in range(i + 1, n):
            x = np.zeros(n + 1)
            x[i], x[j], x[n] = 1, -1, float({i, j} == {first, second})
            p = 1 / (1 + np.exp(theta[j] - theta[i]))
            total = wins[i, j] + wins[j, i]
            information += total * p * (1 - p) * np.outer(x, x)
            slope += (wins[i, j] - total * p) * x
    left = information[n, n] - information[n, :n] @ np.linalg.pinv(information[:n, :n]) @ information[:n, n]
    return float(slope[n] ** 2 / left)


def test_model_z_is_the_root_of_the_score_test(make: Maker) -> None:
    comparisons = make(FIT_OF_PAIRS_THETA, 9, gaps=0.3)
    scores = score(comparisons)
    result = pair_residuals(scores)
    assert len(result.pairs) == 10
    for pair in result.pairs:
        i, j = (comparisons.items.index(name) for name in (pair.first, pair.second))
        assert known(pair.model_z) ** 2 == pytest.approx(score_statistic(comparisons, scores.fit.theta, i, j), rel=1e-8)
        wins = comparisons.wins
        assert pair.observed == pytest.approx(wins[i, j] / (wins[i, j] + wins[j, i]))
        assert pair.expected == pytest.approx(1 / (1 + np.exp(scores.fit.theta[j] - scores.fit.theta[i])))
        assert pair.observed >= pair.expected


@pytest.mark.parametrize(
    ("model", "order"), [("bradley-terry", True), ("thurstone", False), ("davidson", True), ("rao-kupper", False)]
)
def test_drawn_residuals_beside_refitted_ones(make: Maker, model: Model, order: bool) -> None:
    k = 0.4 if model in ("davidson", "rao-kupper") else 0.0
    comparisons = make(FIT_OF_PAIRS_THETA[:4], 30, model=model, k=k, repeats=4)
    scores = score(comparisons, model, order_effect=order)
    own = answer_residuals(scores)
    assert own.by_observer.sum(axis=0) == pytest.approx(own.residual, abs=1e-8)
    drawn = own.drawn(4000, np.random.default_rng(1))
    variance = own.total * own.variance
    slopes = own.total[:, None] * own.mean_slopes
    expected = np.diag(variance) - slopes @ own.inverse @ slopes.T
    # The law's own information is the expected one, and A the observed one: near each other with 720 answers.
    assert np.cov(drawn.T) == pytest.approx(expected, abs=0.1 * variance.max())
    # Leverage is out: no residual moves the strengths.
    sums = np.stack([drawn[:, own.counts.first == 0].sum(axis=1) - drawn[:, own.counts.second == 0].sum(axis=1)])
    if model in ("bradley-terry", "davidson"):
        assert np.abs(sums).max() < 1e-9 * variance.sum()


def test_a_pair_that_goes_its_own_way_is_named(make: Maker) -> None:
    comparisons = make(np.zeros(5), 20, repeats=2)
    assert not pair_residuals(score(comparisons)).flagged
    answers = [one for one in answers_of(comparisons) if {one.winner, one.loser} != {"b", "d"}]
    answers += [Answer("b", "d", 2 - (o == 3), f"{o:02d}") for o in range(20)] + [Answer("d", "b", 1, "03")]
    result = pair_residuals(score(from_answers(answers)))
    assert (result.flagged[0].first, result.flagged[0].second) == ("b", "d")
    assert all({pair.first, pair.second} & {"b", "d"} for pair in result.flagged)  # they bear what the pair pulls
    assert "b over d" in result.sentence
    assert result.to_json()["flagged"] == len(result.flagged) < 5


def test_observers_who_disagree_widen_the_errors() -> None:
    """Each observer always gives the same answer to a pair: twenty answers are worth one."""
    random = np.random.default_rng(5)
    answers = []
    for observer in range(12):
        for first, second in ("ab", "ac", "ad", "bc", "bd", "cd"):
            winner, loser = (first, second) if random.random() < 0.5 else (second, first)
            answers.append(Answer(winner, loser, 20, f"{observer}"))
    result = pair_residuals(score(from_answers(answers)))
    assert 10 < result.overdispersion < 40
    assert not result.flagged
    assert any(pair.model_z is not None and pair.model_z > 4 for pair in result.pairs)
    assert all(
        pair.z is not None and pair.observers_z is not None and pair.z <= pair.observers_z + 1e-9
        for pair in result.pairs
    )


def test_a_pair_that_fits_itself_has_no_residual() -> None:
    votes = {"ab": 5, "ba": 3, "bc": 4, "cb": 4, "ac": 3, "ca": 2, "cd": 6, "dc": 2}
    result = pair_residuals(score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()])))
    bridge = next(pair for pair in result.pairs if "d" in (pair.first, pair.second))
    assert (bridge.z, bridge.p, bridge.flagged) == (None, None, False)
    assert bridge.leverage == pytest.approx(1)
    assert result.overdispersion == 1


def test_fit_of_pairs_refusals(make: Maker) -> None:
    with pytest.raises(ResultsError, match="no correction"):
        pair_residuals(score(make(FIT_OF_PAIRS_THETA)), adjust="maxz")  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(ResultsError, match="separated"):
        pair_residuals(score(from_answers([Answer("a", "b", 3)])))


# Equivalence by two one-sided tests, beside the interval that they amount to.


def test_margins() -> None:
    assert parse_margin("1jnd") == NATS_PER_JND == pytest.approx(parse_margin("75:25"))
    assert parse_margin(" 1 JOD", "thurstone") == STANDARD_DEVIATIONS_PER_JOD
    assert parse_margin("0.75", "thurstone") == pytest.approx(STANDARD_DEVIATIONS_PER_JOD)
    assert parse_margin("55:45") == pytest.approx(parse_margin("55 %")) == pytest.approx(np.log(55 / 45))
    assert parse_margin("0.2 nat") == parse_margin("0.2sd", "thurstone") == 0.2


@pytest.mark.parametrize(
    "text", ["", "jnd", "45:55", "0.5", "1", "0jnd", "-1jnd", "1e999nats", "nan", "1..2nats", "1m"]
)
def test_a_margin_that_is_none(text: str) -> None:
    with pytest.raises(ResultsError, match="the margin is") as caught:
        parse_margin(text)
    assert "0.5jnd" in str(caught.value)


def test_the_unit_belongs_to_the_law() -> None:
    with pytest.raises(ResultsError, match="are in sd"):
        parse_margin("0.2nats", "thurstone")
    with pytest.raises(ResultsError, match="are in nats"):
        parse_margin("0.2sd")


def test_uncorrected_it_is_the_interval_of_twice_the_level(make: Maker) -> None:
    scores = score(make(np.array([0.5, 0.2, 0.1, -0.5]), 25, repeats=6), covariance="sandwich")
    intervals = pair_probabilities(scores, level=0.9)
    seen = set()
    for margin in (0.2, 0.5, 1.3):
        for pair, interval in zip(equivalence(scores, margin, adjust="none").pairs, intervals.pairs, strict=True):
            within = -margin < interval.low and interval.high < margin
            assert (pair.verdict == "equivalent") == within
            seen.add((pair.verdict, pair.is_different))
    assert {("equivalent", False), ("equivalent", True), ("distinguished", True), ("not distinguished", False)} <= seen


def test_holm_by_hand(make: Maker) -> None:
    answers = make(np.array([0.1, 0.0, -0.1]), 40)
    scores, model = score(answers, covariance="sandwich"), score(answers, covariance="model").fit.covariance
    result = equivalence(scores, "1jnd")
    fit, names = scores.fit, scores.comparisons.items
    plain = []
    for pair in result.pairs:
        i, j = names.index(pair.first), names.index(pair.second)
        own, by_model = (of[i, i] + of[j, j] - 2 * of[i, j] for of in (fit.covariance, model))
        twin, spread = of_pair(answers.wins, i, j), np.sqrt(own / by_model)
        above, below = twin.root(-NATS_PER_JND) / spread, -twin.root(NATS_PER_JND) / spread
        plain.append(max(student.sf(above, 39), student.sf(below, 39)))
    order = np.argsort(plain)
    steps, largest = {}, 0.0
    for place, index in enumerate(order):
        largest = max(largest, plain[index] * (3 - place))
        steps[index] = largest
    for index, pair in enumerate(result.pairs):
        assert pair.p_equivalent == pytest.approx(min(1, steps[index]), rel=1e-6)
    assert result.count("equivalent") + result.count("distinguished") + result.count("not distinguished") == 3
    assert "of 3 pairs are equivalent" in result.sentence


def test_no_spread_is_no_evidence() -> None:
    votes = [Answer("a", "b", 3, f"{o}") for o in range(4)] + [Answer("b", "a", 1, f"{o}") for o in range(4)]
    pair = equivalence(score(from_answers(votes), covariance="sandwich"), "3jnd").pairs[0]
    assert (pair.verdict, pair.p_equivalent) == ("not distinguished", 1.0)
    assert pair.p_different == pytest.approx(2 / 2**4)  # four who agree, by exchanging the two items


def test_tost_refusals(make: Maker) -> None:
    scores = score(make(np.zeros(3)), adjust="maxz")
    assert equivalence(scores, "1jnd").adjust == "holm"
    with pytest.raises(ResultsError, match="no correction 'maxz'"):
        equivalence(scores, "1jnd", adjust="maxz")
    wrong: Adjust = "none"
    with pytest.raises(ResultsError, match="the margin is -1"):
        equivalence(scores, -1.0, adjust=wrong)
    with pytest.raises(ResultsError, match="alpha"):
        equivalence(scores, 1.0, alpha=2)


# Stochastic transitivity, beside counting by fractions and loops.


def by_loops(comparisons: Comparisons) -> tuple[int, list[int], list[float], set[frozenset[str]]]:
    """Return the number of triples, how many break each property and by how much, and which break the strong one."""
    wins, ties, names = comparisons.wins, comparisons.tie_counts, comparisons.items
    half = Fraction(1, 2)

    def share(i: int, j: int) -> Fraction:
        total = Fraction(wins[i, j] + wins[j, i] + ties[i, j])
        return (Fraction(wins[i, j]) + Fraction(ties[i, j]) / 2) / total

    number, counts, which = 0, [0, 0, 0], set()
    short = [Fraction(0)] * 3
    for triple in combinations(range(len(names)), 3):
        if any(not (wins[i, j] + wins[j, i] + ties[i, j]) for i, j in combinations(triple, 2)):
            continue
        number += 1
        worst = [Fraction(0)] * 3
        for a, b, c in permutations(triple):
            ab, bc, ac = share(a, b), share(b, c), share(a, c)
            if ab >= half and bc >= half:
                for kind, bound in enumerate((half, min(ab, bc), max(ab, bc))):
                    worst[kind] = max(worst[kind], bound - ac)
        counts = [count + (fall > 0) for count, fall in zip(counts, worst, strict=True)]
        short = [total + fall for total, fall in zip(short, worst, strict=True)]
        if worst[2]:
            which.add(frozenset(names[item] for item in triple))
    return number, counts, [float(total) for total in short], which


@pytest.mark.parametrize(("gaps", "model"), [(0.0, "bradley-terry"), (0.6, "bradley-terry"), (0.3, "davidson")])
def test_counts_beside_loops(make: Maker, gaps: float, model: str) -> None:
    comparisons = make(np.linspace(-0.6, 0.6, 7), 4, gaps=gaps, model=model, k=-0.2, seed=3)
    result = known(transitivity(score(comparisons, model, method="map"), replicates=50))
    number, counts, short, which = by_loops(comparisons)
    assert result.triples == number
    assert [test.broken for test in result.properties] == counts
    assert [test.shortfall for test in result.properties] == pytest.approx(short, abs=1e-9)
    assert {frozenset(triple.items) for triple in result.broken} == which
    if not gaps:
        assert number == 35
    assert 0 < counts[0] < counts[2]
    for triple in result.broken:
        ab, bc, ac = triple.shares
        assert min(ab, bc) >= 0.5
        assert triple.depth == pytest.approx(max(ab, bc) - ac)
        assert triple.depth > 0
    assert sum(times for _, _, times in result.pairs) == len(which)


def test_shares_that_are_equal_break_nothing() -> None:
    votes = {"ab": 3, "ba": 1, "bc": 6, "cb": 2, "ac": 9, "ca": 3}  # all 3 of 4: equal to the larger is strong enough
    result = transitivity(
        score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()])), replicates=20
    )
    assert result is not None
    assert [test.broken for test in result.properties] == [0, 0, 0]
    assert result.broken == ()


def test_a_planted_circle_is_more_than_chance(make: Maker) -> None:
    plain = make(np.array([1.5, 0.9, 0.3, -0.3, -0.9, -1.5]), 25)
    within = known(transitivity(score(plain), replicates=400))
    assert not any(test.exceeds for test in within.properties)
    worst, best = plain.items[5], plain.items[0]
    answers = [one for one in answers_of(plain) if {one.winner, one.loser} != {worst, best}]
    answers += [Answer(worst, best, 1, observer) for observer in plain.observers]
    result = known(transitivity(score(from_answers(answers, plain.items)), replicates=400))
    assert result.weak.broken >= 4
    assert result.weak.exceeds
    assert result.pairs[0][:2] == (best, worst)
    assert "Distinguished from chance: weak" in result.sentence
    assert result.weak.expected < 2


def test_without_observers_or_triples(make: Maker) -> None:
    votes = {"ab": 3, "ba": 1, "bc": 6, "cb": 2}
    assert transitivity(score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()]))) is None
    votes |= {"ac": 3, "ca": 2}
    result = transitivity(
        score(from_answers([Answer(pair[0], pair[1], count) for pair, count in votes.items()])), replicates=30
    )
    assert result is not None
    assert result.strong.p_observers is None
    with pytest.raises(ResultsError, match="0 replicates"):
        transitivity(score(make(np.zeros(3))), replicates=0)
