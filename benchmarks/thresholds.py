"""Thresholds: the time of a choice and the error against trials, the plain entropy and `questplus` beside ours.

    python benchmarks/thresholds.py

A row's error is the root mean square of the threshold's in decimal logarithms, over 40 simulated observers; the rows
of one choice have the largest difference from the plain information instead. `questplus` is timed where installed. The
rows of bias have the mean error of the posterior's median and, beside it, of its mean, over 200 observers.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from curves import program, row, seconds, sized
from numpy.typing import NDArray
from promises import Promise, times_as_fast, worst

from documents.arrays import Floats
from extensions.thresholds import FUNCTIONS, LevelChooser, QuestPlus, Staircase, fit_threshold, simulate

X = np.linspace(-2, 0, 41)
SLOPES, LAPSES = (2.0, 3.0, 4.0, 5.0), (0.0, 0.01, 0.02, 0.03, 0.04)
SLOPE, LAPSE = 3.5, 0.02
OBSERVERS = sized(40, 2)
BIAS = 0.02
TRIALS = sized((25, 50, 100, 200), (25, 100))
SHAPE = FUNCTIONS["weibull"]


def answering(right: NDArray[np.float64], rng: np.random.Generator) -> Callable[[int], bool]:
    """Return who answers right with the probability of each level, shape (levels,)."""
    return lambda level: bool(rng.random() < right[level])


def quest_plus() -> QuestPlus:
    """Return the method over 41 thresholds, four slopes and five lapse rates."""
    return QuestPlus(X, thresholds=X, slopes=SLOPES, lapses=LAPSES)


def standard() -> LevelChooser:
    """Return the method as blocks use it."""
    return QuestPlus.standard(X)


def plain_information(quest: QuestPlus, right: Floats) -> Floats:
    """Return the fall of the expected entropy from the posteriors after each answer; ``right``, shape (m, levels)."""
    before = quest.posterior
    total = np.full(right.shape[1], -float(before @ np.log(np.maximum(before, 1e-300))))
    for likelihood in (right, 1 - right):
        joint = before[:, None] * likelihood
        chance = joint.sum(axis=0)
        after = np.maximum(joint / chance, 1e-300)
        total += chance * (after * np.log(after)).sum(axis=0)
    return total


def thresholds_found(make: Callable[[], LevelChooser], trials: int, observers: int = OBSERVERS) -> tuple[Floats, float]:
    """Return the errors of the fitted thresholds (decimal logarithms), and the share of intervals with the true one."""
    errors, covered = [], 0
    for seed in range(observers):
        rng = np.random.default_rng(seed)
        true = rng.uniform(-1.4, -0.6)
        right = SHAPE.probability(X, true, SLOPE, 0.5, LAPSE)
        told = simulate(make(), trials, answering(right, rng))
        fit = fit_threshold([float(10 ** X[level]) for level, _ in told], [answer for _, answer in told])
        if fit.threshold is not None and fit.threshold_interval is not None:
            errors.append(float(np.log10(fit.threshold)) - true)
            low, high = np.log10(fit.threshold_interval)
            covered += bool(low <= true <= high)
    return np.array(errors), covered / max(len(errors), 1)


def biases(function: str, slope: float, guess: float | None, observers: int, trials: int = 100) -> tuple[float, float]:
    """Return the mean errors of the posterior's median and of its mean (decimal logarithms)."""
    medians, means = [], []
    shape = FUNCTIONS[function]
    for seed in range(observers):
        rng = np.random.default_rng(seed)
        true = rng.uniform(-1.4, -0.6)
        quest = QuestPlus.standard(X, guess=guess, function=shape)
        right = shape.probability(X, true, slope, 0.03 if guess is None else guess, LAPSE)
        simulate(quest, trials, answering(right, rng))
        medians.append(quest.median[0] - true)
        means.append(quest.mean[0] - true)
    return float(np.mean(medians)), float(np.mean(means))


def block_choice_s(guess: float | None) -> float:
    """Return the time in s of what a block computes for a trial: the level, and those that may follow either answer."""
    quest = QuestPlus.standard(X, guess=guess)
    for level in (20, 25, 15, 18, 22):
        quest.learn(level, right=level > 17)

    def trial() -> None:
        level = quest.next_level()
        quest.after(level, right=True)
        quest.after(level, right=False)

    return seconds(trial)


def run() -> dict[str, object]:
    """Time one choice three ways, and follow the error over trials by two methods."""
    quest = quest_plus()
    for level in (20, 25, 15, 18, 22):
        quest.learn(level, right=level > 17)
    right = np.clip(SHAPE.probability(X, *(quest.grid[:, [n]] for n in range(4))), 1e-12, 1 - 1e-12)
    error = float(np.abs(quest.information() - plain_information(quest, right)).max())
    rows: list[dict[str, object]] = [
        row("one choice, ours", "820 × 41", seconds(quest.next_level), error),
        row("one choice, plain entropy", "820 × 41", seconds(lambda: plain_information(quest, right)), 1e-16),
    ]
    peer = _peer()
    if peer is not None:
        rows.append(row("one choice, questplus", "820 × 41", peer, 1e-16))
    slowest = 0.0
    for words, guess in (("forced choice, 2196", 0.5), ("yes or no, 4941", None)):
        taken = block_choice_s(guess)
        slowest = max(slowest, taken)
        rows.append(row("a trial of a block", f"{words} × 41", taken))
    methods: dict[str, Callable[[], LevelChooser]] = {
        "QUEST+": lambda: QuestPlus.standard(X),
        "staircase": lambda: Staircase(41, 35),
    }
    for name, make in methods.items():
        for trials in TRIALS:
            errors, _ = thresholds_found(make, trials)
            rms = float(np.sqrt(np.mean(errors**2)))
            time_s = seconds(
                lambda make=make, trials=trials: simulate(make(), trials, lambda level: level > 20), repeats=3
            )
            note = f"bias {errors.mean():+.3f}, {len(errors)} of {OBSERVERS} with a threshold"
            rows.append(row(name, f"{trials} trials", time_s, rms, note=note))
    farthest = 0.0
    for function, slope, guess in (
        ("weibull", 3.5, 0.5),
        ("logistic", 8.0, 0.5),
        ("normal", 5.0, 0.5),
        ("weibull", 3.5, None),
    ):
        median, mean = biases(function, slope, guess, sized(200, 3))
        farthest = max(farthest, abs(median))
        task = "yes or no" if guess is None else "forced choice"
        for series, bias in (("bias of the median", median), ("bias of the mean", mean)):
            rows.append(row(series, f"{function}, {task}", None, abs(bias)))
    choice_ms = 1000 * float(str(rows[0]["seconds"]))
    promises = [
        Promise(
            "expected entropy against the plain formula",
            worst(rows, series="one choice, ours"),
            1e-10,
            "error",
            unit="nats",
        ),
        Promise(
            "one choice beside the plain formula",
            times_as_fast(rows, "one choice, ours", "one choice, plain entropy"),
            5.0,
            "ratio",
            "at least",
            "×",
        ),
        Promise("one choice", choice_ms, 5.0, "seconds", unit="ms"),
        Promise("a trial of a block: the level, and both that may follow", 1000 * slowest, 5.0, "seconds", unit="ms"),
        Promise("largest bias of QUEST+ after 100 trials, in decimal logarithms", farthest, BIAS, "share"),
        Promise(
            f"error of QUEST+ after {TRIALS[-1]} trials beside a staircase's",
            worst(rows, series="QUEST+", parameter=f"{TRIALS[-1]} trials")
            / worst(rows, series="staircase", parameter=f"{TRIALS[-1]} trials"),
            1.0,
            "share",
        ),
    ]
    return {"title": "Thresholds: time of choosing and error against trials", "rows": rows, "promises": promises}


def _peer() -> float | None:
    try:
        from questplus.qp import QuestPlus as Peer  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        return None
    peer = Peer(
        stim_domain={"intensity": X * 20},
        param_domain={"threshold": X * 20, "slope": SLOPES, "lower_asymptote": [0.5], "lapse_rate": LAPSES},
        outcome_domain={"response": ["Correct", "Incorrect"]},
        func="weibull",
        stim_scale="dB",
        stim_selection_method="min_entropy",
        param_estimation_method="mode",
    )
    return seconds(lambda: peer.next_stim, repeats=3)


if __name__ == "__main__":
    program("thresholds", run)
