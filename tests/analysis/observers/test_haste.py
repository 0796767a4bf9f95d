"""Sessions that were answered faster than anyone looks are named."""

from __future__ import annotations

from analysis.observers import Haste
from analysis.records import Trial


def _trials(count: int, seconds: float, ignored: int) -> list[Trial]:
    presses = [["up", 0.05, "early"]]
    return [
        Trial(1, number, "all_pairs", (("up", seconds),), seconds, "", {"ignored": presses} if number < ignored else {})
        for number in range(count)
    ]


def test_half_of_ten_trials_with_ignored_presses_or_fast_answers_are_striking() -> None:
    assert Haste.of(_trials(10, 1.0, 5)).striking
    assert not Haste.of(_trials(10, 1.0, 4)).striking
    assert Haste.of(_trials(300, 0.15, 0)).striking
    assert not Haste.of(_trials(9, 0.15, 9)).striking
    assert "5 of 10 trials" in Haste.of(_trials(10, 1.0, 5)).words
