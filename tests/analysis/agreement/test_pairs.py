"""Pairs that observers tell apart, counted one by one."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from analysis.agreement import Drawn, ObservedGroup, pair_accuracy


def random_group(seed: int, n: int = 6, draws: int | None = None) -> ObservedGroup:
    random = np.random.default_rng(seed)
    scores = random.normal(size=n)
    differs = np.triu(random.random((n, n)) < 0.6, 1)
    differs |= differs.T
    drawn = None
    if draws is not None:
        errors = random.normal(0, 0.3, (draws, n))
        drawn = Drawn(scores + errors, errors, np.repeat(differs[None], draws, axis=0))
    return ObservedGroup("", "ratings", "points", tuple("abcdef"[:n]), scores, differs, 12, drawn)


def test_pairs_are_counted_as_one_by_one() -> None:
    groups = [random_group(1), random_group(2, 5)]
    values = [np.rint(np.random.default_rng(seed).normal(0, 1, len(group.scores))) for seed, group in enumerate(groups)]
    right, of = 0.0, 0
    for group, value in zip(groups, values, strict=True):
        for i, j in combinations(range(len(value)), 2):
            if group.differs[i, j]:
                of += 1
                way = (group.scores[i] - group.scores[j]) * (value[i] - value[j])
                right += 1.0 if way > 0 else 0.5 if way == 0 else 0.0
    found = pair_accuracy(groups, values)
    assert (found.right, found.of) == (right, of)
    assert found.share == pytest.approx(right / of)


def test_the_order_of_observers_is_all_right_and_the_reverse_all_wrong() -> None:
    group = random_group(3, draws=200)
    assert pair_accuracy([group], [group.scores]).share == 1
    wrong = pair_accuracy([group], [-group.scores])
    assert (wrong.share, wrong.p) == (0, 1)
    right = pair_accuracy([group], [group.scores])
    assert right.p is not None
    assert right.low is not None
    assert right.p < 0.05
    assert 0.5 < right.low < 1  # observers whose draws turn a pair


def test_observers_who_tell_no_pair_apart() -> None:
    group = random_group(4)
    none = ObservedGroup("", "", "", group.stimuli, group.scores, np.zeros((6, 6), dtype=np.bool_), 12, None)
    found = pair_accuracy([none], [group.scores])
    assert (found.of, found.share, found.p) == (0, None, None)
