"""The sets of patches by name: those that come with the project, and a person's own from a CSV file."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from devices.errors import DeviceError
from devices.patches import diagnostic_sets
from devices.patches.patch import Patch, PatchSet, parse_patches, read_patches
from documents import Finding
from documents.text.words import did_you_mean

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


CHARACTERISATIONS: Mapping[str, Callable[[], PatchSet]] = MappingProxyType(
    {"table_c1": table_c1, "grey": grey_ramp, "cube": cube, "dark": dark_weighted}
)
DIAGNOSTIC: Mapping[str, Callable[[], PatchSet]] = MappingProxyType(
    {
        "warm-up": diagnostic_sets.warm_up,
        "repeatability": diagnostic_sets.repeatability,
        "additivity": diagnostic_sets.additivity,
        "on-white": diagnostic_sets.on_surrounds,
        "uniformity": diagnostic_sets.uniformity,
        "angles": diagnostic_sets.angles,
        "crosstalk": diagnostic_sets.crosstalk,
        "glasses": diagnostic_sets.glasses,
    }
)
BUILT_IN: Mapping[str, Callable[[], PatchSet]] = MappingProxyType({**CHARACTERISATIONS, **DIAGNOSTIC})
ALL = "all"
# Warm-up first, what nobody need be there for next, and what the glasses come off for last.
_ALL = (
    "warm-up",
    "table_c1",
    "repeatability",
    "additivity",
    "on-white",
    "uniformity",
    "angles",
    "crosstalk",
    "glasses",
)


def find_sets(
    names: Sequence[str], code_range: str | None = None, every_s: float | None = None
) -> tuple[PatchSet, ...]:
    """Return the sets called ``names``, each once; ``all`` is one set for each diagnosis.

    ``every_s`` is the time between the readings of the warm-up, if not its own.

    Raises
    ------
    DeviceError
        As `find_patches`, or if no set is named.
    """
    wanted = dict.fromkeys(one for name in names for one in (_ALL if name == ALL else (name,)))
    if not wanted:
        raise DeviceError(Finding("no set of patches is named", remedy=f"expected {', '.join(BUILT_IN)} or a CSV file"))
    sets = tuple(find_patches(name, code_range) for name in wanted)
    if every_s is None:
        return sets
    return tuple(diagnostic_sets.warm_up(one.repeats, every_s) if one.name == "warm-up" else one for one in sets)


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
    remedy = did_you_mean(name, [*BUILT_IN, ALL], f"expected {', '.join(BUILT_IN)}, {ALL} or a CSV file")
    raise DeviceError(Finding(f"there is no set of patches '{name}'", remedy=remedy))


def _patch(kind: str, codes: tuple[float, float, float]) -> Patch:
    """Return a patch named after its codes, in thousandths; black and white are called so."""
    if set(codes) in ({0.0}, {1.0}):
        return Patch("white" if codes[0] else "black", codes)
    thousandths = [round(1000 * code) for code in codes]
    if kind == "rgb":
        return Patch("rgb" + "-".join(f"{level:03d}" for level in thousandths), codes)
    return Patch(f"{kind}{max(thousandths):03d}", codes)
