"""Groups of stimuli in the sessions of an experiment, such as scenes: sets that no comparison links.

Pairs within scenes link no two scenes, so there is no scale that is common to them. The sets follow from the design,
not from the answers that happen to be there: the stimuli of one block belong together, and where a block compares
within groups (its trials then have a ``group``), the stimuli of each of its groups.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from analysis.comparisons.comparisons import Answer
from analysis.kinds.pair import PairRecord
from analysis.records.lines import Header

MOST_NAMED = 5


@dataclass(frozen=True, slots=True)
class SessionGroups:
    """The groups of an experiment whose comparisons do not link all stimuli.

    Attributes
    ----------
    group_of
        Each compared stimulus's group.
    factor
        The factor of the stimuli whose levels are the groups; None where no factor tells them apart.
    sentence
        What the groups are, for a reader.
    """

    group_of: Mapping[str, str]
    factor: str | None
    sentence: str

    @property
    def names(self) -> tuple[str, ...]:
        """The groups' names."""
        return tuple(dict.fromkeys(self.group_of.values()))


Compared: TypeAlias = Sequence[tuple[PairRecord, Answer]]


def session_groups(header: Header, compared: Compared) -> SessionGroups | None:
    """Return the groups that the comparisons of an experiment fall into; None if they are all linked.

    Parameters
    ----------
    header
        A session's header, with the stimuli's factors.
    compared
        Comparisons of all sessions, each with its answer.
    """
    sets = _linked_sets(header, compared)
    if len(sets) < 2:
        return None
    recorded = Counter(trial.group_factor for trial, _ in compared if trial.group_factor)
    factor = _telling_factor(header, sets, [name for name, _ in recorded.most_common()])
    names = _names(header, sets, compared, factor)
    group_of = {item: name for name, items in zip(names, sets, strict=True) for item in items}
    listed = ", ".join(names[:MOST_NAMED]) + (f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else "")
    if factor in recorded:
        sentence = f"Only stimuli with the same {factor} were compared ({len(sets)} groups: {listed})."
    else:
        how = f"their {factor}" if factor is not None else "block"
        sentence = f"No comparison links all stimuli: they fall into {len(sets)} groups, named by {how}: {listed}."
    sentence += " Each group has a scale of its own; scores of different groups cannot be compared."
    return SessionGroups(group_of, factor, sentence)


def _linked_sets(header: Header, compared: Compared) -> list[list[str]]:
    """Return the stimuli that blocks, or their groups, link; in the order of the header."""
    members: dict[Hashable, dict[str, None]] = {}
    for trial, answer in compared:
        own = members.setdefault((trial.block, answer.group), {})
        own[answer.winner] = own[answer.loser] = None
    root: dict[str, str] = {}

    def top(item: str) -> str:
        root.setdefault(item, item)
        while root[item] != item:
            root[item] = item = root[root[item]]
        return item

    for items in members.values():
        first, *others = items
        for other in others:
            root[top(other)] = top(first)
    sets: dict[str, list[str]] = {}
    for item in dict.fromkeys([name for name in header.stimulus_names if name in root] + list(root)):
        sets.setdefault(top(item), []).append(item)
    return list(sets.values())


def _telling_factor(header: Header, sets: Sequence[Sequence[str]], first: Iterable[str]) -> str | None:
    """Return a factor that has one level in each set and another in every other; those in ``first`` before others."""
    factors = factors_of(header)
    known = dict.fromkeys(key for items in sets for item in items for key in factors.get(item, {}))
    for factor in dict.fromkeys([*(name for name in first if name in known), *known]):
        levels = [{factors.get(item, {}).get(factor) for item in items} for items in sets]
        if all(len(level) == 1 and None not in level for level in levels) and len(set.union(*levels)) == len(sets):
            return factor
    return None


def factors_of(header: Header) -> dict[str, dict[str, str]]:
    """Return the factors of each stimulus by name, their levels as words."""
    return {
        name: {key: f"{level:.12g}" if isinstance(level, int | float) else level for key, level in levels.items()}
        for name, levels in header.factors.items()
    }


def _names(header: Header, sets: Sequence[Sequence[str]], compared: Compared, factor: str | None) -> tuple[str, ...]:
    if factor is not None:
        factors = factors_of(header)
        return tuple(factors[items[0]][factor] for items in sets)
    labels: list[dict[str, None]] = [{} for _ in sets]
    place = {item: number for number, items in enumerate(sets) for item in items}
    for trial, answer in compared:
        labels[place[answer.winner]].setdefault(answer.group or f"block {trial.block + 1}")
    names = [" + ".join(sorted(own)) for own in labels]
    times = Counter(names)
    return tuple(name if times[name] == 1 else f"{name} ({items[0]})" for name, items in zip(names, sets, strict=True))
