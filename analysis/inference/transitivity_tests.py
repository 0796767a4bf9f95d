"""Stochastic transitivity: triples of items whose observed shares contradict a scale.

With p_ij the share of answers that prefer i over j, a tie being half a preference, and p_ij ≥ ½ and p_jk ≥ ½, the three
properties ask [Tversky1969]

    weak p_ik ≥ ½,   moderate p_ik ≥ min(p_ij, p_jk),   strong p_ik ≥ max(p_ij, p_jk)

Every law here has all three, but shares of few answers break them by chance. How many triples then break them is
simulated, with items whose sums of preferences are as observed: residuals that independent answers would leave, and
residuals that other observers would leave (a wild bootstrap over observers), both with what moves the strengths taken
out, are added to the fitted expectations. Shares are rounded to the steps that so many answers can take. The test
statistic is the sum over triples of how far p_ik falls short, which sees a circle that a mere count does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.classes.classes import check_level
from analysis.classes.conclusions import verdict_of
from analysis.errors import ResultsError
from analysis.inference.answer_residuals import answer_residuals, by_unordered_pair
from analysis.scaling.scores import Scores
from documents import Finding
from documents.arrays import Floats, Indices
from documents.text import JsonResult

PROPERTIES = ("weak", "moderate", "strong")
REPLICATES = 2000
SEED = 2016
SLACK = 1e-9  # shares that are equal but for rounding are equal
MOST_LISTED = 100
MOST_TRIPLES = 300_000
MOST_CELLS = 20_000_000
FEWEST_REPLICATES = 99
BLOCK = 2_000_000


@dataclass(frozen=True, slots=True)
class PropertyTest(JsonResult):
    """How many triples break one property, and how many break it by chance.

    Attributes
    ----------
    name
        ``weak``, ``moderate`` or ``strong``.
    broken, shortfall
        How many triples break it, and the sum of how far the shares of these triples fall short.
    expected, most
        Mean and 95th percentile of the number of broken triples if the model is right and answers are independent.
    p
        Chance of a shortfall at least as large then.
    expected_observers, most_observers, p_observers
        The same if the model is right and the answers of each observer depend on each other as they do here; None with
        fewer than three observers.
    exceeds
        Whether both p values are at most the level: more than chance alone explains.
    """

    name: str
    broken: int
    shortfall: float
    expected: float
    most: float
    p: float
    expected_observers: float | None
    most_observers: float | None
    p_observers: float | None
    exceeds: bool


@dataclass(frozen=True, slots=True)
class BrokenTriple(JsonResult):
    """A triple that contradicts a scale: shares of ``items[0]`` over ``[1]``, ``[1]`` over ``[2]``, ``[0]`` over
    ``[2]``.

    ``breaks`` is the weakest property that it breaks, and with it all stronger ones; ``depth`` is how far the last
    share lies below the larger of the others.
    """

    items: tuple[str, str, str]
    shares: tuple[float, float, float]
    breaks: str
    depth: float


@dataclass(frozen=True, slots=True)
class Transitivity(JsonResult):
    """Stochastic transitivity of all triples whose three pairs were compared.

    Attributes
    ----------
    triples
        How many there are.
    weak, moderate, strong
        How many break each property, beside how many would by chance.
    broken
        The triples that break one, at most 100: those that break the weakest property first, the deepest first.
    pairs
        Pairs by how many triples they break: the pair whose share is too low in each.
    replicates, alpha
        Simulated studies of each kind, and the level of ``exceeds``.
    """

    triples: int
    weak: PropertyTest
    moderate: PropertyTest
    strong: PropertyTest
    broken: tuple[BrokenTriple, ...]
    pairs: tuple[tuple[str, str, int], ...]
    replicates: int
    alpha: float
    json_keys: ClassVar = {"by_name": "*", "shared_pairs": "pairs"}
    json_names: ClassVar = "triples by_name broken shared_pairs replicates alpha"

    @property
    def properties(self) -> tuple[PropertyTest, PropertyTest, PropertyTest]:
        """The three tests."""
        return self.weak, self.moderate, self.strong

    @property
    def sentence(self) -> str:
        """What is broken how often, and whether that is distinguished from chance."""
        counts = ", ".join(
            f"{test.name} {test.broken} (by chance about {test.expected:.1f}; p = {_largest(test):.2g})"
            for test in self.properties
        )
        excess = [test.name for test in self.properties if test.exceeds]
        words = f"Of {self.triples} triples these break stochastic transitivity: {counts}."
        if not excess:
            return f"{words} {verdict_of(False).capitalize()} from chance, which is no proof of transitivity."
        return f"{words} {verdict_of(True).capitalize()} from chance: {', '.join(excess)}."

    @property
    def by_name(self) -> dict[str, PropertyTest]:
        """The tests by name."""
        return {test.name: test for test in self.properties}

    @property
    def shared_pairs(self) -> list[dict[str, Any]]:
        """Each pair with the number of triples that break it."""
        return [{"first": first, "second": second, "triples": number} for first, second, number in self.pairs]


def _largest(test: PropertyTest) -> float:
    return test.p if test.p_observers is None else max(test.p, test.p_observers)


def transitivity(
    scores: Scores, *, alpha: float = 0.05, replicates: int = REPLICATES, seed: int = SEED
) -> Transitivity | None:
    """Count the triples that break weak, moderate and strong stochastic transitivity, and how many would by chance.

    Parameters
    ----------
    scores
        Scores of paired comparisons, by any law.
    alpha
        Level at which there are more than chance explains.
    replicates
        Simulated studies of each kind; fewer, at least 99, with more than 10,000 triples.
    seed
        Random seed of the simulation: the same seed gives the same p values.

    Returns
    -------
    Transitivity or None
        None if no three items were all compared with each other.

    Raises
    ------
    ResultsError
        If there are no finite strengths, more than 300,000 triples (some 120 items), or a choice is out of range.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> votes = {"ab": 30, "ba": 10, "bc": 30, "cb": 10, "ac": 10, "ca": 30}
    >>> result = transitivity(score(from_answers([Answer(*pair, count) for pair, count in votes.items()])))
    >>> result.weak.broken, result.broken[0].items, result.broken[0].shares
    (1, ('a', 'b', 'c'), (0.75, 0.75, 0.25))
    """
    check_level(alpha)
    if replicates < 1:
        raise ResultsError(Finding(f"{replicates} replicates were asked for", remedy=f"ask for {REPLICATES}"))
    own = answer_residuals(scores)
    low, high, place, sign = by_unordered_pair(own.counts)
    size, n = len(low), own.counts.n

    def together(values: Floats) -> Floats:
        """Sum over both orders of each pair, shapes (..., P) to (..., Q)."""
        if size == len(place) and (sign > 0).all():
            return values
        summed = np.zeros((*values.shape[:-1], size))
        np.add.at(np.moveaxis(summed, -1, 0), place, np.moveaxis(values, -1, 0))
        return summed

    total = together(own.total)
    observed = together(np.where(sign > 0, own.y, own.total - own.y))
    expected = together(own.total * np.where(sign > 0, own.mean, 1 - own.mean))
    sides = _triples(low, high, n)
    triples = sides.shape[1]
    if not triples:
        return None
    if triples > MOST_TRIPLES:
        what = f"there are {triples:,} triples of items, more than {MOST_TRIPLES:,}"
        raise ResultsError(Finding(what, remedy="ask for the transitivity of fewer items"))
    draws = (
        int(np.clip(MOST_CELLS // triples, FEWEST_REPLICATES, replicates))
        if replicates > FEWEST_REPLICATES
        else replicates
    )
    excess = observed / total - 0.5
    short = _shortfalls(excess[None], sides)[:, 0]
    broken = short > SLACK
    random = np.random.default_rng(seed)
    step = 0.5 if own.chances[:, 2].any() else 1.0
    whole = bool((total == np.rint(total)).all())

    def by_chance(residuals: Floats) -> Floats:
        """Return how many triples break each property in each study, and their shortfall, shape (2, 3, draws)."""
        y = np.clip(expected + together(residuals * sign), 0, total)
        if whole:
            y = np.rint(y / step) * step
        shares = y / total - 0.5
        size_of_block = max(1, BLOCK // triples)
        parts = [
            _summed(_shortfalls(shares[start : start + size_of_block], sides))
            for start in range(0, len(shares), size_of_block)
        ]
        return np.concatenate(parts, axis=2)

    here = _summed(short)
    independent = by_chance(own.drawn(draws, random))
    clustered = by_chance(own.resampled(draws, random)) if len(own.by_observer) > 2 else None
    tests = [
        _test(name, here[:, row], independent[:, row], None if clustered is None else clustered[:, row], alpha)
        for row, name in enumerate(PROPERTIES)
    ]
    listed, spanning = _named(excess, sides, broken, low, high, scores.comparisons.items)
    return Transitivity(triples, tests[0], tests[1], tests[2], listed, spanning, draws, alpha)


def _summed(short: Floats) -> Floats:
    """Return the number of broken triples and their shortfall. Shapes (..., T) to (2, ...)."""
    return np.stack([(short > SLACK).sum(axis=-1), short.sum(axis=-1)])


def _test(name: str, here: Floats, independent: Floats, clustered: Floats | None, alpha: float) -> PropertyTest:
    """Compare the number of broken triples and their shortfall (2,) with those of simulated studies (2, draws)."""

    def tail(studies: Floats) -> float:
        reached = studies[1] >= here[1] * (1 - SLACK) - SLACK
        return float((1 + reached.sum()) / (1 + len(reached)))

    p, p_observers = tail(independent), None if clustered is None else tail(clustered)
    return PropertyTest(
        name=name,
        broken=int(here[0]),
        shortfall=float(here[1]),
        expected=float(independent[0].mean()),
        most=float(np.quantile(independent[0], 0.95)),
        p=p,
        expected_observers=None if clustered is None else float(clustered[0].mean()),
        most_observers=None if clustered is None else float(np.quantile(clustered[0], 0.95)),
        p_observers=p_observers,
        exceeds=p <= alpha and (p_observers is None or p_observers <= alpha),
    )


def _triples(low: Indices, high: Indices, n: int) -> Indices:
    """Return the pairs (i, j), (j, k) and (i, k) of each triple i < j < k whose pairs are all there, shape (3, T)."""
    at = np.full((n, n), -1, dtype=np.intp)
    at[low, high] = np.arange(len(low))
    linked = at >= 0
    sides = []
    for i in range(n - 2):
        j, k = np.nonzero(linked & linked[i][:, None] & linked[i][None, :])
        sides.append(np.stack([at[i, j], at[j, k], at[i, k]]))
    return np.concatenate(sides, axis=1) if sides else np.zeros((3, 0), dtype=np.intp)


def _orders(excess: Floats, sides: Indices) -> list[tuple[tuple[int, int, int], Floats, Floats, Floats]]:
    """Return for each order a, b, c of a triple's places what p_ab, p_bc and p_ac exceed ½ by."""
    ij, jk, ik = (excess[..., side] for side in sides)
    return [
        ((0, 1, 2), ij, jk, ik),
        ((0, 2, 1), ik, -jk, ij),
        ((1, 0, 2), -ij, ik, jk),
        ((1, 2, 0), jk, -ik, -ij),
        ((2, 0, 1), -ik, ij, -jk),
        ((2, 1, 0), -jk, -ij, -ik),
    ]


def _shortfalls(excess: Floats, sides: Indices) -> Floats:
    """Return how far each triple falls short of each property, 0 where it has it.

    Shapes (B, Q) and (3, T) to (3, B, T). Of the orders that a property applies to, the worst counts.
    """
    short = np.zeros((3, len(excess), sides.shape[1]))
    for _, ab, bc, ac in _orders(excess, sides):
        least = np.minimum(ab, bc)
        applies = least >= -SLACK
        for row, bound in enumerate((np.zeros(1), least, np.maximum(ab, bc))):
            np.maximum(short[row], np.where(applies, bound - ac, 0.0), out=short[row])
    return short


def _named(
    excess: Floats,
    sides: Indices,
    broken: NDArray[np.bool_],
    low: Indices,
    high: Indices,
    names: tuple[str, ...],
) -> tuple[tuple[BrokenTriple, ...], tuple[tuple[str, str, int], ...]]:
    """Return the worst broken triples, each in the order in which it is broken deepest, and pairs by breaks."""
    some = np.flatnonzero(broken[2])
    items = np.stack([low[sides[0, some]], high[sides[0, some]], high[sides[1, some]]])
    orders = _orders(excess, sides[:, some])
    depth = np.stack([np.where(np.minimum(ab, bc) >= -SLACK, np.maximum(ab, bc) - ac, -1) for _, ab, bc, ac in orders])
    deepest = (depth >= depth.max(axis=0, initial=-1) - SLACK).argmax(axis=0)
    kind = 3 - broken[:, some].sum(axis=0)
    spans: dict[tuple[int, int], int] = {}
    lines = []
    for row in range(len(some)):
        places, ab, bc, ac = orders[deepest[row]]
        a, b, c = (int(items[place, row]) for place in places)
        spans[a, c] = spans.get((a, c), 0) + 1
        shares = (float(ab[row]) + 0.5, float(bc[row]) + 0.5, float(ac[row]) + 0.5)
        below = max(shares[:2]) - shares[2]
        triple = BrokenTriple((names[a], names[b], names[c]), shares, PROPERTIES[kind[row]], below)
        lines.append((int(kind[row]), -below, triple))
    lines.sort(key=lambda line: line[:2])
    pairs = sorted(spans.items(), key=lambda entry: (-entry[1], entry[0]))
    return (
        tuple(triple for _, _, triple in lines[:MOST_LISTED]),
        tuple((names[a], names[c], number) for (a, c), number in pairs[:MOST_LISTED]),
    )
