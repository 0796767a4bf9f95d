"""How often each observer of an experiment compares each pair of stimuli."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.scaling import compared_groups
from documents import Finding
from runner.blocks.all_pairs import AllPairs
from runner.blocks.block import chosen
from runner.blocks.context import level_words, shared_seed
from runner.blocks.incomplete_pairs import PLACES
from runner.errors import SessionError
from runner.protocol.experiment import Experiment


@dataclass(frozen=True, slots=True, eq=False)
class PairDesign:
    """``items`` are the stimuli compared; ``times``, shape (P,), says how often each pair i < j is, by one observer.

    Where observers share pairs, ``times`` has shape (R, P): what the observers 1 to R compare.

    ``ties`` says whether an answer may prefer neither. ``groups`` are the sets of items that no pair links, such as
    scenes: each set's name and items; empty where pairs link all.
    """

    items: tuple[str, ...]
    times: NDArray[np.int64]
    ties: bool
    groups: tuple[tuple[str, tuple[int, ...]], ...] = ()

    def pairs_within(self, members: Sequence[int]) -> NDArray[np.intp]:
        """Return the indices of the pairs of ``members``, in the order of their own pairs i < j."""
        index = np.zeros((len(self.items), len(self.items)), dtype=np.intp)
        index[np.triu_indices(len(self.items), 1)] = np.arange(self.times.shape[-1])
        first, second = np.triu_indices(len(members), 1)
        place = np.array(members)
        return np.asarray(index[place[first], place[second]])


def pair_design(experiment: Experiment) -> PairDesign:
    """Return the design of the experiment's blocks of all pairs together.

    Raises
    ------
    SessionError
        If there are none, or there are pairs that depend on the answers.
    """
    blocks = [block for block in experiment.spec.blocks if isinstance(block, AllPairs)]
    file = str(experiment.file)
    if by_answers := next((block.kind for block in experiment.spec.blocks if block.pairs_by_answers), None):
        what = f"'{by_answers}' chooses pairs by the answers: how often each is asked is not known beforehand"
        raise SessionError(Finding(what, file, remedy="simulate the experiment with 'all_pairs' instead"))
    if not blocks:
        what = "no block compares all pairs, so there are no scores to have power for"
        raise SessionError(Finding(what, file, remedy="name an experiment with 'kind: all_pairs'"))
    shown = [chosen(block.stimuli, experiment.stimuli) for block in blocks]
    compared = {name for names in shown for name in names}
    items = tuple(name for name in experiment.stimulus_names if name in compared)
    index = {name: place for place, name in enumerate(items)}
    rows = PLACES if any(block.per_observer for block in blocks) else 1
    times = np.zeros((rows, len(items), len(items)), dtype=np.int64)
    for number, block in enumerate(experiment.spec.blocks):
        if not isinstance(block, AllPairs):
            continue
        seed = shared_seed(experiment.spec.seed, experiment.spec.name, number)
        for row, pairs in enumerate(block.pairs_by_place(experiment.stimuli, seed, rows)):
            for pair in pairs:
                first, second = sorted(index[name] for name in pair)
                times[row, first, second] += block.repeats
    sets = compared_groups(times.sum(axis=0).astype(np.float64))
    groups = tuple(zip(_names(experiment, blocks, items, sets), sets, strict=True)) if len(sets) > 1 else ()
    own = times[:, *np.triu_indices(len(items), 1)]
    return PairDesign(items, own if rows > 1 else own[0], any(b.ties != "none" for b in blocks), groups)


def _names(
    experiment: Experiment, blocks: Sequence[AllPairs], items: Sequence[str], sets: Sequence[Sequence[int]]
) -> list[str]:
    """Return a name for each set: its level of a factor that tells the sets apart, or else its number."""
    known = {name: experiment.stimuli.factors.get(name, {}) for name in items}
    factors = [block.within for block in blocks if block.within is not None]
    factors += [factor for name in items for factor in known[name]]
    for factor in dict.fromkeys(factors):
        levels = [{level_words(known[items[i]][factor]) for i in own if factor in known[items[i]]} for own in sets]
        whole = all(len(level) == 1 for level in levels) and all(factor in known[name] for name in items)
        if whole and len(set.union(*levels)) == len(sets):
            return [level.pop() for level in levels]
    return [f"group {number}" for number in range(1, len(sets) + 1)]
