"""The answer in words, from chances that are given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.errors import ResultsError
from analysis.power import Plan, observers_needed, simulate_power
from analysis.power.results import Power

MakePlan = Callable[..., Plan]
PAIRS = [("item 0", "item 1"), ("item 0", "item 2"), ("item 1", "item 2")]


@pytest.fixture(scope="module")
def found(plan_of: MakePlan) -> Power:
    """Three items at 10, 20 and 30 observers with chances made up."""
    simulated = simulate_power(plan_of(1, 0, -1), [10, 20, 30], replicates=50)
    chances = np.array([[0.5, 0.9, 0.3], [0.81, 0.99, 0.5], [0.9, 1.0, 0.7]])
    return replace(simulated, separates=chances, separates_error=np.full((3, 3), 0.01))


def test_the_fewest_observers_that_are_enough_for_every_pair_named(found: Power) -> None:
    answer = observers_needed(found, [PAIRS[0], ("item 2", "item 0")])
    assert answer.observers == 20
    assert answer.by_pair.tolist() == [20, 10, 0]
    assert "the hardest, item 0 and item 1" in answer.sentence
    assert "in 81 % of the studies (± 1.0 %)" in answer.sentence
    assert answer.doubt is not None
    assert "20 or 30" in answer.doubt


def test_one_pair_is_named_in_the_answer(found: Power) -> None:
    answer = observers_needed(found, [PAIRS[1]])
    assert answer.sentence.startswith("10 observers, the fewest tried")
    assert answer.doubt is None


def test_too_few_are_called_too_few(found: Power) -> None:
    answer = observers_needed(found)
    assert answer.observers is None
    assert answer.to_json()["pairs"][2] == {"items": ["item 1", "item 2"], "observers": None}
    assert "are too few" in answer.sentence
    assert "2 of 3 reach it" in answer.sentence


def test_a_number_that_larger_ones_fall_behind_is_not_enough(found: Power) -> None:
    luck = replace(found, separates=np.array([[0.85, 1, 1], [0.79, 1, 1], [0.9, 1, 1]]))
    assert observers_needed(luck).observers == 30


@pytest.mark.parametrize(
    ("pairs", "target", "finding"),
    [
        ([("item 0", "itm 1")], 0.8, "no item 'itm 1'.*did you mean 'item 1'"),
        ([("item 0", "item 0")], 0.8, "'item 0' is paired with itself"),
        ([], 1.0, "the power is 1"),
    ],
)
def test_wrong_questions_are_refused(found: Power, pairs: list[tuple[str, str]], target: float, finding: str) -> None:
    with pytest.raises(ResultsError, match=finding):
        observers_needed(found, pairs, target)


def test_equal_items_need_a_pair_named(plan_of: MakePlan) -> None:
    alike = simulate_power(plan_of(0, 0), [5], replicates=20)
    with pytest.raises(ResultsError, match="no two items should differ"):
        observers_needed(alike)
    assert observers_needed(alike, [PAIRS[0]]).observers is None
