"""One law fitted to all answers and to all but each part of the observers', in one batch that starts from the whole."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from analysis.comparisons.comparisons import Comparisons
from analysis.scaling.counts import Answers, Counts, count_pairs
from analysis.scaling.fitting import DEFAULT_PRIOR_SD
from analysis.scaling.laws import LAWS, Model
from analysis.scaling.newton import Point, maximise
from analysis.scaling.penalty import NO_PENALTY, Gaussian
from analysis.scaling.separation import are_connected, find_separation
from documents.arrays import Flags, Floats, Indices

MOST_NUMBERS = 4_000_000


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """The answers without each part: row 0 of the batch is all answers, row r those without part r − 1.

    Attributes
    ----------
    model, items
        The law, and the items' names.
    counts
        Counts of the 1 + K sets of answers; ties only where the law has a place for them.
    answers
        Kinds of answers of everybody, ties among them: ``pair`` indexes the pairs of ``counts``.
    why
        For each row a sentence why there is no finite maximum; None where there is one.
    """

    model: Model
    items: tuple[str, ...]
    counts: Counts
    answers: Answers
    why: tuple[str | None, ...]

    @property
    def sound(self) -> Flags:
        """Shape (1 + K,): whether there is a finite maximum."""
        return np.array([reason is None for reason in self.why])

    def fitted(self, penalised: Flags) -> tuple[Point, Flags]:
        """Return the maxima, and in which rows there is one.

        Rows in ``penalised`` are fitted under a Gaussian prior on the strengths of 2 nats or standard deviations.
        """
        law, rows = LAWS[self.model], len(self.why)
        point = Point(np.full((rows, self.counts.n), np.nan), np.full((rows, 1), np.nan), np.full((rows, 1), np.nan))
        done = np.zeros(rows, dtype=np.bool_)
        start: Floats | None = None
        batches = ((~penalised & self.sound, NO_PENALTY), (penalised, Gaussian.of_sd(DEFAULT_PRIOR_SD)))
        for chosen, penalty in batches:
            if penalty.precision:
                chosen = chosen & np.array([bool(own) and self._has_mode(row) for row, own in enumerate(chosen)])
            if not chosen.any():
                continue
            if start is None:
                first = np.zeros(rows, dtype=np.bool_)
                first[np.argmax(chosen)] = True
                start = maximise(self.counts.select(first), law, penalty=penalty).theta
            begin = np.repeat(start, int(chosen.sum()), axis=0)
            top = maximise(self.counts.select(chosen), law, penalty=penalty, start=begin)
            point.theta[chosen], point.k[chosen], point.order[chosen] = top.theta, top.k, top.order
            done[chosen] = top.converged
        return point, done

    def _has_mode(self, row: int) -> bool:
        return _separation(self.counts, self.items, row, self.model, prior=True) is None

    def log_chances(self, point: Point) -> Floats:
        """Return the log probability that each row gives each outcome of each pair, shape (3, 1 + K, m).

        A law without ties gives them the share that they have in the row's answers.
        """
        law, counts = LAWS[self.model], self.counts
        d = counts.differences(point.theta, point.order)
        given, none = np.ones((1, 1)), np.zeros((1, 1))
        logs = []
        for kind in range(3):
            won, lost, tied = (np.broadcast_to(given if kind == own else none, d.shape) for own in range(3))
            if kind == 2 and law.parameter is None:
                logs.append(np.full(d.shape, -np.inf))
                continue
            single = Counts(counts.n, counts.first, counts.second, won, lost, tied, counts.ordered)
            logs.append(law.log_likelihood(single, d, point.k))
        return np.stack(logs)


def left_out(comparisons: Comparisons, model: Model, part: Indices, *, order_effect: bool = False) -> LeftOut:
    """Count the answers without each part of the observers.

    Parameters
    ----------
    part
        Shape (observers,): to which part, from 0, each observer belongs.

    Raises
    ------
    ResultsError
        If ``order_effect`` and the source does not say of every answer which item was shown first.
    """
    ties = LAWS[model].parameter is not None
    everything, answers = count_pairs(comparisons, ordered=order_effect, ties=True)
    parts, m = int(part.max()) + 1, len(everything.first)
    cell = (part[answers.observer] * 3 + answers.outcome) * m + answers.pair
    own = np.bincount(cell, answers.count, parts * 3 * m).reshape(parts, 3, m)
    kinds = np.stack([everything.won[0], everything.lost[0], everything.tied[0]])
    rest = np.concatenate([kinds[None], np.where(own < kinds, kinds - own, 0.0)])
    if not ties:
        rest[:, 2] = 0.0
    won, lost, tied = (np.asarray(rest[:, kind], dtype=np.float64, order="F") for kind in range(3))
    counts = replace(everything, won=won, lost=lost, tied=tied)
    linked = _linked(counts, ties)
    why = tuple(None if linked[row] else _separation(counts, comparisons.items, row, model) for row in range(parts + 1))
    return LeftOut(model, comparisons.items, counts, answers, why)


def _linked(counts: Counts, ties: bool) -> Flags:
    """Say of each row whether wins alone link all items both ways, whichever was shown first: enough for a maximum."""
    rows, n = len(counts.won), counts.n
    linked = np.ones(rows, dtype=np.bool_)
    if ties:
        linked &= counts.tied.any(axis=1)
    block = max(1, MOST_NUMBERS // n**2)
    for start in range(0, rows, block):
        chosen = slice(start, start + block)
        ahead, behind = np.zeros((2, len(counts.won[chosen]), n, n))
        ahead[:, counts.first, counts.second] = counts.won[chosen]
        behind[:, counts.second, counts.first] = counts.lost[chosen]
        for wins in (ahead, behind) if counts.ordered else (ahead + behind,):
            linked[chosen] &= are_connected(wins)
    return linked


def _separation(counts: Counts, items: tuple[str, ...], row: int, model: Model, *, prior: bool = False) -> str | None:
    chosen = np.zeros(len(counts.won), dtype=np.bool_)
    chosen[row] = True
    own = counts.select(chosen)
    kept = own.total[0] > 0  # pairs that only the part met are no pairs of the rest
    ties = LAWS[model].parameter is not None
    if ties and not own.tied.any():
        return "No answer is a tie."
    own = Counts(
        own.n, own.first[kept], own.second[kept], own.won[:, kept], own.lost[:, kept], own.tied[:, kept], own.ordered
    )
    result = find_separation(own, items, ties=ties, prior=prior)
    return result.sentences[0] if result else None
