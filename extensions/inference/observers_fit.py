"""Fit paired comparison with observers as a distribution: population, spread between observers, each observer."""

from __future__ import annotations

import numpy as np

from analysis.choices import Adjust
from analysis.classes import check_level
from analysis.comparisons import Comparisons, split_groups
from analysis.errors import ResultsError
from analysis.scaling import LAWS, MODELS, Counts, Model, find_separation, maximise
from documents import Finding, one_blas_thread
from documents.arrays import Floats, Indices
from extensions.inference.elimination import Blocks
from extensions.inference.observers_result import GroupScores, HierarchicalFit
from extensions.inference.propagation import GroupAnswers
from extensions.inference.spread import SpreadProfile, estimate_spread, mapped


@one_blas_thread()
def fit_observers(
    comparisons: Comparisons, model: Model = "bradley-terry", *, alpha: float = 0.05, adjust: Adjust = "holm"
) -> HierarchicalFit:
    """Fit ``model`` to observers who differ: observer o has the strengths θ + b_o, each b_oi normal with sd τ.

    θ are the strengths *of the typical observer*. The plain fit's are of the average answer, and smaller: observers who
    differ cancel each other. τ is at the maximum of the adjusted marginal likelihood, by expectation propagation, as
    `extensions.inference.spread` and `extensions.inference.propagation` say. Groups of items have scales of their own
    and one τ; an observer's effects in two groups are independent.

    Parameters
    ----------
    comparisons
        Who was preferred over whom, by which of two observers or more. Ties are left out.
    model
        ``bradley-terry`` [Bradley1952], or ``thurstone``, Case V [Thurstone1927].
    alpha, adjust
        Significance level of a difference, and correction for multiple comparisons, of the perceptual classes.

    Returns
    -------
    HierarchicalFit
        For each group the strengths of the n items (in nats, or standard deviations for ``thurstone``) with their
        covariance; τ with its interval; and methods for each observer's scores and for a new observer's answers.

    Raises
    ------
    ResultsError
        If ``alpha`` is out of range, the model is another, fewer than two observers are named, a group's items are not
        linked or are separated, or the answers set no upper limit to τ.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> agree = [Answer("a", "b", 8, "anna"), Answer("b", "a", 2, "anna"), Answer("a", "b", 7, "ben")]
    >>> fit = fit_observers(from_answers([*agree, Answer("b", "a", 3, "ben")]))
    >>> fit.groups[0].theta.round(2).tolist(), fit.spread.estimate
    ([0.55, -0.55], 0.0)
    """
    check_level(alpha)
    law = LAWS.wanted(model, "model", ResultsError)
    if law.parameter:
        remedy = "use one of: " + ", ".join(name for name in MODELS if not LAWS[name].parameter)
        raise ResultsError(Finding(f"the model '{model}' has no distribution of observers", remedy=remedy))
    parts = split_groups(comparisons) if comparisons.groups else (("", comparisons),)
    for name, part in parts:
        _check_observers(part, name)

    def prepared(of: tuple[str, Comparisons]) -> tuple[GroupAnswers, Floats]:
        name, part = of
        answers, total = _answers(part)
        _check_items(total, part, name)
        return answers, maximise(total, law).theta[0]

    groups, plain = zip(*mapped(prepared, parts, size=len(comparisons.winner)), strict=True)
    profile = SpreadProfile(groups, law, plain)
    estimate = estimate_spread(profile)
    if estimate is None:
        what = "the answers set no upper limit to how much observers differ: hardly any observer contradicts himself"
        remedy = "let each observer answer more pairs, or pairs more than once; or fit without '--observers random'"
        raise ResultsError(Finding(what, remedy=remedy))
    scores = tuple(
        GroupScores(
            name=name,
            items=part.items,
            observers=tuple(part.observers[who] for who in np.unique(part.observer).tolist()),
            answers=answers,
            theta=theta,
            covariance=covariance,
            plain_theta=strengths,
            sites=sites,
        )
        for (name, part), answers, theta, covariance, strengths, sites in zip(
            parts, groups, estimate.at.theta, estimate.covariance, plain, profile.sites, strict=True
        )
    )
    return HierarchicalFit(
        model=model,
        groups=scores,
        spread=estimate.spread,
        scale_variance=estimate.scale_variance,
        log_likelihood=estimate.at.log_z,
        sweeps=profile.sweeps,
        converged=profile.converged,
        ties_left_out=comparisons.ties,
        alpha=alpha,
        adjust=adjust,
    )


def _answers(part: Comparisons) -> tuple[GroupAnswers, Counts]:
    """Return each observer's counts of each pair, and all observers' together."""
    n = len(part.items)
    low, high = np.minimum(part.winner, part.loser), np.maximum(part.winner, part.loser)
    _, observer = np.unique(part.observer, return_inverse=True)
    key, place = np.unique((observer * n + low) * n + high, return_inverse=True)
    won = _summed(place, part.count * (part.winner == low), len(key))
    lost = _summed(place, part.count * (part.winner != low), len(key))
    rest, second = np.divmod(key, n)
    who, first = np.divmod(rest, n)
    nodes, at = np.unique(np.concatenate([who * n + first, who * n + second]), return_inverse=True)
    blocks = Blocks(at[: len(key)], at[len(key) :], nodes // n, nodes % n, n)
    none = np.broadcast_to(np.zeros(1), (1, len(key)))
    pairs, total = np.unique(first * n + second, return_inverse=True)
    all_won, all_lost = (_summed(total, count, len(pairs))[None] for count in (won, lost))
    together = Counts(n, pairs // n, pairs % n, all_won, all_lost, np.zeros_like(all_won))
    return GroupAnswers(Counts(n, first, second, won[None], lost[None], none), blocks), together


def _summed(place: Indices, values: Floats, size: int) -> Floats:
    return np.asarray(np.bincount(place, values, size), np.float64)


def _check_observers(part: Comparisons, group: str) -> None:
    where = f" in the group '{group}'" if group else ""
    names = {part.observers[who] for who in np.unique(part.observer).tolist()}
    if not names - {""}:
        raise ResultsError(Finding(f"no observer is named{where}", remedy="add a column 'observer' to the table"))
    if "" in names:
        raise ResultsError(Finding(f"some answers{where} name no observer", remedy="fill the column 'observer'"))
    if len(names) < 2:
        what = f"all answers{where} are of one observer, '{names.pop()}'"
        raise ResultsError(Finding(what, remedy="a spread between observers needs two at least, better ten"))


def _check_items(total: Counts, part: Comparisons, group: str) -> None:
    where = f" in the group '{group}'" if group else ""
    if total.n < 2:
        raise ResultsError(Finding(f"there are fewer than two items{where}", remedy="compare two items at least"))
    separation = find_separation(total, part.items, ties=False)
    if separation is None:
        return
    remedy = "collect more answers, or fit without a distribution of observers: 'cyclopean scores --method map'"
    what = f"no finite scores of the typical observer{where}: " + " ".join(separation.sentences)
    raise ResultsError(Finding(what, remedy=remedy))
