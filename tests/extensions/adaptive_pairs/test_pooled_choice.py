"""Pairs chosen by the answers of all observers: paths, spread over stations, no pair again before all others."""

from __future__ import annotations

import random
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from analysis.scaling import updated_posterior
from documents import InputError
from extensions.adaptive_pairs import ActivePairs, PooledChooser, gains, pooled_batch, pooled_study
from extensions.adaptive_pairs.pooled_choice import GRAIN
from runner.blocks import Stimuli
from runner.ports import PooledAnswers
from tests.runner.every_kind import experiment

NAMES = tuple(f"p{number:02d}" for number in range(20))
ALL = (tuple(range(20)),)


def chooser(seed: str = "1", groups: tuple[tuple[int, ...], ...] = ALL, wanted: int = 400) -> PooledChooser:
    return PooledChooser(NAMES, groups, (wanted,) * len(groups), 10, seed)


def nobody() -> PooledAnswers:
    return PooledAnswers(np.zeros((20, 20)))


@cache
def others() -> PooledAnswers:
    """Return the answers of other observers to stimuli of which the later are the better."""
    theta = np.tile(np.linspace(-3, 3, 20), (3, 1))
    return PooledAnswers(pooled_study(theta, 100, seed="1", batch=10).sum(axis=0), {"one": 300})


def test_it_begins_with_a_path_where_nobody_linked_the_stimuli_and_with_the_best_pairs_where_they_did() -> None:
    alone = chooser()
    first = alone.take(alone.choose(nobody()))
    second = alone.take(alone.choose(nobody()))
    assert (len(first), len(second)) == (10, 9)
    times = Counter(item for pair in first + second for item in pair)
    assert sorted(times.values()) == [1, 1, *[2] * 18]  # a path through all
    known = chooser().choose(others())
    assert len(known.pairs) == 10
    assert len({item for pair in known.pairs for item in pair}) == 20
    # Neighbours are the hard ones, whose answers tell most.
    assert np.mean([abs(i - j) for i, j in known.pairs]) < 4 < np.mean([abs(i - j) for i, j in first])


def test_what_others_answer_in_the_meantime_ends_the_path() -> None:
    late = chooser()
    late.take(late.choose(nobody()))
    assert len(late.take(late.choose(others()))) == 10  # nine would be left of the path


def test_stations_that_know_the_same_ask_different_pairs_that_are_nearly_as_good() -> None:
    known = others()
    batches = [chooser(f"observer {number}").choose(known) for number in range(6)]
    pairs = [{frozenset(pair) for pair in batch.pairs} for batch in batches]
    shared = [len(one & other) for number, one in enumerate(pairs) for other in pairs[:number]]
    assert np.mean(shared) < 5  # of ten; with a grain of nothing it is all of them
    gain = gains(updated_posterior(known.wins), "variance")
    sums = [sum(gain[i, j] for i, j in batch.pairs) for batch in batches]
    assert min(sums) > (1 - 2 * GRAIN) * max(sums)


def test_gains_that_hardly_differ_are_left_to_chance_and_others_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("extensions.adaptive_pairs.pooled_choice.GRAIN", 1e-9)
    known = others()
    first, second = (chooser(seed).choose(known) for seed in ("one", "two"))
    assert {frozenset(pair) for pair in first.pairs} == {frozenset(pair) for pair in second.pairs}


def test_no_pair_comes_again_before_all_others_of_its_group_did() -> None:
    groups = (tuple(range(6)), tuple(range(6, 13)))
    asks = PooledChooser(NAMES, groups, (40, 50), 3, "1")
    rng = random.Random(1)
    asked: list[frozenset[int]] = []
    while len(asked) < 90:
        for first, second in asks.take(asks.choose(nobody())):
            asked.append(frozenset((first, second)))
            asks.learn(first, second, first_share=rng.choice([0.0, 0.5, 1.0]))
            for group, wanted in zip(groups, (15, 21), strict=True):
                times = Counter(pair for pair in asked if pair <= {*group})
                assert max(times.values(), default=0) - (min(times.values()) if len(times) == wanted else 0) <= 1
    assert [sum(pair <= {*group} for pair in asked) for group in groups] == [40, 50]
    assert all(any(pair <= {*group} for group in groups) for pair in asked)


def test_each_stimulus_is_first_as_often_as_second() -> None:
    asks = chooser()
    first: Counter[int] = Counter()
    for _ in range(8):
        for one, other in asks.take(asks.choose(others())):
            first[one] += 1
            first[other] -= 1
    assert max(abs(ahead) for ahead in first.values()) <= 2


def test_choosing_changes_nothing_and_what_is_taken_decides_what_follows() -> None:
    one, other = chooser(), chooser()
    known = others()
    batch = one.choose(known)
    assert one.choose(known) == batch
    assert other.take(batch) == one.take(batch) == batch.pairs
    assert other.choose(known) == one.choose(known)  # though `other` has chosen nothing itself
    assert one.choose(known).changes == ()
    assert one.choose(known).pairs != batch.pairs


def test_a_batch_is_taken_by_its_names() -> None:
    """After a change of the recipe's order that was accepted, the log's numbers are those of the old order."""
    batch = chooser().choose(others())
    back = batch.model_copy(
        update={
            "stimuli": batch.stimuli[::-1],
            "pairs": tuple((19 - i, 19 - j) for i, j in batch.pairs),
            "changes": tuple((19 - i, 19 - j, wins) for i, j, wins in batch.changes),
        }
    )
    one, other = chooser(), chooser()
    assert one.take(batch) == other.take(back)
    assert one.choose(others()) == other.choose(others())


def test_a_pool_where_there_can_be_none_is_a_fault() -> None:
    stimuli = Stimuli({name: {} for name in NAMES})
    pooled = {"kind": "active_pairs", "trials": 30, "pool": "results"}
    assert not list(ActivePairs.model_validate(pooled).faults(stimuli))
    with pytest.raises(ValidationError, match="pool"):
        ActivePairs.model_validate({**pooled, "pool": "elsewhere"})


def test_a_practice_is_not_pooled(tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        experiment(tmp_path, "kind: practice, trials: 3, block: {kind: active_pairs, trials: 14, pool: results}")
    (finding,) = refused.value.findings
    assert (finding.message, finding.remedy) == ("a practice's answers are not pooled", "leave 'pool' out")


@pytest.mark.parametrize(("more", "batch"), [("pool: results", 3), ("pool: results, batch: 2", 2), ("batch: 2", 2)])
def test_a_batch_is_a_sixth_of_the_stimuli_but_at_least_five_or_as_named(tmp_path: Path, more: str, batch: int) -> None:
    assert [pooled_batch(stimuli) for stimuli in (2, 3, 6, 10, 20, 30, 60, 600)] == [1, 1, 3, 5, 5, 5, 10, 100]
    design = experiment(tmp_path, f"kind: active_pairs, trials: 14, {more}")
    (entry,) = design.spec.blocks
    assert isinstance(entry, ActivePairs)
    assert entry.most_at_once(design.stimuli) == batch
