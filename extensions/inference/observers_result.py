"""What a fit with observers as a distribution says: population, spread, each observer, and a new observer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from analysis.choices import Adjust
from analysis.classes import Classes, best_first, classes_if_few, classify
from analysis.covariance import contrast_variances
from analysis.errors import ResultsError
from analysis.scaling import LAWS, Model
from documents import Finding
from documents.arrays import Floats
from documents.text import JsonResult
from extensions.inference.propagation import GroupAnswers, TiltedSites
from extensions.inference.spread import ObserverSd

MOST_PAIRS_IN_JSON = 5000
NUMBERS = (
    *("difference", "se", "low", "high", "p"),
    *("typical", "chance", "chance_low", "chance_high", "lowest", "highest"),
)


@dataclass(frozen=True, slots=True, eq=False)
class GroupScores:
    """The typical observer's strengths in one group of n items, and what each observer's come from.

    Attributes
    ----------
    name
        Of the group; empty where there are no groups.
    items, observers
        Names.
    answers, sites
        Each observer's counts, and the sites that stand for them.
    theta, covariance
        Shapes (n,) and (n, n): strengths with mean 0, and their covariance, averaged over what τ may be.
    plain_theta
        Shape (n,): strengths of the plain fit, of the average answer.
    """

    name: str
    items: tuple[str, ...]
    observers: tuple[str, ...]
    answers: GroupAnswers
    sites: TiltedSites
    theta: Floats
    covariance: Floats
    plain_theta: Floats

    @property
    def order(self) -> tuple[int, ...]:
        """Indices of the items, best first."""
        return best_first(self.theta)

    @property
    def se(self) -> Floats:
        """Shape (n,): standard errors of ``theta``."""
        return np.asarray(np.sqrt(np.maximum(np.diag(self.covariance), 0)))


@dataclass(frozen=True, slots=True)
class Prediction(JsonResult):
    """What a new observer of the same kind says to one pair, as chances (0 to 1) that ``first`` is preferred.

    Attributes
    ----------
    first, second
        Names of the items.
    difference, se, low, high
        θ_first − θ_second of the typical observer, its standard error and 95 % interval, in the units of the strengths.
    p
        Two-sided p value of no difference, by Student's law, not corrected for other pairs.
    typical
        The typical observer's chance.
    chance, chance_low, chance_high
        Chance of a new observer's answer, which is the average over observers, with its 95 % interval.
    lowest, highest
        Between these are the own chances of 95 % of observers; not knowing the population exactly is included.
    share
        Share of observers who would more often prefer ``first``; None where observers do not differ.
    """

    first: str
    second: str
    difference: float
    se: float
    low: float
    high: float
    p: float
    typical: float
    chance: float
    chance_low: float
    chance_high: float
    lowest: float
    highest: float
    share: float | None
    json_keys: ClassVar = {"typical": "typical_observer", "share": "share_of_observers"}
    json_names: ClassVar = "first second difference se low high p typical new_observer observers_95 share"

    @property
    def new_observer(self) -> dict[str, float]:
        """The probability of an observer not yet seen, and its interval."""
        return {"value": self.chance, "low": self.chance_low, "high": self.chance_high}

    @property
    def observers_95(self) -> tuple[float, float]:
        """Between which probabilities 95 % of observers lie."""
        return self.lowest, self.highest


@dataclass(frozen=True, slots=True, eq=False)
class ObserverScores:
    """Each observer's own strengths in one group: ``mean`` and ``sd``, shape (observers, n), means with sum zero.

    They are shrunk: with few answers they are near the population's. ``sd`` contains the population's.
    """

    observers: tuple[str, ...]
    items: tuple[str, ...]
    mean: Floats
    sd: Floats

    def to_json(self) -> list[dict[str, Any]]:
        """Return plain values for JSON, one entry for each observer."""
        return [
            {
                "observer": name,
                "theta": dict(zip(self.items, own, strict=True)),
                "sd": dict(zip(self.items, sd, strict=True)),
            }
            for name, own, sd in zip(self.observers, self.mean.tolist(), self.sd.tolist(), strict=True)
        ]


@dataclass(frozen=True, slots=True, eq=False)
class HierarchicalFit:
    """Strengths of the typical observer in each group, and the spread between observers.

    Attributes
    ----------
    model
        ``bradley-terry`` or ``thurstone``.
    groups
        One for each group of items; a single one without a name where there are no groups.
    spread
        τ, the standard deviation of an item's strength between observers; of the difference of two items it is √2 τ.
    scale_variance
        How much all differences may be too large or too small by one factor, since τ is not known exactly: variance of
        that factor. Intervals of differences contain it; tests of no difference do not depend on it.
    log_likelihood
        Marginal log likelihood.
    sweeps, converged
        How often sites were set in all, and whether they settled at the estimate.
    ties_left_out
        How many ties there are: the models have no place for them.
    alpha, adjust
        Significance level of a difference, and correction for multiple comparisons, of ``classes``.
    """

    model: Model
    groups: tuple[GroupScores, ...]
    spread: ObserverSd
    scale_variance: float
    log_likelihood: float
    sweeps: int
    converged: bool
    ties_left_out: float
    alpha: float = 0.05
    adjust: Adjust = "holm"

    @property
    def df(self) -> int:
        """Degrees of freedom of standard errors: of the observers' deviations from the population, in all groups."""
        return sum((len(of.observers) - 1) * (len(of.items) - 1) for of in self.groups)

    @property
    def unit(self) -> str:
        """Unit of the strengths: nats, or sd, standard deviations of a difference of two perceptions."""
        return LAWS[self.model].unit

    @property
    def jnd(self) -> float:
        """Length of one JND (75 : 25) of the typical observer, in the units of the strengths."""
        return LAWS[self.model].jnd

    def classes(self, group: str | None = None) -> Classes | None:
        """Return the perceptual classes of a group, by Student's law; None where there are too many to list."""
        of = self._group(group)
        tested = partial(classify, of.theta, of.covariance, alpha=self.alpha, adjust=self.adjust, df=self.df)
        return classes_if_few(tested)

    def predict(self, first: str, second: str, group: str | None = None) -> Prediction:
        """Return what a new observer says to one pair of items.

        Parameters
        ----------
        first, second
            Names of the items.
        group
            Name of the group; not needed where there is one.

        Returns
        -------
        Prediction
            Chances that ``first`` is preferred, 0 to 1, with intervals, and how much they differ between observers.

        Raises
        ------
        ResultsError
            If there is no such group or item.

        Examples
        --------
        >>> from analysis.comparisons import Answer, from_answers
        >>> from extensions.inference import fit_observers
        >>> answers = [Answer("a", "b", 18, "anna"), Answer("b", "a", 2, "anna"), Answer("a", "b", 9, "ben")]
        >>> fit = fit_observers(from_answers([*answers, Answer("b", "a", 11, "ben")]))
        >>> new = fit.predict("a", "b")
        >>> new.lowest < new.chance_low < new.chance < new.typical
        True
        """
        of = self._group(group)
        places = []
        for name in (first, second):
            if name not in of.items:
                what = f"there is no item '{name}'" + (f" in the group '{of.name}'" if of.name else "")
                raise ResultsError(Finding(what, remedy="expected one of: " + ", ".join(of.items[:20])))
            places.append(of.items.index(name))
        return self._predictions(of, np.array([places[0]]), np.array([places[1]]))[0]

    def predictions(self, group: str | None = None) -> tuple[Prediction, ...]:
        """Return `predict` for every pair of a group, the better item first, pairs of the best items first."""
        of = self._group(group)
        order = np.array(of.order)
        ahead, behind = np.triu_indices(len(order), 1)
        return self._predictions(of, order[ahead], order[behind])

    def observer_scores(self, group: str | None = None) -> ObserverScores:
        """Return each observer's own strengths in a group, with mean and standard deviation."""
        of, variance = self._group(group), self.spread.estimate**2
        blocks, sites = of.answers.blocks, of.sites
        n, people = len(of.items), len(of.observers)
        mean, sd = np.tile(of.theta, (people, 1)), np.zeros((people, n))
        mean[blocks.block, blocks.item] += sites.effects
        missing = np.ones((people, n))
        missing[blocks.block, blocks.item] = 0.0
        for start, root in blocks.roots(variance * sites.precision):
            some = slice(start, start + root.shape[1])
            roots = root[:n, :, :n].transpose(1, 0, 2)
            inverse = roots @ roots.transpose(0, 2, 1)
            inverse[:, np.arange(n), np.arange(n)] += missing[some]
            spread = variance * inverse + inverse @ of.covariance @ inverse
            edge = spread.mean(axis=1)
            own = np.diagonal(spread, axis1=1, axis2=2) - 2 * edge + edge.mean(axis=1, keepdims=True)
            sd[some] = np.sqrt(np.maximum(own, 0.0))
        return ObserverScores(of.observers, of.items, mean - mean.mean(axis=1, keepdims=True), sd)

    def to_json(self) -> dict[str, Any]:
        """Return what `cyclopean scores --observers random --json` prints: no NaN, null where there is no value."""
        return {
            "model": self.model,
            "observers": "random",
            "spread": self.spread.to_json(),
            "df": self.df,
            "scale_sd": float(np.sqrt(self.scale_variance)),
            "log_likelihood": self.log_likelihood,
            "converged": self.converged,
            "sweeps": self.sweeps,
            "ties_left_out": self.ties_left_out,
            "groups": [self._group_json(of) for of in self.groups],
        }

    def _group_json(self, of: GroupScores) -> dict[str, Any]:
        few = len(of.items) * (len(of.items) - 1) // 2 <= MOST_PAIRS_IN_JSON
        classes = self.classes(of.name)
        items = [
            {
                "name": of.items[place],
                "theta": float(of.theta[place]),
                "se": float(of.se[place]),
                "jnd": float(of.theta[place] / self.jnd),
                "plain_theta": float(of.plain_theta[place]),
                "class": classes.labels[place] if classes else None,
            }
            for place in of.order
        ]
        return {
            "name": of.name,
            "items": items,
            "covariance": {"items": list(of.items), "values": of.covariance.tolist()},
            "pairs": [pair.to_json() for pair in self.predictions(of.name)] if few else None,
            "observers": self.observer_scores(of.name).to_json(),
        }

    def _group(self, name: str | None) -> GroupScores:
        if name is None and len(self.groups) == 1:
            return self.groups[0]
        for of in self.groups:
            if of.name == name:
                return of
        what = "name the group" if name is None else f"there is no group '{name}'"
        raise ResultsError(Finding(what, remedy="expected one of: " + ", ".join(of.name for of in self.groups)))

    def _predictions(
        self, of: GroupScores, ahead: NDArray[np.intp], behind: NDArray[np.intp]
    ) -> tuple[Prediction, ...]:
        from scipy.special import ndtr, stdtr, stdtrit

        law, tau = LAWS[self.model], self.spread.estimate
        d = of.theta[ahead] - of.theta[behind]
        tested = contrast_variances(of.covariance)[ahead, behind]
        variance = tested + d**2 * self.scale_variance
        with np.errstate(divide="ignore", invalid="ignore"):
            p = 2 * stdtr(self.df, -np.abs(d) / np.sqrt(tested))
            share = ndtr(d / (np.sqrt(2) * tau)) if tau > 0 else np.full_like(d, np.nan)
        reach, range_ = (float(stdtrit(self.df, 0.975)) * np.sqrt(v) for v in (variance, variance + 2 * tau**2))
        average = [law.mean_over_observers(at, tau) for at in (d, d - reach, d + reach)]
        single = [law.probabilities(at, 0.0)[0] for at in (d, d - range_, d + range_)]
        columns = (d, np.sqrt(variance), d - reach, d + reach, p, single[0], *average, *single[1:])
        return tuple(
            Prediction(
                of.items[i], of.items[j], **dict(zip(NUMBERS, row, strict=True)), share=part if tau > 0 else None
            )
            for i, j, part, row in zip(ahead, behind, share.tolist(), np.stack(columns, axis=1).tolist(), strict=True)
        )
