"""JOD as pwcmp has them, with intervals, and observers who differ."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom, norm

from analysis.bootstrap import draw_observers
from analysis.choices import DistancePrior
from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.scaling import LAWS
from cyclopean.testing import prove_method
from documents.arrays import Floats
from extensions.inference import PRIORS, all_pairs, fit_jod, scale_jod
from tests.choice import nightly

# JOD as pwcmp has them: published results, and its objective written out plainly.

Scenes = dict[str, tuple[Floats, Floats]]

# pwcmp's third example [Pwcmp]: how often 18 observers preferred each of seven tone mappers (row) over each other one,
# counted from its answers, and the JOD that its authors computed from them in 2017, as they stand in its results.
PUBLISHED: dict[str, tuple[list[list[int]], list[float]]] = {
    "corridor": (
        [
            [0, 13, 7, 3, 10, 7, 1],
            [1, 0, 2, 1, 3, 3, 0],
            [8, 7, 0, 3, 11, 10, 7],
            [10, 6, 5, 0, 8, 7, 5],
            [2, 11, 1, 1, 0, 6, 0],
            [7, 10, 4, 3, 10, 0, 1],
            [15, 8, 9, 9, 10, 11, 0],
        ],
        [0.0152347, -1.5754154, 0.5496967, 0.8194522, -0.9767279, -0.2900205, 1.4565086],
    ),
    "exhibition": (
        [
            [0, 10, 0, 3, 10, 6, 1],
            [1, 0, 0, 1, 1, 0, 1],
            [10, 6, 0, 13, 9, 11, 10],
            [9, 10, 0, 0, 11, 9, 10],
            [5, 13, 0, 1, 0, 5, 5],
            [7, 13, 1, 5, 7, 0, 4],
            [9, 11, 0, 4, 8, 6, 0],
        ],
        [-0.4854565, -2.4198305, 3.0521100, 0.5765664, -0.7173305, -0.0727865, 0.0655990],
    ),
    "students": (
        [
            [0, 7, 1, 1, 10, 4, 6],
            [2, 0, 0, 0, 5, 0, 4],
            [5, 3, 0, 10, 4, 12, 7],
            [8, 9, 4, 0, 9, 10, 12],
            [3, 8, 0, 0, 0, 2, 3],
            [10, 12, 3, 6, 11, 0, 9],
            [9, 8, 1, 1, 10, 6, 0],
        ],
        [-0.3825473, -1.5784680, 1.7703598, 1.2585236, -1.3092075, 0.5086652, -0.2615268],
    ),
}


@pytest.fixture
def published() -> Scenes:
    """For each scene how often each tone mapper (row) was preferred, shape (7, 7), and the published JOD, (7,)."""
    return {scene: (np.array(wins, np.float64), np.array(jod)) for scene, (wins, jod) in PUBLISHED.items()}


def plain_objective(q: Floats, wins: Floats, prior: DistancePrior) -> float:
    """Return what pwcmp minimises at ``q`` in JOD: both orders of each pair, one pair after another."""
    from scipy.stats import norm

    n, total = len(q), wins + wins.T
    pairs = [(i, j) for i in range(n) for j in range(n) if total[i, j] > 0]
    chance = {(i, j): float(norm.cdf(q[i] - q[j], 0, 1.4826)) for i, j in pairs}
    shifted = {}
    for i, j in pairs:
        k = float(wins[i, j])
        unanimous = wins[i, j] == 0 or wins[j, i] == 0
        shifted[i, j] = k if not unanimous else (1.0 if k == 0 else k - 1)
    value = 0.01 * float(np.mean(q)) ** 2
    e = float(np.ptp(q)) + 1
    sums: dict[tuple[int, int], float] = {}
    likelihood: dict[tuple[tuple[int, int], tuple[int, int]], float] = {}
    if prior == "gaussian":
        for answers in pairs:
            k, m = shifted[answers], float(total[answers])
            for pair in pairs:
                p = chance[pair]
                likelihood[answers, pair] = p**k * (1 - p) ** (m - k)
            sums[answers] = sum(likelihood[answers, pair] for pair in pairs)
    for i, j in pairs:
        d = (q[i] - q[j]) / 1.4826
        value -= float(wins[i, j] * norm.logcdf(d) + wins[j, i] * norm.logcdf(-d))
        if prior == "gaussian":
            weight = sum((likelihood[one, (i, j)] + 1e-8) / (sums[one] + 1e-8) for one in pairs)
        elif prior == "bounded":
            mixed = float(wins[i, j] > 0 and wins[j, i] > 0)
            weight = max(mixed, 1 / e - float(wins[i, j]) / e**2)
        else:
            weight = 1.0
        value -= float(np.log(max(weight + 0.1, 1e-300)))
    return value


def plain_jod(wins: Floats, prior: DistancePrior) -> Floats:
    """Return the JOD that pwcmp's objective has its minimum at, by SciPy, started at 0; mean 0."""
    from scipy.optimize import minimize

    how: dict[str, Any] = {"method": "BFGS", "jac": "3-point", "options": {"gtol": 1e-7}}
    found = minimize(plain_objective, np.zeros(len(wins)), args=(wins, prior), **how).x
    return np.asarray(found - found.mean())


def test_published_results_come_out(published: Scenes) -> None:
    wins = np.stack([counts for counts, _ in published.values()])
    jod = np.stack([scores - scores.mean() for _, scores in published.values()])
    # MATLAB's fminunc stopped where its gradient was about 1e-5.
    assert np.abs(fit_jod(wins, "bounded").jod - jod).max() < 1e-5


def test_three_quarters_are_one_jod() -> None:
    wins = np.array([[0.0, 25, 0], [75, 0, 25], [0, 75, 0]])  # pwcmp's first example
    assert fit_jod(wins[None], "none").jod[0] == pytest.approx([-1, 0, 1], abs=1e-5)
    assert fit_jod(wins[None], "gaussian").jod[0] == pytest.approx([-1, 0, 1], abs=1e-3)


@pytest.mark.parametrize("prior", ["gaussian", *nightly("none", "bounded")])
def test_the_plain_objective_has_its_minimum_there(prior: DistancePrior, published: Scenes) -> None:
    wins, _ = published["exhibition"]
    wins = wins[:4, :4]
    if prior == "none":
        wins = wins + np.triu(np.ones((4, 4)), 1)  # the third always won: there is no maximum without a prior
    (fast,) = fit_jod(wins[None], prior).jod
    slow = plain_jod(wins, prior)
    assert np.abs(fast - slow).max() < 1e-6
    assert plain_objective(fast, wins, prior) <= plain_objective(slow, wins, prior) + 1e-10


@pytest.mark.parametrize("prior", ["gaussian", "bounded"])
def test_slopes_are_those_of_the_value(prior: DistancePrior) -> None:
    random = np.random.default_rng(4)
    wins = random.integers(0, 6, (2, 5, 5)).astype(np.float64)
    wins[:, range(5), range(5)] = 0
    wins[0, 0, 1] = wins[0, 1, 0] = 0
    wins[1, 2, 3], wins[1, 3, 2] = 4, 0
    counts, law, penalty = all_pairs(wins), LAWS["thurstone"], PRIORS[prior]
    theta = random.normal(0, 0.6, (2, 5))

    def value(at: Floats) -> Floats:
        return penalty.value(counts, at, lambda: law.slopes(counts, counts.differences(at), 0.0))

    d = counts.differences(theta)
    plain = law.slopes(counts, d, 0.0)
    own = counts.net_flows(penalty.slopes(counts, d, plain).d - plain.d)
    for item in range(5):
        step = 1e-6 * np.eye(5)[item]
        assert own[:, item] == pytest.approx((value(theta + step) - value(theta - step)) / 2e-6, abs=1e-6)


def test_a_batch_is_its_parts(published: Scenes) -> None:
    wins = np.stack([counts for counts, _ in published.values()])
    together = fit_jod(wins, "gaussian")
    assert together.converged.all()
    for one, jod in zip(wins, together.jod, strict=True):
        assert fit_jod(one[None], "gaussian").jod[0] == pytest.approx(jod, abs=1e-9)


def test_items_that_nothing_links_have_no_scale() -> None:
    wins = np.zeros((2, 4, 4))
    wins[:, [0, 1, 2, 3], [1, 0, 3, 2]] = 2
    wins[1, 1, 2] = 1
    assert np.isnan(fit_jod(wins, "gaussian").jod).any(axis=1).tolist() == [True, False]


# Scales in JOD with intervals, and observers who differ.

Call = Callable[..., subprocess.CompletedProcess[str]]
TRUE_JOD = {"a": 0.0, "b": 0.6, "c": 1.5, "d": 1.2}


@pytest.fixture
def answers() -> Comparisons:
    """Six observers, three answers to each pair of four items; the last answers against the others."""
    random, told = np.random.default_rng(8), []
    for observer in range(6):
        for first, second in list(combinations("abcd", 2)) * 3:
            apart = (TRUE_JOD[first] - TRUE_JOD[second]) * (-1 if observer == 5 else 1)
            won = random.random() < norm.cdf(apart / 1.4826)
            told.append(Answer(*((first, second) if won else (second, first)), observer=f"o{observer}"))
    return from_answers(told, items="abcd")


def test_the_first_item_is_at_zero_unless_another_is_named(answers: Comparisons) -> None:
    ((_, first),) = scale_jod(answers, replicates=20).scales
    ((_, other),) = scale_jod(answers, replicates=20, zero="c").scales
    assert (first.zero, other.zero) == ("a", "c")
    assert first.jod[0] == other.jod[2] == 0
    assert first.jod - first.jod[2] == pytest.approx(other.jod)
    assert [item.name for item in first.items] == [item.name for item in other.items]
    zero = next(item for item in other.items if item.name == "c")
    assert (zero.jod, zero.low, zero.high) == (0, 0, 0)


def test_intervals_are_percentiles_of_scales_of_drawn_observers(answers: Comparisons) -> None:
    ((_, scale),) = scale_jod(answers, replicates=40, seed=3, alpha=0.1).scales
    drawn = []
    for weights in draw_observers(6, 40, 3):
        (jod,) = fit_jod(np.einsum("s,sij->ij", weights, answers.wins_by_observer())[None], "gaussian").jod
        drawn.append(jod - jod[0])
    # MATLAB's prctile: the i-th of n values is the 100 (i − 0.5)/n percentile.
    places = 100 * (np.arange(1, 41) - 0.5) / 40
    for item in scale.items:
        values = np.sort(np.array(drawn)[:, "abcd".index(item.name)])
        assert item.low == pytest.approx(np.interp(5, places, values), abs=1e-8)
        assert item.high == pytest.approx(np.interp(95, places, values), abs=1e-8)


def test_an_observer_is_judged_by_the_scale_of_the_others(answers: Comparisons) -> None:
    people = scale_jod(answers, replicates=20).observers
    own, logs = answers.wins_by_observer(), []
    for observer in range(6):
        (jod,) = fit_jod((own.sum(axis=0) - own[observer])[None], "gaussian").jod
        chance = norm.cdf((jod[:, None] - jod[None]) / 1.4826)
        p = binom.pmf(own[observer], own[observer] + own[observer].T, chance)
        logs.append(float(np.log(p[np.triu_indices(4, 1)]).sum()))
    ranked = np.sort(logs)
    lower, upper = ranked[1], ranked[4]  # MATLAB's quartiles of six values
    assert [one.log_likelihood for one in people] == pytest.approx(logs)
    expected = [max(lower - value, 0) / (upper - lower) for value in logs]
    assert [one.distance for one in people] == pytest.approx(expected)
    assert [one.name for one in people if one.worth_a_look] == ["o5"]


def test_without_observers_there_are_no_intervals() -> None:
    ((_, scale),) = scale_jod(from_answers([Answer("a", "b", 3), Answer("b", "a", 9)])).scales
    assert (scale.covariance, scale.replicates, scale.items[0].low) == (None, 0, None)
    assert scale.items[0].jod == pytest.approx(1.0, abs=1e-3)


def test_where_there_is_no_maximum_there_is_no_number(cyclopean: Call) -> None:
    done = cyclopean("scores", "-", "--method", "pwcmp", "--json", text="winner,loser,count\na,b,5\n", expect=1)
    assert [(item["name"], item["jod"]) for item in json.loads(done.stdout)["items"]] == [("a", None), ("b", None)]
    assert "--model thurstone --method map" in done.stderr


def test_groups_have_scales_of_their_own() -> None:
    counts = {"church": {"ab": 1, "ba": 3}, "beach": {"ab": 3, "ba": 1, "ca": 2, "ac": 1}}
    told = [
        Answer(pair[0], pair[1], times, f"o{who}", group=group)
        for who in range(4)
        for group, own in counts.items()
        for pair, times in own.items()
    ]
    scales = scale_jod(from_answers(told), replicates=20)
    assert [(name, [item.name for item in scale.items]) for name, scale in scales.scales] == [
        ("church", ["b", "a"]),
        ("beach", ["c", "a", "b"]),
    ]
    assert len(scales.observers) == 4
    with pytest.raises(ResultsError, match="there is no item 'c' in the group 'church'"):
        scale_jod(from_answers(told), zero="c")


@pytest.mark.parametrize(
    ("told", "options", "message"),
    [
        ([Answer("a", "b", 0.5)], {}, r"'a' was preferred over 'b' 0\.5 times: pwcmp takes whole counts \(use another"),
        ([Answer("a", "b"), Answer("c", "d")], {}, "items of different groups"),
        ([Answer("a", "b")], {"prior": "none"}, "use --distance-prior gaussian"),
        ([Answer("a", "b")], {"zero": "B"}, r"there is no item 'B' \(the items are a, b\)"),
        ([Answer("a", "b")], {"prior": "flat"}, "there is no prior on distances 'flat'"),
        ([Answer("a", "b")], {"replicates": 3}, "3 replicates were asked for"),
        ([Answer("a", "b")], {"alpha": 2.0}, "alpha is 2"),
    ],
)
def test_what_has_no_scale_is_refused(told: list[Answer], options: dict[str, object], message: str) -> None:
    with pytest.raises(ResultsError, match=message):
        scale_jod(from_answers(told), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--method", "pwcmp", "--pairs"], "pairs does not go with the method pwcmp"),
        (["--method", "pwcmp", "--model", "davidson"], "the method pwcmp is for the model thurstone"),
        (["--jod-zero", "a"], "jod_zero and distance_prior go with the method pwcmp"),
    ],
)
def test_options_that_do_not_go_together(cyclopean: Call, words: list[str], message: str) -> None:
    done = cyclopean("scores", "-", *words, expect=2)
    assert message in done.stderr


def test_its_way_to_score_keeps_what_is_promised_of_every_one() -> None:
    assert len(prove_method("pwcmp")) == 5
