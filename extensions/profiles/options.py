"""What a person chooses of `cyclopean display convert`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from devices.display import Eye
from documents.options import Typed


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvertOptions:
    """What a display file converts, and to what.

    Attributes
    ----------
    display
        Display file; with icc and cube it is FILE.
    mode
        Stereo mode of the display file. Default: its only one.
    eye
        Eye whose model is used.
    to
        Quantity to print, or kind of file to write.
    full
        Code of full drive.
    output
        File to write. Default: the display file's name with .icc or .cube.
    profile_kind
        Matrix and curves, or tables; auto takes a matrix where it is exact enough.
    cube_input
        What goes into a .cube: sRGB codes, or each channel's share of light.
    points
        Points of a table, a side. Default: as many as it needs.
    """

    display: Annotated[Path | None, Typed(metavar="DISPLAY.yaml")] = None
    mode: str | None = None
    eye: Eye = "left"
    to: Literal["code", "xyz", "icc", "cube"]
    full: Annotated[float, Typed(least=0, above=True)] = 255.0
    output: Annotated[Path | None, Typed("-o --output", "FILE")] = None
    profile_kind: Literal["auto", "matrix", "table"] = "auto"
    cube_input: Literal["srgb", "light"] = "srgb"
    points: Annotated[int | None, Typed(least=2)] = None
