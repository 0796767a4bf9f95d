"""Simulated answers of observers who are alike, or each have their own strengths."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.comparisons import Comparisons
from analysis.comparisons.comparisons import from_arrays
from analysis.scaling import LAWS, Model

Maker = Callable[..., Comparisons]


@pytest.fixture
def make() -> Maker:
    """Every observer answers every pair ``repeats`` times by a law, either item first."""

    def make_answers(
        theta: NDArray[np.float64],
        observers: int = 8,
        *,
        model: Model = "bradley-terry",
        k: float = 0.0,
        sd: float = 0.0,
        repeats: int = 1,
        gaps: float = 0.0,
        seed: int = 1,
    ) -> Comparisons:
        random = np.random.default_rng(seed)
        n = len(theta)
        first, second = (np.tile(np.repeat(side, repeats), observers) for side in np.triu_indices(n, 1))
        observer = np.repeat(np.arange(observers), len(first) // observers)
        own = theta + random.normal(0, sd, (observers, n))
        d = own[observer, first] - own[observer, second]
        chances = np.cumsum(np.stack(LAWS[model].probabilities(d, k)), axis=0)
        outcome = (random.random(len(d)) > chances[:2]).sum(axis=0)
        kept = random.random(len(d)) >= gaps
        lost = outcome == 1
        winner, loser = np.where(lost, second, first)[kept], np.where(lost, first, second)[kept]
        return from_arrays(
            tuple("abcdefghijklmnopqrstuvwxyz"[:n]),
            tuple(f"{person:02d}" for person in range(observers)),
            winner=winner,
            loser=loser,
            observer=observer[kept],
            count=np.ones(len(winner)),
            winner_was_first=random.integers(0, 2, len(winner)).astype(np.int8),
            tie=(outcome == 2)[kept],
        )

    return make_answers
