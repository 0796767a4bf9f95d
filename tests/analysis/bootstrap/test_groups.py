"""The bootstrap of pairs within groups: the same observers are drawn for all of them."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.bootstrap import class_stability, intervals, resample, resample_groups
from analysis.comparisons import Answer, from_answers, split_groups
from analysis.errors import ResultsError

PAIRS = ("ab", "ab", "ba", "bc", "bc", "cb", "ac", "ac", "ca")
ANSWERS = [
    Answer(
        pair[0 if (place + observer) % 4 else 1],
        pair[1 if (place + observer) % 4 else 0],
        observer=f"{observer:02}",
        group=group,
    )
    for observer in range(8)
    for group in ("church", "beach")
    for place, pair in enumerate(PAIRS)
]


def test_each_group_has_the_draws_of_its_own_answers() -> None:
    comparisons = from_answers(ANSWERS)
    drawn = resample_groups(comparisons, replicates=50, seed=3)
    assert [name for name, _ in drawn] == ["church", "beach"]
    for (_, part), (_, replicates) in zip(split_groups(comparisons), drawn, strict=True):
        alone = resample(part, replicates=50, seed=3)
        assert np.array_equal(replicates.theta, alone.theta, equal_nan=True)
        ends, own = (intervals(one, "theta") for one in (replicates, alone))
        assert np.array_equal(ends.low, own.low)
        assert class_stability(replicates).to_json() == class_stability(alone).to_json()


def test_observers_of_some_groups_are_drawn_with_all_others() -> None:
    some = from_answers([answer for answer in ANSWERS if answer.group == "church" or answer.observer > "01"])
    church, beach = (part for _, part in resample_groups(some, replicates=40, seed=4))
    assert beach.observers == church.observers[2:]
    assert np.array_equal(church.weights[:, 2:], beach.weights)


def test_a_group_without_a_fit_is_named() -> None:
    answers = [answer for answer in ANSWERS if answer.group == "church" or answer.loser != "a"]
    with pytest.raises(ResultsError, match="'beach': the items are separated"):
        resample_groups(from_answers(answers), replicates=5)
