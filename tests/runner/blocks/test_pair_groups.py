"""Pairs within scenes, and between them: which, in which order, on which side, and what is wrong with a file."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from itertools import combinations, pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from extensions.adaptive_pairs import GroupedChooser, shared_out
from runner.blocks import Block, Pair, Stimuli, pairs_in_groups
from runner.blocks.orders import balanced, grouped_order
from runner.ports import Ask, Compare
from tests.runner.every_kind import entry, met, pairs_of, setting

Play = Callable[..., Any]
SEEDS = st.text(max_size=8)


def study(scenes: int, codecs: int) -> Stimuli:
    """Return every codec of every scene, such as s0-c1."""
    return Stimuli({f"s{s}-c{c}": {"scene": f"s{s}", "codec": float(c)} for s in range(scenes) for c in range(codecs)})


def block(stimuli: Stimuli, across: str | None = None, **more: Any) -> Block:
    """Return a block of the pairs within the scenes."""
    return met("all_pairs", setting(stimuli), within="scene", across=across, **more)


def faults(stimuli: Stimuli, kind: str = "all_pairs", **keys: Any) -> list[tuple[str, tuple[str | int, ...], str]]:
    """Return what is wrong with an entry: the words, the key, and the remedy."""
    return [(fault.message, fault.path, fault.remedy) for fault in entry(kind, **keys).faults(stimuli)]


def at_random(seed: int) -> Callable[[Ask], str]:
    """Return an observer who answers comparisons at random."""
    rng = random.Random(seed)
    return lambda ask: rng.choice([*ask.keys]) if isinstance(ask.task, Compare) else "space"


def test_only_stimuli_of_one_scene_are_compared() -> None:
    made = block(study(3, 4), repeats=2)
    pairs = Counter(map(frozenset, pairs_of(made)))
    expected = [pair for s in range(3) for pair in combinations([f"s{s}-c{c}" for c in range(4)], 2)]
    assert pairs == {frozenset(pair): 2 for pair in expected}
    assert made.trials == len(pairs_of(made)) == 36
    assert made.facts == {"pairs_within_scene": {"s0": 6, "s1": 6, "s2": 6}}


def test_pairs_between_scenes_have_one_codec() -> None:
    made = block(study(3, 2), "codec")
    between = [pair for pair in pairs_of(made) if pair[0][:2] != pair[1][:2]]
    assert {*map(frozenset, between)} == {
        frozenset((f"s{i}-c{c}", f"s{j}-c{c}")) for c in range(2) for i, j in combinations(range(3), 2)
    }
    assert made.trials == len(pairs_of(made)) == 3 + 6
    assert made.facts == {"pairs_within_scene": {"s0": 1, "s1": 1, "s2": 1}, "pairs_between": 6}


@given(st.integers(1, 5), st.integers(2, 6), st.booleans(), st.integers(1, 3), SEEDS, SEEDS)
def test_sides_balance_per_stimulus_and_between_neighbours(
    scenes: int, codecs: int, linked: bool, repeats: int, side_seed: str, order_seed: str
) -> None:
    stimuli = study(scenes, codecs)
    sets = pairs_in_groups(stimuli.names, stimuli, "scene", "codec" if linked else None).sets
    order = grouped_order(sets, repeats, side_seed, order_seed)
    assert Counter((min(pair), max(pair)) for pair in order) == dict.fromkeys(sets, repeats)
    trials = Counter(item for pair in order for item in pair)
    first = Counter(pair[0] for pair in order)
    assert all(abs(2 * first[item] - trials[item]) <= 1 for item in trials)
    neighbour = grouped_order(sets, repeats, side_seed, f"{order_seed}, another", flip=True)
    assert Counter((second, first) for first, second in neighbour) == Counter(order)
    assert order == grouped_order(sets, repeats, side_seed, order_seed)


@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=40), st.integers(0, 1000))
def test_any_pairs_are_oriented_evenly(drawn: list[Pair], seed: int) -> None:
    pairs = sorted({(min(pair), max(pair)) for pair in drawn if pair[0] != pair[1]})
    oriented = balanced(pairs, random.Random(seed))
    assert sorted((min(pair), max(pair)) for pair in oriented) == pairs
    times, first = Counter(item for pair in pairs for item in pair), Counter(pair[0] for pair in oriented)
    assert all(abs(2 * first[item] - times[item]) <= 1 for item in times)


def test_each_side_of_a_pair_is_as_likely() -> None:
    first = Counter(balanced([(0, 1), (2, 3), (3, 4)], random.Random(seed))[0] for seed in range(4000))
    for pair in [(0, 1), (2, 3), (3, 4)]:
        one, other = first[pair], first[pair[1], pair[0]]
        assert abs(one - other) < 5 * (one + other) ** 0.5  # five standard deviations of a fair coin


@given(st.integers(2, 6), st.integers(3, 6), st.integers(1, 2), SEEDS)
def test_neighbours_are_of_different_scenes(scenes: int, codecs: int, repeats: int, seed: str) -> None:
    sets = pairs_in_groups(study(scenes, codecs).names, study(scenes, codecs), "scene").sets
    order = grouped_order(sets, repeats, seed, seed)
    shown = [sets[min(pair), max(pair)] for pair in order]
    assert all(one != other for one, other in pairwise(shown))


@given(st.integers(3, 5), st.integers(3, 5), SEEDS)
def test_no_stimulus_comes_twice_running_with_pairs_between_scenes(scenes: int, codecs: int, seed: str) -> None:
    sets = pairs_in_groups(study(scenes, codecs).names, study(scenes, codecs), "scene", "codec").sets
    order = grouped_order(sets, 1, seed, seed)
    assert not any(set(one) & set(other) for one, other in pairwise(order))


def test_the_grouped_order_of_one_seed_is_what_it_was() -> None:
    """A session is resumed under the order it began with, so the order must not change with the program."""
    sets = pairs_in_groups(study(2, 3).names, study(2, 3), "scene", "codec").sets
    order = grouped_order(sets, 1, "side", "order")
    assert order == [(1, 4), (5, 2), (4, 3), (0, 1), (5, 4), (2, 0), (3, 5), (2, 1), (0, 3)]


@pytest.mark.parametrize("across", [None, "codec"])
def test_records_name_the_scene(play: Play, across: str | None) -> None:
    made = block(study(3, 3), across, break_every=5, catch={"every": 2, "pairs": [["s0-c0", "s1-c2"]], "identical": 2})
    played = play(made, at_random(1))
    assert len(played.trials) == made.trials
    for trial in played.trials:
        data = trial.details()
        scenes = {data["first"][:2], data["second"][:2]}
        if len(scenes) == 1:
            assert (data["group"], data["group_factor"]) == (*scenes, "scene")
        else:
            assert "group" not in data
            assert "group_factor" not in data
    again = play(made, at_random(1))
    assert [(t.details(), t.events) for t in again.trials] == [(t.details(), t.events) for t in played.trials]


def test_without_groups_a_record_is_what_it_was(play: Play) -> None:
    played = play(met("all_pairs", setting("abc")), at_random(1))
    assert not any("group" in trial.details() for trial in played.trials)
    assert "within" not in entry("all_pairs").model_dump()


ALONE = Stimuli({**study(2, 3).factors, "x": {"scene": "dune", "codec": 1.0}})
APART = Stimuli({f"{s}{c}": {"scene": s, "codec": f"{s}{c}"} for s in "ab" for c in "12"})
HALF = Stimuli({f"{s}{c}": {"scene": s, "codec": c if s in "ab" else s + c} for s in "abcd" for c in "12"})
BARE = Stimuli({**study(2, 3).factors, "x": {"codec": 1.0}, "y": {}})


@pytest.mark.parametrize(
    ("stimuli", "keys", "path", "said", "remedy"),
    [
        (study(2, 3), {"within": "scen"}, "within", "'scen'", "did you mean 'scene'?"),
        (study(2, 3), {"within": "scene", "across": "quality"}, "across", "'quality'", "codec, scene"),
        (BARE, {"within": "scene"}, "within", "'scene': x, y", ""),
        (Stimuli({"a": {}, "b": {}}), {"within": "scene"}, "within", "", "write 'factors:' beside the stimuli"),
        (ALONE, {"within": "scene"}, "within", "'dune' has one stimulus, 'x'", "leave 'x' out"),
        (Stimuli({name: {"image": name} for name in "abc"}), {"within": "image"}, "within", "the same image", ""),
        (APART, {"within": "scene", "across": "codec"}, "across", "the same codec", ""),
        (HALF, {"within": "scene", "across": "codec"}, "across", "3 sets without a common scale: a, b; c; d", ""),
    ],
)
def test_the_faults_of_factors(stimuli: Stimuli, keys: dict[str, Any], path: str, said: str, remedy: str) -> None:
    (fault,) = faults(stimuli, **keys)
    assert fault[1] == (path,)
    assert said in fault[0]
    assert remedy in fault[2]


def test_what_links_scenes_is_another_factor() -> None:
    assert faults(ALONE, within="scene", across="codec") == []  # x is compared with s0-c1 and s1-c1
    for keys in ({"across": "codec"}, {"within": "codec", "across": "codec"}):
        with pytest.raises(ValidationError):
            entry("all_pairs", **keys)


def active(stimuli: Stimuli, trials: int) -> Block:
    """Return a block that chooses pairs within the scenes."""
    return met("active_pairs", setting(stimuli), within="scene", trials=trials)


def test_active_pairs_stay_within_scenes_and_share_the_trials_out(play: Play) -> None:
    stimuli = Stimuli({**study(2, 6).factors, "x": {"scene": "z"}, "y": {"scene": "z"}})
    made = active(stimuli, 40)
    played = play(made, at_random(2))
    assert len(played.trials) == 40
    asked = Counter(trial.details()["group"] for trial in played.trials)
    assert asked == made.facts["pairs_within_scene"] == {"s0": 17, "s1": 17, "z": 6}
    for trial in played.trials:
        first, second = (stimuli.factors[trial.details()[key]]["scene"] for key in ("first", "second"))
        assert first == second == trial.details()["group"]
    again = play(made, at_random(2))
    assert [(t.details(), t.events) for t in again.trials] == [(t.details(), t.events) for t in played.trials]


def test_each_scene_is_chosen_by_its_own_answers() -> None:
    """The pairs of a scene do not depend on the answers in another."""

    def asked(answer_elsewhere: float) -> list[Pair]:
        chooser = GroupedChooser([(0, 1, 2, 3), (4, 5, 6, 7)], [30, 3], 2, random.Random(1))
        own: list[Pair] = []
        for _ in range(2):
            for first, second in chooser.next_batch(4):
                chooser.learn(first, second, first_share=1.0 if first < 4 else answer_elsewhere)
                own += [(first, second)] * (first < 4)
        return own

    assert asked(0.0) == asked(1.0)


@given(st.lists(st.integers(2, 9), min_size=1, max_size=8), st.integers(0, 200))
def test_every_scene_gets_enough_to_link_it(sizes: list[int], more: int) -> None:
    trials = sum(size - 1 for size in sizes) + more
    shares = shared_out(trials, sizes)
    assert sum(shares) == trials
    assert all(share >= size - 1 for share, size in zip(shares, sizes, strict=True))


def test_the_faults_of_active_pairs_within_scenes() -> None:
    stimuli = study(2, 4)
    assert faults(stimuli, "active_pairs", within="scene", trials=6) == []
    (fault,) = faults(stimuli, "active_pairs", within="scene", trials=5)
    assert fault[0].startswith("5 trials cannot link 8 stimuli")
    (fault,) = faults(stimuli, "active_pairs", within="scene", trials=20, batch=3)
    assert fault[0].startswith("a batch of 3 pairs")
    (fault,) = faults(stimuli, "active_pairs", within="szene", trials=20)
    assert fault[2] == "did you mean 'scene'?"
    with pytest.raises(ValidationError, match="across"):
        entry("active_pairs", trials=9, within="scene", across="codec")
