"""Expectation propagation: the posterior of Bradley-Terry strengths under a normal prior, as a normal one.

The answers about a pair, p^W_ij (1 − p)^W_ji with p = 1 / (1 + e^−d), depend on θ through d = θ_i − θ_j alone. They are
replaced by a *site* exp(ν d − τ d² / 2), so that the posterior is normal, of precision I/σ² + Σ τ a aᵀ, a = e_i − e_j.
Each site is chosen so that mean and variance of d stay the same when the site is exchanged for the answers themselves
[Minka2001]. The integrals are Gauss-Hermite sums about the mode. Unlike Laplace's approximation, which looks at the
mode only, this takes in how skewed a likelihood of few answers is: mean, variance and evidence are then near the exact
ones [Kuss2005].

All sites are updated in the same sweep, which the answers' concave log likelihood permits: no τ is below zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from analysis.covariance import laplacian
from analysis.scaling.counts import Counts
from documents.arrays import Floats

NODES = 20
TOLERANCE = 1e-4  # in standard deviations of each difference
MOST_SWEEPS = 200
_MODE_TOLERANCE, _MODE_STEPS = 0.01, 100  # in standard deviations: the nodes need not stand exactly at the mode
_LEAST_PRECISION = 1e-12  # relative to the prior's


@dataclass(frozen=True, slots=True, eq=False)
class Sites:
    """What stands for the answers about each of m pairs: ``precision`` τ and ``shift`` ν, both of shape (m,)."""

    precision: Floats
    shift: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Approximation:
    """The posterior under a prior of a given width.

    Attributes
    ----------
    theta, covariance
        Shapes (n,) and (n, n): mean and covariance of strengths that sum to zero.
    log_evidence
        Log of the probability of the answers, without binomial coefficients.
    sites
        Those that theta and covariance follow from.
    sweeps, converged
        Updates of all sites, and whether the last one moved no difference by more than the tolerance.
    """

    theta: Floats
    covariance: Floats
    log_evidence: float
    sites: Sites
    sweeps: int
    converged: bool


def approximate(counts: Counts, prior_sd: float, start: Sites | None = None) -> Approximation:
    """Return the posterior of the strengths under normal priors about 0 with the standard deviation ``prior_sd``.

    Parameters
    ----------
    counts
        A single set of m pairs, each compared at least once.
    start
        Where to begin, such as the sites under a prior of another width.
    """
    won, lost = counts.won[0], counts.lost[0]
    sites = Sites(0.15 * (won + lost), 0.4 * (won - lost)) if start is None else start
    last = np.inf
    for sweep in range(1, MOST_SWEEPS + 1):
        theta, covariance = joined(counts, prior_sd, sites)
        log_masses, better, moved = _update(counts, prior_sd, sites, theta, covariance)
        if moved < TOLERANCE or sweep == MOST_SWEEPS:
            break
        sites = better if moved < last else _halfway(sites, better)  # sites that move together may overshoot
        last = moved
    flow = counts.net_flows(sites.shift[None], exact=False)[0]
    # log Z = Σ log Ẑ_ij + ½ (log |Σ| − (n − 1) log σ² + νᵀ Σ ν), ν summed over the items' pairs; νᵀ Σ ν = ν · θ.
    log_widths = _log_determinant(covariance) - 2 * (counts.n - 1) * np.log(prior_sd)
    evidence = float(log_masses.sum() + (log_widths + flow @ theta) / 2)
    return Approximation(theta, covariance, evidence, sites, sweep, bool(moved < TOLERANCE))


def joined(counts: Counts, prior_sd: float, sites: Sites) -> tuple[Floats, Floats]:
    """Return mean (n,) and covariance (n, n) that prior and sites give together."""
    covariance = laplacian.pseudo_inverse(counts.matrix(sites.precision[None]), prior_sd**-2, overwrite=True)[0]
    return np.asarray(covariance @ counts.net_flows(sites.shift[None], exact=False)[0]), covariance


def swept(counts: Counts, prior_sd: float, sites: Sites, theta: Floats, covariance: Floats) -> Sites:
    """Return all sites after one update, from the mean and the covariance that `joined` gives for them."""
    return _update(counts, prior_sd, sites, theta, covariance)[1]


def _update(
    counts: Counts, prior_sd: float, sites: Sites, theta: Floats, covariance: Floats
) -> tuple[Floats, Sites, float]:
    """Return each pair's part of the log evidence, its next site, and the largest move in standard deviations."""
    mean, variance = _of_pairs(counts, theta, covariance)
    # What is left without the site. The prior alone says at least so much.
    precision = np.maximum(1 / variance - sites.precision, 1 / (2 * prior_sd**2))
    # The cavity: the marginal of d divided by the site, in natural parameters (precision, precision × mean).
    shift = mean / variance - sites.shift
    log_mass, own_mean, own_variance = _tilted(counts.won[0], counts.lost[0], shift / precision, 1 / precision, mean)
    # log Ẑ_ij takes the site's own integral out again, so that the sum over pairs counts each answer once.
    kept = precision + sites.precision
    log_mass += (np.log(kept / precision) - (shift + sites.shift) ** 2 / kept + shift**2 / precision) / 2
    # Moment matching [Minka2001]: the new site is the tilted law's natural parameters less the cavity's.
    moved = _largest((own_mean - mean) / np.sqrt(variance), np.log(own_variance / variance) / 2)
    least = _LEAST_PRECISION / prior_sd**2
    return log_mass, Sites(np.maximum(1 / own_variance - precision, least), own_mean / own_variance - shift), moved


def _of_pairs(counts: Counts, theta: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Return mean and variance of each pair's difference."""
    first, second = counts.first, counts.second
    own = np.diag(covariance)
    variance = own[first] + own[second] - 2 * covariance[first, second]
    return theta[first] - theta[second], np.maximum(variance, laplacian.ROUNDING * (own[first] + own[second]))


def _tilted(won: Floats, lost: Floats, mean: Floats, variance: Floats, near: Floats) -> tuple[Floats, Floats, Floats]:
    """Return log mass, mean and variance of N(d; mean, variance) p(d)^won (1 − p(d))^lost, all of one shape.

    ``near`` is where the search for its mode begins.
    """
    total = won + lost
    # The mode solves (d − mean) / variance = W − N p(d), whose right side falls with d.
    reach = mean + variance * (won - total * _logistic(mean))  # the mode is between here and the mean
    low, high = np.minimum(mean, reach), np.maximum(mean, reach)
    mode = np.clip(near, low, high)
    for _ in range(_MODE_STEPS):
        p = _logistic(mode)
        slope, curvature = won - total * p - (mode - mean) / variance, total * p * (1 - p) + 1 / variance
        low, high = np.where(slope > 0, mode, low), np.where(slope < 0, mode, high)
        # A Newton step, or half of the bracket where it would leave it.
        ahead = mode + slope / curvature
        mode = np.where((ahead >= low) & (ahead <= high), ahead, (low + high) / 2)
        if _largest(slope / np.sqrt(curvature)) < _MODE_TOLERANCE:
            break
    nodes, log_weights = _rule()
    p = _logistic(mode)
    # Gauss-Hermite nodes about the mode, as wide as the curvature there says (Laplace's width).
    width = 1 / np.sqrt(total * p * (1 - p) + 1 / variance)
    d = mode + width * nodes[:, None]
    # W log p + L log(1 − p) with p = 1 / (1 + e^−d), without overflow on either side.
    log_mass = won * np.minimum(d, 0) - lost * np.maximum(d, 0) - total * np.log1p(np.exp(-np.abs(d)))
    log_mass += log_weights[:, None] - (d - mean) ** 2 / (2 * variance)
    top = log_mass.max(axis=0)
    mass = np.exp(log_mass - top)
    whole = mass.sum(axis=0)
    # Moments of the tilted law, in widths from the mode.
    off = nodes @ mass / whole
    spread = np.maximum(nodes**2 @ mass / whole - off**2, 1e-12)
    return np.log(whole) + top + np.log(width) - np.log(variance) / 2, mode + width * off, width**2 * spread


@cache
def _rule() -> tuple[Floats, Floats]:
    """Return nodes z and log weights of the integral of f over N(0, 1), of f exp(−z² / 2) / √2π given log f."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    return nodes, np.log(weights / weights.sum()) + nodes**2 / 2


def _log_determinant(covariance: Floats) -> float:
    """Return it for vectors that sum to zero."""
    n = len(covariance)
    size = float(np.trace(covariance)) / n
    return float(np.linalg.slogdet(covariance + size / n)[1] - np.log(size))


def _logistic(x: Floats) -> Floats:
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * x)))


def _halfway(old: Sites, new: Sites) -> Sites:
    return Sites((old.precision + new.precision) / 2, (old.shift + new.shift) / 2)


def _largest(*steps: Floats) -> float:
    return max(float(np.abs(step).max(initial=0.0)) for step in steps)
