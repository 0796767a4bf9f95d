"""Published tables of paired comparisons, and answers drawn from known laws."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.scaling.laws import Law

# Davidson 1970: pair, wins of the first, wins of the second, ties.
PUDDING = (
    "12:19/22/16 13:16/19/12 23:19/19/10 14:18/23/13 24:23/19/9 34:19/20/15 15:13/19/18 25:16/20/12 "
    "35:16/15/17 45:17/14/16 16:18/21/12 26:22/20/12 36:13/18/10 46:14/19/18 56:11/21/12"
)
Drawer = Callable[..., Comparisons]


@pytest.fixture
def pudding() -> Comparisons:
    answers = []
    for entry in PUDDING.split():
        pair, counts = entry.split(":")
        one, other = pair[0], pair[1]
        won, lost, tied = map(float, counts.split("/"))
        answers += [Answer(one, other, won), Answer(other, one, lost), Answer(one, other, tied, tie=True)]
    return from_answers(answers, "123456")


@pytest.fixture
def draw() -> Drawer:
    """Answers of observers to each pair in each order, drawn from a law."""

    def draw_answers(
        law: Law,
        theta: NDArray[np.float64],
        *,
        k: float = 0.0,
        order: float = 0.0,
        observers: int = 10,
        repeats: int = 1,
        seed: int = 1,
    ) -> Comparisons:
        random = np.random.default_rng(seed)
        names = "abcdefghijklmnopqrstuvwxyz"[: len(theta)]
        answers = []
        for observer in range(observers):
            for first in range(len(theta)):
                for second in range(len(theta)):
                    if first == second:
                        continue
                    d = np.array([theta[first] - theta[second] + order])
                    chances = np.concatenate(law.probabilities(d, k))
                    for outcome in random.choice(3, size=repeats, p=chances):
                        pair = (names[first], names[second]) if outcome != 1 else (names[second], names[first])
                        answers.append(Answer(*pair, 1.0, f"{observer}", names[first], bool(outcome == 2)))
        return from_answers(answers, names)

    return draw_answers
