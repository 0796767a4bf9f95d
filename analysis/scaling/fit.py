"""Fit a model of paired comparison: law, penalty, order effect and covariance chosen by name.

`fit_model` fits answers, `fit` one matrix of wins by Bradley and Terry's law, `fit_batch` many of them, such as the
replicates of a bootstrap, and `fit_sparse` a sparse one; all by `analysis.scaling.newton.maximise`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.scaling.counts import Counts, count_pairs
from analysis.scaling.goodness import Goodness, goodness_of_fit
from analysis.scaling.laws import LAWS, LOGISTIC, MODELS, Law, Model
from analysis.scaling.newton import Maximum, joint_covariance, maximise
from analysis.scaling.penalty import FIRTH, NO_PENALTY, Gaussian, Penalty
from analysis.scaling.sandwich import sandwich
from analysis.scaling.separation import (
    Groups,
    Separation,
    are_connected,
    compared_groups,
    find_separation,
    separated_items,
    strong_groups,
)
from documents import Finding

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from analysis.scaling.quasi import QuasiVariances

Floats = NDArray[np.float64]
Method = Literal["ml", "firth"]
ModelMethod = Literal["ml", "firth", "map"]
CovarianceKind = Literal["model", "sandwich"]

DEFAULT_PRIOR_SD = 2.0
TWO_SIDED_95 = 1.959963984540054
SMALL = 64


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a fitted law beside the strengths.

    Attributes
    ----------
    name
        ``nu`` or ``eta`` (ties), or ``order`` (what being shown first adds).
    estimate, se
        On the scale on which it was fitted: log ν, log η, or δ, in the units of the strengths.
    is_factor
        Whether exp(estimate) is a factor of odds; not for an order effect in Thurstone's law, which has no odds.
    """

    name: str
    estimate: float
    se: float
    is_factor: bool = True

    @property
    def low(self) -> float:
        """Lower end of the 95 % interval, estimate − 1.96 se."""
        return self.estimate - TWO_SIDED_95 * self.se

    @property
    def high(self) -> float:
        """Upper end of the 95 % interval, estimate + 1.96 se."""
        return self.estimate + TWO_SIDED_95 * self.se

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

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        values: dict[str, Any] = {"name": self.name, "estimate": self.estimate, "se": self.se}
        values |= {"low": self.low, "high": self.high}
        if self.factor is not None:
            ends = (number if math.isfinite(number) else None for number in self.factor)
            values |= dict(zip(("factor", "factor_low", "factor_high"), ends, strict=True))
        return values


@dataclass(frozen=True, slots=True)
class OrderTest:
    """Likelihood-ratio test of no order effect: twice the gain in log likelihood, χ² with one degree of freedom."""

    statistic: float
    p: float


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Strengths of ``n`` items under a model, and whether they can be trusted.

    Attributes
    ----------
    model, method, covariance_kind, prior_sd
        What was asked for; ``prior_sd`` in the units of the strengths, None unless ``method`` is ``map``.
    counts
        The counts of each pair that it was fitted to.
    theta
        Shape (n,): strengths with mean 0, in nats; for ``thurstone`` in standard deviations of a difference. NaN
        where there is no maximum.
    joint_covariance
        Shape (n + f, n + f): of ``theta``, on vectors that sum to zero, and then of ``parameters``.
    parameters
        The f parameters beside the strengths: the tie parameter, then the order effect.
    log_likelihood
        Σ W log p, without binomial coefficients.
    order_test
        None unless an order effect was fitted by maximum likelihood.
    converged, iterations
        Whether the last step was below the tolerance; Newton steps taken.
    separation
        Why there is no finite maximum; None if the fit is sound.
    held_by_prior
        Why there would be no finite maximum without the prior; None where the answers keep all strengths finite.
        The strengths of groups that were never compared then differ by 0 ± σ √(1/k + 1/l) on average over their k and
        l items: what the prior says, and nothing else.
    ties_left_out
        How many ties the model has no place for.
    """

    model: Model
    method: ModelMethod
    covariance_kind: CovarianceKind
    prior_sd: float | None
    counts: Counts
    theta: Floats
    joint_covariance: Floats
    parameters: tuple[Parameter, ...]
    log_likelihood: float
    order_test: OrderTest | None
    converged: bool
    iterations: int
    separation: Separation | None
    held_by_prior: Separation | None = None
    ties_left_out: float = 0.0

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
        """Free numbers of the answers less the parameters of the law."""
        outcomes = 1 if LAWS[self.model].parameter is None else 2
        compared = int(np.count_nonzero(self.counts.total if outcomes == 2 else self.counts.won + self.counts.lost))
        return compared * outcomes - (self.counts.n - 1) - (len(self.joint_covariance) - self.counts.n)

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
            "method": self.method,
            "prior_sd": self.prior_sd,
            "covariance": self.covariance_kind,
            "log_likelihood": self.log_likelihood if sound else None,
            "log_posterior": self.log_posterior if sound and self.method == "map" else None,
            "deviance": goodness.deviance if goodness else None,
            "df": self.df,
            "goodness_of_fit": goodness.to_json() if goodness else None,
            "parameters": [parameter.to_json() for parameter in self.parameters],
            "order_test": {"statistic": test.statistic, "p": test.p} if test else None,
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


def fit(wins: Floats, *, method: Method = "ml", most_iterations: int | None = None) -> Fit:
    """Fit strengths to one matrix of counts, by Bradley and Terry's law [Bradley1952].

    Parameters
    ----------
    wins
        Shape (n, n), n at least 2: ``wins[i, j]`` is how often item i was preferred over item j; finite, at least
        zero, not necessarily whole; zero on the diagonal.
    method
        ``ml`` maximises the likelihood; ``firth`` the likelihood times the root of the information's determinant
        [Firth1993], which is finite even for an item that always wins.
    most_iterations
        Newton steps after which a fit stops without having converged; at least 1.

    Raises
    ------
    ResultsError
        If ``wins`` is no such matrix.

    Examples
    --------
    >>> import numpy as np
    >>> fitted = fit(np.array([[0.0, 9.0], [3.0, 0.0]]))
    >>> fitted.score.round(2).tolist()
    [0.75, 0.25]
    """
    matrix = _checked(wins, dimensions=2)
    counts = Counts.from_wins(matrix[None])
    if method == "firth":
        groups = compared_groups(matrix)
    else:
        groups = () if len(matrix) <= SMALL and are_connected(matrix[None])[0] else strong_groups(matrix)
    if len(groups) > 1:
        return _unfitted(counts, "bradley-terry", method, "model", None, Separation(groups, ()))
    penalty = FIRTH if method == "firth" else NO_PENALTY
    top = maximise(counts, penalty=penalty, most_iterations=most_iterations)
    return _fitted(counts, "bradley-terry", method, top, joint_covariance(counts, LOGISTIC, top.point)[0])


def fit_batch(wins: Floats) -> BatchFit:
    """Fit strengths by maximum likelihood to B matrices of counts in one call, such as bootstrap replicates.

    Parameters
    ----------
    wins
        Shape (B, n, n), each matrix as in `fit`. A replicate whose items are separated is reported and not solved.

    Raises
    ------
    ResultsError
        If ``wins`` is no such array.
    """
    counts = _checked(wins, dimensions=3)
    sound = are_connected(counts)
    batch, n, _ = counts.shape
    fitted = BatchFit(
        theta=np.full((batch, n), np.nan),
        log_likelihood=np.full(batch, np.nan),
        converged=np.zeros(batch, dtype=np.bool_),
        iterations=np.zeros(batch, dtype=np.intp),
        separated=~sound,
    )
    if sound.any():
        top = maximise(Counts.from_wins(counts[sound]))
        fitted.theta[sound], fitted.log_likelihood[sound] = top.theta, top.log_likelihood
        fitted.converged[sound], fitted.iterations[sound] = top.converged, top.iterations
    return fitted


def fit_sparse(wins: csr_array) -> BatchFit:
    """Fit strengths by maximum likelihood to sparse counts, as a batch of one; nothing of size n² is made.

    Parameters
    ----------
    wins
        Shape (n, n): a SciPy sparse array whose entry (i, j) is how often item i was preferred over item j; finite,
        at least zero, zero on the diagonal.

    Raises
    ------
    ResultsError
        If ``wins`` is no such matrix.
    """
    from scipy.sparse import csr_array

    from analysis.scaling.conjugate_gradients import SparseItems

    matrix = csr_array(wins.astype(np.float64))
    _check_entries(matrix.shape, matrix.data, matrix.diagonal() if matrix.shape[0] == matrix.shape[-1] else None, 2)
    matrix.eliminate_zeros()
    separated = np.array([len(strong_groups(matrix)) > 1])
    if separated[0]:
        nothing = np.full((1, matrix.shape[0]), np.nan)
        return BatchFit(nothing, np.array([np.nan]), ~separated, np.zeros(1, dtype=np.intp), separated)
    counts = Counts.from_sparse(matrix)
    top = maximise(counts, design=SparseItems(counts))
    return BatchFit(top.theta, top.log_likelihood, top.converged, top.iterations, separated)


def fit_model(
    comparisons: Comparisons,
    model: Model = "bradley-terry",
    *,
    method: ModelMethod = "ml",
    prior_sd: float = DEFAULT_PRIOR_SD,
    order_effect: bool = False,
    covariance: CovarianceKind = "model",
) -> Fit:
    """Fit ``model`` to ``comparisons``.

    Parameters
    ----------
    model
        ``bradley-terry`` [Bradley1952], ``davidson`` [Davidson1970] or ``rao-kupper`` [Rao1967] with ties, or
        ``thurstone``, Case V [Thurstone1927].
    method
        ``ml``; ``firth``, for ``bradley-terry`` without an order effect; or ``map``, with a Gaussian prior on each
        strength: the mode of the posterior, and the covariance from the curvature there.
    prior_sd
        Standard deviation of that prior, in the units of the strengths.
    order_effect
        Fit what being shown first adds.
    covariance
        ``model``, the inverse of the observed information, or ``sandwich``, clustered by observer.

    Raises
    ------
    ResultsError
        If there is no such model, it has no such method, no answer is a tie although the model is about ties, the
        prior is no positive number, the order was not noted, or a sandwich has fewer than two observers.

    Examples
    --------
    >>> from analysis.comparisons.comparisons import Answer, from_answers
    >>> answers = [Answer("a", "b", 9), Answer("b", "a", 3), Answer("a", "b", 6, tie=True)]
    >>> fit_model(from_answers(answers), "davidson").theta.round(3).tolist()
    [0.549, -0.549]
    """
    _check(comparisons, model, method, prior_sd, order_effect)
    law = LAWS[model]
    ties = law.parameter is not None
    prior = prior_sd if method == "map" else None
    counts, answers = count_pairs(comparisons, ordered=order_effect, ties=ties)
    left_out = 0.0 if ties else comparisons.ties
    names = comparisons.items
    separation = _separation(counts, names, ties, method)
    if separation is not None:
        return _unfitted(counts, model, method, covariance, prior, separation, left_out)
    penalty: Penalty = FIRTH if method == "firth" else Gaussian.of_sd(prior) if prior else NO_PENALTY
    top = maximise(counts, law, penalty=penalty)
    joint = joint_covariance(counts, law, top.point, penalty)[0]
    if covariance == "sandwich":
        joint = sandwich(counts, answers, law, top.point, joint)
    return _fitted(
        counts,
        model,
        method,
        top,
        joint,
        covariance_kind=covariance,
        prior_sd=prior,
        order_test=_order_test(counts, law, top) if order_effect and method == "ml" else None,
        held_by_prior=find_separation(counts, names, ties=ties) if method == "map" else None,
        ties_left_out=left_out,
    )


def _fitted(
    counts: Counts,
    model: Model,
    method: ModelMethod,
    top: Maximum,
    joint: Floats,
    *,
    covariance_kind: CovarianceKind = "model",
    prior_sd: float | None = None,
    order_test: OrderTest | None = None,
    held_by_prior: Separation | None = None,
    ties_left_out: float = 0.0,
) -> Fit:
    return Fit(
        model=model,
        method=method,
        covariance_kind=covariance_kind,
        prior_sd=prior_sd,
        counts=counts,
        theta=top.theta[0],
        joint_covariance=joint,
        parameters=_parameters(model, top, counts, joint),
        log_likelihood=float(top.log_likelihood[0]),
        order_test=order_test,
        converged=bool(top.converged[0]),
        iterations=int(top.iterations[0]),
        separation=None,
        held_by_prior=held_by_prior,
        ties_left_out=ties_left_out,
    )


def _unfitted(
    counts: Counts,
    model: Model,
    method: ModelMethod,
    covariance: CovarianceKind,
    prior_sd: float | None,
    separation: Separation,
    left_out: float = 0.0,
) -> Fit:
    n = counts.n
    return Fit(
        model=model,
        method=method,
        covariance_kind=covariance,
        prior_sd=prior_sd,
        counts=counts,
        theta=np.full(n, np.nan),
        joint_covariance=np.broadcast_to(np.nan, (n, n)),
        parameters=(),
        log_likelihood=float("nan"),
        order_test=None,
        converged=False,
        iterations=0,
        separation=separation,
        ties_left_out=left_out,
    )


def _check(comparisons: Comparisons, model: str, method: str, prior_sd: float, order_effect: bool) -> None:
    if model not in MODELS:
        raise ResultsError(Finding(f"there is no model '{model}'", remedy="expected one of: " + ", ".join(MODELS)))
    if method not in get_args(ModelMethod):
        remedy = "expected one of: " + ", ".join(get_args(ModelMethod))
        raise ResultsError(Finding(f"there is no method '{method}'", remedy=remedy))
    if method == "firth" and (model != "bradley-terry" or order_effect):
        what = "Firth's method is for the Bradley-Terry model without an order effect"
        raise ResultsError(Finding(what, remedy="use the method 'map', which is finite too"))
    if method == "map" and not (np.isfinite(prior_sd) and prior_sd > 0):
        raise ResultsError(Finding(f"the prior's standard deviation is {prior_sd:g}", remedy="give one above zero"))
    if len(comparisons.items) < 2:
        raise ResultsError(Finding("there are fewer than two items", remedy="compare two items at least"))
    if LAWS[model].parameter and not comparisons.ties:
        what = f"no answer is a tie, and the model '{model}' is about ties"
        raise ResultsError(Finding(what, remedy="use the model 'bradley-terry'"))


def _separation(counts: Counts, items: tuple[str, ...], ties: bool, method: ModelMethod) -> Separation | None:
    if method != "firth":
        return find_separation(counts, items, ties=ties, prior=method == "map")
    total = counts.total
    both = Counts(counts.n, counts.first, counts.second, total, total, counts.tied)
    return find_separation(both, items, ties=False)


def _order_test(counts: Counts, law: Law, top: Maximum) -> OrderTest:
    from scipy.special import gammaincc

    gained = float(top.log_likelihood[0] - maximise(counts.without_order(), law).log_likelihood[0])
    statistic = max(0.0, 2 * gained)
    return OrderTest(statistic, float(gammaincc(0.5, statistic / 2)))


def _parameters(model: Model, top: Maximum, counts: Counts, joint: Floats) -> tuple[Parameter, ...]:
    law = LAWS[model]
    if not (law.parameter or counts.ordered):
        return ()
    errors = iter(np.sqrt(np.maximum(np.diag(joint)[counts.n :], 0)).tolist())
    parameters = []
    if law.parameter:
        parameters.append(Parameter(law.parameter, float(top.k[0, 0]), next(errors)))
    if counts.ordered:
        parameters.append(Parameter("order", float(top.order[0, 0]), next(errors), is_factor=model != "thurstone"))
    return tuple(parameters)


def _checked(wins: Floats, dimensions: int) -> Floats:
    counts = np.asarray(wins, dtype=np.float64)
    square = counts.ndim == dimensions and counts.shape[-1] == counts.shape[-2]
    _check_entries(counts.shape, counts, np.diagonal(counts, axis1=-2, axis2=-1) if square else None, dimensions)
    return counts


def _check_entries(shape: tuple[int, ...], entries: Floats, diagonal: Floats | None, dimensions: int) -> None:
    if diagonal is None or shape[-1] < 2:
        expected = "(n, n)" if dimensions == 2 else "(B, n, n)"
        raise ResultsError(Finding(f"the counts have the shape {shape}", remedy=f"give {expected} with n at least 2"))
    if not (np.isfinite(entries).all() and (entries >= 0).all()):
        raise ResultsError(Finding("the counts hold a negative or infinite number or NaN", remedy="count again"))
    if diagonal.any():
        raise ResultsError(Finding("the diagonal of the counts is not zero", remedy="compare different items"))
