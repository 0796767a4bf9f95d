"""Which stimulus is the photograph that the others are measured against: one for each group, such as a scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from analysis.agreement import ObservedGroup
from analysis.errors import ResultsError
from documents import Finding, did_you_mean

Factors = Mapping[str, Mapping[str, str]]
MOST_NAMED = 8


def photographs_of(
    groups: Sequence[ObservedGroup], factors: Factors, reference: str | None, named: Sequence[str]
) -> tuple[tuple[ObservedGroup, ...], tuple[str, ...]]:
    """Return the groups, divided where their stimuli have several photographs, and the photograph of each.

    Parameters
    ----------
    groups
        What observers said.
    factors
        Each stimulus's factors, their levels as words.
    reference
        The experiment's reference picture; None if it shows none.
    named
        Names of photographs, or ``FACTOR=LEVEL`` for the stimuli with that level; they come before the reference.

    Raises
    ------
    ResultsError
        If nothing says which stimulus is the photograph, a name is no stimulus, or a group has several or none.
    """
    photographs = _named(factors, named) if named else [reference] if reference is not None else []
    if not photographs:
        some = ", ".join(list(factors)[:MOST_NAMED]) + (", …" if len(factors) > MOST_NAMED else "")
        what = "no stimulus is known to be the photograph that the others are measured against: none was shown as such"
        remedy = f"name it: --photograph STIMULUS, one of {some}; or one for each group: --photograph FACTOR=LEVEL"
        raise ResultsError(Finding(what, remedy=remedy))
    found = [pair for group in groups for pair in _divided(group, photographs, factors)]
    return tuple(group for group, _ in found), tuple(photograph for _, photograph in found)


def _named(factors: Factors, named: Sequence[str]) -> list[str]:
    photographs: dict[str, None] = {}
    for name in named:
        factor, equals, level = name.partition("=")
        if name in factors:
            photographs[name] = None
        elif equals:
            chosen = [stimulus for stimulus, own in factors.items() if own.get(factor) == level]
            if not chosen:
                known = sorted({f"{key}={own[key]}" for own in factors.values() for key in own})
                what = f"no stimulus has {factor} '{level}'"
                raise ResultsError(Finding(what, remedy=did_you_mean(name, known)))
            photographs |= dict.fromkeys(chosen)
        else:
            raise ResultsError(Finding(f"there is no stimulus '{name}'", remedy=did_you_mean(name, list(factors))))
    return list(photographs)


def _divided(group: ObservedGroup, photographs: Sequence[str], factors: Factors) -> list[tuple[ObservedGroup, str]]:
    """Return a group with its photograph, or its parts with theirs."""
    if len(photographs) == 1:
        return [(group, photographs[0])]
    own = [name for name in photographs if name in group.stimuli]
    if len(own) == 1:
        return [(group, own[0])]
    # Of stimuli on one scale or beside the scale, each goes with the photograph whose level of a factor it shares.
    candidates = own or list(photographs)
    for factor in _telling(candidates, factors):
        of_level = {factors[name][factor]: name for name in candidates}
        parts = [
            (level, [stimulus for stimulus in group.stimuli if factors[stimulus].get(factor) == level])
            for level in of_level
        ]
        if sum(len(stimuli) for _, stimuli in parts) == len(group.stimuli):
            return [
                (group.only(stimuli, group.name if len(stimuli) == len(group.stimuli) else level), of_level[level])
                for level, stimuli in parts
                if stimuli
            ]
    several = ", ".join(candidates[:MOST_NAMED])
    which = f"the group '{group.name}'" if group.name else "the stimuli"
    what = f"{which} may be measured against {len(candidates)} photographs: {several}"
    remedy = "name one, or give the stimuli a factor, such as scene, that each shares with its photograph"
    raise ResultsError(Finding(what, remedy=remedy))


def _telling(photographs: Sequence[str], factors: Factors) -> list[str]:
    """Return the factors that all photographs have, each another level."""
    first = factors[photographs[0]]
    return [
        key
        for key in first
        if all(key in factors[name] for name in photographs)
        and len({factors[name][key] for name in photographs}) == len(photographs)
    ]
