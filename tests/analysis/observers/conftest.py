"""Observers who answer by given strengths, and others who toss a coin."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from documents.arrays import Floats

Study = Callable[..., Comparisons]


@pytest.fixture
def study() -> Study:
    """Return a function: each row of ``theta`` (observers, n) is an observer's own strengths; every pair ``times``."""

    def make(theta: Floats, random: np.random.Generator, times: int = 1) -> Comparisons:
        answers = []
        for person, own in enumerate(theta):
            for one, other in combinations(range(len(own)), 2):
                for _ in range(times):
                    wins = random.random() < 1 / (1 + np.exp(own[other] - own[one]))
                    winner, loser = (one, other) if wins else (other, one)
                    first = (one, other)[random.integers(2)]
                    answers.append(Answer(f"i{winner}", f"i{loser}", 1.0, f"{person:02d}", f"i{first}"))
        return from_answers(answers, [f"i{item}" for item in range(theta.shape[1])])

    return make
