"""A patch: a name, the device codes of its three channels, what else is on the screen, and how it is to be read."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from devices.errors import DeviceError
from devices.patches.arrangement import Arrangement, PatchEye, Place, degrees

Codes = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Patch:
    """A colour of device ``codes`` in 0..1 (red, green, blue), over all of an eye's area unless said otherwise.

    ``around`` are the codes around a patch that fills but the middle, ``other`` those of the eye that is not read;
    without them a patch at a ``place`` has black around it, and the other eye sees what the measurement says.
    ``eye`` is whose lens it is read through, None for the measurement's own; ``angle`` and ``glasses`` are as in
    `Arrangement`. ``wait_s`` is the least time between the reading before and this one.

    Raises DeviceError if a code is not in 0..1, the name is empty or holds '#', a comma or an end of line, another eye
    is named without an eye to read, or the wait is below 0.
    """

    name: str
    codes: Codes
    around: Codes | None = None
    other: Codes | None = None
    place: Place | None = None
    eye: PatchEye | None = None
    angle: str = ""
    glasses: bool = True
    wait_s: float = 0.0

    def __post_init__(self) -> None:
        if not self.name.strip() or any(character in self.name for character in '#,"\n\r'):
            raise DeviceError(f"a patch needs a name without '#', quotes and commas, not '{self.name}'")
        for codes in (self.codes, self.around, self.other):
            if codes is not None and not _are_codes(codes):
                raise DeviceError(f"the patch '{self.name}' has the codes {codes}; three in 0..1 are needed")
        if self.other is not None and self.eye not in ("left", "right"):
            raise DeviceError(
                f"the patch '{self.name}' has codes for the other eye, but does not say which eye is read"
            )
        if not 0.0 <= self.wait_s < math.inf:
            raise DeviceError(f"the patch '{self.name}' cannot wait {self.wait_s} s")

    def rounded(self, highest: int) -> Patch:
        """Return the patch as a surface of codes 0..``highest`` shows it."""
        around = None if self.around is None else _rounded(self.around, highest)
        other = None if self.other is None else _rounded(self.other, highest)
        return replace(self, codes=_rounded(self.codes, highest), around=around, other=other)

    def arrangement(self, eye: PatchEye) -> Arrangement:
        """Return how the instrument stands, in a measurement of ``eye``."""
        angle = self.angle if degrees(self.angle) else ""
        return Arrangement(self.eye or eye, self.place, angle, self.glasses)


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

    Each is shown ``repeats`` times. Black and white come throughout a set that is a ``characterisation``.

    Raises DeviceError if there are none, two share a name, or ``repeats`` is below 1.
    """

    name: str
    patches: tuple[Patch, ...]
    source: str = ""
    repeats: int = 1
    characterisation: bool = True

    def __post_init__(self) -> None:
        if not self.patches:
            raise DeviceError(f"the set '{self.name}' holds no patches")
        twice = _first_repeated((patch.name, patch.eye) for patch in self.patches)
        if twice is not None:
            raise DeviceError(f"two patches of the set '{self.name}' are called '{twice}'")
        if self.repeats < 1:
            raise DeviceError(f"the set '{self.name}' cannot be shown {self.repeats} times")

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
