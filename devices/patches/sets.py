"""The sets of patches by name: those that come with the project, and a person's own from a CSV file."""

from __future__ import annotations

import difflib
import itertools
from collections.abc import Callable, Mapping
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from devices.errors import DeviceError
from devices.patches.patch import Patch, PatchSet
from devices.patches.patch_file import parse_patches, read_patches
from documents import Finding

_GREY_STEPS = 32
_CUBE_STEPS = 5
_DARK_STEPS = 20  # 8 bits tell the first from black


def table_c1() -> PatchSet:
    """Return the 120 patches of the thesis's Table C.1: ramps of each channel, of yellow, cyan, magenta and grey."""
    text = (files("devices.patches") / "table_c1.csv").read_text(encoding="utf-8")
    return parse_patches(text, "table_c1.csv", "table_c1")


def grey_ramp(steps: int = _GREY_STEPS) -> PatchSet:
    """Return ``steps`` + 1 greys at equal steps of code, with black and white."""
    levels = [number / steps for number in range(steps + 1)]
    patches = tuple(_patch("grey", (level, level, level)) for level in levels)
    return PatchSet("grey", patches, f"{steps + 1} greys at equal steps of code")


def cube(steps: int = _CUBE_STEPS) -> PatchSet:
    """Return (``steps`` + 1)³ colours on a lattice of codes: what tells whether the channels add up."""
    levels = [number / steps for number in range(steps + 1)]
    patches = tuple(_patch("rgb", codes) for codes in itertools.product(levels, levels, levels))
    return PatchSet("cube", patches, f"a lattice of {steps + 1} codes a channel")


def dark_weighted(steps: int = _DARK_STEPS) -> PatchSet:
    """Return ramps of each channel and grey whose codes grow as the square: half of them lie in the lowest quarter."""
    levels = [(number / steps) ** 2 for number in range(1, steps + 1)]
    ramps = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1), "grey": (1, 1, 1)}
    patches = [_patch("grey", (0.0, 0.0, 0.0))]
    for name, (red, green, blue) in ramps.items():
        patches += [_patch(name, (red * level, green * level, blue * level)) for level in levels]
    return PatchSet("dark", tuple(patches), f"ramps of {steps} codes that grow as the square")


BUILT_IN: Mapping[str, Callable[[], PatchSet]] = MappingProxyType(
    {"table_c1": table_c1, "grey": grey_ramp, "cube": cube, "dark": dark_weighted}
)


def find_patches(name: str, code_range: str | None = None) -> PatchSet:
    """Return the built-in set called ``name``, or the set in the CSV file of that name.

    ``code_range`` is what the codes of a file run over, such as ``0..255``, if the file does not say.

    Raises
    ------
    DeviceError
        If there is neither, with the nearest name; or the file is wrong, with its line and column.
    """
    if name in BUILT_IN:
        return BUILT_IN[name]()
    if Path(name).suffix or Path(name).exists():
        return read_patches(Path(name), code_range)
    near = difflib.get_close_matches(name, BUILT_IN, n=1)
    remedy = f"did you mean '{near[0]}'?" if near else f"expected {', '.join(BUILT_IN)} or a CSV file"
    raise DeviceError(Finding(f"there is no set of patches '{name}'", remedy=remedy))


def _patch(kind: str, codes: tuple[float, float, float]) -> Patch:
    """Return a patch named after its codes, in thousandths; black and white are called so."""
    if set(codes) in ({0.0}, {1.0}):
        return Patch("white" if codes[0] else "black", codes)
    thousandths = [round(1000 * code) for code in codes]
    if kind == "rgb":
        return Patch("rgb" + "-".join(f"{level:03d}" for level in thousandths), codes)
    return Patch(f"{kind}{max(thousandths):03d}", codes)
