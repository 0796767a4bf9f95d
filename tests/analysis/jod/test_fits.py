"""JOD as pwcmp has them: published results, and its objective written out plainly."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analysis.jod.fits import fit_jod
from analysis.scaling import LAWS, DistancePrior
from analysis.scaling.distance_prior import PRIORS, all_pairs
from documents.arrays import Floats
from tests.choice import nightly

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
