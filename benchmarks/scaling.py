"""Scores out of comparisons: solvers, and choices from series.

Run time against error of Bradley-Terry solvers: Newton here, choix and evalica beside it, in one run.

The error is the largest difference in θ (nats, mean 0) from a reference refined in extended precision.

Choices from series: the likelihood integrated over observers, and intervals of scores. Run time and error.

The rule that the fit uses (the trapezoid, at even distances) beside Gauss-Hermite nodes, for observers who scatter more
than they differ from each other, and for observers who differ four times as much as they scatter.

Intervals of similarity-weighted scores: the error is that of their coverage, 95 %, in 2000 simulated studies; Wilson's
at the effective number of answers beside a bootstrap over observers.
"""

from __future__ import annotations

import importlib
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter
from types import ModuleType
from typing import Any

import numpy as np
from curves import program, row, seconds, sized, times_faster
from promises import Promise, worst
from scipy.sparse import csr_array

from analysis.scaling.fitting import fit, fit_batch, fit_sparse
from analysis.scaling.separation import are_connected
from analysis.series.just_noticeable import NODES, REACH, Matches
from analysis.series.observer_means import bounded_means, means
from documents.arrays import Floats

Row = dict[str, object]

TITLE = "Bradley-Terry solvers: time against error"
TOLERANCES = sized((1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12), (1e-6,))
BOOTSTRAP_TOLERANCES = sized((1e-2, 1e-4, 1e-6, 1e-8, 1e-10), (1e-6,))
OBSERVERS = 30
ITEMS = sized(1000, 100)
BOOTSTRAPS = sized(1000, 20)
COMMAND = """
import resource, sys, time
from runner.cli.main import main
try:
    main()
finally:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(time.process_time(), peak, file=sys.stderr)
"""
# Medina 2016, Table 4.4.
PRINTED = np.array([0.0718, 0.0432, 0.0762, 0.2036, 0.0740, 0.2574, 0.0543, 0.0296, 0.0751, 0.1149])


def solvers() -> dict[str, Any]:
    """Measure and return the title, the rows and the ratios that the design sets targets for."""
    rows = [
        *(row for n, wins in _small_tables().items() for row in _single(f"n = {n}", wins)),
        *_sparse(),
        _scores_command(),
        *_bootstraps(),
    ]
    return {"title": TITLE, "rows": rows, "promises": [*_promises(_ratios()), _exact(rows)]}


# What is timed, beside which peer, and how many times as fast it is at least.
PROMISED: dict[tuple[str, str], float] = {
    (f"{BOOTSTRAPS} observer bootstraps, n = 10", "evalica"): 10.0,
    (f"{BOOTSTRAPS} observer bootstraps, n = 10", "choix ilsr"): 20.0,
    ("one fit with covariance, n = 10", "evalica"): 1.0,
    ("one fit with covariance, n = 10", "choix ilsr"): 1.0,
    ("one fit with covariance, n = 100", "evalica"): 1.0,
    ("one fit with covariance, n = 100", "choix ilsr"): 1.0,
    (f"one sparse fit, n = {ITEMS}", "evalica"): 3.0,
}


def _promises(ratios: Mapping[tuple[str, str], float]) -> Iterator[Promise]:
    for (what, peer), least in PROMISED.items():
        ratio = ratios.get((what, peer))
        why = "" if ratio is not None else f"{peer.split()[0]} is not installed"
        yield Promise(f"{what}, beside {peer}", ratio, least, "ratio", "at least", "×", missing=why)


def _exact(rows: list[Row]) -> Promise:
    error = worst(rows, series="Newton", parameter="converged")
    return Promise("largest error in θ where Newton converged", error, 1e-10, "error")


def _small_tables() -> dict[int, Floats]:
    """Return the counts of all observers on ten and on a hundred items, by the number of items."""
    strengths = (np.log(PRINTED), np.random.default_rng(1).normal(0, 0.7, 100))
    return {len(theta): _observers(theta).sum(axis=0) for theta in strengths}


def _observers(theta: Floats) -> Floats:
    """Return what each simulated observer answers to every pair once, shape (observers, n, n)."""
    random = np.random.default_rng(2016)
    p = 1 / (1 + np.exp(theta[None, :] - theta[:, None]))
    upper = np.triu(random.random((OBSERVERS, *p.shape)) < p, 1)
    lower = np.tril(~upper.transpose(0, 2, 1), -1)
    return (upper | lower).astype(float)


def _single(case: str, wins: Floats) -> Iterator[Row]:
    truth = _reference(wins)
    note = "with covariance, standard errors and connectivity test"
    for steps in range(1, 8):
        fitted = fit(wins, most_iterations=steps)
        time = seconds(lambda steps=steps: fit(wins, most_iterations=steps))
        yield row(f"{case}: Newton from the log odds", f"{steps} steps", time, _error(fitted.theta, truth), note)
        if fitted.converged:
            break
    time = seconds(lambda: fit(wins))
    yield row(f"{case}: Newton from plain sums", "converged", time, _error(fit(wins).theta, truth), note)
    batch = wins[None]
    time = seconds(lambda: fit_batch(batch))
    yield row(f"{case}: Newton, θ alone", "converged", time, _error(fit_batch(batch).theta[0], truth))
    yield from _peers(case, wins, truth)


def _sparse() -> Iterator[Row]:
    case, wins = "n = 1000, sparse", _sparse_counts()
    truth = _reference(wins)
    counts = csr_array(wins)
    time = seconds(lambda: fit_sparse(counts))
    yield row(f"{case}: Newton, conjugate gradients", "converged", time, _error(fit_sparse(counts).theta, truth))
    dense = wins[None]
    time = seconds(lambda: fit_batch(dense), repeats=3)
    yield row(f"{case}: Newton, dense", "converged", time, _error(fit_batch(dense).theta[0], truth))
    time = seconds(lambda: fit(wins), repeats=3)
    yield row(f"{case}: Newton, with covariance", "converged", time, _error(fit(wins).theta, truth))
    yield from _peers(case, wins, truth, repeats=3)


def _scores_command() -> Row:
    """Measure the whole command on 2000 items of which 10,000 pairs were compared, processor time of all threads."""
    wins = _sparse_counts(2 * ITEMS)
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "table.csv"
        lines = [f"{i},{j},{wins[i, j]:g}" for i, j in zip(*np.nonzero(wins), strict=True)]
        table.write_text("\n".join(["winner,loser,count", *lines]), encoding="utf-8")
        done = subprocess.run(
            [sys.executable, "-c", COMMAND, "scores", str(table)], capture_output=True, text=True, check=True
        )
    used, megabytes = map(float, done.stderr.split()[-2:])
    note = f"with standard errors, classes and table; processor time; at most {megabytes:.0f} MB"
    return row("n = 2000, sparse: cyclopean scores", "whole command", used, None, note)


def _sparse_counts(n: int = ITEMS) -> Floats:
    """Return 20 comparisons of each of 10,000 random pairs of n items, shape (n, n)."""
    pairs = sized(10_000, 1000)
    random = np.random.default_rng(3)
    theta = random.normal(0, 1, n)
    first = random.integers(n, size=pairs)
    second = (first + 1 + random.integers(n - 1, size=pairs)) % n
    won = random.binomial(20, 1 / (1 + np.exp(theta[second] - theta[first]))).astype(float)
    wins = np.zeros((n, n))
    np.add.at(wins, (first, second), won)
    np.add.at(wins, (second, first), 20 - won)
    return wins


def _bootstrap_counts() -> Floats:
    """Return the counts of observers drawn with replacement, shape (bootstraps, n, n)."""
    answers = _observers(np.log(PRINTED))
    drawn = np.random.default_rng(4).multinomial(OBSERVERS, np.full(OBSERVERS, 1 / OBSERVERS), BOOTSTRAPS)
    return np.tensordot(drawn.astype(float), answers, axes=1)


def _bootstraps() -> Iterator[Row]:
    case = f"{BOOTSTRAPS} observer bootstraps, n = 10"
    wins = _bootstrap_counts()
    sound = are_connected(wins)
    note = f"{int((~sound).sum())} replicates separated, left out of the error"
    truth = np.array([_reference(replicate) for replicate in wins[sound]])
    time = seconds(lambda: fit_batch(wins))
    yield row(f"{case}: Newton, batched", "converged", time, _error(fit_batch(wins).theta[sound], truth), note)
    slow = np.array([fit(replicate).theta for replicate in wins[sound]])
    time = seconds(lambda: [fit(replicate) for replicate in wins], repeats=1, at_least_s=0)
    yield row(f"{case}: Newton, one by one", "converged", time, _error(slow, truth), note)
    for name, solve in _solvers().items():
        for tolerance in BOOTSTRAP_TOLERANCES:
            prepared = [solve(replicate, tolerance) for replicate in wins[sound]]
            found = np.array([work() for work in prepared])
            time = seconds(lambda p=prepared: [work() for work in p], repeats=1, at_least_s=0)
            yield row(f"{case}: {name}", f"tolerance {tolerance:g}", time, _error(found, truth), note)


def _peers(case: str, wins: Floats, truth: Floats, repeats: int = 5) -> Iterator[Row]:
    for name in ("choix ilsr", "evalica"):
        if name not in _solvers():
            yield row(f"{case}: {name}", "–", None, None, "not installed")
    for name, solve in _solvers().items():
        for tolerance in TOLERANCES:
            work = solve(wins, tolerance)
            try:
                found = work()
            except RuntimeError as error:
                yield row(f"{case}: {name}", f"tolerance {tolerance:g}", None, None, str(error))
                continue
            time = seconds(work, repeats=repeats)
            yield row(f"{case}: {name}", f"tolerance {tolerance:g}", time, _error(found, truth))


def _solvers() -> dict[str, Callable[[Floats, float], Callable[[], Floats]]]:
    """Return the peers that are installed: from counts and a tolerance to the work to be timed."""
    solvers: dict[str, Callable[[Floats, float], Callable[[], Floats]]] = {}
    choix, evalica = _module("choix"), _module("evalica")
    if choix:
        solvers["choix ilsr"] = lambda wins, tolerance: (
            lambda: np.asarray(choix.ilsr_pairwise_dense(wins, tol=tolerance, max_iter=10_000))
        )
    if evalica:
        solvers["evalica"] = lambda wins, tolerance: _evalica(evalica, wins, tolerance)
    return solvers


def _evalica(evalica: ModuleType, wins: Floats, tolerance: float) -> Callable[[], Floats]:
    """Prepare the counts as evalica takes them, aggregated and indexed, so that only its solving is timed."""
    import pandas as pd

    winner, loser = np.nonzero(wins)
    counts = wins[winner, loser].tolist()
    names = list(range(len(wins)))
    index = pd.Index(names)
    xs, ys, won = winner.tolist(), loser.tolist(), [evalica.Winner.X] * len(counts)

    def work() -> Floats:
        result = evalica.bradley_terry(xs, ys, won, index=index, weights=counts, tolerance=tolerance, limit=10_000)
        return np.log(result.scores.reindex(names).to_numpy())

    return work


def _module(name: str) -> ModuleType | None:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def _reference(wins: Floats) -> Floats:
    """Return θ refined with gradients in extended precision, until the step vanishes."""
    theta = fit_batch(wins[None]).theta[0].astype(np.longdouble)
    n, counts = len(wins), wins.astype(np.longdouble)
    for _ in range(4):
        p = 1 / (1 + np.exp(theta[None, :] - theta[:, None]))
        gradient = (counts * p.T - counts.T * p).sum(axis=1)
        weight = ((counts + counts.T) * p * p.T).astype(float)
        np.fill_diagonal(weight, 0)
        information = np.diag(weight.sum(axis=1)) - weight + weight.sum() / n**2
        theta = theta + np.linalg.solve(information, gradient.astype(float))
        theta -= theta.mean()
    return theta


def _error(found: Floats, truth: Floats) -> float:
    centred = found - found.mean(axis=-1, keepdims=True)
    return float(np.abs(centred - truth).max())


def _ratios() -> dict[tuple[str, str], float]:
    """Return how many times faster than the peers we are, where the design sets a target.

    The peers run at 1e-6 (evalica's default) and 1e-8 (choix's default), which leaves them less exact.
    """
    solvers = _solvers()
    ratios: dict[tuple[str, str], float] = {}
    for n, wins in _small_tables().items():
        for name, tolerance in (("evalica", 1e-6), ("choix ilsr", 1e-8)):
            if name in solvers:
                work = solvers[name](wins, tolerance)
                ratio = times_faster(lambda wins=wins: fit(wins), work, rounds=301)
                ratios[f"one fit with covariance, n = {n}", name] = ratio
    sparse, replicates = _sparse_counts(), _bootstrap_counts()
    counts = csr_array(sparse)
    if "evalica" in solvers:
        sparse_work = solvers["evalica"](sparse, 1e-6)
        ratios[f"one sparse fit, n = {ITEMS}", "evalica"] = times_faster(lambda: fit_sparse(counts), sparse_work)
    sound = replicates[are_connected(replicates)]
    for name, tolerance in (("evalica", 1e-6), ("choix ilsr", 1e-8)):
        if name in solvers:
            prepared = [solvers[name](replicate, tolerance) for replicate in sound]
            ratios[f"{BOOTSTRAPS} observer bootstraps, n = 10", name] = times_faster(
                lambda: fit_batch(replicates), lambda work=prepared: [one() for one in work], rounds=5
            )
    return ratios


LEVELS = np.log([1.3, 1.6, 2.0, 2.5, 3.0, 4.0])
CUTS = np.concatenate([[-np.inf], (LEVELS[1:] + LEVELS[:-1]) / 2, [np.inf]])
STUDIES = sized(((30, 1, 0.1), (15, 5, 0.1), (30, 5, 0.1), (10, 5, 0.3), (15, 5, 0.6)), ((15, 5, 0.1),))
CASES = {"within = 0.25, between = 0.15": (0.25, 0.15), "within = 0.1, between = 0.4": (0.1, 0.4)}


def series() -> dict[str, object]:
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
    program("scaling", solvers, series)
