"""The scores that a simulated study assumes: those of simulated observers, those found before, or a spread."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.errors import ResultsError
from analysis.power.assumed import parted, score_theta, spread_theta
from documents import Finding
from runner.observers.observer_file import read_scored_observer
from runner.protocol.pair_design import PairDesign, unsimulated

DEFAULT_SPREAD_NATS = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Assumed:
    """Log scores ``theta`` (n,) in nats, which pairs ``differs`` (P,), a ``lapse_rate``, and ``notes`` for readers."""

    theta: NDArray[np.float64]
    differs: NDArray[np.bool_]
    lapse_rate: float
    notes: tuple[str, ...]


def assume(design: PairDesign, *, scores: Path | None, simulate: Path | None, spread_nats: float | None) -> Assumed:
    """Return what one of the three says, or a spread of 2 nats where none is given.

    A file of simulated observers gives scores and, where it names them for all stimuli, their classes; ``simulate``
    takes over its lapses too. A file that ends with .json is what `cyclopean scores --json` or `report --json` printed.

    Raises
    ------
    InputError
        If a file is wrong, or has no score for a stimulus.
    """
    ties = ("Observers are simulated without ties.",) if design.ties else ()
    if scores is not None and scores.suffix.lower() == ".json":
        theta = score_theta(_printed_scores(scores), design.items)
        return Assumed(theta, parted(theta), 0.0, ties)
    file = scores if simulate is None else simulate
    if file is None:
        nats = DEFAULT_SPREAD_NATS if spread_nats is None else spread_nats
        theta = spread_theta(len(design.items), nats)
        told = f"Scores are assumed at even steps over {nats:g} nats, in the recipe's order"
        odds = f": the best is preferred to the worst {100 / (1 + np.exp(-nats)):.0f} times in 100."
        return Assumed(theta, parted(theta), 0.0, (told + odds, *ties))
    spec = read_scored_observer(file, design.items)
    theta = score_theta(spec.scores, design.items)
    labels = [spec.stimuli[name].perceptual_class for name in design.items]
    left_out = tuple(unsimulated(spec, design)) if simulate is not None else ()
    return Assumed(theta, parted(theta, labels), spec.lapse_rate if simulate is not None else 0.0, (*left_out, *ties))


def _printed_scores(file: Path) -> dict[str, float]:
    remedy = "give what 'cyclopean scores --json' printed"
    try:
        told = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultsError(Finding(f"the file cannot be read: {error.strerror}", str(file), remedy=remedy)) from None
    except ValueError as error:
        raise ResultsError(Finding(f"this is no JSON: {error}", str(file), remedy=remedy)) from None
    items = told.get("items") if isinstance(told, dict) else None
    if not isinstance(items, list) or not all(isinstance(item, dict) and "name" in item for item in items):
        raise ResultsError(Finding("there is no list of items with names", str(file), remedy=remedy))
    scores = {str(item["name"]): item.get("score") for item in items}
    empty = [name for name, score in scores.items() if isinstance(score, bool) or not isinstance(score, int | float)]
    if empty:
        raise ResultsError(Finding(f"'{empty[0]}' has no score", str(file), remedy="assume one in a file of observers"))
    return {name: float(score) for name, score in scores.items() if score is not None}
