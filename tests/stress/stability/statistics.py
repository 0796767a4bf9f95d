"""Fits, laws of comparison, tails and quantiles, correlations, kernels and homographies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal
from functools import partial
from itertools import combinations

import numpy as np
from scipy.sparse import csr_array

from analysis.bootstrap.tails import acceleration, bias_corrected
from analysis.classes import two_sided_p
from analysis.comparisons import Answer, from_answers
from analysis.scaling import Model, Probit, fit, fit_model
from analysis.scaling.fitting import fit_sparse
from analysis.scaling.laws import Davidson, Law, Logistic, RaoKupper, iso_20462_jnd
from documents.arrays import Floats
from extensions.agreement import correlation
from stimuli.align import homography_from_points
from stimuli.errors import StimulusError
from stimuli.measures.scielab import gaussian_kernel
from tests.stress.stability import sixty_digits as s
from tests.stress.stability.routine import Routine, gives, refuses

D = Decimal
LogLikelihood = Callable[[Sequence[Decimal]], Decimal]
RNG = np.random.default_rng(62)
_STEP = D(10) ** -25


def _logistic(d: Decimal) -> Decimal:
    return 1 / (1 + (-d).exp())


def maximised(log_likelihood: LogLikelihood, start: list[Decimal]) -> list[Decimal]:
    """Return where a concave function is largest: Newton's method, with derivatives by central differences."""
    point, size = start, len(start)

    def at(*moves: tuple[int, Decimal]) -> Decimal:
        moved = list(point)
        for index, by in moves:
            moved[index] += by
        return log_likelihood(moved)

    for _ in range(60):
        h = _STEP
        slope = [(at((i, h)) - at((i, -h))) / (2 * h) for i in range(size)]
        middle = at()
        curve = [[D(0)] * size for _ in range(size)]
        for i in range(size):
            curve[i][i] = (2 * middle - at((i, h)) - at((i, -h))) / (h * h)
        for i, j in combinations(range(size), 2):
            mixed = at((i, h), (j, h)) + at((i, -h), (j, -h)) - at((i, h), (j, -h)) - at((i, -h), (j, h))
            curve[i][j] = curve[j][i] = -mixed / (4 * h * h)
        step = s.solved(curve, slope)
        longest = max(map(abs, step))
        share = min(D(1), 1 / longest) if longest else D(1)
        point = [a + share * b for a, b in zip(point, step, strict=True)]
        if longest < D(10) ** -22:
            return point
    raise AssertionError


def _centred(free: Sequence[Decimal]) -> list[Decimal]:
    theta = [D(0), *free]
    mean = sum(theta, D(0)) / len(theta)
    return [value - mean for value in theta]


def bradley_terry(wins: list[Decimal]) -> list[Decimal]:
    """Strengths of four items, from the twelve counts off the diagonal, by Newton's method with the first held at 0."""
    at = [(i, j) for i in range(4) for j in range(4) if i != j]
    theta = [D(0)] * 4
    for _ in range(60):
        slope, curve = [D(0)] * 4, [[D(0)] * 4 for _ in range(4)]
        for w, (i, j) in zip(wins, at, strict=True):
            lost = 1 - _logistic(theta[i] - theta[j])
            slope[i] += w * lost
            slope[j] -= w * lost
            information = w * lost * (1 - lost)
            for a, b in ((i, j), (j, i)):
                curve[a][a] += information
                curve[a][b] -= information
        step = s.solved([row[1:] for row in curve[1:]], slope[1:])
        longest = max(map(abs, step))
        theta = [D(0), *(a + b / max(D(1), longest) for a, b in zip(theta[1:], step, strict=True))]
        if longest < D(10) ** -60:
            return _centred(theta[1:])
    raise AssertionError


def _wins(row: Floats) -> Floats:
    wins = np.zeros((4, 4))
    wins[~np.eye(4, dtype=bool)] = row
    return wins


def _chances(model: Model, d: Decimal, k: Decimal) -> tuple[Decimal, Decimal, Decimal]:
    if model == "thurstone":
        return s.upper_tail(-d), s.upper_tail(d), D(0)
    if model == "davidson":
        weights = (d / 2).exp(), (-d / 2).exp(), k.exp()
        return weights[0] / sum(weights), weights[1] / sum(weights), weights[2] / sum(weights)
    first, second = _logistic(d - k), _logistic(-d - k)
    return first, second, 1 - first - second


def _three(model: Model) -> Callable[[list[Decimal]], list[Decimal]]:
    """Return the strengths of three items by ``model``, from six counts and three of ties."""
    pairs = list(combinations(range(3), 2))

    def strengths(counts: list[Decimal]) -> list[Decimal]:
        def likelihood(free: Sequence[Decimal]) -> Decimal:
            theta, k = [D(0), *free[:2]], free[2] if len(free) > 2 else D(0)
            total = D(0)
            for number, (i, j) in enumerate(pairs):
                chances = _chances(model, theta[i] - theta[j], k)
                answers = counts[3 * number : 3 * number + 3]
                total += sum((w * p.ln() for w, p in zip(answers, chances, strict=True) if w), D(0))
            return total

        return _centred(maximised(likelihood, [D(0), D(0), *([] if model == "thurstone" else [D("0.5")])])[:2])

    return strengths


def _fitted(row: Floats, model: Model) -> Floats:
    answers = []
    for number, (i, j) in enumerate(combinations("abc", 2)):
        won, lost, tied = row[3 * number : 3 * number + 3]
        answers += [Answer(i, j, won), Answer(j, i, lost)]
        answers += [Answer(i, j, tied, tie=True)] if tied else []
    return fit_model(from_answers(answers), model, covariance="model").theta


def _squares(a: list[Decimal], b: list[Decimal]) -> Decimal:
    return sum((u * u for u in a), D(0)) * sum((v * v for v in b), D(0))


def _all_fitted(model: Model, x: Floats) -> list[Floats]:
    return [_fitted(row, model) for row in x]


def _law_chances(law: Law, x: Floats) -> Floats:
    return np.stack(law.probabilities(x[:, 0], x[:, 1]), axis=1)


def _finite(law: Law) -> bool:
    return bool(np.isfinite(_law_chances(law, np.array([[1e4, 1.0]]))).all())


def _law_exactly(model: Model, x: list[Decimal]) -> Sequence[Decimal]:
    return _chances(model, x[0], x[1])


def _pearson(x: list[Decimal]) -> list[Decimal]:
    a, b = x[: len(x) // 2], x[len(x) // 2 :]
    mean_a, mean_b = sum(a, D(0)) / len(a), sum(b, D(0)) / len(b)
    a, b = [v - mean_a for v in a], [v - mean_b for v in b]
    return [sum((u * v for u, v in zip(a, b, strict=True)), D(0)) / _squares(a, b).sqrt()]


def _bca(x: list[Decimal]) -> list[Decimal]:
    bias = s.normal_quantile(x[0])
    reach = bias + s.normal_quantile(D(0.025))
    return [s.upper_tail(-(bias + reach / (1 - x[1] * reach)))]


def _acceleration(x: list[Decimal]) -> list[Decimal]:
    mean = sum(x, D(0)) / len(x)
    added = [mean - value for value in x]
    square = sum((value * value for value in added), D(0))
    return [sum(value**3 for value in added) / (6 * square * square.sqrt())]


def _kernel(x: list[Decimal]) -> list[Decimal]:
    """The middle five numbers; beyond the reach there is nothing."""
    sd = x[0]
    reach = len(gaussian_kernel(float(sd))) // 2
    edges = [(D(i) - D("0.5")) / sd for i in range(-reach, reach + 2)]
    whole = 1 - 2 * s.upper_tail(edges[-1])
    return [(s.upper_tail(edges[at]) - s.upper_tail(edges[at + 1])) / whole for at in range(reach - 2, reach + 3)]


def _middle(sd: Floats) -> Floats:
    kernels = [gaussian_kernel(float(one)) for one in sd[:, 0]]
    return np.array([kernel[len(kernel) // 2 - 2 : len(kernel) // 2 + 3] for kernel in kernels])


def _homography(x: list[Decimal]) -> list[Decimal]:
    rows, right = [], []
    for i in range(4):
        (a, b), (u, v) = x[2 * i : 2 * i + 2], x[8 + 2 * i : 10 + 2 * i]
        rows += [[a, b, D(1), D(0), D(0), D(0), -a * u, -b * u], [D(0), D(0), D(0), a, b, D(1), -a * v, -b * v]]
        right += [u, v]
    h = s.solved(rows, right)
    return [(h[0] * 300 + h[1] * 200 + h[2]) / (h[6] * 300 + h[7] * 200 + 1)]


def _mapped(x: Floats) -> Floats:
    """Where the place (300, 200) goes."""
    found = []
    for row in x:
        matrix = homography_from_points(row[:8].reshape(4, 2), row[8:].reshape(4, 2))
        place = matrix @ [300.0, 200.0, 1.0]
        found.append(place[0] / place[2])
    return np.array(found)


def routines() -> Iterator[Routine]:
    """Give the routines of `analysis`, and those of `stimuli` that are not colour."""
    counts = RNG.integers(1, 60, (12, 12)).astype(np.float64)
    counts[:3] = 10.0 ** RNG.uniform(0, 5, (3, 12)).round()
    yield Routine.of_row(
        "scaling.fit (Bradley-Terry) | four items, counts of 1 to 1e5 for each pair | 1e-11 nats | "
        "separated items: NaN, with the reason",
        lambda x: [fit(_wins(row)).theta for row in x],
        bradley_terry,
        counts,
        gives(lambda: np.isnan(fit(np.array([[0.0, 3], [0, 0]])).theta), [True, True]),
    )
    yield Routine.of_row(
        "scaling.fit_sparse (conjugate gradients) | four items, counts of 1 to 60 | 1e-10 nats | "
        "separated items are named",
        lambda x: [fit_sparse(csr_array(_wins(row))).theta for row in x],
        bradley_terry,
        counts[3:],
        gives(lambda: fit_sparse(csr_array(np.array([[0.0, 3], [0, 0]]))).separated.any(), True),
    )
    ties = RNG.integers(2, 40, (5, 9)).astype(np.float64)
    without = ties.copy()
    without[:, 2::3] = 0.0
    models: tuple[Model, ...] = ("davidson", "rao-kupper", "thurstone")
    for model in models:
        yield Routine.of_row(
            f"scaling.fit_model, {model} | three items, 2 to 40 of each answer | 1e-11 nats or sd | "
            f"separated items: NaN, with the reason",
            partial(_all_fitted, model),
            _three(model),
            without if model == "thurstone" else ties,
            gives(lambda: np.isnan(_fitted(np.array([3.0, 0, 0, 3, 0, 0, 3, 0, 0]), "bradley-terry")), [True] * 3),
        )
    d = np.concatenate([RNG.uniform(-700, 700, 80), RNG.uniform(-2, 2, 70)])[:, np.newaxis]
    yield Routine.of_row(
        "laws.Logistic.probabilities | differences to ±700 nats | 4.0 ulp | "
        "beyond ±700 the smaller chance stays at 1e-304",
        lambda x: np.stack([Logistic().probabilities(x[:, 0])[0]], 1),
        lambda x: [_logistic(x[0])],
        d,
        gives(lambda: Logistic().probabilities(np.array([800.0, 9e9]))[1] < 1e-303, [True, True]),
    )
    tails = np.concatenate([RNG.uniform(-37, 37, 60), RNG.uniform(-2, 2, 60)])[:, np.newaxis]
    yield Routine.of_row(
        "laws.Probit.probabilities | differences to ±37 sd | 2500.0 ulp | beyond -38 the chance is 0",
        lambda x: Probit().probabilities(x[:, 0])[0],
        lambda x: [s.upper_tail(-x[0])],
        tails,
        gives(lambda: Probit().probabilities(np.array([-50.0, 50.0]))[0], [0.0, 1.0]),
    )
    laws: tuple[tuple[Model, Law, float], ...] = (("davidson", Davidson(), -5.0), ("rao-kupper", RaoKupper(), 0.01))
    for name, law, low in laws:
        within = np.column_stack([RNG.uniform(-40, 40, 100), RNG.uniform(low, 5.0, 100)])
        yield Routine.of_row(
            f"laws, {name}: all three chances | differences to ±40, tie parameters {low:g} to 5 | 16.0 ulp | "
            f"all finite at any difference",
            partial(_law_chances, law),
            partial(_law_exactly, name),
            within,
            gives(partial(_finite, law), True),
        )
    yield Routine.of_row(
        "laws.iso_20462_jnd | shares of 0 to 1 | 1e-14 JND | a share outside 0 to 1 gives NaN",
        lambda x: iso_20462_jnd(x[:, 0]),
        _angular,
        RNG.uniform(0, 1, (100, 1)),
        gives(_angular_outside, True),
    )
    yield Routine.of_row(
        "multiplicity.two_sided_p | z to 37 | 2500.0 ulp | beyond 38 it is 0",
        lambda x: two_sided_p(x[:, 0]),
        lambda x: [2 * s.upper_tail(x[0])],
        np.abs(tails),
        gives(lambda: two_sided_p(np.array([0.0, 50.0])), [1.0, 0.0]),
    )
    ends = np.column_stack([RNG.uniform(0.01, 0.99, 80), RNG.uniform(-0.2, 0.2, 80)])
    yield Routine.of_row(
        "bootstrap.bias_corrected (BCa) | shares below 0.01 to 0.99, acceleration to ±0.2 | 1e-14 level | "
        "without room left: the end of the replicates",
        lambda x: bias_corrected(0.025, x[:, 0], x[:, 1]),
        _bca,
        ends,
        gives(lambda: bias_corrected(0.025, np.array([0.5]), np.array([-0.9])), [0.0]),
    )
    yield Routine.of_row(
        "bootstrap.acceleration | 12 observers, values near 100 that differ by 1e-3 to 30 | 1e-12 acceleration | "
        "0 where no observer adds anything",
        lambda x: [acceleration(row[:, np.newaxis])[0] for row in x],
        _acceleration,
        RNG.normal(0, 1, (60, 12)) ** 3 + 100.0,
        gives(lambda: acceleration(np.ones((5, 1))), [0.0]),
    )
    values = np.hstack([RNG.normal(0, 1, (60, 8)), 1e3 + RNG.normal(0, 1, (60, 8))])
    yield Routine.of_row(
        "agreement.correlation (Pearson) | 8 stimuli, values near 1000 that differ by 1 | 1e-12 r | "
        "0 where either is constant",
        lambda x: [correlation(row[:8], row[8:], "pearson") for row in x],
        _pearson,
        values,
        gives(lambda: correlation(np.arange(4.0), np.ones(4), "pearson"), 0.0),
    )
    yield Routine.of_row(
        "scielab.gaussian_kernel | sd of 0.6 to 100 px | 1e-14 weight | a filter of next to no width leaves the pixel",
        _middle,
        _kernel,
        10.0 ** RNG.uniform(-0.2, 2, (30, 1)),
        gives(lambda: gaussian_kernel(1e-3).max(), 1.0),
    )
    square = np.array([0.0, 0, 600, 0, 0, 400, 600, 400])
    corners = np.hstack([square + RNG.uniform(-30, 30, (60, 8)), square + RNG.uniform(-30, 30, (60, 8))])
    yield Routine.of_row(
        "align.homography_from_points | corners of 600 x 400 px, each 30 px off | 1e-9 px | "
        "three places on a line are refused",
        _mapped,
        _homography,
        corners,
        refuses(
            StimulusError,
            lambda: homography_from_points([[0, 0], [1, 1], [2, 2], [3, 3]], [[0, 0], [1, 0], [0, 1], [1, 1]]),
        ),
    )


def _angular(x: list[Decimal]) -> list[Decimal]:
    root = x[0].sqrt()
    return [12 / s.pi() * s.atan2(root, (1 - x[0]).sqrt()) - 3]


def _angular_outside() -> bool:
    with np.errstate(invalid="ignore"):
        return bool(np.isnan(iso_20462_jnd(np.array([1.2]))).all())
