"""Which pairs the model fits badly: standardised residuals, by the model and by what observers differ by.

A pair's residual is how much more often one item was preferred than the law expects. Over its standard error it is a
*standardised residual*. The standard error takes out the pair's leverage, since the answers to the pair have moved the
strengths towards themselves. The model's one takes all answers for independent; times √φ it allows for observers who
are alike in themselves, φ being how much larger the spread between observers is, over all pairs; and the spread
between the observers of the pair itself gives a third. The largest of them counts. The p values are corrected for the
number of pairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from analysis.classes.classes import check_level
from analysis.classes.conclusions import verdict_of
from analysis.classes.multiplicity import corrected, two_sided_p
from analysis.errors import ResultsError
from analysis.inference.answer_residuals import AnswerResiduals, answer_residuals, by_unordered_pair
from analysis.scaling.scores import Scores
from documents import Finding
from documents.arrays import Floats, Indices
from documents.text import JsonResult, counted, finite

FEWEST_OBSERVERS = 3
LEAST_VARIANCE = 1e-9  # of the variance without leverage: below it the pair alone decides what it is compared with


@dataclass(frozen=True, slots=True)
class PairResidual(JsonResult):
    """One pair's residual.

    Attributes
    ----------
    first, second
        Names of the items; ``first`` was preferred more often than the model expects.
    answers
        How many answers the pair got.
    observed, expected
        Share (0 to 1) of preferences for ``first``, a tie being half of one, and what the model expects.
    leverage
        Share (0 to 1) of the pair's variance that its own answers explain.
    z
        Standardised residual, by the largest standard error; None where the pair determines its own fit.
    model_z, observers_z
        The same by the model's standard error, and by the spread between the observers of the pair; None with fewer
        than three.
    p, p_adjusted
        Two-sided p value of ``z``, and the same corrected for the number of pairs; None without ``z``.
    flagged
        Whether ``p_adjusted`` is at most the level.
    """

    first: str
    second: str
    answers: float
    observed: float
    expected: float
    leverage: float
    z: float | None
    model_z: float | None
    observers_z: float | None
    p: float | None
    p_adjusted: float | None
    flagged: bool


@dataclass(frozen=True, slots=True)
class PairResiduals(JsonResult):
    """Residuals of all compared pairs, the worst fitted first.

    ``overdispersion`` is φ, at least 1: how many times as large the variance between observers is as the model's.
    """

    pairs: tuple[PairResidual, ...]
    overdispersion: float
    alpha: float
    adjust: Literal["none", "holm", "bh"]
    json_keys: ClassVar = {"number_flagged": "flagged"}
    json_names: ClassVar = "alpha adjust overdispersion number_flagged pairs"

    @property
    def flagged(self) -> tuple[PairResidual, ...]:
        """The pairs that fit badly."""
        return tuple(pair for pair in self.pairs if pair.flagged)

    @property
    def sentence(self) -> str:
        """Which pairs fit badly, in a sentence."""
        bad = self.flagged
        if not bad:
            return f"A bad fit is {verdict_of(False)} in any of {counted(len(self.pairs), 'pair', 'pairs')}."
        shown = "; ".join(
            f"{pair.first} over {pair.second}: {pair.observed:.0%} (expected {pair.expected:.0%})" for pair in bad[:5]
        )
        return f"{len(bad)} of {len(self.pairs)} pairs fit badly: {shown}{' and more' if len(bad) > 5 else ''}."

    @property
    def number_flagged(self) -> int:
        """How many pairs are flagged."""
        return len(self.flagged)


def pair_residuals(
    scores: Scores, *, alpha: float = 0.05, adjust: Literal["none", "holm", "bh"] = "holm"
) -> PairResiduals:
    """Return the standardised residual of every compared pair, the worst fitted first.

    Parameters
    ----------
    scores
        Scores of paired comparisons, by any law, of at most 300 items.
    alpha, adjust
        Level at which a pair is flagged, and correction for the number of pairs.

    Returns
    -------
    PairResiduals
        A line for each pair that was compared.

    Raises
    ------
    ResultsError
        If ``alpha`` is out of range, ``adjust`` is unknown, there are no finite strengths, or too many items.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> votes = {"ab": 30, "ba": 10, "bc": 30, "cb": 10, "ac": 10, "ca": 30, "ad": 35, "da": 5, "bd": 30, "db": 10}
    >>> answers = [Answer(pair[0], pair[1], count) for pair, count in votes.items()]
    >>> pair_residuals(score(from_answers(answers))).sentence
    '3 of 5 pairs fit badly: c over a: 75% (expected 48%); b over c: 75% (expected 48%); a over b: 75% (expected 53%).'
    """
    check_level(alpha)
    if adjust not in ("none", "holm", "bh"):
        raise ResultsError(
            Finding(f"residuals have no correction '{adjust}'", remedy="expected one of: none, holm, bh")
        )
    own = answer_residuals(scores)
    low, high, place, sign = by_unordered_pair(own.counts)
    size = len(low)

    def together(values: Floats) -> Floats:
        return np.bincount(place, values, size).astype(np.float64)

    answers, residual = together(own.total), together(sign * own.residual)
    observed = together(np.where(sign > 0, own.y, own.total - own.y)) / answers
    variance, plain = _model_variance(own, place, sign, size)
    between = _between_observers(own, residual, place, sign, size)
    known, seen = variance > LEAST_VARIANCE * plain, np.isfinite(between)
    both = known & seen
    phi = max(1.0, float(between[both].sum() / variance[both].sum())) if both.any() else 1.0
    largest = np.fmax(phi * variance, between)
    z, model_z, observers_z = (
        np.divide(residual, np.sqrt(np.where(used, v, 1)), out=np.full(size, np.nan), where=used)
        for v, used in ((largest, known), (variance, known), (between, both & (between > 0)))
    )
    p = np.full(size, np.nan)
    p[known] = two_sided_p(np.abs(z[known]))
    adjusted = np.full(size, np.nan)
    adjusted[known] = corrected(p[known].copy(), adjust)
    names, lines = scores.comparisons.items, []
    for row in np.argsort(np.where(known, p, 2), kind="stable").tolist():
        ahead = residual[row] >= 0
        more, less = (low[row], high[row]) if ahead else (high[row], low[row])
        share = float(observed[row] if ahead else 1 - observed[row])
        lines.append(
            PairResidual(
                first=names[more],
                second=names[less],
                answers=float(answers[row]),
                observed=share,
                expected=share - abs(float(residual[row])) / float(answers[row]),
                leverage=float(np.clip(1 - variance[row] / plain[row], 0, 1)),
                z=finite(abs(z[row])),
                model_z=finite(abs(model_z[row])),
                observers_z=finite(abs(observers_z[row])),
                p=finite(p[row]),
                p_adjusted=finite(adjusted[row]),
                flagged=bool(known[row] and adjusted[row] <= alpha),
            )
        )
    return PairResiduals(tuple(lines), phi, alpha, adjust)


def _model_variance(own: AnswerResiduals, place: Indices, sign: Floats, size: int) -> tuple[Floats, Floats]:
    """Return the variance of each pair's residual if answers are independent, and that without leverage."""
    plain = np.bincount(place, own.total * own.variance, size).astype(np.float64)
    slopes = np.zeros((size, own.inverse.shape[0]))
    np.add.at(slopes, place, (sign * own.total)[:, None] * own.mean_slopes)
    return plain - (slopes @ own.inverse * slopes).sum(axis=1), plain


def _between_observers(own: AnswerResiduals, residual: Floats, place: Indices, sign: Floats, size: int) -> Floats:
    """Return the variance of each pair's residual from the spread between observers; NaN where fewer than 3 saw it."""
    people = len(own.by_observer)
    if people < FEWEST_OBSERVERS:
        return np.full(size, np.nan)
    each, answered = np.zeros((size, people)), np.zeros((size, people))
    np.add.at(each, place, (own.by_observer * sign).T)
    np.add.at(answered, place, own.answered.T)
    spread = ((each - residual[:, None] / people) ** 2).sum(axis=1) * people / (people - 1)
    return np.where((answered > 0).sum(axis=1) >= FEWEST_OBSERVERS, spread, np.nan)
