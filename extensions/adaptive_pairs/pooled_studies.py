"""Simulated studies in which pairs are chosen by the answers of all observers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from documents.arrays import Floats
from extensions.adaptive_pairs.pair_choice import Gain
from extensions.adaptive_pairs.pooled_choice import PooledChooser, pooled_batch
from runner.ports import PooledAnswers


@dataclass(slots=True)
class _Observer:
    chooser: PooledChooser
    theta: Floats
    left: int
    wins: Floats
    rng: np.random.Generator

    def answer(self, pairs: Sequence[tuple[int, int]]) -> None:
        for first, second in pairs:
            won = float(self.rng.random() < 1 / (1 + np.exp(self.theta[second] - self.theta[first])))
            self.chooser.learn(first, second, first_share=won)
            self.wins[first, second] += won
            self.wins[second, first] += 1.0 - won
        self.left -= len(pairs)


def pooled_study(
    theta: Floats,
    trials: int,
    *,
    seed: str,
    batch: int | None = None,
    gain: Gain = "variance",
    at_once: int = 1,
) -> Floats:
    """Simulate a study of pooled active pairs and return each observer's wins.

    Parameters
    ----------
    theta
        Shape (observers, n): strengths in nats by which each observer answers, in the order in which they come.
    trials
        Pairs that each observer is asked about.
    seed
        What orders and answers follow.
    batch
        Pairs chosen at a time, as in `ActivePairs`; `pooled_batch` if None.
    gain
        What pairs are chosen by.
    at_once
        How many observers sit at stations of their own at a time, and are all in the same batch.

    Returns
    -------
    ndarray
        Shape (observers, n, n): how often each observer preferred stimulus i over j.

    Examples
    --------
    >>> import numpy as np
    >>> wins = pooled_study(np.zeros((3, 6)), 10, seed="1")
    >>> wins.sum(axis=(1, 2)).tolist()
    [10.0, 10.0, 10.0]
    """
    observers, n = theta.shape
    names = tuple(str(number) for number in range(n))
    pooled, wins = np.zeros((n, n)), np.zeros((observers, n, n))
    for begin in range(0, observers, at_once):
        sitting = [
            _Observer(
                PooledChooser(names, (tuple(range(n)),), (trials,), batch or pooled_batch(n), f"{seed}/{number}", gain),
                theta[number],
                trials,
                wins[number],
                np.random.default_rng([*seed.encode(), number]),
            )
            for number in range(begin, min(observers, begin + at_once))
        ]
        while waiting := [one for one in sitting if one.left]:
            known = pooled + sum(one.wins for one in sitting)
            chosen = [one.chooser.take(one.chooser.choose(PooledAnswers(known - one.wins))) for one in waiting]
            for one, pairs in zip(waiting, chosen, strict=True):
                one.answer(pairs)
        pooled += sum(one.wins for one in sitting)
    return wins
