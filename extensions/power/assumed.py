"""What is assumed of stimuli and observers to simulate studies: scores, and how much observers differ."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons import Comparisons, from_sessions, read_any
from analysis.errors import ResultsError
from analysis.records import pool, read_results
from analysis.simulation import TYPICAL_SD, ScoresOf
from documents import Finding
from documents.arrays import Floats
from documents.files import read_regular
from documents.tables import ENDINGS
from documents.text import JsonResult
from runner.observers import BehaviourSpec, read_scored_observer
from runner.reports import PairDesign, ScoresOptions, score_table

_MOST_BYTES = 100_000_000

DEFAULT_SPREAD_NATS = 2.0
OTHER_SDS = 0.0, 1.5
LEAST_APART = 0.005
ANSWERS = (*ENDINGS, ".jsonl")


@dataclass(frozen=True, slots=True)
class ObserverSpread(JsonResult):
    """How much observers differ.

    Attributes
    ----------
    sd
        Standard deviation of an item's strength between observers, in nats.
    source
        ``given``, ``measured`` in earlier answers, or ``assumed``.
    low, high
        95 % interval of a measured one; None otherwise, or where the answers set no limit.
    others
        Which others to compare with.
    notes
        Sentences for a reader.
    """

    sd: float
    source: Literal["given", "measured", "assumed"]
    low: float | None = None
    high: float | None = None
    others: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()
    json_keys: ClassVar = {"others": None, "notes": None}


MeasuredSpread = tuple[float, float, float | None]  # estimate, low, high


def observer_spread_of(
    sd: float | None,
    file: Path | None,
    measured: MeasuredSpread | None,
    *,
    with_simulated: bool = False,
    keep_na: bool = False,
) -> ObserverSpread:
    """Return how much observers differ: as given, as measured in earlier answers, or a typical value, with a note.

    Parameters
    ----------
    sd
        The value given, in nats.
    file
        Results, or a table of comparisons, to measure it in.
    measured
        What the answers that the assumed scores come from say.
    with_simulated
        Whether simulated observers count beside people in results.
    keep_na
        Whether words for missing values in a table are names.

    Raises
    ------
    InputError
        If the earlier answers cannot be read, or do not say how much observers differ.
    """
    if sd is not None and file is not None:
        what = "the spread between observers is both given and to be measured"
        raise ResultsError(Finding(what, remedy="give one of --observer-sd and --observers-from"))
    if sd is not None:
        return ObserverSpread(sd, "given")
    told: tuple[str, ...] = ()
    if file is not None:
        answers, told = earlier_answers(file, with_simulated=with_simulated, keep_na=keep_na)
        measured = _measured(_fitted(answers, random=True))
    if measured is None:
        note = (
            f"Assumed: observers differ by {TYPICAL_SD:g} nats (not measured). Name earlier results with "
            "--observers-from, or give --observer-sd."
        )
        return ObserverSpread(TYPICAL_SD, "assumed", others=OTHER_SDS, notes=(note,))
    estimate, low, high = measured
    to = "with no upper limit" if high is None else f"to {high:.2f}"
    note = f"The observers of the earlier answers differ by {estimate:.2f} nats (95 % interval from {low:.2f} {to})."
    ends = (low, high) if high is not None else (low, max(OTHER_SDS[-1], 2 * estimate))
    others = tuple(end for end in ends if abs(end - estimate) > LEAST_APART)
    return ObserverSpread(estimate, "measured", low, high, others, (*told, note))


def unsimulated(behaviour: BehaviourSpec, design: PairDesign) -> list[str]:
    """Return a sentence on the behaviour of simulated observers, beside lapses, that the simulation leaves out."""
    left_out = []
    if behaviour.position_bias:
        left_out.append("their preference for the first position")
    if behaviour.fatigue is not None:
        left_out.append("their fatigue")
    if behaviour.ties is not None and design.ties:
        left_out.append("their ties")
    return [f"Of the observers in the file, {' and '.join(left_out)} are not simulated."] if left_out else []


@dataclass(frozen=True, slots=True, eq=False)
class AssumedScores:
    """Log scores ``theta`` (n,) in nats, which pairs differ (``differs``, (P,)), a ``lapse_rate``, and notes.

    ``scores_of`` says whose scores they are; ``spread`` is how much observers differ, where the same answers say it.
    """

    theta: NDArray[np.float64]
    differs: NDArray[np.bool_]
    lapse_rate: float
    notes: tuple[str, ...]
    scores_of: ScoresOf = "average"
    spread: MeasuredSpread | None = None


def assume(
    design: PairDesign,
    *,
    scores: Path | None,
    simulate: Path | None,
    spread_nats: float | None,
    with_simulated: bool = False,
    keep_na: bool = False,
) -> AssumedScores:
    """Return the scores that the given source gives; equal steps over 2 nats without a source.

    A file of simulated observers gives scores and, where it names them for all stimuli, their classes; ``simulate``
    also takes its lapses. A file that ends with .json is what `cyclopean scores --json` or `report --json` printed. A
    table that ends with .csv, or results, are fitted with observers as a distribution where they name several: these
    scores are the typical observer's, all others those of the average answer. In results, simulated observers count
    beside people only ``with_simulated``; in a table, words for missing values are names only with ``keep_na``.

    Raises
    ------
    InputError
        If a file is wrong, or has no score for a stimulus.
    """
    ties = ("Observers are simulated without ties.",) if design.ties else ()
    if scores is not None and scores.suffix.lower() == ".json":
        return _by_printed(_printed(scores), str(scores), design, ties)
    if scores is not None and (scores.is_dir() or scores.suffix.lower() in ANSWERS):
        answers, told = earlier_answers(scores, with_simulated=with_simulated, keep_na=keep_na)
        return _by_printed(_fitted(answers, random=len(answers.observers) > 1), str(scores), design, (*told, *ties))
    file = scores if simulate is None else simulate
    if file is None:
        nats = DEFAULT_SPREAD_NATS if spread_nats is None else spread_nats
        theta = np.zeros(len(design.items))
        for _, members in design.groups or (("", tuple(range(len(design.items)))),):
            theta[list(members)] = spread_theta(len(members), nats)
        each = " within each group" if design.groups else ""
        steps = f"Scores are assumed at equal steps over {nats:g} nats{each}, in the recipe's order"
        odds = f": the best is preferred to the worst {100 / (1 + np.exp(-nats)):.0f} times in 100."
        return AssumedScores(theta, differing_pairs(theta), 0.0, (steps + odds, *ties))
    spec = read_scored_observer(file, design.items)
    theta = score_theta(spec.scores, design.items)
    labels = [spec.stimuli[name].perceptual_class for name in design.items]
    left_out = tuple(unsimulated(spec, design)) if simulate is not None else ()
    return AssumedScores(
        theta, differing_pairs(theta, labels), spec.lapse_rate if simulate is not None else 0.0, (*left_out, *ties)
    )


def earlier_answers(
    path: Path, *, with_simulated: bool = False, keep_na: bool = False
) -> tuple[Comparisons, tuple[str, ...]]:
    """Return the comparisons of a table that ends with .csv, or of results, and notes on what they leave out.

    Raises
    ------
    InputError
        If they cannot be read.
    """
    if path.is_file() and path.suffix.lower() not in ANSWERS:
        what = "this is neither a table of comparisons nor results"
        raise ResultsError(Finding(what, str(path), remedy="name a TABLE.csv, or a folder of results"))
    if path.suffix.lower() in ENDINGS:
        table = read_any(path, keep_na=keep_na)
        return table.comparisons, table.warnings
    pooled = pool(read_results(path), with_simulated=with_simulated)
    return from_sessions(pooled.sessions), pooled.notes


def _fitted(comparisons: Comparisons, *, random: bool) -> dict[str, Any]:
    """Return what `cyclopean scores --json` prints of the items, with ``--observers random`` or without."""
    options = ScoresOptions(observers="random" if random else "alike")
    printed: dict[str, Any] = score_table(comparisons, options).value.to_json()
    return printed


def _measured(printed: dict[str, Any]) -> MeasuredSpread:
    """Return how much observers differ, of what is printed with ``--observers random``."""
    spread = printed["spread"]
    return spread["sd"], spread["low"], spread["high"]


def _printed(file: Path) -> Any:
    remedy = "give what 'cyclopean scores --json' printed"
    try:
        return json.loads(read_regular(file, _MOST_BYTES, error=ResultsError))
    except (ValueError, RecursionError) as error:
        raise ResultsError(Finding(f"this is no JSON: {error}", str(file), remedy=remedy)) from None


def _by_printed(printed: Any, file: str, design: PairDesign, notes: tuple[str, ...]) -> AssumedScores:
    """Return what `cyclopean scores --json` printed, of whichever model of observers, with groups or without."""
    values = printed if isinstance(printed, dict) else {}
    groups = values["groups"] if isinstance(values.get("groups"), list) else [values]
    lists = [group.get("items") if isinstance(group, dict) else None for group in groups]
    if not all(isinstance(items, list) and all(_is_item(item) for item in items) for items in lists):
        remedy = "give what 'cyclopean scores --json' printed"
        raise ResultsError(Finding("there is no list of items with names", file, remedy=remedy))
    items = [item for group in lists for item in group or ()]
    random = values.get("observers") == "random"
    scores = {str(item["name"]): item.get("theta" if random else "score") for item in items}
    empty = [name for name, score in scores.items() if isinstance(score, bool) or not isinstance(score, int | float)]
    if empty:
        raise ResultsError(Finding(f"'{empty[0]}' has no score", file, remedy="assume one in a file of observers"))
    if not random:
        theta = score_theta({name: float(score) for name, score in scores.items()}, design.items)
        return AssumedScores(theta, differing_pairs(theta), 0.0, notes)
    theta = score_theta({name: float(np.exp(score)) for name, score in scores.items()}, design.items)
    return AssumedScores(theta, differing_pairs(theta), 0.0, notes, "typical", _measured(values))


def _is_item(item: object) -> bool:
    return isinstance(item, dict) and "name" in item


def spread_theta(count: int, nats: float) -> Floats:
    """Return ``count`` log scores at equal steps over ``nats``, best first, with mean 0.

    Parameters
    ----------
    count
        Number of items, at least 0.
    nats
        Difference between the best and the last item in nats, at least 0.

    Returns
    -------
    NDArray[np.float64]
        Shape (count,): log scores in nats, from nats / 2 down to −nats / 2.

    Raises
    ------
    ResultsError
        If ``nats`` is negative or not finite.

    Examples
    --------
    >>> spread_theta(3, 2.0).tolist()
    [1.0, 0.0, -1.0]
    """
    if not (np.isfinite(nats) and nats >= 0):
        raise ResultsError(Finding(f"the spread is {nats:g} nats", remedy="give 0 or more, such as 2"))
    return np.linspace(nats / 2, -nats / 2, count)


def score_theta(scores: Mapping[str, float], items: Sequence[str]) -> Floats:
    """Return log scores of ``items`` with mean 0, in nats.

    Parameters
    ----------
    scores
        Score of each item by name, above 0 and finite; only ratios between scores matter.
    items
        Names of the n items, in the order wanted.

    Returns
    -------
    NDArray[np.float64]
        Shape (n,): natural logarithms of the scores in nats, less their mean.

    Raises
    ------
    ResultsError
        If an item has no score, or a score is not positive and finite.

    Examples
    --------
    >>> score_theta({"a": 4.0, "b": 1.0}, ["b", "a"]).round(3).tolist()
    [-0.693, 0.693]
    """
    missing = [name for name in items if name not in scores]
    if missing:
        what = f"no score is assumed for {', '.join(missing[:8])}"
        raise ResultsError(Finding(what, remedy="add each with its score"))
    values = np.array([scores[name] for name in items], dtype=np.float64)
    wrong = [name for name, value in zip(items, values.tolist(), strict=True) if not (np.isfinite(value) and value > 0)]
    if wrong:
        raise ResultsError(Finding(f"the score of {wrong[0]} is {scores[wrong[0]]:g}", remedy="scores are above zero"))
    theta = np.log(values)
    return np.asarray(theta - theta.mean())


def differing_pairs(theta: Floats, labels: Sequence[str] = ()) -> NDArray[np.bool_]:
    """Return which pairs differ in the assumed classes, shape (P,).

    Parameters
    ----------
    theta
        Shape (n,): assumed log scores.
    labels
        The class of each item, such as "3+4"; two items that share no class differ. Without labels, or where a label
        is empty, items differ unless their scores are equal.

    Returns
    -------
    NDArray[np.bool_]
        Shape (P,), P = n (n − 1) / 2: True where a pair differs, in the order of ``numpy.triu_indices``.

    Examples
    --------
    >>> differing_pairs(np.array([1.0, 0.0, 0.0])).tolist()
    [True, True, False]
    >>> differing_pairs(np.array([1.0, 0.5, 0.0]), ["1", "1+2", "2"]).tolist()
    [False, True, False]
    """
    first, second = np.triu_indices(len(theta), 1)
    if not labels or not all(labels):
        return np.asarray(theta[first] != theta[second])
    classes = [frozenset(label.split("+")) for label in labels]
    pairs = zip(first.tolist(), second.tolist(), strict=True)
    return np.array([not classes[i] & classes[j] for i, j in pairs], dtype=np.bool_)
