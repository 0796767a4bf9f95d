"""The order of patches: every one once, black and white again and again, the same for a seed."""

from __future__ import annotations

import itertools
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.errors import DeviceError
from devices.patches import Patch, PatchSet, find_patches, steps
from devices.patches.sets import CHARACTERISATIONS


@settings(max_examples=15)
@given(st.sampled_from(list(CHARACTERISATIONS)), st.integers(0, 99), st.integers(0, 40))
def test_every_patch_once_and_black_and_white_throughout(name: str, seed: int, every: int) -> None:
    patches = find_patches(name)
    order = steps(patches, seed, every)
    counts = Counter(step.patch for step in order)
    assert set(counts) == set(patches.patches)
    for patch, count in counts.items():
        if patch.name not in ("black", "white"):
            assert count == 1
    if every:
        others = len(patches.patches) - 2
        assert counts[Patch("white", (1.0, 1.0, 1.0))] == 1 + -(-others // every)
        whites = [step.position for step in order if step.patch.name == "white"]
        assert all(after - before <= every + 2 for before, after in itertools.pairwise(whites))
        assert [step.patch.name for step in order[:2]] == ["black", "white"]
        assert [step.patch.name for step in order[-2:]] == ["black", "white"]
    else:
        assert len(order) == len(patches.patches)
    assert [step.position for step in order] == list(range(len(order)))
    labels = [step.label for step in order]
    assert len(set(labels)) == len(labels)
    assert order == steps(patches, seed, every)


def test_another_seed_is_another_order() -> None:
    patches = find_patches("table_c1")
    assert steps(patches, 1) != steps(patches, 2)
    assert [step.patch for step in steps(patches, 1, 0, shuffled=False)] == list(patches.patches)


def test_labels_count_the_showings() -> None:
    whites = [step.label for step in steps(find_patches("grey"), 1) if step.patch.name == "white"]
    assert whites == ["white", "white#2", "white#3", "white#4"]


def test_wrong_repeats_are_refused() -> None:
    with pytest.raises(DeviceError, match="repeated every -1"):
        steps(find_patches("grey"), 1, -1)
    with pytest.raises(DeviceError, match="'white' has other codes"):
        steps(PatchSet("s", (Patch("white", (0.9, 0.9, 0.9)),)), 1)
