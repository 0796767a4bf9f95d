"""Observers as a distribution: time against error of the marginal likelihood, the spread found again, and large tables.

    python benchmarks/hierarchical.py [STUDIES]
    python benchmarks/hierarchical.py large

The second is of the large table alone, and writes nothing.

The error of a marginal likelihood is in log units for each observer, from a reference by importance sampling with a
hundred times as many draws as the row beside it. The error of the spread is the distance of its mean over studies from
the truth, as a share of it; Laplace's approximation is maximised as it is, expectation propagation as the fit does it.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from documents.arrays import Floats

sys.path.insert(0, str(Path(__file__).parent))
from curves import numbers, program, row, seconds, sized
from promises import Promise, worst

from analysis.comparisons.comparisons import Comparisons, from_arrays
from analysis.covariance import contrast_variances
from analysis.errors import ResultsError
from analysis.scaling import fit_model
from analysis.scaling.laws import LOGISTIC
from documents.platform import cores
from extensions.inference import fit_observers
from extensions.inference.observers_fit import _answers
from extensions.inference.propagation import GroupAnswers, TiltedSites, alike, propagate

Row = dict[str, object]

TITLE = "Observers as a distribution: time against error"
ITEMS = 10
OBSERVERS, SPREADS = sized((5, 10, 30), (5,)), sized((0.0, 0.7, 1.5), (0.7,))
REFERENCE_DRAWS = sized(100_000, 1000)


def simulated(
    observers: int,
    sd: float,
    random: np.random.Generator,
    items: int = ITEMS,
    width: float = 1.0,
    *,
    camps: bool = False,
) -> Floats:
    """Return who preferred the first item of each pair, shape (observers, pairs): each pair once.

    In two camps one half of the observers has the other half's effects with their signs changed.
    """
    i, j = np.triu_indices(items, 1)
    effects = random.normal(0, sd, (observers, items))
    if camps:
        effects = np.where(random.random(observers) < 0.5, 1, -1)[:, None] * effects[:1]
    own = np.linspace(-width, width, items) + effects
    return (random.random((observers, len(i))) < 1 / (1 + np.exp(own[:, j] - own[:, i]))).astype(float)


def comparisons_of(won: Floats, items: int = ITEMS) -> Comparisons:
    """Return the answers as comparisons."""
    i, j = np.triu_indices(items, 1)
    observer, pair = (part.ravel() for part in np.indices(won.shape))
    ahead = won.ravel() > 0
    return _comparisons(np.where(ahead, i[pair], j[pair]), np.where(ahead, j[pair], i[pair]), observer, items)


def _comparisons(
    winner: NDArray[np.intp],
    loser: NDArray[np.intp],
    observer: NDArray[np.intp],
    items: int,
    group: NDArray[np.intp] | None = None,
) -> Comparisons:
    number = len(winner)
    return from_arrays(
        tuple(f"item {place}" for place in range(items)),
        tuple(f"observer {place}" for place in range(int(observer.max()) + 1)),
        winner=winner,
        loser=loser,
        observer=observer,
        count=np.ones(number),
        winner_was_first=np.full(number, -1, np.int8),
        tie=np.zeros(number, np.bool_),
        group=group,
        groups=() if group is None else tuple(f"group {place}" for place in range(int(group.max()) + 1)),
    )


def run(studies: int = sized(40, 2)) -> dict[str, Any]:
    """Measure and return the title and the rows."""
    rows = [*_likelihoods(), *_spreads(studies), _large()]
    promise = Promise("log likelihood of an observer", worst(rows, series="expectation propagation"), 0.05, "error")
    return {"title": TITLE, "rows": rows, "promises": [promise]}


def laplace(won: Floats, theta: Floats, tau: float) -> float:
    """Return the log marginal likelihood by Laplace's approximation: dense, observer by observer."""
    i, j = np.triu_indices(len(theta), 1)
    across = np.zeros((len(i), len(theta)))
    across[np.arange(len(i)), i], across[np.arange(len(i)), j] = 1, -1
    total = 0.0
    for own in won:
        effect = np.zeros(len(theta))
        for _ in range(50):
            p = 1 / (1 + np.exp(-across @ (theta + effect)))
            curvature = across.T * (p * (1 - p)) @ across + np.eye(len(theta)) / tau**2
            step = np.linalg.solve(curvature, across.T @ (own - p) - effect / tau**2)
            effect += step
            if np.abs(step).max() < 1e-10:
                break
        d = across @ (theta + effect)
        terms = own * d - np.logaddexp(0, d)
        total += terms.sum() - effect @ effect / (2 * tau**2) - np.linalg.slogdet(tau**2 * curvature)[1] / 2
    return float(total)


def sampled(won: Floats, theta: Floats, tau: float, sites: TiltedSites, answers: GroupAnswers, draws: int) -> float:
    """Return the log marginal likelihood by importance sampling from the posterior of expectation propagation."""
    random, n = np.random.default_rng(1), len(theta)
    i, j = np.triu_indices(n, 1)
    roots = next(answers.blocks.roots(tau**2 * sites.precision))[1][:n, :, :n].transpose(1, 0, 2)
    means = sites.effects.reshape(-1, n)
    total = 0.0
    for own, mean, root in zip(won, means, roots, strict=True):
        z = random.normal(size=(draws, n))
        effect = mean + tau * z @ root.T
        d = (theta + effect)[:, i] - (theta + effect)[:, j]
        log_p = d @ own - np.logaddexp(0, d).sum(axis=1) - (effect**2).sum(axis=1) / (2 * tau**2)
        weight = log_p + (z**2).sum(axis=1) / 2 + np.linalg.slogdet(root)[1]
        total += weight.max() + np.log(np.exp(weight - weight.max()).mean())
    return float(total)


def _likelihoods() -> Iterator[Row]:
    for sd in (0.7, 1.5):
        won = simulated(30, sd, np.random.default_rng(2016))
        comparisons = comparisons_of(won)
        answers, _ = _answers(comparisons)
        start = alike(answers, LOGISTIC, fit_model(comparisons).theta)
        sites = propagate(answers, LOGISTIC, sd, start, 1e-8)
        truth = sampled(won, sites.theta, sd, sites, answers, REFERENCE_DRAWS)
        case = f"log likelihood, 10 items, 30 observers, sd {sd}"
        note = "the strengths too"

        def work(sd: float = sd, answers: GroupAnswers = answers, start: TiltedSites = start) -> TiltedSites:
            return propagate(answers, LOGISTIC, sd, start, 1e-6)

        error = abs(work().log_z - truth) / 30
        yield row(f"{case}: expectation propagation", "converged", seconds(work, repeats=3), error, note)
        peers: dict[tuple[str, str], Callable[[], float]] = {
            ("Laplace, dense", "converged"): partial(laplace, won, sites.theta, sd)
        }
        for draws in (10, 100, 1000):
            peer = partial(sampled, won, sites.theta, sd, sites, answers, draws)
            peers["importance sampling from that posterior", f"{draws} draws"] = peer
        for (name, parameter), peer in peers.items():
            error = abs(peer() - truth) / 30
            yield row(f"{case}: {name}", parameter, seconds(peer, repeats=3), error, "at given strengths")


def _spreads(studies: int) -> Iterator[Row]:
    for sd in SPREADS:
        for observers in OBSERVERS:
            yield from spreads(sd, observers, studies)
            yield _false_differences(sd, observers, studies)
            if sd:
                yield _false_differences(sd, observers, studies, camps=True)


def _false_differences(sd: float, observers: int, studies: int, *, camps: bool = False) -> Row:
    """Return how often any two of ten equal items are called different, by Holm's correction."""
    random, false, done = np.random.default_rng(100 + observers), 0, 0
    while done < studies:
        try:
            fit = fit_observers(comparisons_of(simulated(observers, sd, random, width=0.0, camps=camps)))
        except ResultsError:  # separated
            continue
        done += 1
        false += min(pair.p for pair in fit.predictions()) < 0.05 / (ITEMS * (ITEMS - 1) / 2)
    case = f"equal strengths, {observers} observers{' in two camps' if camps else ''}, {ITEMS} items, each pair once"
    share = false / studies
    note = f"a false difference in {100 * share:.1f} % of {studies} studies"
    return row(case, f"sd {sd:g}", None, abs(share - 0.05), note)


def spreads(sd: float, observers: int, studies: int, width: float = 1.0, items: int = ITEMS) -> Iterator[Row]:
    """Yield what is found over studies: by the fit, and by Laplace's approximation maximised over the spread."""
    from scipy.optimize import minimize_scalar

    random = np.random.default_rng(observers)
    found, ours, covered, differ, differences, times = [], [], [], [], [], []
    truth = np.linspace(-width, width, items)
    i, j = np.triu_indices(items, 1)
    while len(ours) < studies:
        won = simulated(observers, sd, random, items, width)
        comparisons = comparisons_of(won, items)
        start = time.process_time()
        try:
            fit = fit_observers(comparisons)
        except ResultsError:  # separated
            continue
        times.append(time.process_time() - start)
        ours.append(fit.spread.estimate)
        covered.append(fit.spread.low <= sd <= (fit.spread.high or np.inf))
        differ.append(fit.spread.p < 0.05)
        of = fit.groups[0]
        d = of.theta[i] - of.theta[j]
        error = np.sqrt(contrast_variances(of.covariance)[i, j] + d**2 * fit.scale_variance)
        differences.append(np.mean(np.abs(d - truth[i] + truth[j]) < 1.96 * error))
        if len(found) < studies // 10 and sd:
            # At the strengths of expectation propagation's fit; they move little with τ on the scale of the answers.
            theta, tau = of.theta, fit.spread.estimate

            def cost(other: float, won: Floats = won, theta: Floats = theta, tau: float = tau) -> float:
                scale = np.sqrt((1 + 0.69 * other**2) / (1 + 0.69 * tau**2))
                return -laplace(won, theta * scale, other)

            found.append(minimize_scalar(cost, bounds=(0.05, 4), method="bounded", options={"xatol": 0.01}).x)
    case = f"sd between {observers} observers, {items} items, each pair once"
    share = 100 * np.array([np.mean(covered), np.mean(differ), np.mean(differences)])
    note = (
        f"mean {np.mean(ours):.3f}, median {np.median(ours):.3f}; 95 % interval contains the truth in {share[0]:.1f} %"
    )
    note += f", differences of strengths in {share[2]:.1f} %; observers differ (p < 0.05) in {share[1]:.1f} %"
    distance = abs(np.mean(ours) - sd) / (sd or 1)
    yield row(f"{case}: fit", f"sd {sd:g}", float(np.median(times)), float(distance), f"{note}; {studies} studies")
    if found:
        note = f"mean {np.mean(found):.3f}; {len(found)} studies"
        yield row(f"{case}: Laplace, unadjusted", f"sd {sd:g}", None, float(abs(np.mean(found) - sd) / sd), note)


def large_table(groups: int = 20, observers: int = 1000, items: int = 200, answers: int = 200) -> Comparisons:
    """Return answers of observers to random pairs, sd 0.7 between them, in groups with scales of their own."""
    random = np.random.default_rng(0)
    winner, loser = [], []
    who = np.arange(observers)[:, None]
    for _ in range(groups):
        own = random.normal(size=items) + random.normal(0, 0.7, (observers, items))
        one = random.integers(items, size=(observers, answers))
        other = (one + 1 + random.integers(items - 1, size=one.shape)) % items
        won = random.random(one.shape) < 1 / (1 + np.exp(own[who, other] - own[who, one]))
        winner.append(np.where(won, one, other).ravel())
        loser.append(np.where(won, other, one).ravel())
    observer = np.tile(np.repeat(np.arange(observers), answers), groups)
    group = np.repeat(np.arange(groups), observers * answers)
    return _comparisons(np.concatenate(winner), np.concatenate(loser), observer, items, group)


def _large() -> Row:
    size = sized((20, 1000, 200, 200), (2, 20, 10, 20))
    comparisons = large_table(*size)
    start, used = time.perf_counter(), time.process_time()
    fit = fit_observers(comparisons)
    wall, used = time.perf_counter() - start, time.process_time() - used
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    spread = fit.spread
    note = f"{used:.0f} s of processor on {cores()} cores; at most {peak:.0f} MB in all; "
    note += f"sd {spread.estimate:.4f} (95 % {spread.low:.4f} to {spread.high:.4f}), 0.7 in truth"
    answers = size[0] * size[1] * size[3] / 1e6
    case = f"{size[1]} observers, {size[0]} groups of {size[2]} items, {answers:g} million answers"
    return row(f"{case}: fit", "whole fit", wall, abs(spread.estimate - 0.7) / 0.7, note)


if __name__ == "__main__":
    if sys.argv[1:] == ["large"]:
        print(*_large().values(), sep="; ")
    else:
        program("hierarchical", lambda: run(*numbers()))
