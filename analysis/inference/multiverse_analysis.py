"""Do the conclusions depend on how the answers were analysed? The classes by every choice: a multiverse [Steegen2016].

The choices are the law, the covariance, the correction for multiple comparisons, and which observer is left out. Each
law is fitted once to all answers and once without each observer, in one batch; each covariance is made once for each
fit; corrections and classes then cost little. How often a conclusion stands is its share of all analyses that can be
made.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.choices import Adjust
from analysis.classes.classes import (
    Letters,
    TooManyClasses,
    best_first,
    check_level,
    labelled,
    letter_display,
    numbered,
)
from analysis.classes.conclusions import MAJORITY, verdict_of
from analysis.classes.multiplicity import ADJUSTMENTS, MAXZ_SEED, corrected, single_step, two_sided_p
from analysis.comparisons.comparisons import observer_parts
from analysis.covariance.laplacian import pair_variances
from analysis.covariance.shrinkage import Spread
from analysis.errors import ResultsError
from analysis.inference.differences import check_fitted
from analysis.inference.left_out import LeftOut, left_out
from analysis.scaling.clustered import of_contributions
from analysis.scaling.counts import Answers
from analysis.scaling.jeffreys import Jeffreys
from analysis.scaling.laws import LAWS, Model, models_beside
from analysis.scaling.newton import Point, joint_covariance
from analysis.scaling.profile import exchange_p, penalised_top, scaled, signed_roots, why_not_profiled, wins_by_observer
from analysis.scaling.result import CovarianceKind
from analysis.scaling.sandwich import Contributions, contributions
from analysis.scaling.scores import Scores
from documents import Finding
from documents.arrays import Floats, Indices
from documents.text import JsonResult, counted

MOST_ITEMS = 60
MOST_LEFT_OUT = 100
MAXZ_SAMPLES = 10_000


@dataclass(frozen=True, slots=True)
class AnalysisVariant(JsonResult):
    """One way to analyse the answers, and the classes that it gives, in the order of the items."""

    model: Model
    covariance: CovarianceKind
    adjust: Adjust
    left_out: str
    labels: tuple[str, ...]
    number: int
    json_keys: ClassVar = {"labels": "classes", "number": "number_of_classes"}


@dataclass(frozen=True, slots=True)
class PairConclusion(JsonResult):
    """One pair: whether ``first``, the stronger one, is distinguished from ``second`` in the analysis that was chosen.

    ``stands`` is the share (0 to 1) of all analyses that conclude the same; ``reversed_share`` is the share that report
    a significant difference the other way round.
    """

    first: str
    second: str
    differs: bool
    stands: float
    reversed_share: float
    json_keys: ClassVar = {"reversed_share": "reversed"}


@dataclass(frozen=True, slots=True)
class ItemConclusion(JsonResult):
    """One item: its class in the analysis that was chosen, and the share (0 to 1) of all analyses with the same."""

    name: str
    label: str
    stands: float
    json_keys: ClassVar = {"label": "class"}


@dataclass(frozen=True, slots=True)
class ChoiceEffect(JsonResult):
    """What one choice does: the share of conclusions about pairs, over all analyses with it, that are the chosen ones'.

    ``choice`` is ``model``, ``covariance``, ``adjust`` or ``left_out``.
    """

    choice: str
    value: str
    stands: float


@dataclass(frozen=True, slots=True)
class Multiverse(JsonResult):
    """Every analysis, and how often the conclusions of the one that was chosen stand.

    Attributes
    ----------
    items
        Names of the items, best first, in the order of the labels of each analysis.
    analyses
        Every analysis that could be made.
    pairs, by_item, number, number_stands
        The conclusions of the chosen analysis, and how often each stands: of each pair, each item, and the number of
        classes.
    numbers
        How many analyses gave how many classes.
    choices
        What each choice does; of observers left out the one who matters most comes first.
    skipped
        Analyses that could not be made, with the reason.
    fits, fits_spared
        Fits that were made, and those that were not since several analyses share one.
    alpha
        Level of all tests.
    """

    items: tuple[str, ...]
    analyses: tuple[AnalysisVariant, ...]
    pairs: tuple[PairConclusion, ...]
    by_item: tuple[ItemConclusion, ...]
    number: int
    number_stands: float
    numbers: dict[int, int]
    choices: tuple[ChoiceEffect, ...]
    skipped: tuple[tuple[str, str], ...]
    fits: int
    fits_spared: int
    alpha: float
    json_keys: ClassVar = {"reasons": "skipped"}
    json_names: ClassVar = (
        "alpha items warning pairs by_item number_of_classes choices reasons fits fits_spared analyses"
    )

    @property
    def sentence(self) -> str:
        """How often the conclusions stand."""
        always = sum(pair.stands == 1 for pair in self.pairs)
        least = min(self.pairs, key=lambda pair: pair.stands)
        words = (
            f"In {len(self.analyses):,} analyses, {always} of {len(self.pairs)} pairs have the same conclusion in all; "
            f"{counted(self.number, 'class', 'classes')} in {self.number_stands:.0%}."
        )
        if always < len(self.pairs):
            words += f" Least often: {least.first} and {least.second} {verdict_of(least.differs)} ({least.stands:.0%})."
        return f"{words} {self.warning}".rstrip()

    @property
    def warning(self) -> str:
        """Which conclusions most of the analyses contradict, in a sentence; empty if there are none."""
        best = self.by_item[0]
        weak = [("the number of classes", self.number_stands)] if self.number_stands < MAJORITY else []
        weak += [(f"the class of {best.name}, the best", best.stands)] if best.stands < MAJORITY else []
        pairs = sum(pair.stands < MAJORITY for pair in self.pairs)
        parts = [f"{what} ({stands:.0%})" for what, stands in weak]
        parts += [f"{pairs} of {len(self.pairs)} verdicts on pairs"] if pairs else []
        if not parts:
            return ""
        return f"Stands in a minority of its own {len(self.analyses):,} analyses: {', '.join(parts)}."

    @property
    def number_of_classes(self) -> dict[str, Any]:
        """The chosen number, in what share of analyses it stands, and how many analyses have each."""
        analyses = {str(number): times for number, times in sorted(self.numbers.items())}
        return {"chosen": self.number, "stands": self.number_stands, "analyses": analyses}

    @property
    def reasons(self) -> list[dict[str, str]]:
        """Which analyses were skipped, and why."""
        return [{"analyses": name, "why": why} for name, why in self.skipped]


def multiverse(
    scores: Scores,
    *,
    models: Sequence[Model] | None = None,
    adjustments: Sequence[Adjust] = ADJUSTMENTS,
) -> Multiverse:
    """Return the classes by every law, covariance and correction, with each observer left out in turn.

    Parameters
    ----------
    scores
        The analysis that was chosen, of at most 60 items: its level, and its order effect if it has one, are those of
        all analyses. Above 100 observers, 20 parts of them are left out in turn.
    models
        The laws; by default ``bradley-terry`` and ``thurstone``, and where there are ties ``davidson`` and
        ``rao-kupper`` too.
    adjustments
        The corrections for multiple comparisons.

    Returns
    -------
    Multiverse
        How often each conclusion stands, and every analysis.

    Raises
    ------
    ResultsError
        If ``scores`` have no classes, there are too many items, a choice is unknown, or no analysis can be made.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> from analysis.scaling import score
    >>> votes = {"1": "abcbac", "2": "abbcac", "3": "bacbac", "4": "abbcca"}  # winner, loser, ...
    >>> answers = [Answer(v[i], v[i + 1], observer=name) for name, v in votes.items() for i in (0, 2, 4)]
    >>> result = multiverse(score(from_answers(answers)))
    >>> len(result.analyses), result.number, result.number_stands
    (160, 1, 1.0)
    """
    check_fitted(scores)
    comparisons, classes, n = scores.comparisons, scores.classes, len(scores.comparisons.items)
    if n > MOST_ITEMS:
        what = f"there are {n} items, more than {MOST_ITEMS}"
        raise ResultsError(Finding(what, remedy="compare the analyses of fewer items"))
    if classes is None:
        raise ResultsError(Finding("there are too many classes to compare", remedy="compare fewer items"))
    check_level(classes.alpha)
    ties = comparisons.ties > 0
    laws = list(models) if models is not None else models_beside(scores.fit.model, ties=ties)
    for model in laws:
        LAWS.wanted(model, "model", ResultsError)
    if unknown := [name for name in adjustments if name not in ADJUSTMENTS]:
        raise ResultsError(Finding(f"there is no '{unknown[0]}'", remedy="expected one of: " + ", ".join(ADJUSTMENTS)))
    people = len(comparisons.observers)
    part, names = observer_parts(comparisons.observers, MOST_LEFT_OUT)
    kinds: list[CovarianceKind] = list(get_args(CovarianceKind)) if people > 1 else ["model"]
    critical: dict[tuple[Model, CovarianceKind], float] = {}
    analyses: list[AnalysisVariant] = []
    verdicts: list[NDArray[np.int8]] = []
    skipped: list[tuple[str, str]] = []
    known_classes: dict[bytes, Letters] = {}
    fits = spared = 0
    order = np.array(scores.order, dtype=np.intp)
    first, second = np.triu_indices(n, 1)
    for model in laws:
        case = left_out(comparisons, model, part, order_effect=scores.fit.counts.ordered)
        point, done = case.fitted(np.zeros(len(case.why), dtype=np.bool_))
        inverses, roots = _inverses(case, point, done), _roots(case, point, done)
        for row in range(len(case.why) if people > 1 else 1):
            if not done[row]:
                why = case.why[row] or "the fit did not converge"
                skipped.append((f"{model}, {names[row]} left out", why))
                continue
            fits += 1
            counts = case.counts.select(np.arange(len(done)) == row)
            own = Point(point.theta[[row]], point.k[[row]], point.order[[row]])
            answers = _without(case, row, part)
            theta = own.theta[0]
            difference = theta[first] - theta[second]
            each = None
            if len(np.unique(answers.observer)) > 1:
                each = contributions(counts, answers, LAWS[model], own, inverses[row])
            wins = wins_by_observer(counts, answers) if each and row in roots else None
            exchanged = 1.0 if wins is None else exchange_p(wins[None])[0]
            apart = pair_variances(inverses[row][:n, :n])
            for kind in kinds:
                if kind != "model" and each is None:
                    skipped.append((f"{model}, {kind}, {names[row]} left out", "there are fewer than two observers"))
                    continue
                covariance, df, spread = _covariance(kind, n, each, inverses[row])
                variance = pair_variances(covariance[:n, :n])
                # Where there are no signed roots, the Wald test: sqrt(apart) is then the model's standard error.
                root = roots[row] if row in roots else difference / np.sqrt(apart)
                z = np.abs(scaled(root, variance / apart))
                plain = two_sided_p(z, df) if kind == "model" else np.minimum(two_sided_p(z, df), exchanged)
                for adjust in adjustments:
                    if adjust != "maxz":
                        differs = corrected(plain.copy(), adjust) <= classes.alpha
                    elif spread is None:
                        differs = single_step(z, covariance[:n, :n], MAXZ_SAMPLES) <= classes.alpha
                    else:  # one critical value serves all who are left out
                        if (model, kind) not in critical:
                            largest = spread.largest(MAXZ_SAMPLES, np.random.default_rng(MAXZ_SEED))
                            critical[model, kind] = float(np.quantile(largest, 1 - classes.alpha))
                        differs = z >= critical[model, kind]
                    try:
                        labels, number = _classes(differs, theta, known_classes)
                    except TooManyClasses as too_many:
                        skipped.append((f"{model}, {kind}, {adjust}, {names[row]} left out", str(too_many)))
                        continue
                    spared += 1
                    analyses.append(
                        AnalysisVariant(model, kind, adjust, names[row], tuple(labels[item] for item in order), number)
                    )
                    verdicts.append((differs * np.sign(difference)).astype(np.int8))
    if not analyses:
        raise ResultsError(Finding(f"no analysis can be made: {skipped[0][1]}", remedy="collect more answers"))
    chosen = np.sign(scores.fit.theta[first] - scores.fit.theta[second]) * (classes.pair_p <= classes.alpha)
    return _concluded(scores, analyses, np.array(verdicts), chosen, tuple(skipped), fits, spared - fits)


def _inverses(case: LeftOut, point: Point, done: NDArray[np.bool_]) -> dict[int, Floats]:
    """Return the inverse information of each row that was fitted."""
    rows = np.flatnonzero(done)
    if not len(rows):
        return {}
    joint = joint_covariance(case.counts.select(done), LAWS[case.model], point.select(done))
    return dict(zip(rows.tolist(), joint, strict=True))


def _roots(case: LeftOut, point: Point, done: NDArray[np.bool_]) -> dict[int, Floats]:
    """Return the signed roots of all pairs in each row that was fitted; none where tests are by standard errors."""
    counts = case.counts.select(done)
    if not done.any() or why_not_profiled(counts):
        return {}
    likelihood = Jeffreys(counts, LAWS[case.model])
    parts = [point.theta, point.k, point.order]
    own = [True, likelihood.law.parameter is not None, counts.ordered]
    start = np.hstack([part[done] for part, there in zip(parts, own, strict=True) if there])
    roots = signed_roots(likelihood, penalised_top(likelihood, start))
    return dict(zip(np.flatnonzero(done).tolist(), roots, strict=True))


def _without(case: LeftOut, row: int, part: Indices) -> Answers:
    """Return the answers of a row, ties only where the law has a place for them."""
    own = case.answers
    kept = part[own.observer] != row - 1
    if LAWS[case.model].parameter is None:
        kept &= own.outcome != 2
    return Answers(own.pair[kept], own.outcome[kept], own.observer[kept], own.count[kept])


def _covariance(
    kind: CovarianceKind, n: int, each: Contributions | None, inverse: Floats
) -> tuple[Floats, Floats | None, Spread | None]:
    """Return a covariance, the degrees of freedom of each pair, and what a clustered covariance comes from."""
    if kind == "model" or each is None:
        return inverse, None, None
    clustered = of_contributions(kind, n, each, inverse)
    return clustered.joint, clustered.pair_freedom, clustered.spread


def _classes(differs: NDArray[np.bool_], theta: Floats, known: dict[bytes, Letters]) -> tuple[tuple[str, ...], int]:
    """Return each item's label and the number of classes; ``known`` keeps the classes of each set of differences."""
    n, key = len(theta), np.packbits(differs).tobytes()
    if key not in known:
        matrix = np.zeros((n, n), dtype=np.bool_)
        matrix[np.triu_indices(n, 1)] = differs
        known[key] = letter_display(matrix | matrix.T)
    members = numbered(known[key], theta)
    return labelled(members, n), len(members)


def _concluded(
    scores: Scores,
    analyses: list[AnalysisVariant],
    verdicts: NDArray[np.int8],
    chosen: Floats,
    skipped: tuple[tuple[str, str], ...],
    fits: int,
    spared: int,
) -> Multiverse:
    classes, n = scores.classes, len(scores.comparisons.items)
    assert classes is not None
    names = scores.comparisons.items
    agrees = verdicts == chosen
    stands, against = agrees.mean(axis=0), (verdicts == -np.sign(chosen)).mean(axis=0) * (chosen != 0)
    theta = scores.fit.theta
    rank = {item: place for place, item in enumerate(best_first(theta))}
    pairs = []
    for row, (i, j) in enumerate(zip(*np.triu_indices(n, 1), strict=True)):
        better, worse = sorted((int(i), int(j)), key=rank.__getitem__)
        line = PairConclusion(names[better], names[worse], bool(chosen[row]), float(stands[row]), float(against[row]))
        pairs.append((rank[better], rank[worse], line))
    pairs.sort(key=lambda entry: entry[:2])
    items = []
    for place, item in enumerate(scores.order):
        label = classes.labels[item]
        same = sum(analysis.labels[place] == label for analysis in analyses) / len(analyses)
        items.append(ItemConclusion(names[item], label, same))
    numbers = Counter(analysis.number for analysis in analyses)
    number = len(classes.members)
    return Multiverse(
        items=tuple(names[item] for item in scores.order),
        analyses=tuple(analyses),
        pairs=tuple(line for _, _, line in pairs),
        by_item=tuple(items),
        number=number,
        number_stands=numbers[number] / len(analyses),
        numbers=dict(sorted(numbers.items())),
        choices=_effects(analyses, agrees.mean(axis=1)),
        skipped=skipped,
        fits=fits,
        fits_spared=spared,
        alpha=classes.alpha,
    )


def _effects(analyses: list[AnalysisVariant], agrees: Floats) -> tuple[ChoiceEffect, ...]:
    """Return the share of conclusions that stand, by each value of each choice."""
    effects = []
    for choice in ("model", "covariance", "adjust", "left_out"):
        values: dict[str, list[float]] = {}
        for analysis, share in zip(analyses, agrees.tolist(), strict=True):
            values.setdefault(str(getattr(analysis, choice)), []).append(share)
        lines = [ChoiceEffect(choice, value, float(np.mean(shares))) for value, shares in values.items()]
        effects += sorted(lines, key=lambda line: line.stands) if choice == "left_out" else lines
    return tuple(effects)
