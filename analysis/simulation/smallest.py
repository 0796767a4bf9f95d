"""The smallest difference between two items that a design finds in most studies, by simulated studies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.choices import SEED, TARGET, Adjust, CovarianceChoice
from analysis.comparisons.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.scaling.laws import NATS_PER_JND
from analysis.scaling.separation import compared_groups
from analysis.simulation.plan import Plan
from analysis.simulation.simulation import blocks_of, simulate, summed
from analysis.simulation.studies import matrices
from documents import Finding, one_blas_thread
from documents.text import JsonResult

TYPICAL_SD = 0.7  # between observers in nats, where none is measured
MOST_NATS = float(np.log(99))  # 99 % of choices
# Each 30 % above the last, down to 0.09 nats; between two of them the probit of power is nearly straight.
TRIED_NATS = MOST_NATS / 1.3 ** np.arange(14, -1, -1.0)
MOST_STUDIES, FEWEST_STUDIES, MOST_NUMBERS = 200, 60, 400_000
MOST_PAIRS = 8
MOST_ITEMS = 60  # above, fitting so many studies takes longer than a check may


@dataclass(frozen=True, slots=True)
class SmallestDifference(JsonResult):
    """The smallest difference between two items that a design finds in most studies.

    The two items differ so; all others lie midway between them. Of the places tried it is the one where power grows
    with the difference to its end. Elsewhere a difference within a tenth of it is found, or a larger one, or none where
    observers are few (decision 0083).

    Attributes
    ----------
    observers, items
        How many there are.
    nats
        The difference of the two items' log scores in the average answer; None if none up to `MOST_NATS` is found often
        enough. ``error_nats`` is its Monte-Carlo standard error.
    found_of_most
        Share (0 to 1) of the studies that find a difference of `MOST_NATS`; None where a smaller one is found.
    target
        Share (0 to 1) of the studies that are to find it.
    observer_sd
        Standard deviation between observers in nats, of each item's log score.
    alpha
        Level at which pairs are tested.
    studies, seed
        How many were simulated of each difference that was tried, and their random seed.
    group
        Name of the group of items that it is of, where pairs were compared within groups.
    """

    observers: int
    items: int
    nats: float | None
    error_nats: float | None
    found_of_most: float | None
    target: float
    observer_sd: float
    alpha: float
    studies: int
    seed: int
    group: str = ""
    most_nats: ClassVar = MOST_NATS
    json_keys: ClassVar = {"group_name": "group", "one_camp": "one_camp_in"}
    json_names: ClassVar = (
        "observers group_name nats error_nats percent_of_choices jnd most_nats found_of_most target observer_sd "
        "studies seed size sentence assumed one_camp warnings"
    )

    @property
    def size(self) -> str:
        """The difference in words, such as "1.3 nats (79 % of choices, 1.2 JND)", or "none up to ..."."""
        if self.nats is None:
            return f"none up to {_size(MOST_NATS)}"
        return ("at most " if self.nats <= TRIED_NATS[0] else "") + _size(self.nats)

    @property
    def sentence(self) -> str:
        """What the design finds, in a sentence."""
        often, who = f"in {100 * self.target:g} % of studies", f"{self.observers} observers{self._where}"
        if self.found_of_most is not None:
            most = f"one of {_size(MOST_NATS)} in {100 * self.found_of_most:.0f} %"
            return f"With {who}, this design finds no difference {often}: {most}."
        return f"With {who}, this design finds a difference of {self.size} {often}."

    @property
    def assumed(self) -> str:
        """What was assumed for that, in a sentence."""
        return f"Assumed: {self._world}."

    @property
    def methods(self) -> str:
        """The sentences of a paper's Methods: `sentence` with what was assumed, and `camps`."""
        often = f"found in {100 * self.target:g} % of studies"
        what = f"the smallest difference between two stimuli{self._where} that is {often} is {self.size}"
        if self.found_of_most is not None:
            what = f"no difference between two stimuli{self._where} is {often}, not even one of {_size(MOST_NATS)}"
        how = f"{self.studies} studies of each difference tried, seed {self.seed}"
        said = f"By simulation of this design ({how}), if {self._world}, {what}."
        return f"{said} {self.camps}" if self.camps else said

    @property
    def _where(self) -> str:
        return f" in the group {self.group}" if self.group else ""

    @property
    def _world(self) -> str:
        others = "" if self.items == 2 else ", and all other stimuli lie midway between the two"
        return f"observers differ by {self.observer_sd:g} nats{others}"

    @property
    def one_camp(self) -> int | None:
        """N, where all observers are of one of two equally large camps in one study of N; None if below ``alpha``."""
        studies: int = 2 ** min(self.observers - 1, 60)
        return studies if 1 < studies < 1 / self.alpha else None

    @property
    def camps(self) -> str | None:
        """A warning that all observers may think alike where people do not; None as `one_camp`."""
        if self.one_camp is None:
            return None
        who = "both observers" if self.observers == 2 else f"all {self.observers} observers"
        return (
            f"Where people are in two camps of opposite opinions, {who} are of the same camp in 1 study of "
            f"{self.one_camp}. The differences found are then that camp's: for people as a whole they may be the wrong "
            "way round, and nothing in the answers shows it."
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader needs to know of the design before its results; empty for one that finds differences."""
        none = (f"{self.sentence} {self.assumed}",) if self.nats is None else ()
        return (*none, self.camps) if self.camps else none

    @property
    def group_name(self) -> str | None:
        """The group, None without groups."""
        return self.group or None

    @property
    def percent_of_choices(self) -> float | None:
        """How often the better of two items is chosen at that difference."""
        return None if self.nats is None else _percent(self.nats)

    @property
    def jnd(self) -> float | None:
        """The difference in just noticeable differences."""
        return None if self.nats is None else self.nats / NATS_PER_JND


def smallest_difference(
    times: NDArray[np.int64],
    observers: int,
    *,
    alpha: float = 0.05,
    adjust: Adjust = "holm",
    covariance: CovarianceChoice = "auto",
    observer_sd: float = TYPICAL_SD,
    target: float = TARGET,
    seed: int = SEED,
) -> SmallestDifference | None:
    """Return the smallest difference between two items that a design finds often enough, by simulated studies.

    Parameters
    ----------
    times
        How often each observer compares each pair of n items, as `Plan` has it: shape (P,), or (R, P) where observers
        differ.
    observers
        How many there are, at least 2: the tests of one observer say nothing of others.
    alpha, adjust, covariance
        How pairs are tested, as `Plan` has it.
    observer_sd
        Standard deviation of each observer's own log score of each item, in nats.
    target
        Share (0 to 1) of the studies that are to find the difference, in the right direction.
    seed
        Random seed: the same gives the same result.

    Returns
    -------
    SmallestDifference | None
        None for one observer, for more than 60 items, and where the pairs leave items without a common scale. Where
        pairs differ in how often they are compared, it is that of a pair drawn at random.

    Raises
    ------
    ResultsError
        As `blocks_of` and `summed`, or if ``target`` is not between 0 and 1.

    Examples
    --------
    >>> smallest = smallest_difference(np.ones(15, dtype=int), 20)
    >>> smallest.observers, round(smallest.nats, 1), smallest.warnings
    (20, 1.2, ())
    """
    if not 0 < target < 1:
        remedy = "give one between 0 and 1, such as 0.8"
        raise ResultsError(Finding(f"the share of studies that are to find the difference is {target}", remedy=remedy))
    rows = np.atleast_2d(times)[:observers]
    n = (1 + int(np.sqrt(1 + 8 * rows.shape[1]))) // 2
    if observers < 2 or not 2 <= n <= MOST_ITEMS or not _linked(rows, n):
        return None
    studies = int(np.clip(MOST_NUMBERS // (n * n * max(observers, 20)), FEWEST_STUDIES, MOST_STUDIES))
    asked = SmallestDifference(observers, n, None, None, None, target, observer_sd, alpha, studies, seed)
    return _smallest(asked, tuple(map(tuple, rows.tolist())), adjust, covariance)


def smallest_in(
    comparisons: Comparisons, *, alpha: float, adjust: Adjust, covariance: CovarianceChoice
) -> SmallestDifference | None:
    """Return what `smallest_difference` says of the design of answers: who compared which pairs how often.

    Parameters
    ----------
    comparisons
        The answers.
    alpha, adjust, covariance
        As `smallest_difference`.

    Returns
    -------
    SmallestDifference | None
        As `smallest_difference`.
    """
    n, who = len(comparisons.items), np.unique(comparisons.observer)
    if n > MOST_ITEMS:
        return None
    counts = np.zeros((len(who), n, n))
    pair = np.minimum(comparisons.winner, comparisons.loser), np.maximum(comparisons.winner, comparisons.loser)
    np.add.at(counts, (np.searchsorted(who, comparisons.observer), *pair), comparisons.count)
    times = np.ceil(counts[:, *np.triu_indices(n, 1)]).astype(np.int64)
    times = times[0] if (times == times[0]).all() else times
    return smallest_difference(times, len(who), alpha=alpha, adjust=adjust, covariance=covariance)


@lru_cache(maxsize=64)
def _smallest(
    asked: SmallestDifference, design: tuple[tuple[int, ...], ...], adjust: Adjust, covariance: CovarianceChoice
) -> SmallestDifference:
    """Return ``asked`` with the difference that the design finds."""
    n, observers, target = asked.items, asked.observers, asked.target
    times = np.array(design[0] if len(design) == 1 else design, dtype=np.int64)
    names, none = tuple(f"item {item}" for item in range(n)), np.zeros(times.shape[-1], dtype=np.bool_)
    plan = Plan(names, np.zeros(n), times, none, asked.observer_sd, "average", 0.0, asked.alpha, adjust, covariance)
    tried: dict[float, float] = {}

    def enough(place: int) -> bool:
        nats = float(TRIED_NATS[place])
        tried[nats] = _chance(plan, observers, nats, asked.studies, asked.seed)
        return tried[nats] >= target

    _search(enough, int(np.searchsorted(TRIED_NATS[:-1], _guess(plan, observers, target))))
    nats, error = _between(tried, target, asked.studies)
    return replace(asked, nats=nats, error_nats=error, found_of_most=tried[MOST_NATS] if nats is None else None)


def _search(enough: Callable[[int], bool], place: int) -> None:
    """Try places of `TRIED_NATS` from ``place`` on: downwards to one that is not enough, or upwards to one that is."""
    if enough(place):
        while place and enough(place := place - 1):
            pass
    else:
        while place < len(TRIED_NATS) - 1 and not enough(place := place + 1):
            pass


def _guess(plan: Plan, observers: int, target: float) -> float:
    """Return about which difference will do, in nats: by the standard error of alike items, of the mean pair."""
    from scipy.special import ndtri

    n, pairs = len(plan.items), plan.times.shape[-1]
    totals = plan.totals(observers)
    information = matrices(np.asarray(totals / -4.0)[None])[0]
    np.fill_diagonal(information, -information.sum(axis=1))
    by_answers = 2 * float(np.trace(np.linalg.pinv(information))) / (n - 1)
    tests = 1 if plan.adjust == "none" else pairs
    reach = ndtri(1 - plan.alpha / 2 / tests) + ndtri(target)
    return float(reach * np.sqrt(by_answers + 2 * plan.observer_sd**2 / observers))


def _between(tried: dict[float, float], target: float, studies: int) -> tuple[float | None, float | None]:
    """Return the difference that reaches the ``target`` and its standard error, linear in the probits of chances."""
    from scipy.special import ndtri

    high = min((nats for nats, chance in tried.items() if chance >= target), default=None)
    low = max((nats for nats in tried if high is not None and nats < high), default=None)
    if high is None or low is None:
        return high, None
    least = 1 / (2 * studies)
    ends = ndtri(np.clip([tried[low], tried[high]], least, 1 - least))
    slope = (ends[1] - ends[0]) / (high - low)
    probit = float(ndtri(target))
    density = np.exp(-(probit**2) / 2) / np.sqrt(2 * np.pi)
    error = np.sqrt(target * (1 - target) / studies) / density / slope
    return float(low + (probit - ends[0]) / slope), float(error)


@one_blas_thread()
def _chance(plan: Plan, observers: int, nats: float, studies: int, seed: int) -> float:
    """Return the share of studies that find a pair of items that differ by ``nats``; the others are midway."""
    first, second = plan.pairs
    alike = not plan.shared and len(set(plan.times.tolist())) == 1
    pairs = [0] if alike else np.random.default_rng(seed).permutation(len(first))[:MOST_PAIRS].tolist()
    found = 0.0
    for number, pair in enumerate(pairs):
        theta = np.zeros(len(plan.items))
        theta[first[pair]], theta[second[pair]] = nats / 2, -nats / 2
        blocks = blocks_of(replace(plan, theta=theta), [observers], studies // len(pairs), seed + number)
        tally = summed(blocks, map(simulate, blocks))[observers]
        found += float(tally.right[pair] / (tally.replicates - tally.unfitted))
    return found / len(pairs)


def _linked(rows: NDArray[np.int64], n: int) -> bool:
    totals = np.zeros((n, n))
    totals[np.triu_indices(n, 1)] = rows.sum(axis=0)
    return len(compared_groups(totals)) == 1


def _percent(nats: float) -> float:
    return float(100 / (1 + np.exp(-nats)))


def _size(nats: float) -> str:
    return f"{nats:.2g} nats ({_percent(nats):.0f} % of choices, {nats / NATS_PER_JND:.2g} JND)"
