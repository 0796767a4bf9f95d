"""Fit a model of paired comparison to comparisons: law, method, order effect and covariance chosen by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.scaling.ascent import Point, Top, joint_covariance, maximise
from analysis.scaling.cells import Cells, count_cells
from analysis.scaling.davidson import Davidson
from analysis.scaling.existence import Separation, find_separation
from analysis.scaling.goodness import Goodness, goodness_of_fit
from analysis.scaling.law import Law
from analysis.scaling.logistic import Logistic
from analysis.scaling.parameter import Parameter
from analysis.scaling.probit import Probit
from analysis.scaling.rao_kupper import RaoKupper
from analysis.scaling.sandwich import sandwich
from documents import Finding

Floats = NDArray[np.float64]
Model = Literal["bradley-terry", "davidson", "rao-kupper", "thurstone"]
ModelMethod = Literal["ml", "firth", "map"]
CovarianceKind = Literal["model", "sandwich"]
MODELS: tuple[Model, ...] = get_args(Model)
DEFAULT_PRIOR_SD = 2.0


@dataclass(frozen=True, slots=True)
class OrderTest:
    """Likelihood-ratio test of no order effect: twice the gain in log likelihood, χ² with one degree of freedom."""

    statistic: float
    p: float


@dataclass(frozen=True, slots=True, eq=False)
class ModelFit:
    """Strengths of ``n`` items under a model, and whether they can be trusted.

    Attributes
    ----------
    model, method, covariance_kind, prior_sd
        What was asked for; ``prior_sd`` in the units of the strengths, None unless ``method`` is ``map``.
    theta
        Shape (n,): strengths with mean 0, in nats; for ``thurstone`` in standard deviations of a difference. NaN
        where there is no maximum.
    covariance, se
        Shapes (n, n) and (n,): of ``theta``, on vectors that sum to zero.
    joint_covariance
        Shape (n + f, n + f): of ``theta`` and then of ``parameters``.
    parameters
        The f parameters beside the strengths: the tie parameter, then the order effect.
    log_likelihood
        Σ W log p, without binomial coefficients.
    log_posterior
        The same plus −Σ θ² / (2 σ²); as the log likelihood where there is no prior.
    goodness
        Deviance and degrees of freedom; None where there is no maximum.
    order_test
        None unless an order effect was fitted by maximum likelihood.
    converged, iterations
        Whether the last step was below the tolerance; Newton steps taken.
    separation
        Why there is no finite maximum; None if the fit is sound.
    held_by_prior
        Why there would be no finite maximum without the prior; None where the answers hold all strengths themselves.
        The strengths of groups that were never compared then differ by 0 ± σ √(1/k + 1/l) on average over their k and
        l items: what the prior says, and nothing else.
    ties_left_out
        How many ties the model has no place for.
    """

    model: Model
    method: ModelMethod
    covariance_kind: CovarianceKind
    prior_sd: float | None
    theta: Floats
    covariance: Floats
    se: Floats
    joint_covariance: Floats
    parameters: tuple[Parameter, ...]
    log_likelihood: float
    log_posterior: float
    goodness: Goodness | None
    order_test: OrderTest | None
    converged: bool
    iterations: int
    separation: Separation | None
    held_by_prior: Separation | None
    ties_left_out: float

    def to_json(self) -> dict[str, Any]:
        """Return how the fit was made and how good it is, as plain values; not the strengths."""
        test = self.order_test
        sound = self.separation is None
        return {
            "model": self.model,
            "method": self.method,
            "prior_sd": self.prior_sd,
            "covariance": self.covariance_kind,
            "log_likelihood": self.log_likelihood if sound else None,
            "log_posterior": self.log_posterior if sound and self.method == "map" else None,
            "deviance": self.goodness.deviance if self.goodness else None,
            "df": self.goodness.df if self.goodness else None,
            "goodness_of_fit": self.goodness.to_json() if self.goodness else None,
            "parameters": [parameter.to_json() for parameter in self.parameters],
            "order_test": {"statistic": test.statistic, "p": test.p} if test else None,
            "held_by_prior": list(self.held_by_prior.sentences) if self.held_by_prior else [],
            "ties_left_out": self.ties_left_out,
            "converged": self.converged,
            "iterations": self.iterations,
        }


def fit_model(
    comparisons: Comparisons,
    model: Model = "bradley-terry",
    *,
    method: ModelMethod = "ml",
    prior_sd: float = DEFAULT_PRIOR_SD,
    order_effect: bool = False,
    covariance: CovarianceKind = "model",
) -> ModelFit:
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
    """
    law = _law(model)
    _check(comparisons, model, law, method, prior_sd, order_effect)
    ties = law.parameter is not None
    prior = prior_sd if method == "map" else None
    cells, lines = count_cells(comparisons, ordered=order_effect, ties=ties)
    separation = _separation(cells, comparisons.items, ties, method)
    left_out = 0.0 if ties else comparisons.ties
    if separation is not None:
        return _unfitted(model, method, covariance, prior, separation, cells.n, left_out)
    top = _firth(comparisons, cells, law) if method == "firth" else maximise(cells, law, prior)
    joint = joint_covariance(cells, law, top.point, prior)
    if covariance == "sandwich":
        joint = sandwich(cells, lines, law, top.point, joint)
    n = cells.n
    difference = cells.differences(top.point.theta, top.point.order)
    further = len(joint) - n
    goodness = goodness_of_fit(cells, law.probabilities(difference, top.point.k), n - 1 + further, ties=ties)
    test = _order_test(cells, law, top) if order_effect and method == "ml" else None
    se = np.sqrt(np.maximum(np.diag(joint), 0))
    return ModelFit(
        model=model,
        method=method,
        covariance_kind=covariance,
        prior_sd=prior,
        theta=top.point.theta,
        covariance=joint[:n, :n],
        se=se[:n],
        joint_covariance=joint,
        parameters=_parameters(law, top.point, cells, se[n:], model),
        log_likelihood=top.log_likelihood,
        log_posterior=top.log_posterior,
        goodness=goodness,
        order_test=test,
        converged=top.converged,
        iterations=top.iterations,
        separation=None,
        held_by_prior=find_separation(cells, comparisons.items, ties=ties) if method == "map" else None,
        ties_left_out=left_out,
    )


def _law(model: str) -> Law:
    laws: dict[str, Law] = {"bradley-terry": Logistic(), "davidson": Davidson(), "rao-kupper": RaoKupper()}
    laws["thurstone"] = Probit()
    if model not in laws:
        raise ResultsError(Finding(f"there is no model '{model}'", remedy="expected one of: " + ", ".join(MODELS)))
    return laws[model]


def _check(comparisons: Comparisons, model: str, law: Law, method: str, prior_sd: float, order_effect: bool) -> None:
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
    if law.parameter and not comparisons.ties:
        what = f"no answer is a tie, and the model '{model}' is about ties"
        raise ResultsError(Finding(what, remedy="use the model 'bradley-terry'"))


def _separation(cells: Cells, items: tuple[str, ...], ties: bool, method: ModelMethod) -> Separation | None:
    if method != "firth":
        return find_separation(cells, items, ties=ties, prior=method == "map")
    both = Cells(cells.n, cells.first, cells.second, cells.total, cells.total, cells.tied, False)
    return find_separation(both, items, ties=False)


def _firth(comparisons: Comparisons, cells: Cells, law: Law) -> Top:
    from analysis.scaling import firth

    theta, iterations, converged = firth.maximise(comparisons.wins)
    point = Point(theta)
    likelihood = float(law.log_likelihood(cells, cells.differences(theta, 0.0), 0.0).sum())
    return Top(point, likelihood, likelihood, iterations, converged)


def _order_test(cells: Cells, law: Law, top: Top) -> OrderTest:
    from scipy.special import gammaincc

    without = Cells(cells.n, cells.first, cells.second, cells.won, cells.lost, cells.tied, False)
    statistic = max(0.0, 2 * (top.log_likelihood - maximise(without, law).log_likelihood))
    return OrderTest(statistic, float(gammaincc(0.5, statistic / 2)))


def _parameters(law: Law, point: Point, cells: Cells, se: Floats, model: Model) -> tuple[Parameter, ...]:
    errors = iter(se.tolist())
    found = [Parameter(law.parameter, point.k, next(errors))] if law.parameter else []
    if cells.ordered:
        found.append(Parameter("order", point.order, next(errors), is_factor=model != "thurstone"))
    return tuple(found)


def _unfitted(
    model: Model,
    method: ModelMethod,
    covariance: CovarianceKind,
    prior_sd: float | None,
    separation: Separation,
    n: int,
    left_out: float,
) -> ModelFit:
    nan = float("nan")
    return ModelFit(
        model=model,
        method=method,
        covariance_kind=covariance,
        prior_sd=prior_sd,
        theta=np.full(n, nan),
        covariance=np.full((n, n), nan),
        se=np.full(n, nan),
        joint_covariance=np.full((n, n), nan),
        parameters=(),
        log_likelihood=nan,
        log_posterior=nan,
        goodness=None,
        order_test=None,
        converged=False,
        iterations=0,
        separation=separation,
        held_by_prior=None,
        ties_left_out=left_out,
    )
