"""Effects of factors: calibration by simulation, many items, strengths far apart, tiny and huge counts."""

from __future__ import annotations

import time
from itertools import combinations, product

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.factors import factor_effects
from analysis.scaling import fit
from documents.arrays import Floats
from tests.stress.answered import answered

pytestmark = pytest.mark.stress

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
        assert found.explained is not None
        image, view = found.tests
        (interaction,) = found.interactions
        robust = image.robust_p, view.robust_p
        p.append([image.p, view.p, interaction.p, found.explained.lack_of_fit_p, *robust])
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
