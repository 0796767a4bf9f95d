"""The likelihood of choices from series, integrated over observers, against adaptive quadrature: run time and error.

The rule that the fit uses (the trapezoid, at even distances) beside Gauss-Hermite nodes, for observers who scatter more
than they differ from each other, and for observers who differ four times as much as they scatter.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import curves
import numpy as np

from analysis.series.just_noticeable import NODES, REACH, Matches

LEVELS = np.log([1.3, 1.6, 2.0, 2.5, 3.0, 4.0])
CUTS = np.concatenate([[-np.inf], (LEVELS[1:] + LEVELS[:-1]) / 2, [np.inf]])
CASES = {"within = 0.25, between = 0.15": (0.25, 0.15), "within = 0.1, between = 0.4": (0.1, 0.4)}


def run() -> dict[str, object]:
    """Return the rows."""
    rows: list[dict[str, object]] = []
    for name, (within, between) in CASES.items():
        matches = _matches(within, between)
        truth = _adaptive(matches, within, between)
        plain_s = curves.seconds(partial(_adaptive, matches, within, between), repeats=3)
        rows.append(_row(f"adaptive quadrature, {name}", "1e-13", plain_s, None, "the reference of the others"))
        for count in (11, 21, 41, 81, 121, NODES):
            rule = _trapezoid(matches, count)
            rows.append(_measured(f"trapezoid, {name}", count, rule, (within, between), truth))
        for count in (7, 15, 31, 61, 121):
            rule = _hermite(matches, count)
            rows.append(_measured(f"Gauss-Hermite, {name}", count, rule, (within, between), truth))
    return {"title": "Likelihood of choices from series: 15 observers, 5 choices each", "rows": rows}


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
    taken_s = curves.seconds(lambda: rule.log_likelihood(centre, *spread))
    return _row(series, f"{count} nodes", taken_s, abs(rule.log_likelihood(centre, *spread) / truth - 1), "")


def _row(series: str, parameter: str, taken_s: float, error: float | None, note: str) -> dict[str, object]:
    return {"series": series, "parameter": parameter, "seconds": taken_s, "error": error, "note": note}


if __name__ == "__main__":
    result = run()
    curves.write("best_of_series", str(result["title"]), result["rows"])  # type: ignore[arg-type]  # rows, as it wants
