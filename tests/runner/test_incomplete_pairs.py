"""Pairs shared among observers: balanced over them, linked for each, the same on every station; faults of a file."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from analysis.scaling import compared_groups
from analysis.simulation import Plan
from analysis.simulation.studies import analyse, draw
from runner.blocks import Stimuli
from runner.blocks.all_pairs import AllPairs
from runner.blocks.incomplete_pairs import PLACES, designs, fewest_pairs, observers_pairs, place_of
from runner.reports import pair_design
from tests.runner.every_kind import experiment, pairs_of

OBSERVERS = 10, 15, 30


def counts(pairs: int, parts: Sequence[Sequence[int]]) -> NDArray[np.int64]:
    """Return how often each pair is in ``parts``."""
    return np.bincount(np.concatenate([np.array(part) for part in parts]), minlength=pairs)


@pytest.mark.parametrize(("count", "each", "spread"), [(12, 20, 1), (30, 60, 1), (20, 19, 2), (5, 4, 2)])
def test_pairs_are_balanced_over_observers_and_far_more_than_random_ones(count: int, each: int, spread: int) -> None:
    pairs = list(combinations(range(count), 2))
    parts = list(designs(count, pairs, each, "seed", 30))
    rng = random.Random(1)
    for observers in OBSERVERS:
        shared = counts(len(pairs), parts[:observers])
        chance = counts(len(pairs), [rng.sample(range(len(pairs)), each) for _ in range(observers)])
        assert shared.sum() == observers * each
        assert np.ptp(shared) <= spread
        assert np.ptp(shared) < np.ptp(chance)


@pytest.mark.parametrize(("count", "each"), [(12, 11), (12, 20), (30, 60)])
def test_the_pairs_of_each_observer_link_all_stimuli_and_use_each_about_equally(count: int, each: int) -> None:
    pairs = list(combinations(range(count), 2))
    for part in designs(count, pairs, each, "seed", 30):
        assert len(set(part)) == len(part) == each
        assert len(linked(count, [pairs[index] for index in part])) == 1
        times = Counter(item for index in part for item in pairs[index])
        assert max(times.values()) - min(times.values()) <= 4


def linked(count: int, pairs: Sequence[tuple[int, int]]) -> Sequence[Sequence[int]]:
    """Return the sets of items that pairs link."""
    compared = np.zeros((count, count))
    for pair in pairs:
        compared[pair] = 1.0
    return compared_groups(compared)


def test_a_design_follows_from_seed_and_code_alone() -> None:
    pairs = tuple(combinations(range(8), 2))
    every = [tuple(pairs[index] for index in part) for part in designs(8, pairs, 9, "seed", 12)]
    observers_pairs.cache_clear()
    assert observers_pairs(8, pairs, 9, "seed", place_of("p12")) == every[11]
    assert observers_pairs(8, pairs, 9, "seed", place_of("03")) == every[2]
    assert observers_pairs(8, pairs, 9, "other", 2) != every[2]
    assert place_of(f"{PLACES + 1}") == place_of("1") == 0
    assert all(0 <= place_of(code) < PLACES for code in ("0", "anna", "x" * 60, "9" * 30, "٣"))


def test_blocks_have_their_observers_pairs_each_as_often_as_it_is_repeated(tmp_path: Path) -> None:
    study = experiment(tmp_path, "kind: all_pairs, per_observer: 7, balance: pairs, repeats: 2")
    seen: Counter[frozenset[str]] = Counter()
    for observer in range(1, 16):
        (block,) = study.blocks(f"{observer:02d}")
        trials = pairs_of(block)
        own = Counter(map(frozenset, trials))
        assert len(trials) == block.trials == 14
        assert set(own.values()) == {2}
        first = Counter(first for first, _ in trials)
        assert all(first[name] == sum(own[pair] for pair in own if name in pair) / 2 for name in "abcdef")
        assert trials == pairs_of(study.blocks(f"{observer:02d}")[0])
        seen.update(own.keys())
    assert set(seen.values()) == {7}  # 15 observers of 7 pairs, 15 pairs


def test_within_scenes_each_scene_is_linked(tmp_path: Path) -> None:
    (block,) = experiment(tmp_path, "kind: all_pairs, within: scene, per_observer: 5").blocks("04")
    pairs = [("abcdef".index(first), "abcdef".index(second)) for first, second in pairs_of(block)]
    assert block.trials == len(pairs) == 5
    assert sum(block.facts["pairs_within_scene"].values()) == 5
    assert [set(part) for part in linked(6, pairs)] == [{0, 1, 2}, {3, 4, 5}]


def faults(**keys: Any) -> list[tuple[str, tuple[str | int, ...], str]]:
    """Return what is wrong with an entry about twelve stimuli of two scenes."""
    stimuli = Stimuli({f"s{i}": {"scene": f"scene{i % 2}", "codec": i // 2} for i in range(12)})
    return [(fault.message, fault.path, fault.remedy) for fault in AllPairs(kind="all_pairs", **keys).faults(stimuli)]


def test_wrong_numbers_of_pairs_are_one_clear_fault() -> None:
    assert faults(per_observer=11) == faults(per_observer=66) == faults(per_observer=10, within="scene") == []
    ((message, path, remedy),) = faults(per_observer=67)
    assert message.startswith("67 pairs per observer are more than the 66")
    assert (path, remedy[:22]) == (("per_observer",), "ask for 66 or fewer, o")
    ((message, _, remedy),) = faults(per_observer=10)
    assert message == "10 pairs per observer cannot link 12 stimuli"
    assert remedy.startswith("ask for 11 or more, better 24")
    ((message, _, _),) = faults(per_observer=9, within="scene")
    assert message.endswith("12 stimuli within each scene")
    ((across, _, remedy),) = faults(per_observer=10, within="scene", across="codec")
    assert (across.split()[0], remedy[:18]) == ("10", "ask for 11 or more")
    with pytest.raises(ValidationError, match="give 'per_observer'"):
        AllPairs(kind="all_pairs", balance="pairs")


def test_an_entry_without_the_keys_is_written_as_before() -> None:
    assert not {"per_observer", "balance"} & set(AllPairs(kind="all_pairs").model_dump())
    assert fewest_pairs(4, ((0, 1), (2, 3))) == 2


def test_power_simulates_each_observer_with_their_own_pairs(tmp_path: Path) -> None:
    study = experiment(tmp_path, "kind: instructions, text: Look.", "kind: all_pairs, per_observer: 7, repeats: 3")
    times = pair_design(study).times
    assert times.shape == (PLACES, 15)
    first, second = np.triu_indices(6, 1)
    for row, observer in ((0, "01"), (4, "p5"), (29, "30")):
        own = Counter(map(frozenset, pairs_of(study.blocks(observer)[1])))
        pairs = [frozenset(("abcdef"[i], "abcdef"[j])) for i, j in zip(first, second, strict=True)]
        assert times[row].tolist() == [own[pair] for pair in pairs]


def test_a_plan_of_equal_rows_gives_what_one_row_gives_and_unequal_ones_their_own_counts() -> None:
    theta = np.linspace(1, -1, 4)
    plan = Plan(("a", "b", "c", "d"), theta, np.full(6, 2), np.ones(6, dtype=np.bool_), observer_sd=0.5)
    rows = replace(plan, times=np.full((3, 6), 2))
    one, other = (draw(each, 7, 5, np.random.default_rng(1)) for each in (plan, rows))
    assert (one == other).all()
    for name in ("theta", "covariance"):
        np.testing.assert_array_equal(getattr(analyse(plan, 7, one), name), getattr(analyse(rows, 7, one), name))
    assert plan.critical_z(7) == rows.critical_z(7)
    shared = replace(plan, times=np.array([[1, 0, 2, 1, 0, 3], [0, 4, 1, 1, 1, 0]]))
    won = draw(shared, 5, 2000, np.random.default_rng(2))
    assert (won <= shared.design(5)).all()
    assert (won.max(axis=0) == shared.design(5)).all()
    assert shared.totals(5).tolist() == [3, 8, 8, 5, 2, 9]
