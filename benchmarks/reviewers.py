"""What reviewers ask: time against the plain method, and how often tests and flags are wrong or right.

    python benchmarks/reviewers.py [STUDIES]

Times are of one study of ten items and 30 observers; the error is the largest difference from the plain method. Levels
and powers are shares of simulated studies, with 5 to 30 observers who are alike or each have their own strengths.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import combinations, permutations
from pathlib import Path
from typing import Any, get_args

import numpy as np

from documents.arrays import Floats

sys.path.insert(0, str(Path(__file__).parent))
from curves import numbers, program, row, seconds, sized
from promises import Promise, worst
from simulated_studies import Design, as_comparisons

from analysis.choices import Adjust
from analysis.comparisons.comparisons import Comparisons, from_arrays
from analysis.inference import (
    compare_models,
    equivalence,
    multiverse,
    pair_probabilities,
    pair_residuals,
    transitivity,
)
from analysis.scaling import CovarianceKind, Model, Scores, fit_model, score
from analysis.scaling.laws import LAWS, probabilities
from analysis.scaling.scores import classes_of

Row = dict[str, object]

TITLE = "What reviewers ask: time against error"
# Medina 2016, Table 4.4.
PRINTED = np.array([0.0718, 0.0432, 0.0762, 0.2036, 0.0740, 0.2574, 0.0543, 0.0296, 0.0751, 0.1149])
THETA = np.log(PRINTED) - np.log(PRINTED).mean()
KINDS: tuple[CovarianceKind, ...] = get_args(CovarianceKind)
MODELS: tuple[Model, ...] = ("bradley-terry", "thurstone")
ADJUSTMENTS: tuple[Adjust, ...] = ("none", "holm", "bh")
OBSERVERS = sized((5, 10, 15, 30), (10,))
SPREADS = sized((0.0, 0.7), (0.7,))
REPLICATES = 399
APART = np.array([0.4, 0.4, 0.4, -0.4, -0.4, -0.4])
LINE = np.linspace(-1.25, 1.25, 6)
PLANTED = 1.5


def run(studies: int = sized(100, 2)) -> dict[str, Any]:
    """Measure and simulate, and return the title and the rows."""
    comparisons = as_comparisons(next(Design(THETA, sized(30, 4), 0.7).studies(1, 1)))
    scores = score(comparisons)
    rows = [*_chances(scores), *_residuals(scores), *_triples(scores), *_models(comparisons), *_multiverse(scores)]
    for observers in OBSERVERS:
        for spread in SPREADS:
            rows += levels(observers, spread, studies)
    promises = [
        Promise("analyses of the multiverse that differ", worst(rows, parameter="fits shared"), 0, "count", "exactly"),
        Promise("log likelihood of observers left out", worst(rows, parameter="one batch"), 1e-9, "error"),
    ]
    return {"title": TITLE, "rows": rows, "promises": promises}


def _without(comparisons: Comparisons, person: int) -> Comparisons:
    kept = comparisons.observer != person
    observer = comparisons.observer[kept]
    return from_arrays(
        comparisons.items,
        tuple(name for number, name in enumerate(comparisons.observers) if number != person),
        winner=comparisons.winner[kept],
        loser=comparisons.loser[kept],
        observer=observer - (observer > person),
        count=comparisons.count[kept],
        winner_was_first=comparisons.winner_was_first[kept],
        tie=np.zeros(int(kept.sum()), dtype=np.bool_),
    )


def _chances(scores: Scores) -> Iterator[Row]:
    def sampled() -> Floats:
        random = np.random.default_rng(1)
        drawn = random.multivariate_normal(scores.fit.theta, scores.fit.covariance, 20_000, method="eigh")
        first, second = np.triu_indices(len(scores.items), 1)
        order = np.array(scores.order)
        p = 1 / (1 + np.exp(drawn[:, order[second]] - drawn[:, order[first]]))
        return np.asarray(np.median(p, axis=0))

    ours = np.array([pair.first_preferred.value for pair in pair_probabilities(scores).pairs])
    yield row("probability of every pair", "closed form", seconds(lambda: pair_probabilities(scores)), 0.0)
    error = float(np.abs(sampled() - ours).max())
    yield row("probability of every pair: sampled", "20,000 draws", seconds(sampled, repeats=3), error)


def _residuals(scores: Scores) -> Iterator[Row]:
    wins, theta, n = scores.comparisons.wins, scores.fit.theta, len(scores.items)

    def slowly() -> Floats:
        """A score test of each pair's own parameter, by dense matrices."""
        p = probabilities(theta)
        weight = (wins + wins.T) * p * p.T
        information = np.diag(weight.sum(axis=1)) - weight
        values = []
        for i, j in combinations(range(n), 2):
            across = np.zeros(n)
            across[i], across[j] = weight[i, j], -weight[i, j]
            left = weight[i, j] - across @ np.linalg.pinv(information) @ across
            values.append(abs(wins[i, j] - (wins + wins.T)[i, j] * p[i, j]) / np.sqrt(left))
        return np.array(values)

    ours = {frozenset((pair.first, pair.second)): pair.model_z or 0.0 for pair in pair_residuals(scores).pairs}
    names = scores.comparisons.items
    own = np.array([ours[frozenset((names[i], names[j]))] for i, j in combinations(range(n), 2)])
    error = float(np.abs(own - slowly()).max())
    yield row("residuals of pairs", "all at once", seconds(lambda: pair_residuals(scores)), error)
    yield row("residuals of pairs: a score test for each", "dense matrices", seconds(slowly), 0.0)


def _triples(scores: Scores) -> Iterator[Row]:
    wins = scores.comparisons.wins
    share = wins / np.maximum(wins + wins.T, 1)

    def slowly() -> int:
        broken = 0
        for triple in combinations(range(len(share)), 3):
            broken += any(
                share[a, b] >= 0.5 and share[b, c] >= 0.5 and share[a, c] < max(share[a, b], share[b, c])
                for a, b, c in permutations(triple)
            )
        return broken

    result = transitivity(scores, replicates=1000)
    assert result is not None
    time = seconds(lambda: transitivity(scores, replicates=1000), repeats=3)
    error = float(abs(result.strong.broken - slowly()))
    yield row("transitivity and 2000 simulated studies", "vectorised", time, error, "error in broken triples")
    plain = 2001 * seconds(slowly)
    yield row("transitivity and 2000 simulated studies: loops", "time of one, times 2001", plain, 0.0)


def _models(comparisons: Comparisons) -> Iterator[Row]:
    def slowly() -> Floats:
        totals = []
        for model in MODELS:
            total = 0.0
            for person in range(len(comparisons.observers)):
                theta = fit_model(_without(comparisons, person), model, covariance="model").theta
                own = comparisons.observer == person
                d = theta[comparisons.winner[own]] - theta[comparisons.loser[own]]
                total += float(np.log(LAWS[model].probabilities(d, 0.0)[0]).sum())
            totals.append(total)
        return np.array(sorted(totals, reverse=True))

    ours = np.array([line.log_likelihood for line in compare_models(comparisons).models])
    error = float(np.abs(ours - slowly()).max())
    yield row("models, each observer left out", "one batch", seconds(lambda: compare_models(comparisons)), error)
    time = seconds(slowly, repeats=3)
    yield row("models, each observer left out: one by one", f"{2 * len(comparisons.observers)} fits", time, 0.0)


def _multiverse(scores: Scores) -> Iterator[Row]:
    comparisons = scores.comparisons
    people = len(comparisons.observers)

    def slowly() -> list[tuple[str, ...]]:
        labels = []
        for model in MODELS:
            for person in (-1, *range(people)):
                rest = comparisons if person < 0 else _without(comparisons, person)
                for kind in KINDS:
                    for adjust in ADJUSTMENTS:
                        fit = fit_model(rest, model, covariance=kind)
                        classes = classes_of(fit, adjust=adjust)
                        assert classes is not None
                        labels.append(tuple(classes.labels[item] for item in scores.order))
        return labels

    result = multiverse(scores, adjustments=ADJUSTMENTS)
    wrong = sum(a.labels != b for a, b in zip(result.analyses, slowly(), strict=True))
    time = seconds(lambda: multiverse(scores, adjustments=ADJUSTMENTS), repeats=3)
    note = f"{len(result.analyses)} analyses of {result.fits} fits, {result.fits_spared} fits spared; error in classes"
    yield row("multiverse", "fits shared", time, float(wrong), note)
    time = seconds(slowly, repeats=1, at_least_s=0)
    yield row("multiverse: each analysis from the start", f"{len(result.analyses)} fits", time, 0.0)


def levels(observers: int, spread: float, studies: int) -> Iterator[Row]:
    """Yield shares of studies in which a test is wrong, and in which it is right."""
    case = f"{observers} observers, {'alike' if not spread else f'each their own ({spread:g} nats)'}"
    shares = {**_equivalent(observers, spread, studies), **_checks(observers, spread, studies)}
    for name, (share, used) in shares.items():
        level = name.startswith("false")
        error = abs(share - 0.05) if level else None
        yield row(name, case, None, error, f"{100 * share:.1f} % of {used} studies", share=share)


def _equivalent(observers: int, spread: float, studies: int) -> dict[str, tuple[float, int]]:
    """Three items of one strength and three of another, the margin apart: none of these nine pairs is equivalent."""
    design = Design(APART, observers, spread)
    truth = design.truth()
    margin = float(truth[0] - truth[-1])
    wrong, uncorrected, used = 0, 0.0, 0
    for by_observer in design.studies(studies, 1):
        scores = score(as_comparisons(by_observer))
        if scores.fit.separation:
            continue
        used += 1
        upper = set(scores.comparisons.items[:3])
        for adjust in ("holm", "none"):
            result = equivalence(scores, margin, alpha=0.05, adjust=adjust)
            false = [
                pair.verdict == "equivalent" for pair in result.pairs if (pair.first in upper) != (pair.second in upper)
            ]
            assert len(false) == 9
            if adjust == "holm":
                wrong += any(false)
            else:
                uncorrected += float(np.mean(false))
    right, seen = 0.0, 0
    for by_observer in Design(np.zeros(6), observers, spread).studies(studies, 2):
        scores = score(as_comparisons(by_observer))
        if scores.fit.separation:
            continue
        seen += 1
        right += equivalence(scores, "1.5jnd", alpha=0.05, adjust="holm").count("equivalent") / 15
    return {
        "false equivalence of any pair, Holm": (wrong / used, used),
        "false equivalence of a pair, uncorrected": (uncorrected / used, used),
        "equal pairs called equivalent, 1.5 JND, Holm": (right / seen, seen),
    }


def _checks(observers: int, spread: float, studies: int) -> dict[str, tuple[float, int]]:
    """Transitivity and residuals where the model is right, and with one pair that goes its own way."""
    false = {"weak": 0, "moderate": 0, "strong": 0, "pair": 0}
    true = dict.fromkeys(false, 0)
    used = seen = 0
    random = np.random.default_rng(3)
    for hits, planted in ((false, False), (true, True)):
        for by_observer in Design(LINE, observers, spread).studies(studies, 4):
            if planted:  # nine of ten prefer the worst item to the best
                ahead = random.random(observers) < 0.9
                by_observer[:, 0, 5], by_observer[:, 5, 0] = ahead, ~ahead
            scores = score(as_comparisons(by_observer))
            if scores.fit.separation:
                continue
            used += not planted
            seen += planted
            result = transitivity(scores, replicates=REPLICATES)
            assert result is not None
            for test in result.properties:
                hits[test.name] += test.exceeds
            flagged = pair_residuals(scores).flagged
            ends = {scores.comparisons.items[0], scores.comparisons.items[5]}
            hits["pair"] += any({pair.first, pair.second} == ends for pair in flagged) if planted else bool(flagged)
    names = {"weak": "weak transitivity", "moderate": "moderate transitivity", "strong": "strong transitivity"}
    names["pair"] = "any pair flagged"
    shares = {f"false alarm: {names[name]}": (times / used, used) for name, times in false.items()}
    names["pair"] = "the pair flagged"
    return shares | {f"planted circle: {names[name]}": (times / max(seen, 1), seen) for name, times in true.items()}


if __name__ == "__main__":
    program("reviewers", lambda: run(*numbers()))
