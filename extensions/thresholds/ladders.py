"""The stimuli of a threshold block: their levels of the factor from hard to easy, in each group if there are groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from documents.text import counted
from extensions.thresholds.fit import Easier
from runner.blocks import Fault, Stimuli, StimulusNames, chosen, factor_faults, level_words, name_faults

LEAST_LEVELS = 3  # fewer have no slope
References = str | Mapping[str, str] | None


@dataclass(frozen=True, slots=True)
class Ladder:
    """The levels of a factor from hard to easy, the stimuli of each, and the reference shown beside or instead."""

    levels: tuple[float, ...]
    stimuli: tuple[tuple[str, ...], ...]
    reference: str | None = None
    group: str | None = None


def ladders(
    names: StimulusNames, stimuli: Stimuli, factor: str, within: str | None, reference: References, easier: Easier
) -> tuple[Ladder, ...]:
    """Return a ladder of the stimuli, or one for each level of ``within``, in the order of the stimuli."""
    at: dict[str | None, dict[float, list[str]]] = {}
    for name in _takers(names, stimuli, reference):
        factors = stimuli.factors.get(name, {})
        level = factors.get(factor)
        if isinstance(level, str) or level is None or (within is not None and within not in factors):
            continue
        group = None if within is None else level_words(factors[within])
        at.setdefault(group, {}).setdefault(float(level), []).append(name)
    return tuple(
        Ladder(
            tuple(sorted(by_level, reverse=easier == "lower")),
            tuple(tuple(by_level[level]) for level in sorted(by_level, reverse=easier == "lower")),
            _reference(reference, group, stimuli),
            group,
        )
        for group, by_level in at.items()
    )


def ladder_faults(
    names: StimulusNames,
    stimuli: Stimuli,
    factor: str,
    within: str | None,
    reference: References,
    *,
    wanted: bool,
) -> Iterator[Fault]:
    """Yield wrong stimuli, references and factors, and groups with too few levels; ``wanted`` is a reference."""
    wrong = [*name_faults(names, stimuli, "stimuli"), *_reference_faults(names, stimuli, within, reference)]
    takers = _takers(names, stimuli, reference)
    wrong += factor_faults(takers, stimuli, "factor", factor)
    if within is not None:
        wrong += factor_faults(takers, stimuli, "within", within)
    words = {name: stimuli.factors[name].get(factor) for name in takers if name in stimuli.factors}
    named = next(((name, level) for name, level in words.items() if isinstance(level, str)), None)
    if named is not None:
        what = f"the factor '{factor}' is no number: it is '{named[1]}' for '{named[0]}'"
        known = [key for key in _factors(stimuli) if all(not isinstance(f.get(key), str) for f in _each(stimuli))]
        remedy = f"name a factor of numbers: {', '.join(known)}" if known else "give the stimuli a factor of numbers"
        wrong.append(Fault(what, ("factor",), remedy))
    yield from wrong
    if wrong:
        return
    for ladder in ladders(names, stimuli, factor, within, reference, "higher"):
        where = f" in the {within} '{ladder.group}'" if within else ""
        if wanted and ladder.reference is None:
            remedy = "write reference: and the stimulus without a signal"
            yield Fault(f"there is no reference to compare with{where}", ("reference",), remedy)
            return
        if len(ladder.levels) < LEAST_LEVELS:
            what = f"'{factor}' has {counted(len(ladder.levels), 'level', 'levels')}{where}, too few for a threshold"
            yield Fault(what, ("factor",), f"make stimuli of {LEAST_LEVELS} or more, better eight")


def _reference_faults(
    names: StimulusNames, stimuli: Stimuli, within: str | None, reference: References
) -> Iterator[Fault]:
    by_group = reference if isinstance(reference, Mapping) else {}
    groups = {level_words(each[within]) for each in _each(stimuli) if within in each} if within else set()
    for group, name in by_group.items():
        path = ("reference", group)
        if group not in groups:
            yield Fault(f"no stimulus has the {within} '{group}'", path, f"write one of {', '.join(sorted(groups))}")
        for fault in name_faults([name], stimuli, *path):
            yield Fault(fault.message, path, fault.remedy)
    if isinstance(reference, str):
        for fault in name_faults([reference], stimuli, "reference"):
            yield Fault(fault.message, ("reference",), fault.remedy)
    if names != "all":
        for index, name in enumerate(names):
            if name in _references(stimuli, reference):
                what = f"'{name}' is the reference, and cannot be at a level too"
                yield Fault(what, ("stimuli", index), "remove it from stimuli, or name another reference")


def _takers(names: StimulusNames, stimuli: Stimuli, reference: References) -> list[str]:
    """Return the stimuli that have a level: all but references."""
    none = _references(stimuli, reference)
    return [name for name in chosen(names, stimuli) if name not in none]


def _references(stimuli: Stimuli, reference: References) -> set[str]:
    if isinstance(reference, Mapping):
        return {*reference.values()}
    return {name for name in (reference or stimuli.reference,) if name is not None}


def _reference(reference: References, group: str | None, stimuli: Stimuli) -> str | None:
    if isinstance(reference, Mapping):
        return reference.get(group or "", stimuli.reference)
    return reference or stimuli.reference


def _each(stimuli: Stimuli) -> Iterator[Mapping[str, str | float]]:
    yield from stimuli.factors.values()


def _factors(stimuli: Stimuli) -> list[str]:
    return sorted({key for each in _each(stimuli) for key in each})
