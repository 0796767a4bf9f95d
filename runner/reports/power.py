"""The power of an experiment: its design, the scores assumed, and studies simulated with them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.bootstrap import Covariance
from analysis.classes import Adjust
from analysis.errors import ResultsError
from analysis.power import (
    REPLICATES,
    SEED,
    TARGET,
    Interval,
    Needed,
    Plan,
    assumed_notes,
    check_target,
    chosen_pairs,
    differing_pairs,
    observers_needed,
    score_theta,
    simulate_power,
    spread_theta,
)
from documents import Finding
from runner.blocks.active_pairs import ActivePairsSpec
from runner.blocks.all_pairs import AllPairsSpec
from runner.blocks.block import chosen
from runner.errors import SessionError
from runner.observers.behaviour import BehaviourSpec
from runner.observers.observer_file import read_scored_observer
from runner.protocol.experiment import Experiment, read_experiment

DEFAULT_SPREAD_NATS = 2.0


@dataclass(frozen=True, slots=True)
class PowerOptions:
    """What is assumed about stimuli and observers, and how studies are simulated and tested.

    Attributes
    ----------
    observers
        Numbers of observers to try.
    scores, simulate, spread_nats
        Where the assumed scores come from, at most one of the three: a file of scores; simulated observers, with their
        lapses; equal steps over so many nats. Without any: equal steps over 2 nats.
    observer_sd
        Standard deviation in nats of each observer's own strength of each stimulus.
    lapse_rate
        Share (0 to 1) of random answers; None takes that of ``simulate``, or 0.
    pairs
        Names of the pairs that matter; without any, all pairs that should differ.
    target
        Power (0 to 1) that each of these pairs is to have.
    alpha, adjust
        Level and correction of the tests; None takes those of the experiment.
    covariance, interval
        Standard errors of the tests, and kind of the scores' intervals.
    replicates, seed
        Studies for each number of observers, and the random seed.
    scheduler, workers
        As `analysis.power.compute.compute`.
    """

    observers: tuple[int, ...]
    scores: Path | None = None
    simulate: Path | None = None
    spread_nats: float | None = None
    observer_sd: float = 0.0
    lapse_rate: float | None = None
    pairs: tuple[tuple[str, str], ...] = ()
    target: float = TARGET
    alpha: float | None = None
    adjust: Adjust | None = None
    covariance: Covariance = "model"
    interval: Interval = "wald"
    replicates: int = REPLICATES
    seed: int = SEED
    scheduler: str | None = None
    workers: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PowerStudy:
    """The power of an ``experiment``: how many observers it needs, and ``notes`` that come before the numbers."""

    experiment: str
    needed: Needed
    notes: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        answer = {"experiment": self.experiment, "notes": list(self.notes), "needed": self.needed.to_json()}
        return {**answer, **self.needed.power.to_json()}


def study_power(
    experiment: Path, options: PowerOptions, progress: Callable[[int, int], None] | None = None
) -> PowerStudy:
    """Simulate studies of an experiment with several numbers of observers.

    Parameters
    ----------
    experiment
        An experiment file with a block of all pairs; its stimuli need not be built.
    options
        What is assumed, and how studies are simulated and tested.
    progress
        Called with how many blocks of work are done, and how many there are.

    Returns
    -------
    The number of observers needed, with the power of each number tried.

    Raises
    ------
    InputError
        If a file is wrong, the experiment compares no pairs of a fixed number, or an option is out of range.
    ComputeError
        As `analysis.power.compute.compute`.

    Examples
    --------
    >>> options = PowerOptions(observers=(10, 40), replicates=100, workers=1)
    >>> study = study_power(Path("experiments/dynamic_range.yaml"), options)
    >>> study.needed.observers, study.needed.power.separates.shape
    (None, (2, 45))
    """
    design = read_experiment(experiment)
    pairs = pair_design(design)
    assumed = assume(pairs, scores=options.scores, simulate=options.simulate, spread_nats=options.spread_nats)
    plan = Plan(
        items=pairs.items,
        theta=assumed.theta,
        times=pairs.times,
        differs=assumed.differs,
        observer_sd=options.observer_sd,
        lapse_rate=assumed.lapse_rate if options.lapse_rate is None else options.lapse_rate,
        alpha=design.spec.analysis.alpha if options.alpha is None else options.alpha,
        adjust=options.adjust or design.spec.analysis.adjust,
        covariance=options.covariance,
        interval=options.interval,
    )
    check_target(options.target)  # before the work, not after it
    chosen_pairs(plan.items, options.pairs)
    power = simulate_power(
        plan,
        options.observers,
        replicates=options.replicates,
        seed=options.seed,
        scheduler=options.scheduler,
        workers=options.workers,
        done=progress,
    )
    needed = observers_needed(power, options.pairs, options.target)
    return PowerStudy(design.spec.name, needed, (*assumed.notes, *assumed_notes(plan)))


@dataclass(frozen=True, slots=True, eq=False)
class PairDesign:
    """``items`` are the stimuli compared; ``times``, shape (P,), says how often each pair i < j is, by one observer.

    ``ties`` says whether an answer may prefer neither.
    """

    items: tuple[str, ...]
    times: NDArray[np.int64]
    ties: bool


def pair_design(experiment: Experiment) -> PairDesign:
    """Return the design of the experiment's blocks of all pairs together.

    Raises
    ------
    SessionError
        If there are none, or there are pairs that depend on the answers.
    """
    blocks = [block for block in experiment.spec.blocks if isinstance(block, AllPairsSpec)]
    file = str(experiment.file)
    if any(isinstance(block, ActivePairsSpec) for block in experiment.spec.blocks):
        what = "'active_pairs' chooses pairs by the answers: how often each is asked is not known beforehand"
        raise SessionError(Finding(what, file, remedy="simulate the experiment with 'all_pairs' instead"))
    if not blocks:
        what = "no block compares all pairs, so there are no scores to have power for"
        raise SessionError(Finding(what, file, remedy="name an experiment with 'kind: all_pairs'"))
    shown = [chosen(block.stimuli, experiment.stimuli) for block in blocks]
    compared = {name for names in shown for name in names}
    items = tuple(name for name in experiment.stimulus_names if name in compared)
    index = {name: place for place, name in enumerate(items)}
    times = np.zeros((len(items), len(items)), dtype=np.int64)
    for block, names in zip(blocks, shown, strict=True):
        for first, second in combinations(sorted(index[name] for name in names), 2):
            times[first, second] += block.repeats
    return PairDesign(items, times[np.triu_indices(len(items), 1)], any(block.ties != "none" for block in blocks))


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
class Assumed:
    """Log scores ``theta`` (n,) in nats, which pairs differ (``differs``, (P,)), a ``lapse_rate``, and notes."""

    theta: NDArray[np.float64]
    differs: NDArray[np.bool_]
    lapse_rate: float
    notes: tuple[str, ...]


def assume(design: PairDesign, *, scores: Path | None, simulate: Path | None, spread_nats: float | None) -> Assumed:
    """Return the scores that the given source gives; equal steps over 2 nats without a source.

    A file of simulated observers gives scores and, where it names them for all stimuli, their classes; ``simulate``
    also takes its lapses. A file that ends with .json is what `cyclopean scores --json` or `report --json` printed.

    Raises
    ------
    InputError
        If a file is wrong, or has no score for a stimulus.
    """
    ties = ("Observers are simulated without ties.",) if design.ties else ()
    if scores is not None and scores.suffix.lower() == ".json":
        theta = score_theta(_printed_scores(scores), design.items)
        return Assumed(theta, differing_pairs(theta), 0.0, ties)
    file = scores if simulate is None else simulate
    if file is None:
        nats = DEFAULT_SPREAD_NATS if spread_nats is None else spread_nats
        theta = spread_theta(len(design.items), nats)
        steps = f"Scores are assumed at equal steps over {nats:g} nats, in the recipe's order"
        odds = f": the best is preferred to the worst {100 / (1 + np.exp(-nats)):.0f} times in 100."
        return Assumed(theta, differing_pairs(theta), 0.0, (steps + odds, *ties))
    spec = read_scored_observer(file, design.items)
    theta = score_theta(spec.scores, design.items)
    labels = [spec.stimuli[name].perceptual_class for name in design.items]
    left_out = tuple(unsimulated(spec, design)) if simulate is not None else ()
    return Assumed(
        theta, differing_pairs(theta, labels), spec.lapse_rate if simulate is not None else 0.0, (*left_out, *ties)
    )


def _printed_scores(file: Path) -> dict[str, float]:
    remedy = "give what 'cyclopean scores --json' printed"
    try:
        printed = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultsError(Finding(f"the file cannot be read: {error.strerror}", str(file), remedy=remedy)) from None
    except ValueError as error:
        raise ResultsError(Finding(f"this is no JSON: {error}", str(file), remedy=remedy)) from None
    items = printed.get("items") if isinstance(printed, dict) else None
    if not isinstance(items, list) or not all(isinstance(item, dict) and "name" in item for item in items):
        raise ResultsError(Finding("there is no list of items with names", str(file), remedy=remedy))
    scores = {str(item["name"]): item.get("score") for item in items}
    empty = [name for name, score in scores.items() if isinstance(score, bool) or not isinstance(score, int | float)]
    if empty:
        raise ResultsError(Finding(f"'{empty[0]}' has no score", str(file), remedy="assume one in a file of observers"))
    return {name: float(score) for name, score in scores.items() if score is not None}
