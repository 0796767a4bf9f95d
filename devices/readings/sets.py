"""The sets of patches by name: those that come with the project, and a person's own from a CSV file.

A set for one diagnosis names its patches with the tags that `devices.diagnostics.readings` reads.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import cast

from devices.errors import DeviceError
from devices.readings.arrangement import GridCell, PatchEye
from devices.readings.code_range import DRIVEN, PARTS, SURROUND, driven, part_faults
from devices.readings.patch import Codes, Patch, PatchSet
from documents import Finding
from documents.tables import MOST_FINDINGS, Cells, Form
from documents.text import did_you_mean

# The set of patches that shows what codes pass on their way to the light, and how light depends on the picture.
#
# `devices.diagnostics` judges these readings by their codes, areas and surrounds; the tag ``@cable`` in their names
# keeps them out of every fit and out of the checks of a characterisation.

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


# Sets of patches in CSV files.
#
# The columns are ``name,red,green,blue``, with ``# codes: 0..255`` above. A patch that does not fill the picture has
# the share of it that it fills in ``area``, and the codes around it in ``surround_red,surround_green,surround_blue``;
# empty cells stand for all of it, and for black.

_FORM = Form((*DRIVEN, *PARTS), "table of patches", DeviceError)


def read_patches(path: Path, code_range: str | None = None) -> PatchSet:
    """Read the patches in the CSV file at ``path``; ``code_range`` is what its codes run over, if it does not say.

    Raises
    ------
    DeviceError
        With file, line, column, value and remedy of the first twenty faults.
    """
    return _patches(_FORM.read(path, _more_faults), path.stem, code_range)


def parse_patches(text: str, file: str, name: str, code_range: str | None = None) -> PatchSet:
    """Read the patches in ``text``; ``file`` is the name that findings carry; else as `read_patches`."""
    return _patches(_FORM.parse(text, file, _more_faults), name, code_range)


def _more_faults(table: Cells) -> Iterator[Finding]:
    """Yield what is wrong with a table of patches beside its numbers."""
    yield from part_faults(table)
    first: dict[str, int] = {}
    for row, name in enumerate(_names(table)):
        if name in first:
            yield table.fault(row, None, f"'{name}' stands in line {table.lines[first[name]]} too", "rename one")
        first.setdefault(name, row)


def _names(table: Cells) -> list[str]:
    return table.texts("name") if "name" in table else [f"patch{row + 1}" for row in range(len(table))]


def _patches(table: Cells, name: str, code_range: str | None) -> PatchSet:
    drive = driven(table, code_range)
    patches: list[Patch] = []
    findings: list[Finding] = []
    for row, called in enumerate(_names(table)):
        surround = None
        if drive.around is not None and any(table.texts(column)[row] for column in SURROUND):
            surround = cast(Codes, tuple(drive.around[row].tolist()))
        area = float(table.numbers("area")[row]) if table.texts("area")[row] else None
        try:
            patches.append(Patch(called, cast(Codes, tuple(drive.codes[row].tolist())), surround, area=area))
        except DeviceError as error:
            findings += [table.fault(row, None, finding.message, finding.remedy) for finding in error.findings]
    if findings:
        raise DeviceError(findings[:MOST_FINDINGS])
    return PatchSet(name, tuple(patches), table.comment("source", table.file))


_GREY_STEPS = 32
_CUBE_STEPS = 5
_DARK_STEPS = 20  # in 8 bits the first differs from black
_COLOURS: Mapping[str, Codes] = MappingProxyType(
    {
        "white": (1.0, 1.0, 1.0),
        "red": (1.0, 0.0, 0.0),
        "green": (0.0, 1.0, 0.0),
        "blue": (0.0, 0.0, 1.0),
    }
)
_BLACK: Codes = (0.0, 0.0, 0.0)
_GRAY_180: Codes = (180 / 255, 180 / 255, 180 / 255)
_EYES: tuple[PatchEye, PatchEye] = ("left", "right")
_WARM_UP_CODE = 120 / 255  # the grey of the thesis's Figure 3.8


def table_c1() -> PatchSet:
    """Return the 120 patches of the thesis's Table C.1: ramps of each channel, of yellow, cyan, magenta and grey."""
    text = (files("devices.readings") / "table_c1.csv").read_text(encoding="utf-8")
    return parse_patches(text, "table_c1.csv", "table_c1")


def grey_ramp(steps: int = _GREY_STEPS) -> PatchSet:
    """Return ``steps`` + 1 greys at equal steps of code, with black and white."""
    levels = [number / steps for number in range(steps + 1)]
    patches = tuple(_patch("grey", (level, level, level)) for level in levels)
    return PatchSet("grey", patches, f"{steps + 1} greys at equal steps of code")


def cube(steps: int = _CUBE_STEPS) -> PatchSet:
    """Return (``steps`` + 1)³ colours on a lattice of codes, which shows whether the channels add up."""
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


def crosstalk() -> PatchSet:
    """Return, through each lens, each colour alone, and black and a grey with it in the other eye's picture.

    Over the grey a negative leak shows, which has nothing to take over black.
    """
    patches = []
    for eye in _EYES:
        patches.append(Patch("black@other=black", _BLACK, other=_BLACK, eye=eye))
        for name, codes in _COLOURS.items():
            patches.append(Patch(f"{name}@other=black", codes, other=_BLACK, eye=eye))
            patches.append(Patch(f"black@other={name}", _BLACK, other=codes, eye=eye))
        for name, codes in {"black": _BLACK, **_COLOURS}.items():
            patches.append(Patch(f"gray180@other={name}", _GRAY_180, other=codes, eye=eye))
    source = "each eye's colours alone, and the other eye's seen through its black and over a grey"
    return _special("crosstalk", patches, source)


def uniformity(rows: int = 3, columns: int = 3) -> PatchSet:
    """Return white in each cell of a grid over the screen, black around it."""
    cells = [GridCell(row + 1, column + 1, rows, columns) for row in range(rows) for column in range(columns)]
    patches = [Patch(f"white@r{place.row}c{place.column}", _COLOURS["white"], place=place) for place in cells]
    return _special("uniformity", patches, f"white at {rows} × {columns} places")


def on_surrounds() -> PatchSet:
    """Return three greys in the middle of a black, a grey and a white screen."""
    source = "greys in the middle of a black, a grey and a white screen"
    return _special("on-white", on_each_surround(), source, repeats=2)


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


def warm_up_places(repeats: int = 7, every_s: float = 300.0) -> PatchSet:
    """Return one grey over the screen, read at three places along its middle (thesis Figure 3.8), round after round.

    There are ``repeats`` rounds, each begun at least ``every_s`` seconds after the last reading of the one before.
    """
    code = _WARM_UP_CODE
    grey: Codes = (code, code, code)
    waits = {1: every_s, 2: 0.0, 3: 0.0}
    patches = [
        Patch(f"gray120@warm-up-r2c{column}", grey, grey, place=GridCell(2, column), wait_s=wait_s)
        for column, wait_s in waits.items()
    ]
    source = f"a grey at three places {repeats} times, every {every_s:g} s"
    return PatchSet("warm-up-places", tuple(patches), source, repeats, characterisation=False, rounds=True)


def glasses() -> PatchSet:
    """Return greys, the primaries and black, through the glasses and without them."""
    levels = [number / 8 for number in range(1, 8)]
    colours: dict[str, Codes] = {"black": _BLACK, **_COLOURS}
    colours |= {f"grey{round(1000 * level):03d}": (level, level, level) for level in levels}
    patches = [Patch(name, codes) for name, codes in colours.items()]
    patches += [Patch(f"{name}@no-glasses", codes, glasses=False) for name, codes in colours.items()]
    return _special("glasses", patches, "greys and primaries through the glasses and without them")


def ambient() -> PatchSet:
    """Return black with the display switched off: what it sends to the eye of the room's light."""
    patches = [Patch("black@screen-off", _BLACK, screen_off=True)]
    return _special("ambient", patches, "the room's light from the screen while it is off", repeats=3)


def angles() -> PatchSet:
    """Return white straight ahead, to both sides and from above and below."""
    every = [f"{degrees}deg" for degrees in (0, 10, 20, 30, -10, -20, -30)]
    every += [f"v{degrees}deg" for degrees in (0, 10, 20, -10, -20)]
    patches = [Patch(f"white@{angle}", _COLOURS["white"], angle=angle) for angle in every]
    return _special("angles", patches, "white from twelve angles")


def _special(name: str, patches: list[Patch], source: str, repeats: int = 1) -> PatchSet:
    return PatchSet(name, tuple(patches), source, repeats, characterisation=False)


CHARACTERISATIONS: Mapping[str, Callable[[], PatchSet]] = MappingProxyType(
    {"table_c1": table_c1, "grey": grey_ramp, "cube": cube, "dark": dark_weighted}
)


DIAGNOSTIC: Mapping[str, Callable[[], PatchSet]] = MappingProxyType(
    {
        "warm-up": warm_up,
        "warm-up-places": warm_up_places,
        "repeatability": repeatability,
        "additivity": additivity,
        "on-white": on_surrounds,
        "cable": cable,
        "uniformity": uniformity,
        "angles": angles,
        "crosstalk": crosstalk,
        "glasses": glasses,
        "ambient": ambient,
    }
)


BUILT_IN: Mapping[str, Callable[[], PatchSet]] = MappingProxyType({**CHARACTERISATIONS, **DIAGNOSTIC})


ALL = "all"


# Warm-up first, what nobody need be there for next, what the glasses come off for, and last the display switched off.
_ALL = (
    "warm-up",
    "table_c1",
    "repeatability",
    "additivity",
    "on-white",
    "cable",
    "uniformity",
    "angles",
    "crosstalk",
    "glasses",
    "ambient",
)


def find_sets(
    names: Sequence[str], code_range: str | None = None, every_s: float | None = None
) -> tuple[PatchSet, ...]:
    """Return the sets called ``names``, each once; ``all`` is one set for each diagnosis.

    Parameters
    ----------
    names
        Names as `find_patches` takes them, or ``all``; at least one.
    code_range
        What the codes of files run over, such as ``0..255``, if they do not say; None if they do.
    every_s
        Seconds between the readings of the warm-up, above 0; None takes the set's own time.

    Returns
    -------
    tuple of PatchSet
        The sets in the order of ``names``, with codes in 0..1.

    Raises
    ------
    DeviceError
        As `find_patches`, or if no set is named.

    Examples
    --------
    >>> [patch_set.name for patch_set in find_sets(["grey", "dark", "grey"])]
    ['grey', 'dark']
    """
    wanted = dict.fromkeys(set_name for name in names for set_name in (_ALL if name == ALL else (name,)))
    if not wanted:
        raise DeviceError(Finding("no set of patches is named", remedy=f"expected {', '.join(BUILT_IN)} or a CSV file"))
    sets = tuple(find_patches(name, code_range) for name in wanted)
    if every_s is None:
        return sets
    timed = {"warm-up": warm_up, "warm-up-places": warm_up_places}
    return tuple(
        timed[patch_set.name](patch_set.repeats, every_s) if patch_set.name in timed else patch_set
        for patch_set in sets
    )


def find_patches(name: str, code_range: str | None = None) -> PatchSet:
    """Return the built-in set called ``name``, or the set in the CSV file of that name.

    Parameters
    ----------
    name
        One of `BUILT_IN`, or the path of a CSV file.
    code_range
        What the codes of a file run over, such as ``0..255``, if the file does not say; None if it does.

    Returns
    -------
    PatchSet
        The patches, with codes in 0..1.

    Raises
    ------
    DeviceError
        If there is neither, with the nearest name; or the file is wrong, with its line and column.

    Examples
    --------
    >>> len(find_patches("table_c1").patches)
    120
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
