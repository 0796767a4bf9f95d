"""Scale paired comparisons in JOD as pwcmp does [PerezOrtiz2017], with intervals by bootstrap over observers."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, TypedDict, Unpack

import numpy as np

from analysis.bootstrap import draw_observers
from analysis.choices import Adjust, DistancePrior
from analysis.classes import Classes, best_first, check_level, classes_if_few, classify
from analysis.comparisons import Comparisons, split_groups
from analysis.errors import ResultsError, naming
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult, did_you_mean
from extensions.inference.distance_prior import DISTANCE_PRIORS
from extensions.inference.jod_fits import check_counts, fit_jod
from extensions.inference.jod_outliers import ObserverLikelihood, observer_likelihoods

REPLICATES, SEED = 500, 2016  # pwcmp draws 500 times
FEWEST_DRAWS = 20


class JodOptions(TypedDict, total=False):
    """The options of `scale_jod`, whose defaults stand there."""

    zero: str | None
    prior: DistancePrior
    alpha: float
    adjust: Adjust
    replicates: int
    seed: int


@dataclass(frozen=True, slots=True)
class JodItem(JsonResult):
    """One item: counts, strength in JOD above the item at 0, the ends of its interval, and its class.

    ``jod`` is None where the objective has no maximum; ``low``, ``high`` and ``label`` also where fewer than two
    observers are named.
    """

    name: str
    wins: float
    comparisons: float
    jod: float | None
    low: float | None
    high: float | None
    label: str | None
    json_keys: ClassVar = {"low": "jod_low", "high": "jod_high", "label": "class"}


@dataclass(frozen=True, slots=True, eq=False)
class JodScale(JsonResult):
    """The scale of one set of comparisons.

    Attributes
    ----------
    items
        Best first.
    order
        Indices of the comparisons' items in that order.
    zero
        The item at 0 JOD.
    prior
        Name of the prior on distances.
    jod
        Shape (n,): in the order of the comparisons' items; NaN where the objective has no maximum.
    covariance
        Shape (n, n): of ``jod`` less its mean, over the draws; None where fewer than two observers are named.
    classes
        Groups of items whose differences are not significant by that covariance; None without one.
    log_likelihood
        Σ W log p, without binomial coefficients and prior.
    converged, iterations
        Whether the last step was below the tolerance, and how many there were.
    level, replicates, without_fit, seed
        Of the intervals: their level; how many draws of observers there were, how many of these have no scale, such as
        where no chain of comparisons links all items, and count in no interval; what the draws started from.
    ties_left_out
        How many answers prefer neither item: this model has no place for them.
    """

    items: tuple[JodItem, ...]
    order: tuple[int, ...]
    zero: str
    prior: DistancePrior
    jod: Floats
    covariance: Floats | None
    classes: Classes | None
    log_likelihood: float
    converged: bool
    iterations: int
    level: float
    replicates: int
    without_fit: int
    seed: int
    ties_left_out: float
    json_keys: ClassVar = {"order": None, "prior": None, "jod": None, "covariance": None, "classes": None, "seed": None}


@dataclass(frozen=True, slots=True, eq=False)
class JodScales:
    """A scale, or one for each group, and how much each observer's answers differ from the others'.

    Attributes
    ----------
    scales
        The name and the scale of each group; a single empty name without groups.
    observers
        By name; empty with fewer than four.
    """

    scales: tuple[tuple[str, JodScale], ...]
    observers: tuple[ObserverLikelihood, ...]

    def to_json(self) -> dict[str, Any]:
        """Return what `cyclopean scores --method pwcmp --json` prints."""
        first = self.scales[0][1]
        how = {"model": "thurstone", "method": "pwcmp", "distance_prior": first.prior, "seed": first.seed}
        people = {"observers": [one.to_json() for one in self.observers]}
        if len(self.scales) == 1 and not self.scales[0][0]:
            return first.to_json() | how | people
        return {"groups": [{"name": name, **scale.to_json()} for name, scale in self.scales]} | how | people


def scale_jod(comparisons: Comparisons, **options: Unpack[JodOptions]) -> JodScales:
    """Scale ``comparisons`` in JOD: Thurstone's Case V with pwcmp's prior on distances, each group by itself.

    Parameters
    ----------
    comparisons
        Answers with whole counts of at most 200 items; answers that prefer neither item are left out.
    **options
        ``zero``, the item at 0 JOD, by default the first of the table, or of the group; ``prior``, one of ``gaussian``,
        ``bounded`` and ``none``, as `extensions.inference.distance_prior` has them; ``alpha``, 0.05, for intervals and
        classes; ``adjust``, ``none`` as in pwcmp, the correction of the classes; ``replicates``, 500, and ``seed`` of
        the bootstrap.

    Returns
    -------
    JodScales
        The items in JOD with intervals, and each observer's distance from the others.

    Raises
    ------
    ResultsError
        If an option is out of range, there is no such item, counts are not whole, or no chain of comparisons links all
        items.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> answers = [Answer("b", "a", 75), Answer("a", "b", 25), Answer("c", "b", 75), Answer("b", "c", 25)]
    >>> ((_, scale),) = scale_jod(from_answers(answers), zero="a", prior="none").scales
    >>> [(item.name, round(item.jod, 3)) for item in scale.items]
    [('c', 2.0), ('b', 1.0), ('a', 0.0)]
    """
    how: JodOptions = {
        "zero": None,
        "prior": "gaussian",
        "alpha": 0.05,
        "adjust": "none",
        "replicates": REPLICATES,
        "seed": SEED,
    }
    how |= options
    _check(comparisons, how)
    parts = split_groups(comparisons) or (("", comparisons),)
    people = sorted(comparisons.observers)
    weights = draw_observers(len(people), how["replicates"], how["seed"])
    scales = []
    for name, part in parts:
        own = weights[:, np.isin(people, part.observers)]
        with naming(f"the group '{name}'") if name else nullcontext():
            scales.append((name, _scale(part, how, own)))
    return JodScales(tuple(scales), observer_likelihoods([part for _, part in parts], how["prior"]))


def _scale(comparisons: Comparisons, how: JodOptions, weights: Floats) -> JodScale:
    """Return the scale of one group; ``weights`` (replicates, S) say how often each observer, by name, is drawn."""
    items, prior, alpha = comparisons.items, how["prior"], how["alpha"]
    check_counts(comparisons, prior)
    fitted = fit_jod(comparisons.wins[None], prior)
    place = 0 if how["zero"] is None else items.index(how["zero"])
    jod = fitted.jod[0] - fitted.jod[0, place]
    sound = not np.isnan(jod).any()
    drawn = _drawn(comparisons, weights, prior)
    low = high = covariance = classes = None
    if sound and len(drawn) >= FEWEST_DRAWS:
        low, high = np.quantile(drawn - drawn[:, place, None], [alpha / 2, 1 - alpha / 2], 0, method="hazen").tolist()
        covariance = np.cov(drawn.T)
        classes = classes_if_few(partial(classify, jod, covariance, alpha=alpha, adjust=how["adjust"]))
    won, compared = comparisons.won, comparisons.compared
    order = best_first(jod if sound else won / np.maximum(compared, 1))
    rows = tuple(
        JodItem(
            items[index],
            float(won[index]),
            float(compared[index]),
            float(jod[index]) if sound else None,
            None if low is None else low[index],
            None if high is None else high[index],
            classes.labels[index] if classes else None,
        )
        for index in order
    )
    replicates = len(weights) if weights.shape[1] > 1 else 0
    return JodScale(
        items=rows,
        order=order,
        zero=items[place],
        prior=prior,
        jod=jod,
        covariance=covariance,
        classes=classes,
        log_likelihood=float(fitted.log_likelihood[0]),
        converged=bool(fitted.converged[0]),
        iterations=int(fitted.iterations[0]),
        level=1 - alpha,
        replicates=replicates,
        without_fit=replicates - len(drawn),
        seed=how["seed"],
        ties_left_out=comparisons.ties,
    )


def _drawn(comparisons: Comparisons, weights: Floats, prior: DistancePrior) -> Floats:
    """Return the strengths of each draw of observers that has a fit, with mean 0; none for fewer than two observers."""
    n, people = len(comparisons.items), comparisons.observers
    if weights.shape[1] < 2:
        return np.empty((0, n))
    order = sorted(range(len(people)), key=people.__getitem__)
    flat = comparisons.wins_by_observer()[order].reshape(len(people), n * n)
    drawn = fit_jod((weights @ flat).reshape(-1, n, n), prior).jod
    return drawn[~np.isnan(drawn).any(axis=1)]


def _check(comparisons: Comparisons, how: JodOptions) -> None:
    check_level(how["alpha"])
    if how["prior"] not in DISTANCE_PRIORS:
        remedy = "expected one of: " + ", ".join(DISTANCE_PRIORS)
        raise ResultsError(Finding(f"there is no prior on distances '{how['prior']}'", remedy=remedy))
    if how["replicates"] < FEWEST_DRAWS:
        remedy = f"ask for {REPLICATES}, {FEWEST_DRAWS} at least"
        raise ResultsError(Finding(f"{how['replicates']} replicates were asked for", remedy=remedy))
    parts = split_groups(comparisons) or (("", comparisons),)
    for name, part in parts:
        if how["zero"] is not None and how["zero"] not in part.items:
            where = f" in the group '{name}'" if name else ""
            items = list(part.items)
            remedy = did_you_mean(how["zero"], items, "the items are " + ", ".join(items[:5]))
            raise ResultsError(Finding(f"there is no item '{how['zero']}'{where}", remedy=remedy))
