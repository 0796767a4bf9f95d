"""The laws as probabilities: against their formulas, at their limits, and what they share."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from runner.observers.behaviour import (
    BehaviourSpec,
    FatigueSpec,
    PsychometricSpec,
    TiesSpec,
    choice_law,
    difficulty,
    pair_law,
    psychometric_law,
)

SCORES = st.floats(0.01, 100)


@given(SCORES, SCORES, st.floats(0, 5))
def test_davidsons_law_is_its_formula(one: float, other: float, width: float) -> None:
    tie = width * math.sqrt(one * other)
    total = one + other + tie
    found = pair_law(math.log(one) - math.log(other), TiesSpec(width=width))
    assert found == pytest.approx((one / total, other / total, tie / total), abs=1e-12)


@given(SCORES, SCORES, st.floats(1, 5))
def test_rao_and_kuppers_law_is_its_formula(one: float, other: float, width: float) -> None:
    first, second = one / (one + width * other), other / (other + width * one)
    tie = (width**2 - 1) * one * other / ((one + width * other) * (other + width * one))
    found = pair_law(math.log(one) - math.log(other), TiesSpec(law="rao_kupper", width=width))
    assert found == pytest.approx((first, second, tie), abs=1e-12)


@given(st.floats(-1e6, 1e6), st.sampled_from([None, TiesSpec(width=0.7), TiesSpec(law="rao_kupper", width=1.5)]))
def test_probabilities_sum_to_one_and_swap_with_the_sides(log_odds: float, ties: TiesSpec | None) -> None:
    first, second, tie = pair_law(log_odds, ties)
    assert min(first, second, tie) >= 0
    assert first + second + tie == pytest.approx(1, abs=1e-12)
    assert pair_law(-log_odds, ties) == pytest.approx((second, first, tie), abs=1e-12)


def test_without_width_there_are_no_ties() -> None:
    plain = pair_law(0.8)
    assert pair_law(0.8, TiesSpec(width=0)) == pytest.approx(plain)
    assert pair_law(0.8, TiesSpec(law="rao_kupper", width=1)) == pytest.approx(plain)
    with pytest.raises(ValidationError, match="is 1"):
        TiesSpec(law="rao_kupper", width=0.5)


def test_a_choice_of_two_is_the_pair_law_and_far_scores_do_not_overflow() -> None:
    assert choice_law([1.0, 0.2])[0] == pytest.approx(pair_law(0.8)[0])
    assert choice_law([0.0, 5000.0, -5000.0]) == pytest.approx([0, 1, 0])


def test_equal_pictures_are_the_hardest_to_choose_from() -> None:
    assert difficulty([2.0] * 6) == pytest.approx(1)
    assert difficulty([0.0, 500.0]) == pytest.approx(0)
    assert 0 < difficulty([0.0, 1.0, 2.0]) < difficulty([0.0, 0.5, 1.0]) < 1
    assert difficulty([1.0]) == 0


def test_at_threshold_right_answers_are_half_way_from_guessing() -> None:
    function = PsychometricSpec(threshold=40, slope=3)
    assert psychometric_law(40, 1 / 4, function) == pytest.approx(0.25 + 0.75 / 2)
    assert psychometric_law(0, 1 / 4, function) == pytest.approx(0.25)
    assert psychometric_law(1e9, 1 / 4, function) == pytest.approx(1)
    assert psychometric_law(40 * math.e, 1 / 2, function) == pytest.approx(0.5 + 0.5 / (1 + math.exp(-3)))


def test_fatigue_grows_evenly_and_stays() -> None:
    tired = BehaviourSpec(lapse_rate=0.1, fatigue=FatigueSpec(over_trials=100, lapse_rate=0.3, noise=2))
    assert [tired.lapses(judged) for judged in (0, 50, 100, 500)] == pytest.approx([0.1, 0.2, 0.3, 0.3])
    assert [tired.noise(judged) for judged in (0, 50, 100, 500)] == pytest.approx([1, 1.5, 2, 2])
    assert BehaviourSpec(lapse_rate=0.1, fatigue=FatigueSpec(over_trials=9, noise=2)).lapses(50) == 0.1
