"""The result of a fit: strengths, their covariance, further parameters, and whether they can be trusted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.choices import CovarianceChoice
from analysis.classes.conclusions import Conclusion, concluded
from analysis.scaling.clustered import ByObserver
from analysis.scaling.counts import Counts
from analysis.scaling.laws import LAWS, Model
from analysis.scaling.robust_tests import ObserverTest
from analysis.scaling.separation import Groups, Separation, find_separation, separated_items
from documents.arrays import Floats
from documents.text import JsonResult

if TYPE_CHECKING:
    from analysis.scaling.quasi import QuasiVariances

# How well a law fits: deviance and Pearson's statistic against free chances for each pair.

FEWEST_EXPECTED = 5.0


@dataclass(frozen=True, slots=True)
class Goodness(JsonResult):
    """Goodness of fit.

    Attributes
    ----------
    deviance, pearson
        2 Σ O log(O / E) and Σ (O − E)² / E over the answers to each pair.
    df
        Free numbers of the answers less the parameters of the law.
    p_deviance, p_pearson
        Chance of as much or more if the law is right, by the χ² distribution: it takes all answers for independent.
        None where ``df`` is zero. Judge by `analysis.scaling.lack_of_fit.one_scale`, which does not where it can.
    smallest_expected
        Smallest expected count E.
    share_small
        Share (0 to 1) of expected counts below 5. Where there are such, the χ² distribution is a rough guide:
        Pearson's p is then the safer of the two, and with single answers to most pairs neither says anything.
    """

    deviance: float
    pearson: float
    df: int
    p_deviance: float | None
    p_pearson: float | None
    smallest_expected: float
    share_small: float
    json_keys: ClassVar = {"share_small": "share_of_expected_below_5"}
    json_also: ClassVar = ("caveat",)

    @property
    def caveat(self) -> str | None:
        """A sentence of caution where expected counts are small; None if they are not."""
        if not self.share_small:
            return None
        return (
            f"{self.share_small:.0%} of the expected counts are below {FEWEST_EXPECTED:g} (the smallest is "
            f"{self.smallest_expected:.2g}): the p value of the fit is rough."
        )


def goodness_of_fit(
    counts: Counts, probabilities: tuple[Floats, Floats, Floats], parameters: int, *, ties: bool
) -> Goodness:
    """Compare ``counts``, a batch of one, with a law's chances of ``first``, ``second`` and neither, each (1, m).

    ``parameters`` is how many numbers of the law were fitted.
    """
    from scipy.special import gammaincc, xlogy

    outcomes = 3 if ties else 2
    observed = np.concatenate([counts.won, counts.lost, counts.tied])[:outcomes]
    total = observed.sum(axis=0)
    kept = total > 0
    observed, total = observed[:, kept], total[kept]
    chance = np.concatenate(probabilities)[:outcomes, kept]
    expected = total * chance
    ratio = np.divide(observed / total, chance, out=np.ones_like(chance), where=(observed > 0) & (chance > 0))
    deviance = max(0.0, float(2 * xlogy(observed, ratio).sum()))
    misses = np.divide((observed - expected) ** 2, expected, out=np.zeros_like(expected), where=expected > 0)
    pearson = float(misses.sum())
    df = max(0, int(kept.sum()) * (outcomes - 1) - parameters)  # with a prior, parameters may outnumber the pairs
    tail = [float(gammaincc(df / 2, value / 2)) if df > 0 else None for value in (deviance, pearson)]
    share = float((expected < FEWEST_EXPECTED * (1 - 1e-9)).mean())  # 5 less rounding is 5
    return Goodness(deviance, pearson, df, tail[0], tail[1], float(expected.min()), share)


Method = Literal["ml", "firth"]
ModelMethod = Literal["ml", "firth", "map"]
CovarianceKind = Literal["model", "scaled", "sandwich", "shrinkage"]
COVARIANCE_CHOICES: tuple[CovarianceChoice, ...] = get_args(CovarianceChoice)
TWO_SIDED_95 = 1.959963984540054


def t_quantile(freedom: float) -> float:
    """Return the number of standard errors on either side of an estimate that make a 95 % interval."""
    if math.isinf(freedom):
        return TWO_SIDED_95
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 0.975))


@dataclass(frozen=True, slots=True)
class Parameter(JsonResult):
    """One parameter of a fitted law beside the strengths.

    Attributes
    ----------
    name
        ``nu`` or ``eta`` (ties), or ``order`` (what being shown first adds).
    estimate, se
        On the scale on which it was fitted: log ν, log η, or δ, in the units of the strengths.
    is_factor
        Whether exp(estimate) is a factor of odds; not for an order effect in Thurstone's law, which has no odds.
    freedom
        Degrees of freedom of ``se``; infinite where it comes from the model.
    """

    name: str
    estimate: float
    se: float
    is_factor: bool = True
    freedom: float = math.inf
    json_names: ClassVar = "name estimate se low high odds"
    json_keys: ClassVar = {"odds": "*"}

    @property
    def low(self) -> float:
        """Lower end of the 95 % interval: estimate − 1.96 se, or by Student's law with ``freedom``."""
        return self.estimate - t_quantile(self.freedom) * self.se

    @property
    def high(self) -> float:
        """Upper end of the 95 % interval."""
        return self.estimate + t_quantile(self.freedom) * self.se

    @property
    def factor(self) -> tuple[float, float, float] | None:
        """ν, η, or what being shown first multiplies the odds by, with the ends of its interval; None without odds.

        η is never below 1, and an end too large to write is infinite.
        """
        if not self.is_factor:
            return None
        with np.errstate(over="ignore"):
            value, low, high = (float(np.exp(number)) for number in (self.estimate, self.low, self.high))
        return value, max(low, 1.0) if self.name == "eta" else low, high

    @property
    def odds(self) -> dict[str, float]:
        """The same as a factor of odds, if it is one, with its interval."""
        return dict(zip(("factor", "factor_low", "factor_high"), self.factor or (), strict=False))


@dataclass(frozen=True, slots=True)
class OrderTest(JsonResult):
    """Test of no order effect.

    Attributes
    ----------
    statistic, p
        Of the likelihood ratio, χ² with one degree of freedom: it takes all answers for independent.
    by_observers
        The test with the observer as the unit; None with fewer than five observers.
    """

    statistic: float
    p: float
    by_observers: ObserverTest | None = None

    @property
    def conclusion(self) -> Conclusion:
        """What is concluded at the level 0.05: by observers where there is such a test."""
        return concluded("order effect", self.by_observers.p if self.by_observers else None, self.p)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Maximised:
    """Where the likelihood of ``n`` items' strengths, or their posterior, is largest.

    Attributes
    ----------
    theta
        Shape (n,): strengths with mean 0, in nats; for ``thurstone`` in standard deviations of a difference. NaN
        where there is no finite maximum.
    joint_covariance
        Shape (e, e): of all that was estimated, in nats².
    prior_sd
        Standard deviation of the Gaussian prior, in the units of the strengths; None without one.
    log_likelihood
        Σ W log p, without binomial coefficients; NaN where there is no finite maximum.
    converged, iterations
        Whether the last step was below the tolerance; Newton steps taken.
    ties_left_out
        How many answers prefer neither item, where the model has no place for them.
    """

    theta: Floats
    joint_covariance: Floats
    prior_sd: float | None
    log_likelihood: float
    converged: bool
    iterations: int
    ties_left_out: float = 0.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Fit(Maximised):
    """Strengths of ``n`` items under a model, and whether they can be trusted.

    Attributes
    ----------
    model, method, covariance_kind
        What was asked for.
    counts
        The counts of each pair that it was fitted to.
    parameters
        The f parameters beside the strengths: the tie parameter, then the order effect. ``joint_covariance`` is of
        ``theta``, on vectors that sum to zero, and then of these.
    order_test
        None unless an order effect was fitted by maximum likelihood.
    separation
        Why there is no finite maximum; None if the fit is sound.
    held_by_prior
        Why there would be no finite maximum without the prior; None where the answers keep all strengths finite.
        The strengths of groups that were never compared then differ by 0 ± σ √(1/k + 1/l) on average over their k and
        l items: what the prior says, and nothing else.
    clustered
        Where the covariance is clustered by observer, what it comes from, with its degrees of freedom; None where it is
        the model's.
    wins_by_observer
        Shape (S, n), where the covariance is clustered and all observers answered every pair as often; None otherwise.
    """

    model: Model
    method: ModelMethod
    covariance_kind: CovarianceKind
    counts: Counts
    parameters: tuple[Parameter, ...]
    order_test: OrderTest | None
    separation: Separation | None
    held_by_prior: Separation | None = None
    clustered: ByObserver | None = None
    wins_by_observer: Floats | None = None

    @property
    def pair_freedom(self) -> Floats | None:
        """Shape (P,): degrees of freedom of differences, pairs i < j; None for the model's covariance."""
        return None if self.clustered is None else self.clustered.pair_freedom

    def freedom(self, contrasts: Floats) -> Floats | None:
        """Return the degrees of freedom of contrasts of the strengths (k, n), shape (k,); None for the model's."""
        return None if self.clustered is None else self.clustered.freedom(contrasts)

    @property
    def covariance(self) -> Floats:
        """Shape (n, n): of ``theta``, on vectors that sum to zero, as `analysis.scaling.penalty` says."""
        n = self.counts.n
        return self.joint_covariance[:n, :n]

    @property
    def se(self) -> Floats:
        """Shape (n,): standard errors of ``theta``."""
        return np.asarray(np.sqrt(np.maximum(np.diag(self.covariance), 0)))

    @property
    def log10_score(self) -> Floats:
        """Shape (n,): decimal logarithm of ``score``."""
        with np.errstate(invalid="ignore"):  # of items that are separated, inf − inf
            return np.asarray((self.theta - np.logaddexp.reduce(self.theta)) / np.log(10))

    @property
    def score(self) -> Floats:
        """Shape (n,): softmax of ``theta``, which sums to 1."""
        with np.errstate(invalid="ignore"):
            return np.asarray(np.exp(self.theta - np.logaddexp.reduce(self.theta)))

    @property
    def log_posterior(self) -> float:
        """The log likelihood less Σ θ² / (2 σ²); the log likelihood where there is no prior."""
        if self.prior_sd is None:
            return self.log_likelihood
        return self.log_likelihood - float((self.theta**2).sum()) / (2 * self.prior_sd**2)

    @property
    def separated(self) -> Groups:
        """Groups of item indices, best first, between which no finite strength exists; empty if the fit is sound."""
        return self.separation.groups if self.separation else ()

    @property
    def separated_items(self) -> tuple[int, ...]:
        """Indices of the items outside the largest group; all where no group is the largest; none if sound."""
        return separated_items(self.separated)

    @property
    def held_by_penalty(self) -> bool:
        """Whether residuals are the penalty's too: it alone keeps strengths finite, or a prior was used."""
        if self.method != "firth":
            return self.method == "map"
        names = [str(item) for item in range(self.counts.n)]
        return find_separation(self.counts, names, ties=LAWS[self.model].parameter is not None) is not None

    @property
    def goodness(self) -> Goodness | None:
        """How well the law fits; None where there is no maximum."""
        if self.separation is not None or not np.isfinite(self.theta).all():
            return None
        law = LAWS[self.model]
        values = {parameter.name: parameter.estimate for parameter in self.parameters}
        difference = self.counts.differences(self.theta[None], values.get("order", 0.0))
        chances = law.probabilities(difference, values.get(law.parameter or "", 0.0))
        further = len(self.joint_covariance) - self.counts.n
        return goodness_of_fit(self.counts, chances, self.counts.n - 1 + further, ties=law.parameter is not None)

    @property
    def deviance(self) -> float:
        """2 Σ O log(O / E) over the answers to the pairs that were compared; NaN where there is no maximum."""
        goodness = self.goodness
        return goodness.deviance if goodness else float("nan")

    @property
    def df(self) -> int:
        """Free numbers of the answers less the parameters of the law; 0 where these are more, as a prior allows."""
        outcomes = 1 if LAWS[self.model].parameter is None else 2
        compared = int(np.count_nonzero(self.counts.total if outcomes == 2 else self.counts.won + self.counts.lost))
        return max(0, compared * outcomes - (self.counts.n - 1) - (len(self.joint_covariance) - self.counts.n))

    def quasi_variances(self) -> QuasiVariances:
        """Return one variance for each item, such that any two sum to about that of the items' difference.

        Raises
        ------
        ResultsError
            As `analysis.scaling.quasi.quasi_variances`.
        """
        from analysis.scaling.quasi import quasi_variances

        return quasi_variances(self.covariance)

    def to_json(self) -> dict[str, Any]:
        """Return how the fit was made and how good it is, as plain values; not the strengths."""
        goodness, test = self.goodness, self.order_test
        sound = self.separation is None
        return {
            "model": self.model,
            **({"model_of": LAWS.whose(self.model)} if LAWS.whose(self.model) else {}),
            "method": self.method,
            "prior_sd": self.prior_sd,
            "covariance": self.covariance_kind,
            **({"by_observer": self.clustered.to_json()} if self.clustered else {}),
            "log_likelihood": self.log_likelihood if sound else None,
            "log_posterior": self.log_posterior if sound and self.method == "map" else None,
            "deviance": goodness.deviance if goodness else None,
            "df": self.df,
            "goodness_of_fit": goodness.to_json() if goodness else None,
            "parameters": [parameter.to_json() for parameter in self.parameters],
            "order_test": test.to_json() if test else None,
            "held_by_prior": list(self.held_by_prior.sentences) if self.held_by_prior else [],
            "ties_left_out": self.ties_left_out,
            "converged": self.converged,
            "iterations": self.iterations,
        }


@dataclass(frozen=True, slots=True, eq=False)
class BatchFit:
    """Strengths of ``n`` items in each of B replicates, by Bradley and Terry's law, without their covariance.

    ``theta`` has the shape (B, n), each row with mean 0, and NaN where ``separated``; ``log_likelihood``,
    ``converged``, ``iterations`` and ``separated`` have the shape (B,).
    """

    theta: Floats
    log_likelihood: Floats
    converged: NDArray[np.bool_]
    iterations: NDArray[np.intp]
    separated: NDArray[np.bool_]
