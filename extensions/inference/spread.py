"""The spread τ between observers, from the profile of the marginal likelihood, and what not knowing it exactly adds.

For each τ the marginal likelihood is at its maximum over the population's strengths θ. Maximised as it is, it makes τ
too small where there are few observers, as a variance is too small when it is divided by n. Cox and Reid's adjustment
[Cox1987] takes − ½ log det of the information about the strengths, which must be orthogonal to τ: θ is not, since
strengths grow with τ at the same answers, but a θ is, a(τ) being the factor by which the differences between observers
flatten the chances of a small difference (Thurstone: a = 1 / √(1 + 2τ²)). So

    ℓ(τ) = Σ_groups [ log Z − ½ log det M + (n − 1) log a ].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, TypeVar

import numpy as np

from analysis.covariance import pseudo_inverse
from analysis.scaling import LOGISTIC, Counts, Law
from documents import in_threads
from documents.arrays import Floats
from documents.text import JsonResult
from extensions.inference.elimination import Blocks
from extensions.inference.propagation import GroupAnswers, TiltedSites, alike, propagate

Result = TypeVar("Result")

GRID = (0.05, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0, 1.25, 1.5, 1.8, 2.2, 2.7, 3.3, 4.0, 5.0, 6.5, 8.0)  # in nats
ROUGH, FINE = 1e-4, 1e-6
LOOSE_FOR_MANY, ROUGH_FOR_MANY, FINE_FOR_MANY = 1e-2, 1e-3, 1e-4
DROP_95 = 1.920729410347062  # half the quantile of χ² with one degree of freedom
FAR_DROP, CLOSE_DROP = 8.0, 1.5
FINE_POINTS = 801
MANY_PAIRS, FEW_PAIRS = 200_000, 20_000
FEW_SHARE, FIRST_SPREAD, CLOSE = 0.05, 0.5, 0.5


def mapped(work: Callable[..., Result], *columns: Sequence[Any], size: float) -> tuple[Result, ...]:
    """Return ``work`` of each group, in their order: side by side where there are many pairs or answers, ``size``."""
    if len(columns[0]) == 1 or size < MANY_PAIRS:
        return tuple(map(work, *columns))
    return tuple(in_threads(lambda group: work(*group), zip(*columns, strict=True)))


def unit(law: Law) -> float:
    """Return one nat's worth of difference in the units of the law's strengths, by the length of a JND."""
    return law.jnd / LOGISTIC.jnd


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """One τ: ℓ(τ), log Z and its slope by τ, and each group's strengths and their covariance at that τ."""

    spread: float
    height: float
    log_z: float
    slope: float
    theta: tuple[Floats, ...]
    covariance: tuple[Floats, ...]


class SpreadProfile:
    """ℓ at the values of τ that have been looked at, in rising order; ``sites`` are the last ones, one per group."""

    def __init__(self, groups: Sequence[GroupAnswers], law: Law, plain: Sequence[Floats]) -> None:
        self.groups, self.law = tuple(groups), law
        self._alike = tuple(alike(answers, law, theta) for answers, theta in zip(groups, plain, strict=True))
        self.sites, self.sweeps, self.converged = self._alike, 0, True
        self._flattening = 1.0
        self.nodes = [self._node(0.0, self.sites)]

    def look(self, spread: float, tolerance: float = ROUGH) -> Node:
        """Compute ℓ at ``spread``, above zero."""
        self.move(spread, tolerance, slope_only=False)
        node = self._node(spread, self.sites)
        self.nodes = sorted([*(n for n in self.nodes if n.spread != spread), node], key=lambda n: n.spread)
        return node

    def move(self, spread: float, tolerance: float, *, slope_only: bool = True) -> float:
        """Bring the sites to ``spread``, above zero; return the slope of log Z there.

        With ``slope_only`` the sites have no log Z, and their links are near the exact ones.
        """
        now = self.law.flattening(spread)
        ratio = now / self._flattening
        starts = [replace(sites, theta=sites.theta / ratio, links=sites.links * ratio**2) for sites in self.sites]
        self._flattening = now

        def work(answers: GroupAnswers, start: TiltedSites) -> TiltedSites:
            return propagate(answers, self.law, spread, start, tolerance, slope_only=slope_only)

        self.sites = mapped(work, self.groups, starts, size=sum(answers.blocks.pairs for answers in self.groups))
        self.sweeps += max(sites.sweeps for sites in self.sites)
        self.converged = all(sites.converged for sites in self.sites)
        return sum(sites.log_z_slope for sites in self.sites)

    def adjustment(self, sites: Sequence[TiltedSites]) -> float:
        """Return what ℓ adds to log Z, by the links of ``sites``."""
        added = 0.0
        for part in sites:
            strength = part.links.sum(axis=1)
            information = np.diag(strength) - part.links
            added += (len(strength) - 1) * float(np.log(self._flattening))
            added -= float(np.linalg.slogdet(information[1:, 1:])[1]) / 2
        return added

    def back_to_zero(self) -> Node:
        """Return the node of observers who do not differ, with its sites."""
        self.sites, self.converged = self._alike, True
        return self.nodes[0]

    def _node(self, spread: float, sites: Sequence[TiltedSites]) -> Node:
        log_z = sum(part.log_z for part in sites)
        height = log_z + self.adjustment(sites)
        covariances = tuple(pseudo_inverse(part.links[None])[0] for part in sites)
        slope = sum(part.log_z_slope for part in sites)
        return Node(spread, height, log_z, slope, tuple(part.theta for part in sites), covariances)


@dataclass(frozen=True, slots=True)
class ObserverSd(JsonResult):
    """Standard deviation τ of an item's strength between observers, in the units of the strengths.

    Attributes
    ----------
    estimate
        The maximum of ℓ, at least 0.
    low, high
        Ends of the 95 % likelihood interval: where ℓ is 1.92 below its maximum. ``low`` may be 0; ``high`` is None
        where the answers set no upper limit.
    statistic, p
        Twice ℓ's gain over τ = 0, and its p value by the equal mixture of 0 and χ² with one degree of freedom
        [Self1987].
    """

    estimate: float
    low: float
    high: float | None
    statistic: float
    p: float
    json_keys: ClassVar = {"estimate": "sd"}


@dataclass(frozen=True, slots=True, eq=False)
class SpreadEstimate:
    """τ, the node at its estimate, and what not knowing τ exactly adds.

    Attributes
    ----------
    covariance
        Of each group's strengths, averaged over what τ may be, on the scale of the τ that was estimated.
    scale_variance
        Variance of that scale, as a share of itself: all differences of strengths may be too large, or too small, by
        the same factor.
    """

    spread: ObserverSd
    at: Node
    covariance: tuple[Floats, ...]
    scale_variance: float


def estimate_spread(profile: SpreadProfile) -> SpreadEstimate | None:
    """Look at as many τ as are needed; None where ℓ has no maximum below the end of the grid."""
    if sum(answers.blocks.pairs for answers in profile.groups) > MANY_PAIRS:
        found = _by_newton(profile)
        if found is not None:
            return found
    _explore(profile)
    nodes = profile.nodes
    tau, height = _interpolated(nodes)
    top = int(np.argmax(height))
    if top == len(tau) - 1:
        return None
    best, most = _vertex(tau, height, top) if top else 0.0, float(height[top])
    over = height - most + DROP_95
    low = 0.0 if over[0] >= 0 else float(np.interp(0.0, over[: top + 1], tau[: top + 1]))
    high = None if over[-1] >= 0 else float(np.interp(0.0, -over[top:], tau[top:]))
    spread = ObserverSd(best, low, high, *_test(most - nodes[0].height))
    weights = _weights(tau, height, nodes)
    at = profile.look(best, FINE) if best > 0 else profile.back_to_zero()
    share = np.array([profile.law.flattening(node.spread) for node in nodes]) / profile.law.flattening(best)
    covariance = tuple(
        np.asarray(np.tensordot(weights * share**2, np.stack(matrices), 1))
        for matrices in zip(*(node.covariance for node in nodes), strict=True)
    )
    return SpreadEstimate(spread, at, covariance, float(weights @ (share - 1) ** 2))


def _explore(profile: SpreadProfile) -> None:
    """Look at τ along the grid until ℓ has fallen far, then between the nodes next to the highest one."""
    scale = unit(profile.law)
    for value in GRID:
        node = profile.look(value * scale)
        top = max(profile.nodes, key=lambda other: other.height)
        if top.spread < node.spread and top.height - node.height > FAR_DROP:
            break
    for _ in range(12):
        nodes = profile.nodes
        highest = max(range(len(nodes)), key=lambda place: nodes[place].height)
        gaps = [place for place in (highest - 1, highest) if 0 <= place < len(nodes) - 1]
        wide = [place for place in gaps if abs(nodes[place].height - nodes[place + 1].height) > CLOSE_DROP]
        if not wide:
            break
        for place in wide:
            profile.look((nodes[place].spread + nodes[place + 1].spread) / 2)


def _interpolated(nodes: Sequence[Node]) -> tuple[Floats, Floats]:
    """Return τ on a fine grid, and ℓ there; ℓ is an even function of τ."""
    from scipy.interpolate import CubicSpline

    places = np.array([node.spread for node in nodes])
    heights = np.array([node.height for node in nodes])
    tau = np.linspace(0.0, places[-1], FINE_POINTS)
    mirrored = CubicSpline(np.r_[-places[:0:-1], places], np.r_[heights[:0:-1], heights])
    return tau, np.asarray(mirrored(tau))


def _vertex(tau: Floats, height: Floats, top: int) -> float:
    """Return where the parabola through the highest point and its neighbours is highest."""
    below, at, above = height[top - 1 : top + 2].tolist()
    return float(tau[top] + (tau[1] - tau[0]) / 2 * (below - above) / (below - 2 * at + above))


def _weights(tau: Floats, height: Floats, nodes: Sequence[Node]) -> Floats:
    """Return each node's share of the likelihood, spread over τ evenly before: what lies between two is divided."""
    mass = np.exp(height - height.max())
    mass /= mass.sum()
    places = [node.spread for node in nodes]
    return np.array([mass @ np.interp(tau, places, row) for row in np.eye(len(nodes))])


def _test(gain: float) -> tuple[float, float]:
    from scipy.special import gammaincc

    statistic = max(0.0, 2 * gain)
    return statistic, float(gammaincc(0.5, statistic / 2)) / 2 if statistic > 0 else 1.0


def _by_newton(profile: SpreadProfile) -> SpreadEstimate | None:
    """With many answers ℓ is a parabola in log τ: by the slopes at two values; None where it is too wide for that.

    Strengths are those of a τ within half a standard error of the estimate, brought to its scale by a(τ).

    Where to begin comes from a few of the observers, their strengths being those of the plain fit over a(τ).
    """
    start = _from_few(profile)
    if start is None:
        return None
    one, step = start
    slope = profile.move(one, LOOSE_FOR_MANY)
    added = profile.adjustment(profile.sites)
    newton = one + slope * step**2
    two = one + float(np.sign(newton - one)) * min(max(abs(newton - one), step), one / 2)
    second = profile.move(float(two), ROUGH_FOR_MANY)
    # What is added to log Z changes little with τ.
    further = (profile.adjustment(profile.sites) - added) / (two - one)
    curvature = (slope - second) / (two - one)
    if curvature <= 0:
        return None
    error, three = float(curvature**-0.5), float(two + (second + further) / curvature)
    if not 0 < error < FEW_SHARE * three:
        return None
    at = profile.look(three, FINE_FOR_MANY)
    best = three + (at.slope + further) / curvature
    if abs(best - three) > CLOSE * error:
        three, at = best, profile.look(best, FINE_FOR_MANY)
        best = three + (at.slope + further) / curvature
    best = float(best)
    width = float(np.sqrt(2 * DROP_95)) * error / best
    low, high = best * float(np.exp(-width)), best * float(np.exp(width))
    spread = ObserverSd(best, low, high, *_test(at.height - profile.nodes[0].height))
    ratio = profile.law.flattening(three) / profile.law.flattening(best)
    there = replace(at, theta=tuple(ratio * theta for theta in at.theta))
    scale = (error * _log_slope(profile.law, best)) ** 2
    return SpreadEstimate(spread, there, tuple(ratio**2 * covariance for covariance in at.covariance), scale)


def _from_few(profile: SpreadProfile) -> tuple[float, float] | None:
    """Return τ by some observers, and the standard error that it would have by all; None where τ is at an end."""
    from scipy.optimize import brentq

    law, scale = profile.law, unit(profile.law)
    pairs = sum(answers.blocks.pairs for answers in profile.groups)
    groups = [_some(answers, -(-pairs // FEW_PAIRS)) for answers in profile.groups]
    share = sum(answers.blocks.pairs for answers in groups) / pairs
    theta = [sites.theta for sites in profile.sites]

    def slope(spread: float) -> float:
        flat = law.flattening(spread)
        starts = [alike(answers, law, strengths / flat) for answers, strengths in zip(groups, theta, strict=True)]
        return sum(
            propagate(answers, law, spread, sites, ROUGH_FOR_MANY, fixed=True, slope_only=True).log_z_slope
            for answers, sites in zip(groups, starts, strict=True)
        )

    low = high = FIRST_SPREAD * scale
    while slope(high) > 0:
        low, high = high, 2 * high
        if high > GRID[-1] * scale:
            return None
    while low == high or slope(low) <= 0:
        low, high = low / 2, low
        if low < GRID[0] * scale:
            return None
    best = float(brentq(slope, low, high, rtol=1e-2))
    curvature = (slope(0.98 * best) - slope(1.02 * best)) / (0.04 * best)
    return (best, float((curvature / share) ** -0.5)) if curvature > 0 else None


def _some(answers: GroupAnswers, every: int) -> GroupAnswers:
    """Return the answers of one in ``every`` observers."""
    counts, blocks = answers.counts, answers.blocks
    kept = blocks.block % every == 0
    place = np.cumsum(kept) - 1
    pairs = kept[blocks.first]
    first, second = (place[nodes[pairs]] for nodes in (blocks.first, blocks.second))
    some = Blocks(first, second, blocks.block[kept] // every, blocks.item[kept], blocks.items)
    parts = (counts.won[:, pairs], counts.lost[:, pairs], counts.tied[:, pairs])
    return GroupAnswers(Counts(counts.n, counts.first[pairs], counts.second[pairs], *parts), some)


def _log_slope(law: Law, spread: float) -> float:
    """Return the derivative of log a by τ."""
    return float(np.log(law.flattening(1.01 * spread) / law.flattening(0.99 * spread)) / (0.02 * spread))
