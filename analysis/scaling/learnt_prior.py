"""Bradley-Terry strengths under a normal prior: finite, with a covariance, for any answers, even for none.

Each θ_i is normal about 0 with standard deviation σ. For one σ, `analysis.scaling.expectation_propagation` gives mean
and covariance of the strengths, which sum to zero, and the evidence, the probability of the answers.

σ is learnt from the answers too (empirical Bayes [MacKay1992]). Few answers say little about it: a single best σ makes
intervals too short. So the posterior is averaged over σ, each weighted by its evidence and a half-normal prior
[Gelman2006] of `WIDTH_OF_SPREADS` nats. Mean and covariance are those of the whole average, in which the spread of the
means is included.

Without any of this, answers to pairs that were chosen for being close make strengths seem further apart than they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.covariance.laplacian import contrast_variances
from analysis.scaling.counts import Counts
from analysis.scaling.expectation_propagation import Approximation, Sites, approximate, joined, swept
from analysis.scaling.laws import LOGISTIC
from documents.arrays import Floats

WIDTH_OF_SPREADS = 3.0  # standard deviation of the half-normal prior of σ, in nats
DRAWS, SEED = 4000, 41414
_START_SD = 1.5
_STEPS, _LONGEST_STEP, _CLOSE = 50, 1.0, 0.2  # of log σ; the last in its own standard deviations
_WIDEST_GAP = 0.5  # between values of log σ that are averaged
_LEAST_WEIGHT = 1e-4  # of the largest: σ of less weight are left out


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """The strengths in nats after some answers, and how they were computed.

    Attributes
    ----------
    theta, covariance
        Shapes (n,) and (n, n): mean and covariance on strengths that sum to zero.
    prior_sd
        σ in nats. If it was learnt, the geometric mean of its posterior, or its most probable value while pairs are
        chosen.
    log_likelihood
        Σ W log p at ``theta``.
    iterations, converged
        Sweeps of expectation propagation, and whether all that were asked for converged.
    sites
        Shape (2, n, n), for i < j: precision τ and shift ν that stand for the answers about each pair.
    """

    theta: Floats
    covariance: Floats
    prior_sd: float
    log_likelihood: float
    iterations: int
    converged: bool
    sites: Floats

    def contrasts(self) -> tuple[Floats, Floats]:
        """Return mean and variance of θ_i − θ_j, each of shape (n, n)."""
        return self.theta[:, None] - self.theta[None, :], contrast_variances(self.covariance)

    def log10_score_limits(self, level: float = 0.95, wider: float = 1.0) -> Floats:
        """Return the limits of log10 scores, shape (n, 2): quantiles of `DRAWS` draws from a fixed seed.

        Scores are shares of a sum of exponentials. Where strengths are not well known, that is far from linear. Draws
        lie ``wider`` times as far from the mean as the covariance says.
        """
        n = len(self.theta)
        mean_too = self.covariance + np.trace(self.covariance) / n**2  # scores do not depend on the mean strength
        normal = np.random.default_rng(SEED).standard_normal((DRAWS, n))
        drawn = self.theta + wider * normal @ np.linalg.cholesky(mean_too).T
        drawn -= np.logaddexp.reduce(drawn, axis=1, keepdims=True)
        tail = (1 - level) / 2
        return np.asarray(np.quantile(drawn / np.log(10), [tail, 1 - tail], axis=0).T)


def posterior(wins: Floats, prior_sd: float) -> Posterior:
    """Return the posterior of the strengths.

    Parameters
    ----------
    wins
        Shape (n, n): ``wins[i, j]`` is how often item i was preferred over item j; any counts, also none.
    prior_sd
        σ in nats, above zero.
    """
    counts = Counts.from_wins(wins[None])
    return _of_one(counts, approximate(counts, prior_sd), prior_sd)


def updated_posterior(wins: Floats, before: Posterior | None = None, steps: int = 3) -> Posterior:
    """Return the posterior at the most probable σ, quickly: for choosing the next pairs, not for intervals.

    Parameters
    ----------
    wins
        Shape (n, n): as for `posterior`; at least the answers of ``before``.
    before
        The posterior before the last few answers, from which on sites and σ move.
    steps
        How often σ moves, with one sweep of all sites after each step.

    Examples
    --------
    >>> import numpy as np
    >>> first = updated_posterior(np.array([[0.0, 1, 0], [0, 0, 0], [0, 0, 0]]))
    >>> after = updated_posterior(np.array([[0.0, 1, 1], [0, 0, 0], [0, 0, 0]]), first)
    >>> int(after.theta.argmax())
    0
    """
    counts = Counts.from_wins(wins[None])
    if before is None:
        return _of_one(counts, *_at_likely_sd(counts))
    prior_sd, sites = before.prior_sd, _listed(counts, before.sites)
    for _ in range(steps):
        theta, covariance = joined(counts, prior_sd, sites)
        sites = swept(counts, prior_sd, sites, theta, covariance)
        prior_sd *= float(np.exp(_step(theta, covariance, prior_sd)[0]))
    theta, covariance = joined(counts, prior_sd, sites)
    return _posterior(counts, theta, covariance, prior_sd, sites, steps, converged=True)


def learnt_posterior(wins: Floats) -> Posterior:
    """Return the posterior of the strengths under a prior whose standard deviation is learnt from the answers too.

    It is averaged over σ. In simulation, intervals of ± 1.96 standard deviations of differences then have their
    coverage for 10 to 60 items, from 5 answers an item on (``benchmarks/active_pairs.py``).

    Parameters
    ----------
    wins
        Shape (n, n): as for `posterior`.

    Returns
    -------
    Posterior
        Mean, shape (n,), and covariance, shape (n, n), of the strengths in nats, with the σ that was learnt.

    Examples
    --------
    >>> import numpy as np
    >>> after = learnt_posterior(np.array([[0.0, 3, 3], [0, 0, 3], [0, 0, 0]]))  # each better item always won
    >>> bool(np.isfinite(after.theta).all()), after.converged
    (True, True)
    """
    counts = Counts.from_wins(wins[None])
    middle, likely_sd = _at_likely_sd(counts)
    gap = min(_WIDEST_GAP, 1 / np.sqrt(_step(middle.theta, middle.covariance, likely_sd)[1]))
    known = [(np.log(likely_sd), middle, _log_weight(middle, likely_sd))]
    for direction in (-gap, gap):
        log_sd, after, _ = known[0]
        while True:
            log_sd += direction
            after = approximate(counts, float(np.exp(log_sd)), after.sites)
            known.append((log_sd, after, _log_weight(after, float(np.exp(log_sd)))))
            if known[-1][2] < max(weight for _, _, weight in known) + np.log(_LEAST_WEIGHT):
                break
    log_weights = np.array([weight for _, _, weight in known])
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    theta = np.asarray(sum(weight * after.theta for weight, (_, after, _) in zip(weights, known, strict=True)))
    covariance = np.zeros((counts.n, counts.n))
    for weight, (_, after, _) in zip(weights, known, strict=True):
        off = after.theta - theta
        covariance += weight * (after.covariance + np.outer(off, off))
    prior_sd = float(np.exp(weights @ np.array([log_sd for log_sd, _, _ in known])))
    sweeps, converged = sum(after.sweeps for _, after, _ in known), all(after.converged for _, after, _ in known)
    return _posterior(counts, theta, covariance, prior_sd, middle.sites, sweeps, converged=converged)


def _at_likely_sd(counts: Counts) -> tuple[Approximation, float]:
    """Return the posterior at nearly the most probable σ, and that σ."""
    prior_sd = _START_SD
    after = approximate(counts, prior_sd)
    for _ in range(_STEPS):
        step, information = _step(after.theta, after.covariance, prior_sd)
        prior_sd *= float(np.exp(step))
        after = approximate(counts, prior_sd, after.sites)
        if abs(step) * np.sqrt(information) < _CLOSE:
            break
    return after, prior_sd


def _step(theta: Floats, covariance: Floats, prior_sd: float) -> tuple[float, float]:
    """Return Newton's step of log σ towards its most probable value, and the information about log σ.

    Where sites are as they should be, they need not be followed: the slope of the evidence is that of fixed ones.
    """
    precision = prior_sd**-2
    size = precision * float(theta @ theta + np.trace(covariance))
    wide = (prior_sd / WIDTH_OF_SPREADS) ** 2
    slope = size - (len(theta) - 1) + 1 - wide
    fall = 4 * theta @ covariance @ theta + 2 * (covariance**2).sum()
    information = max(2 * size - precision**2 * float(fall) + 2 * wide, 0.5)
    return float(np.clip(slope / information, -_LONGEST_STEP, _LONGEST_STEP)), information


def _log_weight(after: Approximation, prior_sd: float) -> float:
    """Return the log density of log σ given the answers, up to a constant."""
    return after.log_evidence + float(np.log(prior_sd)) - (prior_sd / WIDTH_OF_SPREADS) ** 2 / 2


def _listed(counts: Counts, sites: Floats) -> Sites:
    """Return the sites of the pairs that were compared."""
    precision, shift = sites[:, counts.first, counts.second]
    return Sites(precision, shift)


def _of_one(counts: Counts, after: Approximation, prior_sd: float) -> Posterior:
    theta, covariance = after.theta, after.covariance
    return _posterior(counts, theta, covariance, prior_sd, after.sites, after.sweeps, converged=after.converged)


def _posterior(
    counts: Counts,
    theta: Floats,
    covariance: Floats,
    prior_sd: float,
    sites: Sites,
    iterations: int,
    *,
    converged: bool,
) -> Posterior:
    spread = np.zeros((2, counts.n, counts.n))
    spread[:, counts.first, counts.second] = sites.precision, sites.shift
    likelihood = LOGISTIC.log_likelihood(counts, counts.differences(theta[None]), 0.0)
    return Posterior(theta, covariance, prior_sd, float(likelihood.sum()), iterations, converged, spread)
