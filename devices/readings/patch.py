"""Patches, each a name, device codes and how it is to be read; sets of them; their order.

The order is shuffled from a seed, with black and white again and again for drift.
"""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from devices.errors import DeviceError
from devices.readings.arrangement import Arrangement, GridCell, PatchEye, degrees
from documents import Finding

Codes = tuple[float, float, float]
# What fills the screen before a patch stands for so many times as long as the patch settles.
BEFORE_SETTLINGS = 10.0
_MIDDLE = 1.0 / 9.0


@dataclass(frozen=True, slots=True)
class Patch:
    """A colour of device ``codes`` in 0..1 (red, green, blue), over all of an eye's area unless a field limits it.

    ``around`` are the codes around a patch that fills but the middle, ``area`` the share of the eye's area that the
    middle is, in its shape (a ninth without it); ``other`` are the codes of the eye that is not read. Without them a
    patch with an area or at a ``place`` has black around it, and the other eye sees what the measurement says.
    ``before`` are codes that fill the screen before the patch, for `BEFORE_SETTLINGS` times as long as it settles.
    ``eye`` is whose lens it is read through, None for the measurement's own; ``angle``, ``glasses`` and
    ``screen_off`` are as in `Arrangement`. ``wait_s`` is the least time between the reading before and this one.

    Raises DeviceError if a code is not in 0..1, the name is empty or holds '#', a comma or an end of line, another eye
    is named without an eye to read, the wait is below 0, or the area is not above 0 and at most 1 or goes with a place.
    """

    name: str
    codes: Codes
    around: Codes | None = None
    other: Codes | None = None
    place: GridCell | None = None
    eye: PatchEye | None = None
    angle: str = ""
    glasses: bool = True
    wait_s: float = 0.0
    area: float | None = None
    before: Codes | None = None
    screen_off: bool = False

    def __post_init__(self) -> None:
        if not self.name.strip() or any(character in self.name for character in '#,"\n\r'):
            raise DeviceError(f"a patch needs a name without '#', quotes and commas, not '{self.name}'")
        for codes in (self.codes, self.around, self.other, self.before):
            if codes is not None and not _are_codes(codes):
                raise DeviceError(f"the patch '{self.name}' has the codes {codes}; three in 0..1 are needed")
        if self.other is not None and self.eye not in ("left", "right"):
            raise DeviceError(
                f"the patch '{self.name}' has codes for the other eye, but does not say which eye is read"
            )
        if not 0.0 <= self.wait_s < math.inf:
            raise DeviceError(f"the patch '{self.name}' cannot wait {self.wait_s} s")
        if self.area is not None and not 0.0 < self.area <= 1.0:
            what = f"the patch '{self.name}' has the area {self.area}"
            raise DeviceError(f"{what}; a share of the picture above 0 and at most 1 is needed")
        if self.area is not None and self.place is not None:
            raise DeviceError(f"the patch '{self.name}' stands in a cell of a grid, which is its area")

    @property
    def filled(self) -> float:
        """The share of the picture that the patch fills: all of it, a ninth, its ``area``, or a cell of its grid."""
        if self.place is not None:
            return 1.0 / (self.place.rows * self.place.columns)
        return self.area or (1.0 if self.around is None else _MIDDLE)

    @property
    def surround(self) -> Codes:
        """The codes around the patch, black where it has none."""
        return self.around or (0.0, 0.0, 0.0)

    @property
    def shown_before(self) -> Patch | None:
        """What fills the screen before the patch, None if nothing does."""
        return None if self.before is None else replace(self, codes=self.before, around=None, area=None, before=None)

    def rounded(self, highest: int) -> Patch:
        """Return the patch as a surface of codes 0..``highest`` shows it."""
        around = None if self.around is None else _rounded(self.around, highest)
        other = None if self.other is None else _rounded(self.other, highest)
        before = None if self.before is None else _rounded(self.before, highest)
        return replace(self, codes=_rounded(self.codes, highest), around=around, other=other, before=before)

    def arrangement(self, eye: PatchEye) -> Arrangement:
        """Return how the instrument stands, in a measurement of ``eye``."""
        angle = self.angle if degrees(self.angle) else ""
        return Arrangement(self.eye or eye, self.place, angle, self.glasses, self.screen_off)


def _are_codes(codes: Codes) -> bool:
    return len(codes) == 3 and all(math.isfinite(code) and 0.0 <= code <= 1.0 for code in codes)


def _rounded(codes: Codes, highest: int) -> Codes:
    red, green, blue = (math.floor(code * highest + 0.5) / highest for code in codes)
    return red, green, blue


BLACK = Patch("black", (0.0, 0.0, 0.0))


WHITE = Patch("white", (1.0, 1.0, 1.0))


@dataclass(frozen=True, slots=True)
class PatchSet:
    """Patches of different names, or read through different lenses, and where they come from.

    Each is shown ``repeats`` times. Black and white come throughout a set that is a ``characterisation``. A set in
    ``rounds`` keeps its order, all patches once before any is shown again, however often the instrument is moved.

    Raises DeviceError if there are none, two share a name, or ``repeats`` is below 1.
    """

    name: str
    patches: tuple[Patch, ...]
    source: str = ""
    repeats: int = 1
    characterisation: bool = True
    rounds: bool = False

    def __post_init__(self) -> None:
        if not self.patches:
            raise DeviceError(f"the set '{self.name}' holds no patches")
        twice = _first_repeated((patch.name, patch.eye) for patch in self.patches)
        if twice is not None:
            raise DeviceError(f"two patches of the set '{self.name}' are called '{twice}'")
        if self.repeats < 1:
            raise DeviceError(f"the set '{self.name}' cannot be shown {self.repeats} times")

    def in_part(self, area: float | None, around: Codes | None) -> PatchSet:
        """Return the set with every patch that fills the picture in the middle alone, with the codes ``around`` it.

        ``area`` is the share of the picture that it then fills, a ninth where it is None. Patches that name an area, a
        surround, a place, what stands before them or what the other eye sees stay as they are.
        """
        moved = (
            replace(patch, area=area, around=around or (0.0, 0.0, 0.0))
            if all(part is None for part in (patch.area, patch.around, patch.other, patch.place, patch.before))
            else patch
            for patch in self.patches
        )
        return replace(self, patches=tuple(moved))

    def rounded(self, highest: int) -> PatchSet:
        """Return the set as a surface of codes 0..``highest`` shows it."""
        return replace(self, patches=tuple(patch.rounded(highest) for patch in self.patches))


def _first_repeated(names: Iterable[tuple[str, PatchEye | None]]) -> str | None:
    seen: set[tuple[str, PatchEye | None]] = set()
    for name in names:
        if name in seen:
            return name[0]
        seen.add(name)
    return None


@dataclass(frozen=True, slots=True)
class PatchTurn:
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
) -> tuple[PatchTurn, ...]:
    """Return the showings of ``patches`` in an order drawn from ``seed``, or in their own.

    In a characterisation, black and white come first, again after every ``repeat_every`` patches, and last, so that the
    set's own black and white are not shown again; with 0, nothing is repeated. Sets come one after the other, but all
    patches of one arrangement of the instrument (in a measurement of ``eye``) together, so that it is moved least; a
    set in rounds keeps its own.

    Parameters
    ----------
    patches
        A set of patches, or several, which follow each other.
    seed
        The seed of the order.
    repeat_every
        After how many patches of a characterisation black and white are repeated, at least 0; 0 repeats none.
    shuffled
        Whether the patches are shuffled; if not, they keep the order of their set.
    eye
        Through which lens the measurement is made.

    Returns
    -------
    tuple of Step
        The showings, with positions from 0; a label such as ``white#2`` counts the showings of a patch.

    Raises
    ------
    DeviceError
        If ``repeat_every`` is negative, or a characterisation calls another colour black or white.

    Examples
    --------
    >>> pair = PatchSet("pair", (Patch("red", (1.0, 0.0, 0.0)), Patch("blue", (0.0, 0.0, 1.0))))
    >>> [step.label for step in steps(pair, 0, 0, shuffled=False)]
    ['red', 'blue']
    """
    if repeat_every < 0:
        raise DeviceError(Finding(f"patches cannot be repeated every {repeat_every}", remedy="0 repeats none"))
    sets = (patches,) if isinstance(patches, PatchSet) else tuple(patches)
    together: dict[Arrangement | str, list[Patch]] = {}
    for patch_set in sets:
        if patch_set.rounds:
            together[patch_set.name] = list(patch_set.patches) * patch_set.repeats
            continue
        for patch in _ordered(patch_set, seed, repeat_every, shuffled=shuffled):
            together.setdefault(patch.arrangement(eye), []).append(patch)
    times: Counter[str] = Counter()
    made = []
    for position, patch in enumerate(patch for group in together.values() for patch in group):
        times[patch.name] += 1
        label = patch.name if times[patch.name] == 1 else f"{patch.name}#{times[patch.name]}"
        made.append(PatchTurn(position, label, patch))
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
    part = {(patch.area, patch.around) for patch in order}
    area, around = part.pop() if len(part) == 1 else (None, None)
    ends = [replace(end, area=area, around=around) for end in (BLACK, WHITE)]
    order = [patch for patch in order if patch.codes not in (BLACK.codes, WHITE.codes)]
    shown = list(ends)
    for start in range(0, len(order), repeat_every):
        shown += [*order[start : start + repeat_every], *ends]
    return shown
