"""What an experiment compares: how often each observer meets each pair of stimuli."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from documents import Finding
from runner.blocks.active_pairs import ActivePairsSpec
from runner.blocks.all_pairs import AllPairsSpec
from runner.blocks.block import chosen
from runner.errors import SessionError
from runner.protocol.experiment import Experiment

if TYPE_CHECKING:
    from runner.observers.behaviour import BehaviourSpec


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
        for one, other in combinations(sorted(index[name] for name in names), 2):
            times[one, other] += block.repeats
    return PairDesign(items, times[np.triu_indices(len(items), 1)], any(block.ties != "none" for block in blocks))


def unsimulated(behaviour: BehaviourSpec, design: PairDesign) -> list[str]:
    """Return a sentence on each way of simulated observers, beside lapses, that a simulation of counts leaves out."""
    left_out = []
    if behaviour.position_bias:
        left_out.append("their leaning to the first place")
    if behaviour.fatigue is not None:
        left_out.append("their fatigue")
    if behaviour.ties is not None and design.ties:
        left_out.append("their ties")
    return [f"Of the observers in the file, {' and '.join(left_out)} are not simulated."] if left_out else []
