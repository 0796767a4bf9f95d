"""Simulated answers of observers who differ, by a pair or all pairs."""

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
    """Every observer answers every pair ``repeats`` times, in each group; items have the same names in all."""

    def make_answers(
        theta: NDArray[np.float64],
        observers: int,
        sd: float,
        *,
        model: Model = "bradley-terry",
        repeats: int = 1,
        groups: int = 1,
        seed: int = 1,
    ) -> Comparisons:
        random = np.random.default_rng(seed)
        n = len(theta)
        own = theta + random.normal(0, sd, (groups, observers, n))
        i, j = np.triu_indices(n, 1)
        p = LAWS[model].probabilities(own[..., i] - own[..., j], 0.0)[0]
        won = random.binomial(repeats, p)
        group, observer, pair = (part.ravel() for part in np.indices(won.shape))
        count = np.concatenate([won.ravel(), repeats - won.ravel()]).astype(float)
        columns = (np.r_[i[pair], j[pair]], np.r_[j[pair], i[pair]], np.r_[observer, observer], np.r_[group, group])
        kept = count > 0
        winner, loser, who, where = (column[kept] for column in columns)
        return from_arrays(
            tuple(f"item {place}" for place in range(n)),
            tuple(f"observer {place}" for place in range(observers)),
            winner=winner,
            loser=loser,
            observer=who,
            count=count[kept],
            winner_was_first=np.full(len(winner), -1, np.int8),
            tie=np.zeros(len(winner), np.bool_),
            group=where,
            groups=tuple(f"group {place}" for place in range(groups)) if groups > 1 else (),
        )

    return make_answers
