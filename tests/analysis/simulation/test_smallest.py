"""The smallest difference that a design finds: against the power simulated at it, by a long simulation, and exactly."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

from analysis.comparisons import Answer, from_answers
from analysis.errors import ResultsError
from analysis.simulation import (
    MOST_NATS,
    Plan,
    SmallestDifference,
    blocks_of,
    simulate,
    smallest_difference,
    smallest_in,
    summed,
)
from analysis.simulation.smallest import _smallest
from tests.choice import nightly
from tests.kept import known

Designs = Any

ALL_PAIRS = {n: np.ones(n * (n - 1) // 2, dtype=np.int64) for n in (2, 3, 6, 8, 10)}


def setup_module() -> None:
    """Forget what other rooms' tests found by few studies."""
    _smallest.cache_clear()


def some_pairs(n: int, share: float, rows: int) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return what each of ``rows`` observers compares: as many pairs each, drawn at random."""
    random, pairs = np.random.default_rng(3), n * (n - 1) // 2
    times = np.zeros((rows, pairs), dtype=np.int64)
    for row in times:
        row[random.permutation(pairs)[: round(share * pairs)]] = 1
    return times


def power_at(found: SmallestDifference, times: Designs, nats: float, adjust: Any, replicates: int = 2000) -> float:
    """Return the power at a difference, by studies with other seeds, over many pairs where these are not alike."""
    n = found.items
    first, second = np.triu_indices(n, 1)
    pairs = range(len(first)) if times.ndim == 2 else [len(first) // 2]
    plan = Plan(tuple(map(str, range(n))), np.zeros(n), times, np.zeros(len(first), dtype=np.bool_))
    plan = replace(plan, observer_sd=found.observer_sd, scores_of="average", alpha=found.alpha, adjust=adjust)
    chances = []
    for pair in pairs:
        theta = np.zeros(n)
        theta[first[pair]], theta[second[pair]] = nats / 2, -nats / 2
        many = max(100, replicates // len(pairs))
        blocks = blocks_of(replace(plan, theta=theta), [found.observers], many, 7000 + pair)
        tally = summed(blocks, map(simulate, blocks))[found.observers]
        chances.append(tally.right[pair] / (tally.replicates - tally.unfitted))
    return float(np.mean(chances))


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("times", "observers", "options"),
    [
        *nightly((ALL_PAIRS[6], 15, {}), (ALL_PAIRS[10], 8, {"target": 0.5})),
        (2 * ALL_PAIRS[3], 12, {"observer_sd": 0.0, "alpha": 0.01, "adjust": "bh"}),
        *nightly((some_pairs(6, 0.5, 20), 20, {})),
    ],
)
def test_the_difference_is_found_as_often_as_it_says(times: Designs, observers: int, options: dict[str, Any]) -> None:
    found = known(smallest_difference(times, observers, **options))
    assert found.nats is not None
    assert found.warnings == ()
    assert 0 < known(found.error_nats) < 0.1 * found.nats
    # Four standard errors of 400 studies, of as many pairs as there are, and of the 2000 here: 0.08.
    assert power_at(found, times, found.nats, options.get("adjust", "holm")) == pytest.approx(found.target, abs=0.08)
    assert power_at(found, times, 0.75 * found.nats, options.get("adjust", "holm")) < found.target - 0.1


def test_two_items_are_as_the_binomial_distribution_has_it() -> None:
    """With the model's errors and observers who are alike: 40 answers, z of the log odds beyond 1.96."""
    found = known(smallest_difference(40 * ALL_PAIRS[2], 2, covariance="model", observer_sd=0.0))
    won, answers = np.arange(81), 80
    share = won.clip(1, answers - 1) / answers
    significant = np.abs(np.log(share / (1 - share))) * np.sqrt(answers * share * (1 - share)) >= 1.959963984540054
    law = binom(answers, 1 / (1 + np.exp(-known(found.nats))))
    assert law.pmf(won[significant & (won > answers / 2)]).sum() == pytest.approx(0.8, abs=0.05)


@pytest.mark.nightly
@pytest.mark.parametrize("share", [0.34, *nightly(0.5)])
def test_a_design_that_finds_nothing_says_so(share: float) -> None:
    found = known(smallest_difference(some_pairs(6, share, 3), 3))
    assert (found.nats, found.error_nats) == (None, None)
    assert known(found.found_of_most) < 0.2
    few = known(smallest_difference(some_pairs(6, share, 5), 5))
    assert few.nats is None or few.nats > 3.5  # 97 % of choices
    assert (few.found_of_most is None) == (few.nats is not None)
    assert len(found.warnings) == 2
    assert "no difference" in found.warnings[0]
    assert "99 %" in found.warnings[0]
    more = known(smallest_difference(some_pairs(6, share, 30), 30))
    assert (more.nats is None, more.warnings) == (False, ())


@pytest.mark.parametrize(("observers", "alpha", "of"), [(2, 0.05, 2), (5, 0.05, 16), (6, 0.05, None), (6, 0.01, 32)])
def test_camps_are_said_where_they_are_likelier_than_the_level(observers: int, alpha: float, of: int | None) -> None:
    found = known(smallest_difference(20 * ALL_PAIRS[3], observers, alpha=alpha))
    assert found.one_camp == of
    assert (found.camps is not None) == (of is not None)
    assert ("two camps" in found.methods) == (of is not None)


def test_what_cannot_be_said_is_none() -> None:
    apart = np.zeros(6, dtype=np.int64)
    apart[[0, 5]] = 1  # a with b, c with d
    assert smallest_difference(apart, 10) is None
    assert smallest_difference(ALL_PAIRS[6], 1) is None
    assert smallest_difference(np.ones(61 * 30, dtype=np.int64), 10) is None


def test_the_design_of_answers_is_who_compared_what() -> None:
    rows = some_pairs(6, 0.8, 12)
    first, second = np.triu_indices(6, 1)
    answers = [
        Answer(f"item {first[pair]}", f"item {second[pair]}", 1, f"{row:02d}")
        for row, pair in zip(*np.nonzero(rows), strict=True)
    ]
    found = smallest_in(
        from_answers(answers, [f"item {item}" for item in range(6)]), alpha=0.05, adjust="holm", covariance="auto"
    )
    assert found == smallest_difference(rows, 12)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.stress) for seed in range(1, 25))])
def test_any_design_has_a_sound_answer_and_twice_the_observers_need_no_larger_difference(seed: int) -> None:
    random = np.random.default_rng(seed)
    n, observers = int(random.integers(2, 13)), int(random.integers(2, 41))
    pairs = n * (n - 1) // 2
    times = random.integers(1, 3) * ALL_PAIRS.get(n, np.ones(pairs, dtype=np.int64))
    if random.random() < 0.5:
        times = times * (random.random((observers, pairs)) < random.uniform(0.2, 1))
    options: dict[str, Any] = {
        "alpha": random.choice([0.05, 0.01]),
        "adjust": random.choice(["holm", "bh", "none", "maxz"]),
        "covariance": random.choice(["auto", "auto", "model", "sandwich"]),
        "observer_sd": random.choice([0.0, 0.7, 1.5]),
        "target": random.choice([0.5, 0.8, 0.95]),
    }
    found, more = (smallest_difference(times, many, **options) for many in (observers, 2 * observers))
    if found is None or more is None:
        assert times.ndim == 2  # some pairs may leave items apart
        assert found is None or more is None
        return
    for one in (found, more):
        said = json.loads(json.dumps(one.to_json(), allow_nan=False))
        assert (one.nats is None) == (one.found_of_most is not None)
        assert 0 <= (one.found_of_most or 0) < one.target
        assert one.nats is None or 0 < one.nats <= MOST_NATS
        assert one.error_nats is None or 0 < one.error_nats < 0.5 * said["nats"]
        assert not re.search(r"\bnan\b|\binf\b|\bNone\b|-\d", " ".join([one.sentence, one.assumed, one.methods]))
    if found.nats is not None:
        apart = 4 * np.hypot(found.error_nats or 0, more.error_nats or 0)
        assert known(more.nats) <= found.nats + apart


@pytest.mark.parametrize("target", [0, 1, 1.2, float("nan")])
def test_a_target_that_no_share_of_studies_can_have_is_refused(target: float) -> None:
    with pytest.raises(ResultsError, match="share"):
        smallest_difference(ALL_PAIRS[3], 10, target=target)
