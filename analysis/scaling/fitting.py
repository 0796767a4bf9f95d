"""Fit a model of paired comparison: law, penalty, order effect and covariance chosen by name.

`fit_model` fits answers, `fit` one matrix of wins by Bradley and Terry's law, `fit_batch` many of them, such as the
replicates of a bootstrap, and `fit_sparse` a sparse one; all by `analysis.scaling.newton.maximise`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, get_args

import numpy as np

from analysis.choices import CovarianceChoice
from analysis.comparisons.comparisons import Comparisons
from analysis.covariance.laplacian import for_equations
from analysis.errors import ResultsError
from analysis.scaling.clustered import ByObserver, by_observer
from analysis.scaling.counts import Answers, Counts, count_pairs
from analysis.scaling.jeffreys import Jeffreys
from analysis.scaling.laws import LAWS, LOGISTIC, Law, Model
from analysis.scaling.newton import Maximum, joint_covariance, maximise
from analysis.scaling.penalty import FIRTH, NO_PENALTY, Gaussian, Penalty
from analysis.scaling.profile import MOST_STEPS, climbed, wins_by_observer
from analysis.scaling.result import (
    COVARIANCE_CHOICES,
    BatchFit,
    CovarianceKind,
    Fit,
    Method,
    ModelMethod,
    OrderTest,
    Parameter,
)
from analysis.scaling.robust_tests import score_test
from analysis.scaling.sandwich import observer_slopes
from analysis.scaling.separation import Separation, are_connected, find_separation, separation_of_method, strong_groups
from documents import Finding, one_blas_thread
from documents.arrays import Floats

if TYPE_CHECKING:
    from scipy.sparse import csr_array

DEFAULT_PRIOR_SD = 2.0
SETTLED = 1e-9  # a step of Fisher's scoring, whose slopes are exact to about 1e-10
MOST_AT_START = 3.0  # of a tie parameter, where answers say that it is endless


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

    Returns
    -------
    Fit
        Strengths of the n items in nats, their covariance, and how well the law fits. Where no finite strengths fit,
        the fit has the reason: how the items are separated.

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
    linked = matrix + matrix.T if method == "firth" else matrix
    if not are_connected(linked[None])[0]:
        return _unfitted(counts, "bradley-terry", method, "model", None, Separation(strong_groups(linked), ()))
    penalty = FIRTH if method == "firth" else NO_PENALTY
    with for_equations(counts.n):
        top = maximise(counts, penalty=penalty, most_iterations=most_iterations)
        covariance = joint_covariance(counts, LOGISTIC, top.point)[0]
    return _fitted(counts, "bradley-terry", method, top, covariance)


@one_blas_thread()
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

    Examples
    --------
    >>> import numpy as np
    >>> batch = fit_batch(np.array([[[0.0, 9], [3, 0]], [[0, 12], [0, 0]]]))
    >>> batch.theta.round(2).tolist(), batch.separated.tolist()
    ([[0.55, -0.55], [nan, nan]], [False, True])
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


@one_blas_thread()
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


@one_blas_thread()
def fit_model(
    comparisons: Comparisons,
    model: Model = "bradley-terry",
    *,
    method: ModelMethod = "ml",
    prior_sd: float = DEFAULT_PRIOR_SD,
    order_effect: bool = False,
    covariance: CovarianceChoice = "auto",
) -> Fit:
    """Fit ``model`` to ``comparisons``.

    Parameters
    ----------
    comparisons
        Who was preferred over whom, by which observer.
    model
        ``bradley-terry`` [Bradley1952], ``davidson`` [Davidson1970] or ``rao-kupper`` [Rao1967] with ties, or
        ``thurstone``, Case V [Thurstone1927].
    method
        ``ml``; ``firth``, with Jeffreys' prior, which keeps the strengths of all items that comparisons link finite;
        or ``map``, with a Gaussian prior on each strength: the mode of the posterior, and the covariance from the
        curvature there.
    prior_sd
        Standard deviation of that prior, in the units of the strengths.
    order_effect
        Fit what being shown first adds.
    covariance
        ``model``, the inverse of the observed information, which takes all answers for independent; or clustered by
        observer: ``scaled``, ``sandwich`` or ``shrinkage``, as `analysis.covariance.shrinkage` has them. ``auto`` is
        ``shrinkage`` where the table names two observers or more; ``scaled`` above 200 items, and for Firth's fits,
        in which observers who all agree say nothing of how much others would differ; ``model`` for ``map``.

    Returns
    -------
    Fit
        Strengths of the n items (in nats, or standard deviations for ``thurstone``), their covariance, other
        parameters, and how well the model fits. Where no finite strengths fit, the fit has the reason: how the
        items are separated.

    Raises
    ------
    ResultsError
        If there is no such model or method, no answer is a tie although the model is about ties, the
        prior is no positive number, the order was not noted, a covariance clustered by observer has fewer than two
        observers, or there is no such covariance.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> answers = [Answer("a", "b", 9), Answer("b", "a", 3), Answer("a", "b", 6, tie=True)]
    >>> fit_model(from_answers(answers), "davidson").theta.round(3).tolist()
    [0.549, -0.549]
    """
    law = LAWS.wanted(model, "model", ResultsError)
    _check(comparisons, model, method, prior_sd, order_effect)
    ties = law.parameter is not None
    prior = prior_sd if method == "map" else None
    counts, answers = count_pairs(comparisons, ordered=order_effect, ties=ties)
    # Who prefers neither throughout has no answer to a model without ties.
    kind = covariance_kind(covariance, len(np.unique(answers.observer)), len(comparisons.items), method)
    left_out = 0.0 if ties else comparisons.ties
    names = comparisons.items
    separation = separation_of_method(counts, names, ties=ties, method=method)
    if separation is not None:
        return _unfitted(counts, model, method, kind, prior, separation, left_out)
    penalty: Penalty = FIRTH if method == "firth" else Gaussian.of_sd(prior) if prior else NO_PENALTY
    plain = law is LOGISTIC and not order_effect
    top = maximise(counts, law, penalty=penalty) if plain or method != "firth" else _penalised(counts, law)
    joint = joint_covariance(counts, law, top.point, penalty)[0]
    clustered = None if kind == "model" else by_observer(kind, counts, answers, law, top.point, joint)
    wins = None if clustered is None else wins_by_observer(counts, answers)
    return _fitted(
        counts,
        model,
        method,
        top,
        joint if clustered is None else clustered.joint,
        covariance_kind=kind,
        clustered=clustered,
        prior_sd=prior,
        order_test=_order_test(counts, answers, law, top) if order_effect and method == "ml" else None,
        held_by_prior=find_separation(counts, names, ties=ties) if method == "map" else None,
        ties_left_out=left_out,
        wins=wins,
    )


def _penalised(counts: Counts, law: Law) -> Maximum:
    """Return where the likelihood with Jeffreys' prior is largest by another law, or with an order effect."""
    likelihood = Jeffreys(counts, law)
    own = law.parameter is not None
    start = np.zeros((1, likelihood.parameters))
    if own:
        start[:, counts.n] = np.clip(law.start(counts)[0], -MOST_AT_START, MOST_AT_START)
    _, found, steps = climbed(likelihood, start, small=SETTLED)
    theta, none = found[:, : counts.n], np.zeros((1, 1))
    k, order = found[:, counts.n : counts.n + 1] if own else none, found[:, -1:] if counts.ordered else none
    log_likelihood = law.log_likelihood(counts, counts.differences(theta, order), k).sum(axis=1)
    return Maximum(theta, k, order, log_likelihood, steps, np.array(steps < MOST_STEPS))


def _fitted(
    counts: Counts,
    model: Model,
    method: ModelMethod,
    top: Maximum,
    joint: Floats,
    *,
    covariance_kind: CovarianceKind = "model",
    clustered: ByObserver | None = None,
    prior_sd: float | None = None,
    order_test: OrderTest | None = None,
    held_by_prior: Separation | None = None,
    ties_left_out: float = 0.0,
    wins: Floats | None = None,
) -> Fit:
    return Fit(
        model=model,
        method=method,
        covariance_kind=covariance_kind,
        prior_sd=prior_sd,
        counts=counts,
        theta=top.theta[0],
        joint_covariance=joint,
        parameters=_parameters(model, top, counts, joint, clustered),
        log_likelihood=float(top.log_likelihood[0]),
        order_test=order_test,
        converged=bool(top.converged[0]),
        iterations=int(top.iterations[0]),
        separation=None,
        held_by_prior=held_by_prior,
        ties_left_out=ties_left_out,
        clustered=clustered,
        wins_by_observer=wins,
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


MOST_ITEMS_SHRUNK = 200


def covariance_kind(choice: CovarianceChoice, observers: int, items: int, method: ModelMethod) -> CovarianceKind:
    """Return the kind of covariance that ``choice`` means with so many ``observers`` and ``items``.

    Raises
    ------
    ResultsError
        If there is no such choice, or too few observers for it.
    """
    if choice not in COVARIANCE_CHOICES:
        remedy = "expected one of: " + ", ".join(COVARIANCE_CHOICES)
        raise ResultsError(Finding(f"there is no covariance '{choice}'", remedy=remedy))
    if choice != "auto":
        return choice
    if observers < 2 or method == "map":
        return "model"
    return "scaled" if method == "firth" or items > MOST_ITEMS_SHRUNK else "shrinkage"


def _check(comparisons: Comparisons, model: str, method: str, prior_sd: float, order_effect: bool) -> None:
    if method not in get_args(ModelMethod):
        remedy = "expected one of: " + ", ".join(get_args(ModelMethod))
        raise ResultsError(Finding(f"there is no method '{method}'", remedy=remedy))
    if method == "map" and not (np.isfinite(prior_sd) and prior_sd > 0):
        raise ResultsError(Finding(f"the prior's standard deviation is {prior_sd:g}", remedy="give one above zero"))
    if len(comparisons.items) < 2:
        raise ResultsError(Finding("there are fewer than two items", remedy="compare two items at least"))
    if LAWS[model].parameter and not comparisons.ties:
        what = f"no answer is a tie, and the model '{model}' is about ties"
        raise ResultsError(Finding(what, remedy="use the model 'bradley-terry'"))


def _order_test(counts: Counts, answers: Answers, law: Law, top: Maximum) -> OrderTest:
    from scipy.special import gammaincc

    without = maximise(counts.without_order(), law)
    statistic = max(0.0, 2 * float(top.log_likelihood[0] - without.log_likelihood[0]))
    slopes = observer_slopes(counts, answers, law, without.point)
    inverse = joint_covariance(counts, law, without.point)[0]
    by_observers = score_test(slopes, inverse, np.eye(len(inverse))[-1:])
    return OrderTest(statistic, float(gammaincc(0.5, statistic / 2)), by_observers)


def _parameters(
    model: Model, top: Maximum, counts: Counts, joint: Floats, clustered: ByObserver | None
) -> tuple[Parameter, ...]:
    law = LAWS[model]
    if not (law.parameter or counts.ordered):
        return ()
    errors = np.sqrt(np.maximum(np.diag(joint)[counts.n :], 0)).tolist()
    freedom = [math.inf] * len(errors) if clustered is None else clustered.parameter_freedom.tolist()
    own = ([(law.parameter, float(top.k[0, 0]), True)] if law.parameter else []) + (
        [("order", float(top.order[0, 0]), law.unit == "nats")] if counts.ordered else []
    )
    return tuple(
        Parameter(name, estimate, se, is_factor, free)
        for (name, estimate, is_factor), se, free in zip(own, errors, freedom, strict=True)
    )


def _checked(wins: Floats, dimensions: int) -> Floats:
    counts = np.asarray(wins, dtype=np.float64)
    square = counts.ndim == dimensions and counts.shape[-1] == counts.shape[-2]
    _check_entries(counts.shape, counts, counts.diagonal(axis1=-2, axis2=-1) if square else None, dimensions)
    return counts


def _check_entries(shape: tuple[int, ...], entries: Floats, diagonal: Floats | None, dimensions: int) -> None:
    if diagonal is None or shape[-1] < 2:
        expected = "(n, n)" if dimensions == 2 else "(B, n, n)"
        raise ResultsError(Finding(f"the counts have the shape {shape}", remedy=f"give {expected} with n at least 2"))
    if entries.size and not 0 <= entries.min() <= entries.max() < np.inf:
        raise ResultsError(Finding("the counts contain a negative or infinite number or NaN", remedy="count again"))
    if diagonal.any():
        raise ResultsError(Finding("the diagonal of the counts is not zero", remedy="compare different items"))
