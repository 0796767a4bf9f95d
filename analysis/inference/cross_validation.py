"""Which law predicts the answers of new observers best? Cross-validation over observers [Stone1974].

Each observer, or each of K folds of observers, is left out in turn; a law fitted to the others gives the log
probability of the answers that were left out. Their sum needs no count of parameters and no independence within an
observer. The difference between two laws has a standard error over observers.

So that laws with and without ties can be compared on all answers, a law without ties is given the share of ties among
the other observers' answers as the probability of a tie.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from analysis.comparisons.comparisons import Comparisons
from analysis.errors import ResultsError
from analysis.inference.left_out import LeftOut, left_out
from analysis.scaling.laws import LAWS, MODELS, Model, models_beside
from analysis.scaling.newton import Point
from documents import Finding
from documents.arrays import Floats, Indices
from documents.text import JsonResult

SEED = 2016
MOST_LEFT_OUT_ONE_BY_ONE = 30
FOLDS = 10


@dataclass(frozen=True, slots=True)
class PredictiveScore(JsonResult):
    """How well one model predicts observers it has not seen.

    Attributes
    ----------
    model, order_effect
        The model; ``order_effect`` says whether what being shown first adds is part of it.
    log_likelihood
        Σ log probability of all answers, each by the fit without its observer, in nats.
    per_answer
        The same per answer.
    difference, difference_se
        Mean over observers of the log probability of their answers, less that by the best model: at most 0 up to
        chance, and its standard error over observers.
    """

    model: Model
    order_effect: bool
    log_likelihood: float
    per_answer: float
    difference: float
    difference_se: float

    @property
    def name(self) -> str:
        """The model, and whether it has an order effect."""
        return f"{self.model} with order effect" if self.order_effect else self.model


@dataclass(frozen=True, slots=True, eq=False)
class ModelComparison(JsonResult):
    """Models by how well they predict new observers, the best first.

    Attributes
    ----------
    models
        A line for each model.
    by_observer
        Shape (observers, models): log probability of each observer's answers.
    chance
        Log probability per answer if all outcomes are equally likely.
    observers, folds
        How many observers there are, and in how many folds they were left out.
    penalised_folds
        In how many folds the other observers' answers were separated for some model, so that all models were fitted
        under a prior there.
    left_out
        Models that could not be compared, with the reason.
    """

    models: tuple[PredictiveScore, ...]
    by_observer: Floats
    chance: float
    observers: int
    folds: int
    penalised_folds: int
    left_out: tuple[tuple[str, str], ...]
    json_keys: ClassVar = {"chance": "chance_per_answer", "reasons": "left_out"}
    json_names: ClassVar = "models chance observers folds penalised_folds reasons"

    @property
    def sentence(self) -> str:
        """Which model predicts best, and which of the others are clearly worse."""
        best, *others = self.models
        far = [other for other in others if other.difference + 2 * other.difference_se < 0]
        near = [other.name for other in others if other not in far]
        words = f"Answers of new observers are predicted best by {best.name}"
        words += f"; not distinguished from {', '.join(near)}" if near else ""
        words += f"; clearly worse: {', '.join(other.name for other in far)}" if far else ""
        return words + "."

    @property
    def reasons(self) -> list[dict[str, str]]:
        """Which models were left out, and why."""
        return [{"model": name, "why": why} for name, why in self.left_out]


def compare_models(
    comparisons: Comparisons,
    models: Sequence[Model] | None = None,
    *,
    order_effects: bool | None = None,
    folds: int | None = None,
    seed: int = SEED,
) -> ModelComparison:
    """Compare models by the cross-validated log likelihood of observers [Stone1974].

    Parameters
    ----------
    comparisons
        Who was preferred over whom, by which observer; at least three observers.
    models
        The models to compare; by default ``bradley-terry`` and ``thurstone``, and where there are ties ``davidson`` and
        ``rao-kupper`` too.
    order_effects
        Whether each model is compared with an order effect too; by default wherever every answer says which item was
        shown first.
    folds
        Number of folds, from 2 to the number of observers; by default each observer is a fold of their own up to 30
        observers, and there are 10 folds above.
    seed
        Random seed for the folds.

    Returns
    -------
    ModelComparison
        The models, the best first.

    Raises
    ------
    ResultsError
        If there are fewer than three observers, a choice is out of range, or no model can be fitted.

    Examples
    --------
    >>> from analysis.comparisons import Answer, from_answers
    >>> votes = {"1": "abcbac", "2": "abbcac", "3": "bacbac", "4": "abbcca"}  # winner, loser, ...
    >>> answers = [Answer(v[i], v[i + 1], observer=name) for name, v in votes.items() for i in (0, 2, 4)]
    >>> result = compare_models(from_answers(answers))
    >>> result.folds, {model.model for model in result.models} == {"bradley-terry", "thurstone"}
    (4, True)
    """
    people = len(comparisons.observers)
    if people < 3:
        what = f"models are compared by leaving observers out, and there are {people}"
        raise ResultsError(Finding(what, remedy="name three observers or more in the column 'observer'"))
    ties = comparisons.ties > 0
    chosen = list(models) if models is not None else models_beside(MODELS[0], ties=ties)
    for model in chosen:
        LAWS.wanted(model, "model", ResultsError)
    part = _parts(comparisons, folds, seed)
    both = _sides_known(comparisons) if order_effects is None else order_effects
    cases, left = [], []
    for model in dict.fromkeys(chosen):
        for order_effect in (False, True) if both else (False,):
            case = left_out(comparisons, model, part, order_effect=order_effect)
            cases.append((case, order_effect))
    plain = [case for case, order_effect in cases if not order_effect and LAWS[case.model].parameter is None]
    whole_is_sound = all(case.why[0] is None for case in plain)
    usable = []
    for case, order_effect in cases:
        why = case.why[0]
        if why is None or (not whole_is_sound and not order_effect and LAWS[case.model].parameter is None):
            usable.append((case, order_effect))
        else:
            left.append((_name(case.model, order_effect), why))
    penalised = np.zeros(int(part.max()) + 2, dtype=np.bool_)
    for case, _ in usable:
        penalised |= ~case.sound
    columns, kept = [], []
    for case, order_effect in usable:
        point, done = case.fitted(penalised)
        if not done[1:].all():
            fold = int(np.flatnonzero(~done[1:])[0])
            why = case.why[fold + 1] or "the fit did not converge"
            left.append((_name(case.model, order_effect), f"without fold {fold + 1}: {why}"))
            continue
        columns.append(_by_observer(case, point, part, comparisons, ties))
        kept.append((case.model, order_effect))
    if not kept:
        why = left[0][1] if left else "no model was asked for"
        raise ResultsError(Finding(f"no model can be compared: {why}", remedy="collect more answers"))
    return _compared(np.stack(columns, axis=1), kept, comparisons, part, int(penalised[1:].sum()), tuple(left))


def _name(model: Model, order_effect: bool) -> str:
    return f"{model} with order effect" if order_effect else model


def _sides_known(comparisons: Comparisons) -> bool:
    return bool((comparisons.winner_was_first >= 0).all() and (comparisons.tied.a_was_first >= 0).all())


def _parts(comparisons: Comparisons, folds: int | None, seed: int) -> Indices:
    """Return each observer's fold; observers go by name, so that the order of lines changes nothing."""
    people = len(comparisons.observers)
    number = folds if folds is not None else people if people <= MOST_LEFT_OUT_ONE_BY_ONE else FOLDS
    if not 2 <= number <= people:
        what = f"{number} folds were asked for"
        raise ResultsError(Finding(what, remedy=f"give a number from 2 to {people}, the number of observers"))
    order = np.array(sorted(range(people), key=lambda index: comparisons.observers[index]), dtype=np.intp)
    part = np.empty(people, dtype=np.intp)
    part[np.random.default_rng(seed).permutation(order)] = np.arange(people) % number
    return part


def _by_observer(case: LeftOut, point: Point, part: Indices, comparisons: Comparisons, ties: bool) -> Floats:
    """Return the log probability of each observer's answers by the fit without their fold, shape (observers,)."""
    logs, answers = case.log_chances(point), case.answers
    row = part[answers.observer] + 1
    terms = logs[answers.outcome, row, answers.pair]
    if ties and LAWS[case.model].parameter is None:
        size = int(part.max()) + 2
        tied = np.bincount(row, answers.count * (answers.outcome == 2), size)
        given = np.bincount(row, answers.count, size)
        share = ((tied.sum() - tied + 0.5) / (given.sum() - given + 1))[row]
        terms = np.where(answers.outcome == 2, np.log(share), terms + np.log1p(-share))
    return np.bincount(answers.observer, answers.count * terms, len(comparisons.observers)).astype(np.float64)


def _compared(
    by_observer: Floats,
    models: Sequence[tuple[Model, bool]],
    comparisons: Comparisons,
    part: Indices,
    penalised: int,
    left: tuple[tuple[str, str], ...],
) -> ModelComparison:
    total = by_observer.sum(axis=0)
    order = np.argsort(-total, kind="stable")
    people = len(by_observer)
    answers = float(comparisons.count.sum() + comparisons.tied.count.sum())
    behind = by_observer - by_observer[:, [order[0]]]
    error = behind.std(axis=0, ddof=1) / np.sqrt(people)
    lines = tuple(
        PredictiveScore(
            model=models[place][0],
            order_effect=models[place][1],
            log_likelihood=float(total[place]),
            per_answer=float(total[place] / answers),
            difference=float(behind[:, place].mean()),
            difference_se=float(error[place]),
        )
        for place in order.tolist()
    )
    chance = float(np.log(1 / 3 if comparisons.ties else 1 / 2))
    return ModelComparison(lines, by_observer[:, order], chance, people, int(part.max()) + 1, penalised, left)
