"""The results of a power simulation: the power of each number of observers, and how many the pairs that matter need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.choices import TARGET
from analysis.errors import ResultsError
from analysis.scaling import CovarianceKind
from analysis.simulation import Plan
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult, did_you_mean, finite


@dataclass(frozen=True, slots=True, eq=False)
class Power(JsonResult):
    """Power with each of K numbers of observers, for n items and P pairs i < j in the order of ``numpy.triu_indices``.

    Each value has a Monte-Carlo standard error of its own, in a field that ends with ``_error``.

    Attributes
    ----------
    plan, replicates, seed
        What was simulated, how often per number of observers, and from which seed.
    observers
        The K numbers of observers, ascending.
    separates
        Shape (K, P): chance (0 to 1) that a pair comes out significantly different, the way it was assumed to.
    reversed
        Shape (K, P): chance that it comes out significantly different the other way round.
    recovery
        Shape (K,): chance that the classes are exactly the right ones.
    alike
        Shape (K,): mean share of pairs that share a class, or do not, as they should.
    width
        Shape (K, n): mean width of the interval of log10 score of each item; ``mean_width``, shape (K,): of all.
    separated, unfitted
        Shape (K,): share of the studies that needed Firth's fit, and of those without any fit, which are left out.
    """

    plan: Plan
    replicates: int
    seed: int
    observers: tuple[int, ...]
    separates: Floats
    separates_error: Floats
    reversed: Floats
    recovery: Floats
    recovery_error: Floats
    alike: Floats
    alike_error: Floats
    width: Floats
    width_error: Floats
    mean_width: Floats
    mean_width_error: Floats
    separated: Floats
    unfitted: Floats
    json_names: ClassVar = (
        "items plan.observer_sd plan.scores_of plan.lapse_rate plan.alpha plan.adjust covariance plan.interval "
        "plan.level replicates seed sizes"
    )

    @property
    def pair_names(self) -> tuple[tuple[str, str], ...]:
        """The names of each pair's items."""
        first, second = self.plan.pairs
        items = self.plan.items
        return tuple((items[i], items[j]) for i, j in zip(first.tolist(), second.tolist(), strict=True))

    @property
    def items(self) -> list[dict[str, Any]]:
        """The items with their strengths."""
        return [{"name": name, "theta": theta} for name, theta in zip(self.plan.items, self.plan.theta, strict=True)]

    @property
    def covariance(self) -> CovarianceKind:
        """How errors are found with the most observers."""
        return self.plan.kind(self.observers[-1])

    @property
    def sizes(self) -> list[dict[str, Any]]:
        """Every value for each number of observers."""
        return [self._size(index) for index in range(len(self.observers))]

    def _size(self, index: int) -> dict[str, Any]:
        pairs = zip(
            self.pair_names,
            self.plan.differs.tolist(),
            self.separates[index].tolist(),
            self.separates_error[index].tolist(),
            self.reversed[index].tolist(),
            strict=True,
        )
        widths = zip(self.plan.items, self.width[index].tolist(), self.width_error[index].tolist(), strict=True)
        return {
            "observers": self.observers[index],
            "class_recovery": float(self.recovery[index]),
            "class_recovery_error": float(self.recovery_error[index]),
            "pairs_alike": float(self.alike[index]),
            "pairs_alike_error": float(self.alike_error[index]),
            "log10_width": finite(self.mean_width[index]),
            "log10_width_error": finite(self.mean_width_error[index]),
            "separated": float(self.separated[index]),
            "unfitted": float(self.unfitted[index]),
            "items": [
                {"name": name, "log10_width": finite(width), "log10_width_error": finite(error)}
                for name, width, error in widths
            ],
            "pairs": [
                {"items": list(names), "should_differ": should, "separates": p, "separates_error": e, "reversed": r}
                for names, should, p, e, r in pairs
            ],
        }


@dataclass(frozen=True, slots=True, eq=False)
class Needed(JsonResult):
    """The fewest observers, of those tried, with which the pairs that matter separate often enough.

    Attributes
    ----------
    power
        The power it follows from.
    target
        The power (0 to 1) that each pair should reach.
    pairs
        Shape (k,): indices of the pairs that matter, of the P pairs of ``power``.
    named
        Whether they were named; if not, they are all pairs that should differ.
    observers
        The fewest with which all these pairs reach the target, as they do with every larger number tried; None if
        there is no such number.
    by_pair
        Shape (P,): the same for each pair alone; 0 if there is no such number.
    """

    power: Power
    target: float
    pairs: NDArray[np.intp]
    named: bool
    observers: int | None
    by_pair: NDArray[np.intp]
    json_keys: ClassVar = {"needs": "pairs"}
    json_names: ClassVar = "target observers sentence doubt needs"

    @property
    def weakest(self) -> tuple[int, int]:
        """Index of the number of observers reported (the number needed, or the largest), and of its weakest pair."""
        sizes = self.power.observers
        size = len(sizes) - 1 if self.observers is None else sizes.index(self.observers)
        return size, int(self.pairs[np.argmin(self.power.separates[size, self.pairs])])

    @property
    def sentence(self) -> str:
        """The answer in words."""
        size, pair = self.weakest
        first, second = self.power.pair_names[pair]
        return answer_words(
            self.power.observers[size],
            enough=self.observers is not None,
            fewest=size == 0,
            target=self.target,
            which=self._which,
            hardest=f"{first} and {second}",
            reach=(int((self.power.separates[size, self.pairs] >= self.target).sum()), len(self.pairs)),
            chance=float(self.power.separates[size, pair]),
            error=float(self.power.separates_error[size, pair]),
        )

    @property
    def doubt(self) -> str | None:
        """Which numbers two standard errors of the simulation leave open, or None."""
        return doubt_words(self.power.observers, *self.limits)

    @property
    def limits(self) -> tuple[int | None, int | None]:
        """Indices of the fewest observers that are perhaps enough, and surely, by two standard errors; None: none."""
        chance, error = (values[:, self.pairs] for values in (self.power.separates, self.power.separates_error))
        perhaps, surely = (chance + sign * 2 * error >= self.target for sign in (1, -1))
        return _first_kept(np.asarray(perhaps.all(axis=1))), _first_kept(np.asarray(surely.all(axis=1)))

    @property
    def _which(self) -> str:
        if len(self.pairs) == 1:
            return "{} and {}".format(*self.power.pair_names[int(self.pairs[0])])
        if self.named:
            return f"the {len(self.pairs)} pairs named"
        return f"all {len(self.pairs)} pairs that should differ"

    @property
    def details(self) -> Power:
        """Every value."""
        return self.power

    @property
    def needs(self) -> list[dict[str, Any]]:
        """The number of observers of each pair that matters."""
        names, numbers = self.power.pair_names, self.by_pair
        return [{"items": names[one], "observers": int(numbers[one]) or None} for one in self.pairs.tolist()]


def observers_needed(power: Power, pairs: Sequence[tuple[str, str]] = (), target: float = TARGET) -> Needed:
    """Return the fewest observers with which ``pairs``, by name, separate with the power ``target``.

    Parameters
    ----------
    power
        What `simulate_power` returned.
    pairs
        The pairs that matter, by the items' names; none stands for all pairs that should differ.
    target
        The power wanted, between 0 and 1.

    Returns
    -------
    Needed
        The number of observers, with a sentence on it.

    Raises
    ------
    ResultsError
        If a name is no item's, a pair is named with itself, ``target`` is out of range, or no pair should differ.

    Examples
    --------
    >>> import numpy as np
    >>> from extensions.power import simulate_power
    >>> from analysis.simulation import Plan
    >>> plan = Plan(("a", "b"), np.array([1.0, -1.0]), times=np.array([1]), differs=np.array([True]))
    >>> power = simulate_power(plan, [2, 100], replicates=50, workers=1)
    >>> observers_needed(power).observers
    100
    """
    check_target(target)
    chosen = chosen_pairs(power.plan.items, pairs) if pairs else np.flatnonzero(power.plan.differs)
    if not len(chosen):
        raise ResultsError(Finding("no two items should differ", remedy="name the pairs that matter with --pair"))
    enough = power.separates >= target
    index = _first_kept(np.asarray(enough[:, chosen].all(axis=1)))
    by_pair = [_first_kept(column) for column in enough.T]
    return Needed(
        power,
        target,
        chosen,
        bool(pairs),
        None if index is None else power.observers[index],
        np.array([0 if size is None else power.observers[size] for size in by_pair], dtype=np.intp),
    )


def check_target(target: float) -> None:
    """Raise ResultsError unless ``target`` lies between 0 and 1.

    Parameters
    ----------
    target
        The power wanted, above 0 and below 1.

    Examples
    --------
    >>> check_target(0.8)
    >>> check_target(80)
    Traceback (most recent call last):
    ...
    analysis.errors.ResultsError: the power is 80 (give a chance between 0 and 1, such as 0.8)
    """
    if not 0 < target < 1:
        raise ResultsError(Finding(f"the power is {target:g}", remedy="give a chance between 0 and 1, such as 0.8"))


def chosen_pairs(items: Sequence[str], pairs: Sequence[tuple[str, str]]) -> NDArray[np.intp]:
    """Return the indices of ``pairs``, by name, in the order of ``numpy.triu_indices``, each once.

    Parameters
    ----------
    items
        Names of the n items.
    pairs
        Pairs of names; their order, and that of the two names, does not matter.

    Returns
    -------
    NDArray[np.intp]
        Shape (k,): ascending indices, from 0 to n (n − 1) / 2 − 1.

    Examples
    --------
    >>> chosen_pairs(["a", "b", "c"], [("c", "b"), ("a", "b")]).tolist()
    [0, 2]
    """
    first, second = np.triu_indices(len(items), 1)
    index = {pair: place for place, pair in enumerate(zip(first.tolist(), second.tolist(), strict=True))}
    indices = []
    for pair in pairs:
        for name in pair:
            if name not in items:
                remedy = did_you_mean(name, items, "there are: " + ", ".join(items[:20]))
                raise ResultsError(Finding(f"there is no item '{name}' to compare", remedy=remedy))
        low, high = sorted(items.index(name) for name in pair)
        if low == high:
            raise ResultsError(Finding(f"'{pair[0]}' is paired with itself", remedy="name two items"))
        indices.append(index[low, high])
    return np.unique(np.array(indices, dtype=np.intp))


def _first_kept(enough: NDArray[np.bool_]) -> int | None:
    """Return the first index from which on all are true."""
    short = np.flatnonzero(~enough)
    first = int(short[-1]) + 1 if len(short) else 0
    return first if first < len(enough) else None


def answer_words(
    observers: int,
    *,
    enough: bool,
    fewest: bool,
    target: float,
    which: str,
    hardest: str,
    reach: tuple[int, int],
    chance: float,
    error: float,
) -> str:
    """Return the answer in words: ``reach`` is how many pairs reach the ``target``, and of how many."""
    people, power = _people(observers), f"{100 * target:g} % power on {which}"
    how = f"separate in {100 * chance:.0f} % of the studies (± {100 * error:.1f} %)."
    if enough:
        few = ", the fewest tried," if fewest else ""
        return f"{people}{few} give {power}: {'they' if reach[1] == 1 else f'the hardest, {hardest},'} {how}"
    few = f"{people}, the most tried, are too few for {power}"
    if reach[1] == 1:
        return f"{few}: they {how}"
    return f"{few}: {reach[0]} of {reach[1]} reach it, and the hardest, {hardest}, {how}"


def doubt_words(sizes: Sequence[int], perhaps: int | None, surely: int | None) -> str | None:
    """Return which numbers the simulation leaves open, or None; both are indices of ``sizes``."""
    if perhaps == surely:
        return None
    fewest = sizes[perhaps] if perhaps is not None else sizes[-1]
    most = str(sizes[surely]) if surely is not None else f"more than {sizes[-1]}"
    return f"The simulation leaves open whether it takes {fewest} or {most}; more replicates would decide."


def _people(observers: int) -> str:
    return "1 observer" if observers == 1 else f"{observers} observers"
