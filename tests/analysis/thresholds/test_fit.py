"""The fit is the plain posterior, finds what was put in, and gives no number where answers tell none."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from analysis.thresholds import FUNCTIONS, fit_threshold, mean_threshold

LEVELS = np.array([0.05, 0.1, 0.2, 0.4, 0.8])


def _answers(shares: list[float], each: int = 40) -> tuple[list[float], list[bool]]:
    levels = np.repeat(LEVELS, each)
    right = [number < round(share * each) for share in shares for number in range(each)]
    return levels.tolist(), right


@pytest.mark.parametrize("function", FUNCTIONS)
def test_it_finds_what_answers_follow(function: str) -> None:
    shape = FUNCTIONS[function]
    shares = shape.probability(np.log10(LEVELS), np.log10(0.2), 5.0, 0.5, 0.0)
    fit = fit_threshold(*_answers(shares.tolist(), 1000), function=function)
    assert fit.threshold == pytest.approx(0.2, rel=0.05)
    assert fit.slope == pytest.approx(5.0, rel=0.12)
    assert fit.threshold_interval is not None
    assert fit.threshold_interval[0] < 0.2 < fit.threshold_interval[1]
    assert fit.probability(0.2) == pytest.approx(0.5 + 0.5 * shape.at_threshold, abs=0.03)


def test_it_is_the_posterior_summed_plainly() -> None:
    """The slow twin: one fine grid over all that the prior allows, a term for each trial."""
    levels, right = _answers([0.5, 0.6, 0.75, 0.9, 0.95], 20)
    fit = fit_threshold(levels, right)
    x, good = np.log10(levels), np.array(right)
    span = np.log10(16.0)
    thresholds = np.linspace(np.log10(0.05) - span / 2, np.log10(0.8) + span / 2, 241)
    middle = np.log(1.3395 / 0.25 / span)
    log_slopes = np.linspace(middle - 3 * np.log(3), middle + 3 * np.log(3), 121)
    weights = np.zeros((241, 121))
    for lapse in (np.arange(20) + 0.5) / 100:
        prior = np.exp(-(((log_slopes - middle) / np.log(3)) ** 2) / 2) * (1 - lapse) ** 18
        total = np.zeros((241, 121))
        for place in np.unique(x):
            z = np.exp(log_slopes) * (place - thresholds[:, None])
            p = 0.5 + (0.5 - lapse) * (1 - np.exp(-(10.0 ** np.clip(z, -300, 2.5))))
            here = good[x == place]
            total += here.sum() * np.log(p) + (~here).sum() * np.log(np.maximum(1 - p, 1e-12))
        weights += prior * np.exp(total)
    weights /= weights.sum()
    below = np.cumsum(weights.sum(axis=1)) - weights.sum(axis=1) / 2
    plain = 10 ** np.interp([0.025, 0.5, 0.975], below, thresholds)
    assert fit.threshold_interval is not None
    assert fit.threshold is not None
    assert [fit.threshold_interval[0], fit.threshold, fit.threshold_interval[1]] == pytest.approx(plain, rel=0.01)


@pytest.mark.parametrize("function", FUNCTIONS)
def test_the_rise_is_from_a_tenth_to_nine_tenths(function: str) -> None:
    z = np.linspace(-6, 6, 120_001)
    shape = FUNCTIONS[function].shape(z)
    assert np.diff(np.interp([0.1, 0.9], shape, z))[0] == pytest.approx(FUNCTIONS[function].rise, abs=1e-3)


@pytest.mark.parametrize(
    ("shares", "words"),
    [
        ([1, 1, 1, 1, 1], "all answers are right"),
        ([0, 0, 0, 0, 0], "below chance: 0 of"),
        ([0.5, 0.45, 0.35, 0.2, 0.1], "below chance"),
        ([0.5, 0.5, 0.5, 0.45, 0.5], "than guessing gives"),
        ([1, 0.9, 0.9, 0.8, 0.7], "not more often right"),
    ],
)
def test_answers_that_tell_nothing_give_no_number(shares: list[float], words: str) -> None:
    fit = fit_threshold(*_answers(shares))
    assert words in fit.reason
    assert (fit.threshold, fit.threshold_interval, fit.slope, fit.probability(0.1)) == (None, None, None, None)


def test_who_guesses_is_not_called_below_chance() -> None:
    rng = np.random.default_rng(20)
    levels = np.repeat(LEVELS, 8).tolist()
    reasons = [fit_threshold(levels, (rng.random(len(levels)) < 0.25).tolist(), guess=0.25).reason for _ in range(100)]
    assert sum("below chance" in reason for reason in reasons) <= 4  # at a level of 1 %, of 100
    assert "no answer is right" in fit_threshold([1, 2, 4], [False] * 3).reason


def test_two_levels_and_a_threshold_above_all_levels_give_no_number() -> None:
    assert "fewer than three levels" in fit_threshold([1, 2] * 10, [True, False] * 10).reason
    assert "above all levels" in fit_threshold(*_answers([0.5, 0.5, 0.5, 0.5, 0.6])).reason


def test_yes_and_no_estimate_false_alarms() -> None:
    shares = FUNCTIONS["normal"].probability(np.log10(LEVELS), np.log10(0.2), 5.0, 0.05, 0.0)
    fit = fit_threshold(*_answers(shares.tolist(), 400), function="normal", guess=None)
    assert fit.threshold == pytest.approx(0.2, rel=0.06)
    assert fit.guess == pytest.approx(0.05, abs=0.02)


def test_levels_below_zero_are_on_a_linear_axis() -> None:
    levels = np.repeat([-2.0, -1.0, 0.0, 1.0, 2.0], 40).tolist()
    right = _answers([0.05, 0.15, 0.5, 0.85, 0.95])[1]
    fit = fit_threshold(levels, right, function="logistic", guess=None)
    assert fit.axis == "linear"
    assert fit.threshold == pytest.approx(0.0, abs=0.25)
    with pytest.raises(ValueError, match="no logarithm"):
        fit_threshold(levels, right, axis="log10")


def _seen(blanks: int) -> tuple[list[float], list[bool]]:
    """Return answers of a forced choice with a slope of about 4, and ``blanks`` trials at level 0."""
    rng = np.random.default_rng(1)
    levels = np.repeat([0.01, 0.02, 0.04, 0.08, 0.16], 40)
    right = rng.random(200) < 0.5 + 0.48 * (1 - np.exp(-((levels / 0.05) ** 3)))
    return [*levels.tolist(), *[0.0] * blanks], [*right.tolist(), *(rng.random(blanks) < 0.5).tolist()]


def test_a_level_of_zero_on_a_logarithmic_axis_is_said_with_the_way_out() -> None:
    sound = fit_threshold(*_seen(0))
    levels, right = _seen(40)
    with pytest.warns(UserWarning, match="level 0") as warned:
        fit = fit_threshold(levels, right)
    assert (sound.axis, sound.warning, fit.axis) == ("log10", "", "linear")
    assert f"blanks=({sum(right[200:])}, 40)" in str(warned[0].message)
    assert fit.to_json()["warning"] == fit.warning == str(warned[0].message)
    assert sound.slope is not None
    assert fit.slope is not None
    assert fit.slope > 5 * sound.slope
    mended = fit_threshold(levels[:200], right[:200], blanks=(sum(right[200:]), 40))
    assert (mended.threshold, mended.slope, mended.blanks[1]) == (sound.threshold, sound.slope, 40)
    with pytest.raises(ValueError, match="blanks="):
        fit_threshold(levels, right, axis="log10")


def test_axes_that_are_linear_by_right_are_not_warned_of() -> None:
    assert fit_threshold(*_seen(40), axis="linear").warning == ""
    assert fit_threshold([-1.0, 0.0, 1.0] * 20, [False, True, True] * 20, guess=None).warning == ""


@pytest.mark.parametrize("level", [math.nan, math.inf, None, pd.NA, "NA"])
def test_a_level_that_is_no_number_is_the_reason(level: Any) -> None:
    levels, right = _seen(0)
    fit = fit_threshold([*levels[:6], level, *levels[7:-1], level], right)
    assert (fit.threshold, fit.slope) == (None, None)
    assert f"in trial 7 of 200 the level is {level!r}, and 1 other" in fit.reason


@pytest.mark.parametrize("answer", [math.nan, None, pd.NA, "yes", 2])
def test_an_answer_that_is_neither_right_nor_wrong_is_the_reason(answer: Any) -> None:
    levels, right = _seen(0)
    fit = fit_threshold(levels, [*right[:6], answer, *right[7:]])
    assert fit.threshold is None
    assert f"in trial 7 of 200 the answer is {answer!r}" in fit.reason


def test_the_mean_over_observers_leaves_out_who_has_no_threshold() -> None:
    sharp = fit_threshold(*_answers([0.5, 0.75, 0.95, 1, 1]))
    blunt = fit_threshold(*_answers([0.5, 0.5, 0.75, 0.95, 1]))
    hopeless = fit_threshold(*_answers([1, 1, 1, 1, 1]))
    mean = mean_threshold([sharp, blunt, hopeless])
    assert mean.observers == 2
    assert mean.value == pytest.approx(np.sqrt((sharp.threshold or 0) * (blunt.threshold or 0)))
    assert mean_threshold([hopeless]).value is None
    assert mean_threshold([sharp]).low is None


@pytest.mark.parametrize(
    ("levels", "right", "function", "words"),
    [([1.0], [True, False], "weibull", "do not go with"), ([1.0], [True], "probit", "no function 'probit'")],
)
def test_wrong_columns_and_functions_are_refused(
    levels: list[float], right: list[bool], function: str, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        fit_threshold(levels, right, function=function)


def test_trials_without_a_signal_say_how_often_yes_is_a_false_alarm() -> None:
    levels = [1, 2, 4, 8, 16] * 12
    yes = [level > 4 or (level == 4 and number % 2 == 0) for number, level in enumerate(levels)]
    never, often = (fit_threshold(levels, yes, guess=None, blanks=blanks) for blanks in ((0, 60), (12, 60)))
    assert never.guess is not None
    assert never.guess < 0.03
    assert often.guess is not None
    assert often.guess > 0.08
    assert often.guess_interval is not None
    assert never.guess_interval is not None
    assert often.guess_interval[0] > never.guess
    assert never.blanks == (0, 60)


@pytest.mark.parametrize("axis", ["log10", "linear"])
def test_where_lower_levels_are_easier_the_fit_is_the_mirrored_one(axis: str) -> None:
    rng = np.random.default_rng(8)
    levels = rng.choice([1.0, 2.0, 4.0, 8.0, 16.0], 200)
    x = np.log10(levels) if axis == "log10" else levels
    right = rng.random(200) < FUNCTIONS["normal"].probability(-x, -x.mean(), 4.0 / np.ptp(x), 0.5, 0.02)
    lower = fit_threshold(levels.tolist(), right.tolist(), function="normal", axis=axis, easier="lower")
    mirrored = 1 / levels if axis == "log10" else -levels
    higher = fit_threshold(mirrored.tolist(), right.tolist(), function="normal", axis=axis)
    assert lower.threshold is not None
    assert higher.threshold is not None
    assert lower.threshold_interval is not None
    assert higher.threshold_interval is not None
    back = [1 / each if axis == "log10" else -each for each in (higher.threshold, *higher.threshold_interval)]
    assert [lower.threshold, *lower.threshold_interval[::-1]] == pytest.approx(back, rel=1e-9)
    assert lower.slope == pytest.approx(higher.slope or 0.0, rel=1e-9)
    assert lower.probability(1.0) == pytest.approx(higher.probability(1.0 if axis == "log10" else -1.0) or 0.0)
