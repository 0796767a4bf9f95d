"""The order in which patches are shown: shuffled from a seed, with black and white again and again for drift."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from devices.errors import DeviceError
from devices.patches.arrangement import Arrangement, PatchEye
from devices.patches.patch import BLACK, WHITE, Patch, PatchSet
from documents import Finding


@dataclass(frozen=True, slots=True)
class Step:
    """A patch shown once. ``label`` is its name, with ``#2`` behind it at its second showing, and so on."""

    position: int
    label: str
    patch: Patch


def steps(
    patches: PatchSet | Sequence[PatchSet],
    seed: int,
    repeat_every: int = 12,
    *,
    shuffled: bool = True,
    eye: PatchEye = "both",
) -> tuple[Step, ...]:
    """Return the showings of ``patches`` in an order drawn from ``seed``, or in their own.

    In a characterisation, black and white come first, again after every ``repeat_every`` patches, and last, so that the
    set's own black and white are not shown besides; with 0, nothing is repeated. Sets come one after the other, but all
    patches of one arrangement of the instrument (in a measurement of ``eye``) together, so that it is moved least.

    Raises
    ------
    DeviceError
        If ``repeat_every`` is negative, or a characterisation calls another colour black or white.
    """
    if repeat_every < 0:
        raise DeviceError(Finding(f"patches cannot be repeated every {repeat_every}", remedy="0 repeats none"))
    sets = (patches,) if isinstance(patches, PatchSet) else tuple(patches)
    together: dict[Arrangement, list[Patch]] = {}
    for one in sets:
        for patch in _ordered(one, seed, repeat_every, shuffled=shuffled):
            together.setdefault(patch.arrangement(eye), []).append(patch)
    times: Counter[str] = Counter()
    made = []
    for position, patch in enumerate(patch for group in together.values() for patch in group):
        times[patch.name] += 1
        label = patch.name if times[patch.name] == 1 else f"{patch.name}#{times[patch.name]}"
        made.append(Step(position, label, patch))
    return tuple(made)


def _ordered(patches: PatchSet, seed: int, repeat_every: int, *, shuffled: bool) -> list[Patch]:
    """Return the patches of one set in their order, those of each arrangement in the arrangement's turn."""
    order = list(patches.patches) * patches.repeats
    if shuffled:
        random.Random(f"{seed}/{patches.name}/patches").shuffle(order)
        turns = list(dict.fromkeys(patch.arrangement("both") for patch in patches.patches))
        order.sort(key=lambda patch: turns.index(patch.arrangement("both")))
    if not repeat_every or not patches.characterisation:
        return order
    for known in (BLACK, WHITE):
        if any(patch.name == known.name and patch.codes != known.codes for patch in order):
            remedy = "give it another name, or repeat nothing"
            raise DeviceError(Finding(f"a patch called '{known.name}' has other codes", remedy=remedy))
    order = [patch for patch in order if patch.codes not in (BLACK.codes, WHITE.codes)]
    shown = [BLACK, WHITE]
    for start in range(0, len(order), repeat_every):
        shown += [*order[start : start + repeat_every], BLACK, WHITE]
    return shown
