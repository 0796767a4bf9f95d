"""What is left of the answers to each pair after a fit, observer by observer.

For each pair y is how often the first item was preferred, a tie being half a preference, and m its expectation per
answer by the fitted law. Observer s leaves the residual e_s = y_s − N_s m at the fitted parameters. The answers have
also moved the parameters: to first order by A g_s, with A the inverse information and g_s the slope of that observer's
log likelihood. What residuals vary by from study to study is therefore e_s − D A g_s, with D the change of N m with
the parameters: the residual with its leverage taken out. The sum over observers is the plain residual, as Σ g_s = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.errors import ResultsError
from analysis.inference.differences import check_fitted
from analysis.scaling.counts import Counts, count_pairs
from analysis.scaling.laws import LAWS
from analysis.scaling.newton import Point, joint_covariance
from analysis.scaling.penalty import NO_PENALTY, Gaussian
from analysis.scaling.profile import parts
from analysis.scaling.sandwich import observer_slopes
from analysis.scaling.scores import Scores
from documents import Finding
from documents.arrays import Floats, Indices

MOST_ITEMS = 300


@dataclass(frozen=True, slots=True, eq=False)
class AnswerResiduals:
    """Residuals of the answers to P pairs by G observers.

    Attributes
    ----------
    counts
        What was fitted; its pairs, of both orders where the order was fitted.
    mean, variance
        Shape (P,): expectation and variance of one answer's y.
    chances
        Shape (P, 3): of ``first``, ``second`` and neither.
    total, y
        Shape (P,): answers to the pair, and preferences for its first item.
    mean_slopes
        Shape (P, n + f): change of ``mean`` with strengths and further parameters.
    inverse
        Shape (n + f, n + f): the inverse information A.
    single
        Slopes of the log likelihood of one answer of each kind, by the difference and by the law's parameter, each of
        shape (3, P).
    by_observer
        Shape (G, P): each observer's residual, leverage taken out.
    answered
        Shape (G, P): how many answers each observer gave.
    """

    counts: Counts
    mean: Floats
    variance: Floats
    chances: Floats
    total: Floats
    y: Floats
    mean_slopes: Floats
    inverse: Floats
    single: tuple[Floats, Floats]
    by_observer: Floats
    answered: Floats

    @property
    def residual(self) -> Floats:
        """Shape (P,): y − N m."""
        return self.y - self.total * self.mean

    def drawn(self, replicates: int, random: np.random.Generator) -> Floats:
        """Return residuals that independent answers by the fitted law leave, shape (replicates, P)."""
        whole = np.maximum(np.rint(self.total), 1).astype(np.int64)
        kinds = random.multinomial(whole, self.chances, (replicates, len(whole))) * (self.total / whole)[:, None]
        y = kinds[:, :, 0] + kinds[:, :, 2] / 2
        flow, by_k = (np.einsum("bpc,cp->bp", kinds, slope) for slope in self.single)
        n = self.counts.n
        slope = np.zeros((replicates, self.inverse.shape[0]))
        for item in range(n):
            first, second = self.counts.first == item, self.counts.second == item
            slope[:, item] = flow[:, first].sum(axis=1) - flow[:, second].sum(axis=1)
        at = n
        if self.single[1].any():
            slope[:, at] = by_k.sum(axis=1)
            at += 1
        if self.counts.ordered:
            slope[:, at] = flow.sum(axis=1)
        return np.asarray(
            y - self.total * self.mean - slope @ self.inverse @ (self.total[:, None] * self.mean_slopes).T
        )

    def resampled(self, replicates: int, random: np.random.Generator) -> Floats:
        """Return residuals that other observers of this kind would leave if the law is right, shape (replicates, P).

        A wild bootstrap over observers: each one's residuals, less their mean, times a standard normal number.
        """
        people = len(self.by_observer)
        weights = random.standard_normal((replicates, people)) * np.sqrt(people / (people - 1))
        return np.asarray((weights - weights.mean(axis=1, keepdims=True)) @ self.by_observer)


def answer_residuals(scores: Scores) -> AnswerResiduals:
    """Return the residuals of the answers that ``scores`` were fitted to.

    Raises
    ------
    ResultsError
        If there are no finite strengths, or more than 300 items.
    """
    check_fitted(scores)
    fit, comparisons = scores.fit, scores.comparisons
    if fit.counts.n > MOST_ITEMS:
        what = f"residuals of pairs are for at most {MOST_ITEMS} items, and there are {fit.counts.n}"
        raise ResultsError(Finding(what, remedy="ask for scores and classes alone"))
    law = LAWS[fit.model]
    counts, answers = count_pairs(comparisons, ordered=fit.counts.ordered, ties=law.parameter is not None)
    values = {parameter.name: parameter.estimate for parameter in fit.parameters}
    k, order = (np.array([[values.get(name or "", 0.0)]]) for name in (law.parameter, "order"))
    point = Point(fit.theta[None], k, order)
    penalty = Gaussian.of_sd(fit.prior_sd) if fit.prior_sd else NO_PENALTY
    inverse = joint_covariance(counts, law, point, penalty)[0]
    d = counts.differences(point.theta, point.order)
    chances = np.concatenate(law.probabilities(d, k)).T
    mean = chances[:, 0] + chances[:, 2] / 2
    variance = chances[:, 0] * (1 - mean) ** 2 + chances[:, 1] * mean**2 + chances[:, 2] * (mean - 0.5) ** 2
    won, lost, tied = np.broadcast_to(np.eye(3)[:, :, None], (3, 3, d.shape[1]))
    each = law.slopes(
        Counts(counts.n, counts.first, counts.second, won, lost, tied, counts.ordered), np.repeat(d, 3, 0), k
    )
    single = (each.d, np.broadcast_to(each.k, each.d.shape) if law.parameter else np.zeros_like(each.d))
    observer, who = np.unique(answers.observer, return_inverse=True)
    y_of, people, pairs = np.array([1.0, 0.0, 0.5]), len(observer), d.shape[1]
    cell, size = who * pairs + answers.pair, people * pairs
    answered = np.asarray(np.bincount(cell, answers.count, size), np.float64).reshape(people, pairs)
    own = np.asarray(np.bincount(cell, answers.count * y_of[answers.outcome], size), np.float64).reshape(people, pairs)
    total = counts.total[0]
    mean_slopes = _mean_slopes(counts, chances, single, len(inverse))
    y, moved = own.sum(axis=0), observer_slopes(counts, answers, law, point) @ inverse
    for rows in parts(people, pairs):
        own[rows] -= answered[rows] * mean + moved[rows] @ (total[:, None] * mean_slopes).T
    return AnswerResiduals(
        counts=counts,
        mean=mean,
        variance=variance,
        chances=chances,
        total=total,
        y=y,
        mean_slopes=mean_slopes,
        inverse=inverse,
        single=single,
        by_observer=own,
        answered=answered,
    )


def _mean_slopes(counts: Counts, chances: Floats, single: tuple[Floats, Floats], width: int) -> Floats:
    """Return the change of m with strengths and further parameters, shape (P, width)."""
    y = np.array([1.0, 0.0, 0.5])
    by_d, by_k = (np.einsum("c,pc,cp->p", y, chances, slope) for slope in single)
    pairs = np.arange(len(by_d))
    slopes = np.zeros((len(by_d), width))
    slopes[pairs, counts.first] = by_d
    slopes[pairs, counts.second] = -by_d
    at = counts.n
    if single[1].any():
        slopes[:, at] = by_k
        at += 1
    if counts.ordered:
        slopes[:, at] = by_d
    return slopes


def by_unordered_pair(counts: Counts) -> tuple[Indices, Indices, Indices, Floats]:
    """Return the unordered pairs' lower and higher item (Q,), and for each pair of ``counts`` its pair and sign (P,).

    The sign is −1 where the pair's first item is the higher one, so that what speaks for it speaks against the lower.
    """
    low, high = np.minimum(counts.first, counts.second), np.maximum(counts.first, counts.second)
    key, place = np.unique(low * counts.n + high, return_inverse=True)
    sign = np.where(counts.first == low, 1.0, -1.0)
    return (key // counts.n).astype(np.intp), (key % counts.n).astype(np.intp), place.astype(np.intp), sign
