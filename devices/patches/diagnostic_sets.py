"""Sets of patches for one diagnosis each: their names carry the tags that `devices.diagnostics.readings` reads."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from types import MappingProxyType

from devices.patches.arrangement import PatchEye, Place
from devices.patches.patch import Codes, Patch, PatchSet

_COLOURS: Mapping[str, Codes] = MappingProxyType(
    {
        "white": (1.0, 1.0, 1.0),
        "red": (1.0, 0.0, 0.0),
        "green": (0.0, 1.0, 0.0),
        "blue": (0.0, 0.0, 1.0),
    }
)
_BLACK: Codes = (0.0, 0.0, 0.0)
_EYES: tuple[PatchEye, PatchEye] = ("left", "right")
_WARM_UP_CODE = 120 / 255  # the grey of the thesis's Figure 3.8


def crosstalk() -> PatchSet:
    """Return, through each lens, each colour with the other eye's picture black, and black with it in the other's."""
    patches = []
    for eye in _EYES:
        patches.append(Patch("black@other=black", _BLACK, other=_BLACK, eye=eye))
        for name, codes in _COLOURS.items():
            patches.append(Patch(f"{name}@other=black", codes, other=_BLACK, eye=eye))
            patches.append(Patch(f"black@other={name}", _BLACK, other=codes, eye=eye))
    source = "each eye's colours alone, and the other eye's seen through its black"
    return _special("crosstalk", patches, source)


def uniformity(rows: int = 3, columns: int = 3) -> PatchSet:
    """Return white in each cell of a grid over the screen, black around it."""
    cells = [Place(row + 1, column + 1, rows, columns) for row in range(rows) for column in range(columns)]
    patches = [Patch(f"white@r{place.row}c{place.column}", _COLOURS["white"], place=place) for place in cells]
    return _special("uniformity", patches, f"white at {rows} × {columns} places")


def on_surrounds() -> PatchSet:
    """Return three greys in the middle of a black, a grey and a white screen."""
    surrounds: Mapping[str, Codes] = {"black": _BLACK, "grey": (0.5, 0.5, 0.5), "white": _COLOURS["white"]}
    patches = [
        Patch(f"grey{round(1000 * level):03d}@on-{name}", (level, level, level), around=around)
        for level, (name, around) in itertools.product((0.25, 0.5, 0.75), surrounds.items())
    ]
    return _special("on-white", patches, "greys in the middle of a black, a grey and a white screen", repeats=2)


def additivity() -> PatchSet:
    """Return each channel at four codes, every mixture of two or three channels at them, and black."""
    patches = [Patch("black", _BLACK)]
    for level in (0.25, 0.5, 0.75, 1.0):
        lit = (0.0, level)
        for on in itertools.product(lit, lit, lit):
            if any(on):
                name = "rgb" + "-".join(f"{round(1000 * code):03d}" for code in on)
                patches.append(Patch("white" if all(code == 1.0 for code in on) else name, on))
    return _special("additivity", patches, "channels alone and together at four codes")


def repeatability(repeats: int = 8) -> PatchSet:
    """Return white, a grey and the primaries, shown ``repeats`` times in a mixed order."""
    patches = [Patch(name, codes) for name, codes in _COLOURS.items()] + [Patch("grey500", (0.5, 0.5, 0.5))]
    return _special("repeatability", patches, f"five colours {repeats} times", repeats)


def warm_up(repeats: int = 31, every_s: float = 60.0) -> PatchSet:
    """Return one grey, read ``repeats`` times at intervals of ``every_s`` seconds at least."""
    code = _WARM_UP_CODE
    patch = Patch("gray120@warm-up", (code, code, code), wait_s=every_s)
    return _special("warm-up", [patch], f"a grey {repeats} times, every {every_s:g} s", repeats)


def glasses() -> PatchSet:
    """Return greys, the primaries and black, through the glasses and without them."""
    levels = [number / 8 for number in range(1, 8)]
    colours: dict[str, Codes] = {"black": _BLACK, **_COLOURS}
    colours |= {f"grey{round(1000 * level):03d}": (level, level, level) for level in levels}
    patches = [Patch(name, codes) for name, codes in colours.items()]
    patches += [Patch(f"{name}@no-glasses", codes, glasses=False) for name, codes in colours.items()]
    return _special("glasses", patches, "greys and primaries through the glasses and without them")


def angles() -> PatchSet:
    """Return white straight ahead, to both sides and from above and below."""
    every = [f"{degrees}deg" for degrees in (0, 10, 20, 30, -10, -20, -30)]
    every += [f"v{degrees}deg" for degrees in (0, 10, 20, -10, -20)]
    patches = [Patch(f"white@{angle}", _COLOURS["white"], angle=angle) for angle in every]
    return _special("angles", patches, "white from twelve angles")


def _special(name: str, patches: list[Patch], source: str, repeats: int = 1) -> PatchSet:
    return PatchSet(name, tuple(patches), source, repeats, characterisation=False)
