"""The set of patches that shows what codes pass on their way to the light, and how light depends on the picture.

`devices.diagnostics` judges these readings by their codes, areas and surrounds; the tag ``@cable`` in their names keeps
them out of every fit and out of the checks of a characterisation.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from devices.readings.patch import Codes, Patch, PatchSet

# Codes of 8 bits. A signal of 16..235 that is taken for 0..255, or the reverse, shows at the ends.
DARK_CODES = (0, 8, 12, 16, 20, 24, 32, 48)
BRIGHT_CODES = (215, 225, 235, 239, 243, 247, 250, 251, 252, 253, 254, 255)
# Successive codes in the middle, where one is about 1.8 % of light.
SUCCESSIVE_CODES = tuple(range(120, 137))
CHANNEL_CODES = (96, 160, 255)
INCREMENT_FROM, INCREMENT_TO = 128, 208
SURROUNDS: Mapping[str, Codes] = MappingProxyType(
    {"black": (0.0, 0.0, 0.0), "grey": (0.5, 0.5, 0.5), "white": (1.0, 1.0, 1.0)}
)
MIDDLE_AREA = 1.0 / 9.0
WHITE_AREAS = (0.02, 0.05, 0.25, 0.5, 0.75, 1.0)
BLACK_AREA = 0.64
_FULL = 255


def cable() -> PatchSet:
    """Return the patches, each to be read three times.

    In the middle of a black screen, where no limit of the picture's mean level is reached: greys near black, near white
    and at successive codes; the channels at three codes, in pairs, and added to a grey. Besides, greys on a black, a
    grey and a white screen; white of several areas; black beside grey, after black and after white.
    """
    black, white = SURROUNDS["black"], SURROUNDS["white"]
    codes = {f"grey{code:03d}": _grey(code) for code in sorted({*DARK_CODES, *SUCCESSIVE_CODES, *BRIGHT_CODES})}
    for channel, name in enumerate(("red", "green", "blue")):
        codes |= {f"{name}{code:03d}": _channel(channel, code, 0) for code in CHANNEL_CODES}
        codes[f"grey+{name}"] = _channel(channel, INCREMENT_TO, INCREMENT_FROM)
    codes |= {"yellow": (1.0, 1.0, 0.0), "cyan": (0.0, 1.0, 1.0), "magenta": (1.0, 0.0, 1.0)}
    patches = [Patch(f"{name}@cable", own, area=MIDDLE_AREA) for name, own in codes.items()]
    patches += [Patch(f"white@cable-{100 * area:g}%", white, area=area) for area in WHITE_AREAS]
    patches += on_each_surround()
    patches.append(Patch("black@cable-in-grey", black, around=SURROUNDS["grey"], area=BLACK_AREA))
    patches += [Patch(f"black@cable-after-{name}", black, before=SURROUNDS[name]) for name in ("black", "white")]
    return PatchSet("cable", tuple(patches), "what codes pass on their way to the light", 3, characterisation=False)


def on_each_surround() -> list[Patch]:
    """Return three greys in the middle of a black, a grey and a white screen."""
    return [
        Patch(f"grey{round(1000 * level):03d}@on-{name}", (level, level, level), around=around)
        for level in (0.25, 0.5, 0.75)
        for name, around in SURROUNDS.items()
    ]


def _grey(code: int) -> Codes:
    level = code / _FULL
    return level, level, level


def _channel(channel: int, code: int, others: int) -> Codes:
    red, green, blue = ((code if index == channel else others) / _FULL for index in range(3))
    return red, green, blue
