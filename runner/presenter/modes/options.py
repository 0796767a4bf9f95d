"""Options of a mode: where an eye's picture stands, what an anaglyph's filters pass, marks for instruments."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeAlias

from devices.compensation import Filter
from documents import Finding
from documents.text import did_you_mean
from runner.presenter.errors import PresentationError

Mirror = tuple[bool, bool]
MIRRORS: Mapping[str, Mirror] = MappingProxyType(
    {"none": (False, False), "horizontal": (True, False), "vertical": (False, True), "both": (True, True)}
)
CORNERS: Mapping[str, tuple[bool, bool]] = MappingProxyType(
    {
        "top-left": (False, False),
        "top-right": (True, False),
        "bottom-left": (False, True),
        "bottom-right": (True, True),
    }
)
SPLITS: Mapping[str, bool] = MappingProxyType({"least-squares": False, "channels": True})
_FILTERS = MappingProxyType({"left_filter": "left", "right_filter": "right", "anaglyph": "split_channels"})


@dataclass(frozen=True, slots=True)
class Filters:
    """What each filter does to light: the share that it passes of each channel, or a matrix (3, 3) on XYZ.

    None is the mode's own default. ``split_channels`` mixes nothing: each channel is one eye's alone.
    """

    left: Filter | None = None
    right: Filter | None = None
    split_channels: bool = False


@dataclass(frozen=True, slots=True)
class ModeOptions:
    """How a mode is adjusted to the rig; the default adjusts nothing.

    ``swap_eyes`` gives each eye the other's place: crossed in place of parallel halves, the right eye on top, the left
    eye on odd rows. The offsets, (right, down) in pixels of the eye's view, move all that the eye sees. A mirror is
    (left to right, top to bottom). ``filters`` are those of an anaglyph. ``sync_line`` marks the lowest row of each
    eye's frame: blue for a quarter of its width is the left eye's, for three quarters the right eye's. A photodiode's
    square stands in a corner, (right, bottom), and is white and black in turn with each new scene.
    """

    swap_eyes: bool = False
    left_offset_px: tuple[int, int] = (0, 0)
    right_offset_px: tuple[int, int] = (0, 0)
    left_mirror: Mirror = (False, False)
    right_mirror: Mirror = (False, False)
    filters: Filters | None = None
    sync_line: bool = False
    photodiode_corner: tuple[bool, bool] | None = None
    photodiode_size_px: int = 60

    @classmethod
    def parse(cls, options: Mapping[str, Any]) -> ModeOptions:
        """Return the options of a rig file's ``mode_options``; what is absent keeps its default.

        Raises
        ------
        PresentationError
            With a finding for each unknown key, with the nearest spelling, and each value that cannot be.
        """
        readers: dict[str, Read] = {
            "swap_eyes": flag,
            "left_offset_px": pair_px,
            "right_offset_px": pair_px,
            "left_mirror": one_of(MIRRORS),
            "right_mirror": one_of(MIRRORS),
            "sync_line": flag,
            "photodiode_corner": one_of(CORNERS),
            "photodiode_size_px": positive_px,
            "left_filter": read_filter,
            "right_filter": read_filter,
            "anaglyph": one_of(SPLITS),
        }
        values = read_options(options, readers)
        filters = {_FILTERS[key]: values.pop(key) for key in _FILTERS if key in values}
        return cls(**values, filters=Filters(**filters) if filters else None)


def refuse_options(mode: str, why: str, remedy: str) -> PresentationError:
    """Return the error of a mode that cannot be adjusted as asked."""
    return PresentationError(Finding(f"the mode '{mode}' {why}", remedy=remedy))


Read: TypeAlias = Callable[[Any], Any]  # raises ValueError with what was expected


def flag(value: Any) -> bool:
    """Return ``value`` if it is true or false."""
    if not isinstance(value, bool):
        raise ValueError("expected true or false")
    return value


def pair_px(value: Any) -> tuple[int, int]:
    """Return two whole numbers."""
    whole = isinstance(value, list | tuple) and [type(part) for part in value] == [int, int]
    if not whole:
        raise ValueError("expected two whole numbers of pixels, such as [3, -2]")
    return value[0], value[1]


def positive_px(value: Any) -> int:
    """Return a whole number above 0."""
    if type(value) is not int or value < 1:
        raise ValueError("expected a whole number of pixels above 0")
    return value


def one_of(choices: Mapping[str, Any]) -> Read:
    """Return a reader of one of the names in ``choices``."""

    def read(value: Any) -> Any:
        if not isinstance(value, str) or value not in choices:
            raise ValueError(did_you_mean(str(value), choices))
        return choices[value]

    return read


def read_options(options: Mapping[str, Any], readers: Mapping[str, Read]) -> dict[str, Any]:
    """Return the values of ``options`` by their ``readers``.

    Raises
    ------
    PresentationError
        With a finding for every fault.
    """
    values: dict[str, Any] = {}
    findings: list[Finding] = []
    for key, value in options.items():
        if key not in readers:
            findings.append(Finding(f"unknown mode option '{key}'", remedy=did_you_mean(str(key), readers)))
            continue
        try:
            values[key] = readers[key](value)
        except ValueError as error:
            findings.append(Finding(f"the mode option '{key}' is {value!r}", remedy=str(error)))
    if findings:
        raise PresentationError(findings)
    return values


def read_filter(value: Any) -> Filter:
    """Return three shares in 0..1, or a 3 × 3 matrix; raise ValueError with what was expected."""
    if isinstance(value, list | tuple) and len(value) == 3:
        if all(isinstance(row, list | tuple) and len(row) == 3 and all(map(_number, row)) for row in value):
            first, second, third = ((float(row[0]), float(row[1]), float(row[2])) for row in value)
            return first, second, third
        if all(_number(share) and 0.0 <= share <= 1.0 for share in value):
            return float(value[0]), float(value[1]), float(value[2])
    raise ValueError("expected the shares of red, green and blue that it passes, such as [0.9, 0.05, 0.02], or 3 × 3")


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
