"""How often tests find an effect that is not there, and one that is: by likelihood ratio, and by observers.

    python benchmarks/robust_tests.py [STUDIES [TEST]]

Observers are alike; or each has strengths of their own (for the order effect, a side bias of their own), normal about
the common ones; or they are two camps of opposite tastes. The error is the distance of the share of false findings at
the level 0.05 from 0.05. Time is that of one bootstrap over observers.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.special import chdtrc, expit, xlogy

from documents.arrays import Floats

sys.path.insert(0, str(Path(__file__).parent))
from curves import numbers, program, row, seconds, sized
from promises import Promise

from analysis.scaling.robust_tests import from_products

Row = dict[str, object]

TITLE = "Tests where observers differ: time against distance of false findings from 5 %"
OBSERVERS = sized((5, 10, 15, 30), (5,))
STUDIES = sized(100, 4)
WORLDS = ("alike", "sd 0.7", "sd 1.5", "two camps")


@dataclass(frozen=True, slots=True, eq=False)
class Test:
    """One test of m pairs of n items.

    Attributes
    ----------
    pairs
        Shape (m, n): 1 for the first item, −1 for the second.
    null, full
        Shape (m, p₀) and (m, p): columns of the models, the null's first.
    effect
        Shape (m,): what is added to the differences where there is an effect, in nats, for 15 observers.
    answers
        Of each observer to each pair.
    differ
        What observers differ in: the items' strengths, a side bias, or tastes for single pairs.
    """

    pairs: Floats
    null: Floats
    full: Floats
    effect: Floats
    answers: int
    differ: Literal["items", "sides", "pairs"] = "items"


def tests() -> dict[str, Test]:
    """Return the tests by name."""
    sides = _pairs(5, both_orders=True)
    ones = np.ones((len(sides), 1))
    scale = sides[:, 1:]
    six, eight = _pairs(6), _pairs(8)
    circle = np.zeros(len(six))
    circle[[0, 5, 1]] = 1.0, 1.0, -1.0  # items 0 over 1, 1 over 2, 2 over 0
    random = np.random.default_rng(0)
    bent = random.standard_normal(len(eight))
    bent -= eight @ np.linalg.lstsq(eight, bent)[0]
    return {
        "order effect (1 df)": Test(sides, scale, np.hstack([scale, ones]), 0.3 * ones[:, 0], 1, "sides"),
        "interaction 2 x 3 (2 df)": _factorial(2, 3, 2, 0.9),
        "interaction 3 x 4 (6 df)": _factorial(3, 4, 1, 0.8),
        "lack of fit of a slope, 22 items (20 df)": _slope(22, 0.33),
        "one scale, 6 items (10 df)": Test(six, six[:, 1:], np.eye(len(six)), 0.9 * circle, 2),
        "one scale, 6 items, tastes for pairs (10 df)": Test(
            six, six[:, 1:], np.eye(len(six)), 0.6 * circle, 4, "pairs"
        ),
        "one scale, 8 items (21 df)": Test(eight, eight[:, 1:], np.eye(len(eight)), 0.55 * bent, 1),
    }


def _pairs(n: int, *, both_orders: bool = False) -> Floats:
    one, other = np.triu_indices(n, 1)
    rows = np.eye(n)[one] - np.eye(n)[other]
    return np.vstack([rows, -rows]) if both_orders else rows


def _factorial(first: int, second: int, answers: int, size: float) -> Test:
    levels = np.array(list(product(range(first), range(second))))
    one, other = np.eye(first)[levels[:, 0]][:, 1:], np.eye(second)[levels[:, 1]][:, 1:]
    both = (one[:, :, None] * other[:, None, :]).reshape(len(levels), -1)
    pairs = _pairs(len(levels))
    null, more = pairs @ np.hstack([one, other]), pairs @ both
    return Test(pairs, null, np.hstack([null, more]), size * more[:, 0], answers)


def _slope(n: int, size: float) -> Test:
    pairs, line = _pairs(n), np.linspace(-1, 1, n)[:, None]
    wave = np.sin(2.5 * np.pi * line)
    null = pairs @ line
    return Test(pairs, null, np.hstack([null, pairs[:, 2:]]), size * (pairs @ wave)[:, 0], 1)


def simulate(test: Test, observers: int, world: str, size: float, studies: int, seed: int = 1) -> tuple[Floats, Floats]:
    """Return p values by likelihood ratio (and Pearson's, for free pairs), (1 or 2, S), and by observers, (S,)."""
    random = np.random.default_rng(seed)
    apart = {"items": test.pairs, "sides": np.ones((len(test.pairs), 1)), "pairs": np.eye(len(test.pairs))}[test.differ]
    sd = {"alike": 0.0, "sd 0.7": 0.7, "sd 1.5": 1.5, "two camps": 0.0}[world]
    own = random.standard_normal((studies, observers, apart.shape[1]))
    d = sd * own @ apart.T + size * test.effect
    if world == "two camps":
        side = np.where(random.random((studies, observers, 1)) < 0.5, 1.0, -1.0)
        tastes = np.ones((1, 1, 1)) if test.differ == "sides" else random.standard_normal((studies, 1, apart.shape[1]))
        d = d + side * 0.7 * (tastes @ apart.T)
    won = random.binomial(test.answers, np.broadcast_to(expit(d), (studies, observers, len(test.pairs))))
    return _tested(test, won.astype(np.float64))


def _tested(test: Test, won: Floats) -> tuple[Floats, Floats]:
    total = float(won.shape[1] * test.answers)
    summed = won.sum(axis=1)
    chance = _fitted(test.null, summed, total)
    df = test.full.shape[1] - test.null.shape[1]
    weight = total * chance * (1 - chance)
    residual = won - test.answers * chance[:, None]
    products = _taken_up(test.full, weight, residual) - _taken_up(test.null, weight, residual)
    free = test.full.shape[1] == len(test.pairs)
    best = summed / total if free else _fitted(test.full, summed, total)
    plain = [2 * (_likelihood(best, summed, total) - _likelihood(chance, summed, total))]
    if free:
        plain.append(products.sum(axis=(1, 2)))
    own = [from_products(each, df) for each in products]
    return chdtrc(df, np.maximum(plain, 0.0)), np.array([one.p for one in own if one is not None])


def _taken_up(columns: Floats, weight: Floats, residual: Floats) -> Floats:
    """Return uᵀ A u of the observers' slopes u by a model with these columns, shape (S, G, G)."""
    if columns.shape[1] == len(columns):
        return np.asarray((residual / weight[:, None]) @ residual.swapaxes(1, 2))
    slopes = residual @ columns
    return np.asarray(slopes @ np.linalg.solve((columns.T * weight[:, None]) @ columns, slopes.swapaxes(1, 2)))


def _fitted(columns: Floats, won: Floats, total: float) -> Floats:
    """Return fitted chances, shape (S, m), by Newton's method; a fit that runs away ends far out."""
    beta = np.zeros((len(won), columns.shape[1]))
    ridge = 1e-9 * np.eye(columns.shape[1])
    for _ in range(30):
        chance = expit(beta @ columns.T)
        information = (columns.T * (total * chance * (1 - chance))[:, None]) @ columns + ridge
        step = np.linalg.solve(information, ((won - total * chance) @ columns)[..., None])[..., 0]
        beta += step / np.maximum(1.0, np.abs(step).max(axis=1, keepdims=True) / 2)
    return np.asarray(expit(beta @ columns.T))


def _likelihood(chance: Floats, won: Floats, total: float) -> Floats:
    return np.asarray((xlogy(won, chance) + xlogy(total - won, 1 - chance)).sum(axis=1))


def run(studies: int = STUDIES, only: str = "") -> dict[str, Any]:
    """Simulate and return the title and the rows."""
    rows: list[Row] = []
    for name, test in tests().items():
        if only in name:
            for observers in OBSERVERS:
                rows += _rows(name, test, observers, studies)
    false = float(np.mean([row["false"] for row in rows if row["series"] == "by observers"]))
    promise = Promise("false findings of the test that reports use, mean over all worlds", false, 0.055, "share")
    return {"title": TITLE, "rows": rows, "promises": [promise]}


def _rows(name: str, test: Test, observers: int, studies: int) -> Iterator[Row]:
    x = np.random.default_rng(0).standard_normal((observers, 3))
    time = seconds(lambda: from_products(x @ x.T, 3), repeats=3)
    names = ["deviance", "Pearson's", "by observers"] if test.full.shape[1] == len(test.pairs) else []
    for world in WORLDS:
        false, found = (
            (np.vstack(simulate(test, observers, world, size, studies)) <= 0.05).mean(axis=1)
            for size in (0.0, np.sqrt(15 / observers))
        )
        for kind, wrong, right in zip(names or ["likelihood ratio", "by observers"], false, found, strict=True):
            yield row(
                kind,
                f"{name}, {observers} observers, {world}",
                time if kind == "by observers" else None,
                abs(float(wrong) - 0.05),
                note=f"{100 * wrong:.1f} % false, {100 * right:.1f} % of planted effects found in {studies} studies",
                false=float(wrong),
                found=float(right),
            )


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if not (word.isdecimal() or word.startswith("--"))]
    program("robust_tests", lambda: run(*(numbers() or [STUDIES]), *words))
