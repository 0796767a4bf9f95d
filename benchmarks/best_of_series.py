"""Choices from series: the likelihood integrated over observers, and intervals of scores. Run time and error.

The rule that the fit uses (the trapezoid, at even distances) beside Gauss-Hermite nodes, for observers who scatter more
than they differ from each other, and for observers who differ four times as much as they scatter.

Intervals of similarity-weighted scores: the error is that of their coverage, 95 %, in 2000 simulated studies; Wilson's
at the effective number of answers beside a bootstrap over observers.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from time import perf_counter

import numpy as np
from curves import program, row, seconds, sized
from promises import Promise, worst

from analysis.series.just_noticeable import NODES, REACH, Matches
from analysis.series.observer_means import bounded_means, means

LEVELS = np.log([1.3, 1.6, 2.0, 2.5, 3.0, 4.0])
CUTS = np.concatenate([[-np.inf], (LEVELS[1:] + LEVELS[:-1]) / 2, [np.inf]])
STUDIES = sized(((30, 1, 0.1), (15, 5, 0.1), (30, 5, 0.1), (10, 5, 0.3), (15, 5, 0.6)), ((15, 5, 0.1),))
CASES = {"within = 0.25, between = 0.15": (0.25, 0.15), "within = 0.1, between = 0.4": (0.1, 0.4)}


def run() -> dict[str, object]:
    """Return the rows."""
    rows: list[dict[str, object]] = []
    for name, (within, between) in CASES.items():
        matches = _matches(within, between)
        truth = _adaptive(matches, within, between)
        plain_s = seconds(partial(_adaptive, matches, within, between), repeats=3)
        rows.append(row(f"adaptive quadrature, {name}", "1e-13", plain_s, None, "the reference of the others"))
        for count in (11, 21, 41, 81, 121, NODES):
            rule = _trapezoid(matches, count)
            rows.append(_measured(f"trapezoid, {name}", count, rule, (within, between), truth))
        for count in (7, 15, 31, 61, 121):
            rule = _hermite(matches, count)
            rows.append(_measured(f"Gauss-Hermite, {name}", count, rule, (within, between), truth))
    for observers, series, share in STUDIES:
        rows += _intervals(observers, series, share)
    used = worst(rows, series="trapezoid", parameter=f"{NODES} nodes")
    promises = [Promise("relative error of the log likelihood that the fit uses", used, 1e-13, "error")]
    return {"title": "Choices from series: likelihood, and intervals of scores", "rows": rows, "promises": promises}


def _intervals(observers: int, series: int, share: float) -> list[dict[str, object]]:
    random = np.random.default_rng([observers, series])
    size = series, observers, sized(2000, 20)
    own = random.beta(2 * share, 2 * (1 - share), size[1:]) if series > 1 else np.full(size[1:], share)
    lean = random.normal(0, 1, size[1:])
    given = (random.random(size) < own) * np.clip(np.round(6.5 + lean + random.normal(0, 1.2, size)), 1, 10)
    truth = share * float(
        np.clip(np.round(6.5 + random.normal(0, np.hypot(1, 1.2), sized(4_000_000, 10_000))), 1, 10).mean()
    )
    count = np.full(size[1:], float(series))
    total, squares = given.sum(axis=0), (given**2).sum(axis=0)
    ways = {
        "Wilson's": partial(bounded_means, total, squares, count, 10.0),
        "bootstrap": partial(means, total, count, replicates=1000),
    }
    rows = []
    for way, work in ways.items():
        start = perf_counter()
        found = [one for one in work() if one.value and one.low is not None and one.high is not None]
        taken_s = (perf_counter() - start) / size[2]
        covered = float(np.mean([one.low <= truth <= one.high for one in found]))
        name = f"{way}, chosen in {share:.0%}, {observers} observers of {series} choices"
        rows.append(row(name, "one score", taken_s, abs(covered - 0.95), f"coverage {covered:.1%}"))
    return rows


def _matches(within: float, between: float) -> Matches:
    random = np.random.default_rng(414)
    observer = np.repeat(np.arange(15), 5)
    match = np.log(2.2) + between * random.standard_normal(15)[observer] + within * random.standard_normal(75)
    index = np.searchsorted(CUTS, match) - 1
    return Matches.of(CUTS[index], CUTS[index + 1], observer)


def _adaptive(matches: Matches, within: float, between: float) -> float:
    from scipy.integrate import quad
    from scipy.special import ndtr

    total = 0.0
    for counts in matches.counts:

        def chance(lean: float, counts: np.ndarray = counts) -> float:
            centre = np.log(2.2) + between * lean
            each = ndtr((matches.high - centre) / within) - ndtr((matches.low - centre) / within)
            return float(np.prod(each**counts) * np.exp(-(lean**2) / 2) / np.sqrt(2 * np.pi))

        total += np.log(quad(chance, -9, 9, epsabs=1e-15, epsrel=1e-13, limit=400, points=np.linspace(-6, 6, 13))[0])
    return float(total)


def _trapezoid(matches: Matches, count: int) -> Matches:
    nodes = np.linspace(-REACH, REACH, count)
    weights = np.exp(-(nodes**2) / 2)
    return replace(matches, nodes=nodes, log_weights=np.log(weights / weights.sum()))


def _hermite(matches: Matches, count: int) -> Matches:
    nodes, weights = np.polynomial.hermite_e.hermegauss(count)
    return replace(matches, nodes=nodes, log_weights=np.log(weights / weights.sum()))


def _measured(series: str, count: int, rule: Matches, spread: tuple[float, float], truth: float) -> dict[str, object]:
    centre = float(np.log(2.2))
    taken_s = seconds(lambda: rule.log_likelihood(centre, *spread))
    return row(series, f"{count} nodes", taken_s, abs(rule.log_likelihood(centre, *spread) / truth - 1), "")


if __name__ == "__main__":
    program("best_of_series", run)
