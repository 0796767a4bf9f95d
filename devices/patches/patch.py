"""A patch: a name and the device codes of its three channels."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from devices.errors import DeviceError

Codes = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Patch:
    """A uniform colour of device ``codes`` in 0..1: red, green, blue.

    Raises DeviceError if a code is not in 0..1, or the name is empty or holds '#', a comma or an end of line.
    """

    name: str
    codes: Codes

    def __post_init__(self) -> None:
        if not self.name.strip() or any(character in self.name for character in '#,"\n\r'):
            raise DeviceError(f"a patch needs a name without '#', quotes and commas, not '{self.name}'")
        if len(self.codes) != 3 or not all(math.isfinite(code) and 0.0 <= code <= 1.0 for code in self.codes):
            raise DeviceError(f"the patch '{self.name}' has the codes {self.codes}; three in 0..1 are needed")

    def rounded(self, highest: int) -> Patch:
        """Return the patch as a surface of codes 0..``highest`` shows it."""
        red, green, blue = (math.floor(code * highest + 0.5) / highest for code in self.codes)
        return Patch(self.name, (red, green, blue))


BLACK = Patch("black", (0.0, 0.0, 0.0))
WHITE = Patch("white", (1.0, 1.0, 1.0))


@dataclass(frozen=True, slots=True)
class PatchSet:
    """Patches of different names, and where they come from.

    Raises DeviceError if there are none or two share a name.
    """

    name: str
    patches: tuple[Patch, ...]
    source: str = ""

    def __post_init__(self) -> None:
        if not self.patches:
            raise DeviceError(f"the set '{self.name}' holds no patches")
        twice = _first_repeated(patch.name for patch in self.patches)
        if twice is not None:
            raise DeviceError(f"two patches of the set '{self.name}' are called '{twice}'")

    def rounded(self, highest: int) -> PatchSet:
        """Return the set as a surface of codes 0..``highest`` shows it."""
        return PatchSet(self.name, tuple(patch.rounded(highest) for patch in self.patches), self.source)


def _first_repeated(names: Iterable[str]) -> str | None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None
