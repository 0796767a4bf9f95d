"""Expectation propagation: the marginal likelihood of observers who differ, at a given spread between them.

Observer o answers by strengths θ + b_o, each entry of b_o normal with standard deviation τ. The answers to one pair by
one observer make a factor t(η) of the difference η = θ_i + b_i − θ_j − b_j. A site exp(β η − v η² / 2) stands for it,
and with sites alone everything is Gaussian. Each site is set so that its η keeps mean and variance when the factor
takes the site's place [Minka2001], until none moves. Means under t are by Gauss-Hermite quadrature in one dimension.
The marginal likelihood is Z = ∫ N(b) Π site db · Π E[t / site].

There the gradient of log Z by θ is that of the Gaussian model, Σ_o b̂_o / τ². Its information is close to the
Gaussian's, M = Σ_o (I − Q_o⁻¹) / τ² with Q_o as in `extensions.inference.elimination`. Newton's steps for θ are taken
together with those of the sites.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from analysis.covariance import ROUNDING, solve
from analysis.scaling import LOGISTIC, Counts, Law
from documents.arrays import Floats
from extensions.inference.elimination import Blocks, Solution

QUADRATURE_POINTS = 15
CHUNK = 2048
FEW_ANSWERS, LARGEST_EXPONENT = 8, 60.0
MOST_SWEEPS = 300
BALANCING = 10
SETTLING, WORSE, SLOW = 5, 3.0, 0.25
LARGEST_SHIFT, LARGEST_RATIO = 2.0, 5.0


@dataclass(frozen=True, slots=True, eq=False)
class GroupAnswers:
    """The answers within one group: ``counts`` list each observer's pairs, ``blocks`` their networks, in one order."""

    counts: Counts
    blocks: Blocks


@dataclass(frozen=True, slots=True, eq=False)
class TiltedSites:
    """Where the propagation stands in one group of n items and E pairs of an observer.

    Attributes
    ----------
    theta
        Shape (n,): the population's strengths, with mean 0.
    slope, precision
        Shape (E,): β and v of each site.
    links
        Shape (n, n): weights of the graph whose Laplacian is the population's information M.
    effects, doubt
        Shape (N,), for each item that an observer compared: mean of the observer's effect, and its variance in units
        of τ².
    log_z, log_z_slope
        Log of the marginal likelihood at ``theta``, and its derivative by τ.
    sweeps, converged
        How often the sites were set, and whether they had settled.
    """

    theta: Floats
    slope: Floats
    precision: Floats
    links: Floats
    effects: Floats
    doubt: Floats
    log_z: float
    log_z_slope: float
    sweeps: int
    converged: bool


def alike(answers: GroupAnswers, law: Law, theta: Floats) -> TiltedSites:
    """Return the sites of observers who do not differ, at the strengths ``theta`` (n,) of the plain fit."""
    counts, nodes = answers.counts, answers.blocks.nodes
    d = counts.differences(theta[None])
    slopes = law.slopes(counts, d, 0.0)
    v = slopes.dd[0]
    links = np.zeros((counts.n, counts.n))
    np.add.at(links, (counts.first, counts.second), v)
    return TiltedSites(
        theta=theta,
        slope=slopes.d[0] + v * d[0],
        precision=v,
        links=links + links.T,
        effects=np.zeros(nodes),
        doubt=np.ones(nodes),
        log_z=float(law.log_likelihood(counts, d, 0.0).sum()),
        log_z_slope=0.0,
        sweeps=0,
        converged=True,
    )


def propagate(
    answers: GroupAnswers,
    law: Law,
    spread: float,
    start: TiltedSites,
    tolerance: float,
    *,
    fixed: bool = False,
    slope_only: bool = False,
) -> TiltedSites:
    """Return the sites at the maximum over θ, for observers with the standard deviation ``spread``, above zero.

    Sites have settled when no mean moves by more than ``tolerance`` of its standard deviation, no variance by more than
    that share, and no strength by more than that. Where sweeps make matters worse, the next ones go half as far. With
    ``fixed`` the strengths stay where they are, and the links are those of the start. With ``slope_only`` log Z is NaN,
    its slope is not, and the links are those of `_rough_links`.
    """
    counts, blocks, variance = answers.counts, answers.blocks, spread**2
    theta, slope, v, links = start.theta, start.slope, start.precision, start.links
    share, best, converged, sweeps, slow = 1.0, np.inf, False, 0, False
    sizes = [np.inf, np.inf]
    while not converged and sweeps < MOST_SWEEPS:
        sweeps += 1
        delta = counts.differences(theta[None])[0]
        solution = _solved(blocks, variance, slope - v * delta, v)
        mean, deviation = _marginals(blocks, variance, delta, solution)
        shift, ratio, _ = _tilted(counts, law, (mean, deviation, slope, v))
        largest = max(float(np.abs(shift).max()), float(np.abs(ratio - 1).max()))
        shift = np.clip(shift, -LARGEST_SHIFT, LARGEST_SHIFT)
        ratio = np.clip(ratio, 1 / LARGEST_RATIO, LARGEST_RATIO)
        change = share * (1 / ratio - 1) / deviation**2
        slope = slope + mean * change + share * shift / (ratio * deviation)
        v = np.maximum(v + change, 0.0)
        if not fixed:
            gradient = np.bincount(blocks.item, solution.mean, counts.n) / variance
            if slope_only and not slow:
                links = _rough_links(counts, blocks, variance, solution)
            step = solve(links[None], (gradient - gradient.mean())[None, :, None])[0, :, 0]
            theta = theta + share * step
            size = float(np.abs(step).max())
            if size > SLOW * sizes[-2]:  # a step of the strengths answers one of the sites, two sweeps later
                links, slow = blocks.links(variance * v) / variance, True
            sizes.append(size)
            largest = max(largest, size)
        converged = largest < tolerance
        if sweeps > SETTLING and largest > WORSE * best:
            share, best = share / 2, largest
        best = min(best, largest)
    delta = counts.differences(theta[None])[0]
    solution = _solved(blocks, variance, slope - v * delta, v)
    if not fixed:
        if slope_only:
            links = _rough_links(counts, blocks, variance, solution)
        else:
            links = blocks.links(variance * v) / variance
    log_z = np.nan
    if not slope_only:
        mean, deviation = _marginals(blocks, variance, delta, solution)
        gained = _tilted(counts, law, (mean, deviation, slope, v))[2]
        flow = slope - v * delta
        # hᵀ b̂ / 2, h being the sum of the flows into each node.
        log_z = float((delta * (slope + flow)).sum() + (flow * (mean - delta)).sum()) / 2 + float(gained.sum())
        log_z -= blocks.log_determinant(variance * v) / 2
    squares = float((solution.mean**2).sum()) / variance + float(solution.variance.sum())
    return TiltedSites(
        theta=theta,
        slope=slope,
        precision=v,
        links=links,
        effects=solution.mean,
        doubt=solution.variance,
        log_z=log_z,
        log_z_slope=(squares - blocks.nodes) / spread,
        sweeps=sweeps,
        converged=converged,
    )


def _solved(blocks: Blocks, variance: float, flow: Floats, v: Floats) -> Solution:
    """Return the posterior of the effects: means in the units of the strengths, variances in those of τ²."""
    of_first, of_second = (np.bincount(ends, flow, blocks.nodes) for ends in (blocks.first, blocks.second))
    right = np.asarray(of_first - of_second, np.float64)
    return blocks.solve(variance * v, variance * right)


def _marginals(blocks: Blocks, variance: float, delta: Floats, solution: Solution) -> tuple[Floats, Floats]:
    """Return mean and standard deviation of η for each site."""
    mean = delta + solution.mean[blocks.first] - solution.mean[blocks.second]
    return mean, np.sqrt(variance * solution.pair_variance)


def _rough_links(counts: Counts, blocks: Blocks, variance: float, solution: Solution) -> Floats:
    """Return about what `Blocks.links` gives, over τ², at little cost.

    Sums of rows, and what observers who compared a pair contribute to it, are exact. What is left of the rows' sums is
    divided among all pairs, as s_i s_j.
    """
    n = counts.n
    of_pair = solution.variance[blocks.first] + solution.variance[blocks.second] - solution.pair_variance
    links = np.bincount(counts.first * n + counts.second, of_pair / (2 * variance), n * n).reshape(n, n)
    links = links + links.T
    rows = np.bincount(blocks.item, (1 - solution.variance) / variance, n)
    left = np.maximum(rows - links.sum(axis=1), 0.0)
    if left.sum() <= ROUNDING * rows.sum():
        return np.asarray(links, np.float64)
    s = left / np.sqrt(left.sum())
    for _ in range(BALANCING):
        s = left / np.maximum(s.sum() - s, s.sum() / n)
        s *= np.sqrt(left.sum() / (s.sum() ** 2 - s @ s))
    rest = np.outer(s, s)
    np.fill_diagonal(rest, 0.0)
    return np.asarray(links + rest)


def _tilted(counts: Counts, law: Law, sites: Sequence[Floats]) -> tuple[Floats, Floats, Floats]:
    """Return what a factor does to its η in place of the site, and log E[t / site], each of shape (E,).

    ``sites``: means and deviations of the marginals of η, slopes and precisions, of shape (E,) each. The first is by
    how many standard deviations it moves the mean, the second by what it multiplies the variance.
    """
    pairs = len(sites[0])
    shift, ratio, gained = np.empty(pairs), np.empty(pairs), np.empty(pairs)
    for start in range(0, pairs, CHUNK):
        some = slice(start, start + CHUNK)
        first, second = counts.first[some], counts.second[some]
        own = Counts(counts.n, first, second, counts.won[:, some], counts.lost[:, some], counts.tied[:, some])
        mean, deviation, slope, v = (each[some] for each in sites)
        part = mean, deviation, slope, v
        moments = (_logistic_moments(own, part) if law is LOGISTIC else None) or _moments(own, law, part)
        shift[some], ratio[some], gained[some] = moments
    return shift, ratio, gained


def _moments(counts: Counts, law: Law, sites: Sequence[Floats]) -> tuple[Floats, Floats, Floats]:
    """Return `_tilted` by any law, for answers of any number."""
    (mean, deviation, slope, v), (z, weight) = sites, _rule()
    eta = mean + deviation * z[:, None]
    terms = law.log_likelihood(counts, eta, 0.0)
    terms += np.log(weight)[:, None] - eta * (slope - eta * (v / 2))
    largest = terms.max(axis=0)
    chance = np.exp(terms - largest)
    total = chance.sum(axis=0)
    shift = z @ chance / total
    return shift, z**2 @ chance / total - shift**2, np.log(total) + largest


def _logistic_moments(counts: Counts, sites: Sequence[Floats]) -> tuple[Floats, Floats, Floats] | None:
    """As `_moments` by the logistic law, without a logarithm for each point; None where a product could underflow.

    With η = m + s z, W answers won of N, factor / site = exp(c + A z + B z²) (1 + exp η)^−N.
    """
    (mean, deviation, slope, v), (z, weight) = sites, _rule()
    won, answers = counts.won[0], counts.won[0] + counts.lost[0]
    linear, square = deviation * (won - slope + v * mean), deviation**2 * v / 2
    reach = np.abs(mean) + z[-1] * deviation
    exponent = z[-1] * np.abs(linear) + z[-1] ** 2 * square
    if answers.max() > FEW_ANSWERS or max(reach.max(), exponent.max()) > LARGEST_EXPONENT:
        return None
    eta = z[:, None] * deviation
    eta += mean
    odds = np.exp(eta, out=eta)
    odds += 1
    terms = z[:, None] * linear
    terms += (z**2)[:, None] * square
    chance = np.exp(terms, out=terms)
    chance /= odds
    several = np.flatnonzero(answers != 1)
    chance[:, several] *= odds[:, several] ** (1 - answers[several])
    total, first, second = (weight * np.stack([z**0, z, z**2])) @ chance
    shift = first / total
    return shift, second / total - shift**2, np.log(total) + mean * (won - slope + mean * (v / 2))


@cache
def _rule() -> tuple[Floats, Floats]:
    z, weight = np.polynomial.hermite_e.hermegauss(QUADRATURE_POINTS)
    return z, weight / weight.sum()
