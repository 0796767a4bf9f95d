"""Small studies with answers of many observers."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers

Study = Callable[..., Comparisons]


@pytest.fixture(scope="session")
def study() -> Study:
    """Make every observer answer every pair once, each with strengths of their own about ``theta``."""

    def make(theta: Sequence[float], observers: int = 12, *, seed: int = 0, observer_sd: float = 0.5) -> Comparisons:
        random = np.random.default_rng(seed)
        answers = []
        for number in range(observers):
            own = np.asarray(theta) + random.normal(0, observer_sd, len(theta))
            for first in range(len(own)):
                for second in range(first):
                    ahead = random.random() < 1 / (1 + np.exp(own[second] - own[first]))
                    winner, loser = (first, second) if ahead else (second, first)
                    answers.append(Answer(f"item {winner}", f"item {loser}", observer=f"{number:02d}"))
        return from_answers(answers, [f"item {item}" for item in range(len(theta))])

    return make
