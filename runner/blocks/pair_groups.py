"""Pairs within groups of stimuli, such as the pictures of one scene, and pairs that link the groups."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from documents.text import counted, did_you_mean
from runner.blocks.block import Fault
from runner.blocks.context import Stimuli, level_words
from runner.blocks.orders import Pair


@dataclass(frozen=True, slots=True)
class PairGroups:
    """Pairs of stimuli within groups, and between them.

    Attributes
    ----------
    factor
        The factor whose levels are the groups.
    group_of
        Each stimulus's group, by its name.
    sets
        Each pair, as the numbers i < j of its stimuli, with the set that it belongs to: the group of both, or the level
        of another factor in which two stimuli of different groups agree.
    """

    factor: str
    group_of: Mapping[str, str]
    sets: Mapping[Pair, tuple[str, str]]

    def only(self, pairs: Sequence[Pair]) -> PairGroups:
        """Return the same groups with some of their pairs, in the order of ``pairs``."""
        return replace(self, sets={pair: self.sets[pair] for pair in pairs})

    @property
    def members(self) -> tuple[tuple[int, ...], ...]:
        """The numbers of each group's stimuli, of the groups that have pairs."""
        members: dict[str, dict[int, None]] = {}
        for pair, (factor, level) in self.sets.items():
            if factor == self.factor:
                members.setdefault(level, {}).update(dict.fromkeys(pair))
        return tuple(tuple(sorted(numbers)) for numbers in members.values())

    @property
    def facts(self) -> dict[str, Any]:
        """How many pairs each group has, and how many link groups."""
        within = dict.fromkeys(self.group_of.values(), 0)
        links = 0
        for factor, level in self.sets.values():
            if factor == self.factor:
                within[level] += 1
            else:
                links += 1
        return {f"pairs_within_{self.factor}": within, **({"pairs_between": links} if links else {})}

    def record(self, first: str, second: str) -> dict[str, str]:
        """Return the group of a pair, and the factor that makes the groups; nothing for a pair between groups."""
        group = self.group_of.get(first)
        if group is None or group != self.group_of.get(second):
            return {}
        return {"group": group, "group_factor": self.factor}


def pairs_in_groups(names: Sequence[str], stimuli: Stimuli, within: str, across: str | None = None) -> PairGroups:
    """Return the pairs of ``names`` that agree in the factor ``within``, or differ in it and agree in ``across``."""
    levels = [{key: level_words(value) for key, value in stimuli.factors.get(name, {}).items()} for name in names]
    sets: dict[Pair, tuple[str, str]] = {}
    for i, j in combinations(range(len(names)), 2):
        one, other = levels[i], levels[j]
        if within not in one or within not in other:
            continue
        if one[within] == other[within]:
            sets[i, j] = within, one[within]
        elif across is not None and across in one and one[across] == other.get(across):
            sets[i, j] = across, one[across]
    group_of = {name: level[within] for name, level in zip(names, levels, strict=True) if within in level}
    return PairGroups(within, group_of, sets)


def group_faults(names: Sequence[str], stimuli: Stimuli, within: str, across: str | None = None) -> Iterator[Fault]:
    """Yield factors that the stimuli have not, stimuli without any pair, and links that link nothing, or not all."""
    wrong = [
        fault
        for key, factor in (("within", within), ("across", across))
        if factor is not None
        for fault in factor_faults(names, stimuli, key, factor)
    ]
    yield from wrong
    if wrong:
        return
    groups = pairs_in_groups(names, stimuli, within, across)
    if not any(factor == within for factor, _ in groups.sets.values()):
        what = f"no two stimuli have the same {within}, so there is no pair within one"
        yield Fault(what, ("within",), f"name a factor that several stimuli agree in: {_known(names, stimuli)}")
        return
    paired = {names[number] for pair in groups.sets for number in pair}
    for name, group in groups.group_of.items():
        if name not in paired:
            what = f"the {within} '{group}' has one stimulus, '{name}', which is in no pair"
            yield Fault(what, ("within",), f"add stimuli of this {within}, or leave '{name}' out of 'stimuli'")
    if across is None:
        return
    if all(factor == within for factor, _ in groups.sets.values()):
        what = f"no two stimuli of different {within} have the same {across}, so no pair links two of them"
        yield Fault(what, ("across",), "name a factor whose levels recur, or leave 'across' out")
        return
    linked = _linked(len(names), groups.sets)
    if len(linked) > 1:
        sets = [", ".join(dict.fromkeys(groups.group_of[names[number]] for number in part)) for part in linked]
        what = f"the pairs across {across} leave {len(sets)} sets without a common scale: {'; '.join(sets[:5])}"
        yield Fault(what, ("across",), "name a factor with a level that recurs there, or leave 'across' out")


def factor_faults(names: Sequence[str], stimuli: Stimuli, key: str, factor: str) -> Iterator[Fault]:
    """Yield that stimuli have no such factor, at the block's ``key``."""
    without = [name for name in names if factor not in stimuli.factors.get(name, {})]
    if len(without) == len(names):
        known = sorted({key for name in names for key in stimuli.factors.get(name, {})})
        remedy = did_you_mean(factor, known, _known(names, stimuli))
        yield Fault(f"the stimuli have no factor '{factor}'", (key,), remedy)
    elif without:
        what = f"{counted(len(without), 'stimulus has', 'stimuli have')} no factor '{factor}': {', '.join(without[:5])}"
        yield Fault(what, (key,), "give it to them in the recipe, or leave them out of 'stimuli'")


def _known(names: Sequence[str], stimuli: Stimuli) -> str:
    known = sorted({key for name in names for key in stimuli.factors.get(name, {})})
    return f"the stimuli have: {', '.join(known)}" if known else "write 'factors:' beside the stimuli in the recipe"


def _linked(count: int, pairs: Iterable[Pair]) -> tuple[tuple[int, ...], ...]:
    from analysis.scaling import compared_groups

    compared = np.zeros((count, count))
    for pair in pairs:
        compared[pair] = 1.0
    return compared_groups(compared)
