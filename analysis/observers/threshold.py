"""The strength at which answers with a right and a wrong turn from guessing to certainty, by maximum likelihood."""

from __future__ import annotations

import math
from collections.abc import Sequence

SLOPE = 4.0  # log odds per factor of e in strength
LAPSES = 0.02
_STEP = 0.02
_BEYOND = math.log(2.0)


def threshold_estimate(strengths: Sequence[float], right: Sequence[bool], options: int) -> float | None:
    """Return the strength half-way between guessing among ``options`` and certainty, None if the answers leave it open.

    The probability of a right answer is guess + (1 - guess - lapses) · logistic(slope · ln(strength / threshold)), with
    a slope of 4 and 0.02 lapses: a few answers cannot tell these two. The estimate is sought from half the smallest of
    ``strengths``, all above 0, to twice the largest; a best value at either end is none.
    """
    if not strengths:
        return None
    guess = 1.0 / options
    low = math.log(min(strengths)) - _BEYOND
    count = math.ceil((math.log(max(strengths)) + _BEYOND - low) / _STEP)
    places = [math.log(strength) for strength in strengths]

    def log_likelihood(threshold: float) -> float:
        total = 0.0
        for place, was_right in zip(places, right, strict=True):
            known = 1.0 / (1.0 + math.exp(-SLOPE * (place - threshold)))
            chance = guess + (1.0 - guess - LAPSES) * known
            total += math.log(chance if was_right else 1.0 - chance)
        return total

    likelihoods = [log_likelihood(low + _STEP * index) for index in range(count + 1)]
    best = max(range(count + 1), key=likelihoods.__getitem__)
    return None if best in (0, count) else math.exp(low + _STEP * best)
