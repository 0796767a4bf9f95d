"""JOD as pwcmp has them: run time against error beside its objective by SciPy, and coverage beside our own default.

    python benchmarks/jod.py [STUDIES]

pwcmp itself needs MATLAB. Its peer here is its objective, vectorised, minimised by SciPy's BFGS from 0 as pwcmp does.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtr

from analysis.comparisons import Answer, from_answers
from analysis.scaling import fit_model
from documents.arrays import Floats
from extensions.inference import fit_jod, scale_jod

sys.path.insert(0, str(Path(__file__).parent))
from curves import numbers, program, row, sized
from promises import Promise, worst

Row = dict[str, object]

TITLE = "JOD: run time, and coverage of 95 % intervals"
SIZES, DRAWS, PLAIN_DRAWS = sized((5, 7, 15), (4,)), sized(200, 5), sized(5, 2)
TRUE_JOD = np.array([0.0, 0.4, 0.9, 1.5, 2.4, 3.6])
OBSERVERS = sized((5, 10, 15, 30), (5,))


def run(studies: int = sized(100, 2)) -> dict[str, Any]:
    """Measure and return the title and the rows."""
    rows = [row for n in SIZES for row in _speed(n)]
    rows += [row for observers in OBSERVERS for row in _coverage(observers, studies)]
    off = worst(rows, series="maximise")
    promises = [Promise("JOD against pwcmp's objective by SciPy", off, 1e-5, "error", unit="JOD")]
    return {"title": TITLE, "rows": rows, "promises": promises}


def _speed(n: int) -> list[Row]:
    random = np.random.default_rng(n)
    jod = random.normal(0, 1, n)
    draws = np.stack([_answers(jod, 15, random).sum(axis=0) for _ in range(DRAWS)])
    start = time.process_time()
    ours = fit_jod(draws, "gaussian")
    seconds = (time.process_time() - start) / DRAWS
    start = time.process_time()
    plain = np.stack([_plain(wins) for wins in draws[:PLAIN_DRAWS]])
    slow = (time.process_time() - start) / PLAIN_DRAWS
    error = float(np.abs(ours.jod[:PLAIN_DRAWS] - plain).max())
    note = f"{slow / seconds:.0f} times faster; {ours.iterations.mean():.0f} steps"
    name = f"{n} items, one draw"
    return [
        row("maximise", name, seconds, error, note=note),
        row("SciPy's BFGS", name, slow, error, note=""),
    ]


def _coverage(observers: int, studies: int) -> list[Row]:
    """Return how often intervals of differences contain the truth, for observers who are alike and who differ."""
    rows: list[Row] = []
    pairs = np.triu_indices(len(TRUE_JOD), 1)
    for sd in (0.0, 0.7):
        random = np.random.default_rng(observers)
        # What all observers together answer follows the same law, on a shorter scale where they differ.
        mean_jod = TRUE_JOD / np.sqrt(1 + 2 * (sd / 1.4826) ** 2)
        truth = mean_jod[pairs[0]] - mean_jod[pairs[1]]
        held, length = np.zeros((2, 2)), np.ptp(mean_jod)
        lengths, seconds = np.zeros(2), np.zeros(2)
        for _ in range(studies):
            table = _table(_answers(TRUE_JOD, observers, random, sd))
            start = time.process_time()
            ((_, scale),) = scale_jod(table, replicates=sized(200, 40)).scales
            between = time.process_time()
            own = fit_model(table, "thurstone", method="ml")
            end = time.process_time()
            seconds += [between - start, end - between]
            assert scale.covariance is not None
            apart = scale.jod[pairs[0]] - scale.jod[pairs[1]]
            reach = 1.96 * np.sqrt(np.maximum(_variance(scale.covariance), 0))[pairs]
            held[0] += [np.mean(np.abs(apart - truth) <= reach), 1]
            lengths[0] += np.ptp(scale.jod)
            if own.separation is None and own.pair_freedom is not None:
                theta, error = own.theta * 1.4826, np.sqrt(np.maximum(_variance(own.covariance), 0))[pairs] * 1.4826
                reach = _quantile(own.pair_freedom) * error
                held[1] += [np.mean(np.abs(theta[pairs[0]] - theta[pairs[1]] - truth) <= reach), 1]
                lengths[1] += np.ptp(theta)
        for place, series in enumerate(("pwcmp's prior and bootstrap", "maximum likelihood, shrinkage")):
            covered, times = held[place]
            share = covered / times if times else float("nan")
            note = f"coverage {share:.3f}, range {lengths[place] / max(times, 1) / length:.3f} of the truth"
            note += f", {int(studies - times)} of {studies} studies without a finite fit"
            name = f"{observers} observers, sd {sd:g}"
            error = abs(share - 0.95)
            rows.append(row(series, name, seconds[place] / studies, error, note=note))
    return rows


def _answers(jod: Floats, observers: int, random: np.random.Generator, sd: float = 0.0) -> Floats:
    """Return each observer's counts of one answer to each pair, shape (observers, n, n)."""
    n = len(jod)
    own = jod + random.normal(0, sd, (observers, n)) if sd else np.broadcast_to(jod, (observers, n))
    first, second = np.triu_indices(n, 1)
    won = random.random((observers, len(first))) < ndtr((own[:, first] - own[:, second]) / 1.4826)
    wins = np.zeros((observers, n, n))
    wins[:, first, second], wins[:, second, first] = won, ~won
    return wins


def _table(wins: Floats) -> Any:
    return from_answers(
        [Answer(str(i), str(j), 1, f"o{who}") for who, i, j in np.argwhere(wins > 0)],
        items=[str(item) for item in range(wins.shape[1])],
    )


def _variance(covariance: Floats) -> Floats:
    diagonal = np.diag(covariance)
    return np.asarray(diagonal[:, None] + diagonal[None] - 2 * covariance)


def _quantile(freedom: Floats) -> Floats:
    from scipy.special import stdtrit

    return np.asarray(stdtrit(freedom, 0.975))


def _plain(wins: Floats) -> Floats:
    """Return the minimum of pwcmp's objective, both orders of each pair, by SciPy."""
    rows, columns = np.nonzero(wins + wins.T)
    won, lost = wins[rows, columns], wins[columns, rows]
    total = won + lost
    shifted = np.where(won == 0, 1.0, np.where(lost == 0, won - 1, won))

    def objective(q: Floats) -> float:
        d = (q[rows] - q[columns]) / 1.4826
        p = ndtr(d)[:, None]
        likelihood = p**shifted * (1 - p) ** (total - shifted)
        prior = ((likelihood + 1e-8) / (likelihood.sum(axis=0) + 1e-8)).sum(axis=1)
        logs = won * log_ndtr(d) + lost * log_ndtr(-d) + np.log(prior + 0.1)
        return float(0.01 * np.mean(q) ** 2 - logs.sum())

    found = minimize(objective, np.zeros(len(wins)), method="BFGS", options={"gtol": 1e-6}).x
    return np.asarray(found - found.mean())


if __name__ == "__main__":
    program("jod", lambda: run(*numbers()))
