"""Thresholds at the edges: coverage and bias by simulation, long staircases, thousands of trials."""

from __future__ import annotations

import random
import time
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.thresholds import FUNCTIONS, QuestPlus, Staircase, fit_threshold, simulate
from runner.blocks import Draft, Response, Stimuli
from runner.ports import Ask, Choose
from tests.runner.every_kind import met, setting
from tests.stress.how_many import how_many

pytestmark = pytest.mark.stress
X = np.linspace(-2, 0, 21)


def answering(right: NDArray[np.float64], rng: np.random.Generator) -> Callable[[int], bool]:
    """Return who answers right with the probability of each level, shape (levels,)."""
    return lambda level: bool(rng.random() < right[level])


@pytest.mark.parametrize(
    ("name", "slope", "guess"),
    [
        ("weibull", 3.5, 0.5),
        ("logistic", 8.0, 0.5),
        ("normal", 5.0, 0.5),
        ("weibull", 3.5, None),
        ("logistic", 8.0, None),
    ],
)
def test_intervals_cover_and_thresholds_are_unbiased(name: str, slope: float, guess: float | None) -> None:
    """Of simulated observers (fewer of yes/no, where a fit takes longer) with 100 trials by QUEST+.

    Three standard errors of a share are allowed.
    """
    studies = how_many(100, 300) if guess is None else how_many(200, 600)
    shape, rng = FUNCTIONS[name], np.random.default_rng(5)
    covered, errors, medians, means = 0, [], [], []
    for _ in range(studies):
        true = rng.uniform(-1.4, -0.6)
        right = shape.probability(X, true, slope, 0.03 if guess is None else guess, 0.02)
        quest = QuestPlus.standard(X, guess=guess, function=shape)
        told = simulate(quest, 100, answering(right, rng))
        fit = fit_threshold(
            [float(10 ** X[n]) for n, _ in told], [answer for _, answer in told], guess=guess, function=name
        )
        medians.append(quest.median[0] - true)
        means.append(quest.mean[0] - true)
        if fit.threshold is None or fit.threshold_interval is None:
            continue
        errors.append(np.log10(fit.threshold) - true)
        low, high = np.log10(fit.threshold_interval)
        covered += bool(low <= true <= high)
    print(
        f"\n{name} {slope:g}, guess {guess}: bias of the median {np.mean(medians):+.4f} (sd {np.std(medians):.3f}), "
        f"of the mean {np.mean(means):+.4f}, of the fit {np.mean(errors):+.4f}; covered {covered / len(errors):.3f}"
    )
    assert len(errors) > 0.98 * studies
    slack = 3 * np.sqrt(0.95 * 0.05 / studies)
    assert 0.93 - slack < covered / len(errors) < 0.97 + slack
    # The prior of lapses draws the fit's median below: -0.02 was measured, half of the error's standard deviation.
    assert abs(np.mean(errors)) < np.std(errors)
    assert abs(np.mean(medians)) < 0.02


@pytest.mark.parametrize(("up", "down"), [(1, 1), (3, 1), (7, 3), (1, 2)])
def test_long_staircases_come_to_their_share(up: int, down: int) -> None:
    rng, p = np.random.default_rng(2), np.linspace(0.0, 1.0, 101)
    told = simulate(Staircase(101, 50, up, down), 100_000, lambda level: bool(rng.random() < p[level]))
    assert np.mean([right for _, right in told]) == pytest.approx(up / (up + down), abs=0.005)


def test_ten_thousand_trials_narrow_the_interval() -> None:
    rng = np.random.default_rng(4)
    levels = 10 ** rng.choice(X, 10_000)
    right = rng.random(10_000) < FUNCTIONS["weibull"].probability(np.log10(levels), -1.0, 3.0, 0.5, 0.01)
    fit = fit_threshold(levels.tolist(), right.tolist())
    assert fit.threshold == pytest.approx(0.1, rel=0.06)
    assert fit.threshold_interval is not None
    assert fit.threshold_interval[1] / fit.threshold_interval[0] < 1.15


@pytest.mark.parametrize(("task", "tracks"), [("yes_no", 1), ("two_places", 6)])
def test_thousands_of_trials_and_a_hundred_levels(task: str, tracks: int) -> None:
    """2400 trials on 120 levels: as many records, the last chosen as soon as the first, within a frame."""
    levels = [float(level) for level in np.geomspace(0.001, 1, 120)]
    stimuli = Stimuli({"blank": {"c": 0.0}} | {f"s{n}": {"c": level} for n, level in enumerate(levels)})
    method = {"kind": "quest_plus", "tracks": tracks}
    place = setting(stimuli)
    block = met("threshold", place, factor="c", task=task, reference="blank", trials=2400 // tracks, method=method)
    steps, rng = block.steps(), random.Random(1)
    taken: list[float] = []
    drafts: list[Draft] = []
    response: Response | None = None
    while True:
        began = time.process_time()
        try:
            step = steps.send(response)
        except StopIteration:
            break
        taken.append(time.process_time() - began)
        response = None
        if isinstance(step, Draft):
            drafts.append(step)
        elif isinstance(step, Ask):
            assert isinstance(step.task, Choose)
            sees = rng.random() < 0.5 + 0.5 / (1 + (0.05 / (step.task.strength or 1e-9)) ** 4)
            wrong = next(option for option in step.task.options if option != step.task.correct)
            response = Response("x", str(step.task.correct) if sees else wrong, 0.5)
    assert len(drafts) == block.trials == 2400
    trial_s = sum(taken) / block.trials
    print(f"\n{task}: choosing takes {1e3 * trial_s:.2f} ms of processor time a trial")
    assert trial_s < 1 / 60
    first_s, last_s = np.median(taken[:200]), np.median(taken[-200:])
    assert last_s < 2 * first_s
