"""How a new study differs from the default: the options of `cyclopean new`, in Python and typed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from documents.options import MONITOR, Typed

if TYPE_CHECKING:
    from devices.display import PanelSpec

Kind: TypeAlias = Literal["pairs", "best", "rating", "within-groups"]


@dataclass(frozen=True, slots=True)
class StudyOptions:
    """How a new study differs from the default.

    Attributes
    ----------
    kind
        What observers do: compare pairs, choose the best of a series, rate single pictures, or compare pairs within
        groups. A group is a folder, or the files whose names agree before the last underscore.
    mode
        Stereo mode. Default: flat for flat pictures, anaglyph-red-cyan for stereo pictures.
    question
        What observers are asked. Default: a question that suits --kind.
    white_cd_m2
        Luminance of white in cd/m². Default: 100, or the display's.
    display
        Display or rig file of a display that was measured. Default: a nominal sRGB display.
    panel
        Pixels and pixel pitch in mm of the nominal display. Default: what the monitor reports.
    distance_mm
        From the eyes to the screen in mm. Default: 600.
    monitors
        Monitor for the window, as `cyclopean doctor` lists them; twice for dual-window, the left eye's first. Default:
        the rig's, else the first of the panel's resolution.
    fit
        Bring pictures to one size on the screen, or leave them. Default: where they differ by more than 5 %.
    reference
        What the pictures are compared with: a picture, or a real thing beside the screen. Default: nothing.
    """

    kind: Kind = "pairs"
    mode: str | None = None
    question: str | None = None
    white_cd_m2: Annotated[float | None, Typed("--white")] = None
    display: Path | None = None
    panel: Annotated[PanelSpec | None, Typed(metavar="1920x1080,0.2768", read="devices.display.read_panel")] = None
    distance_mm: Annotated[float | None, Typed("--distance")] = None
    monitors: Annotated[tuple[str, ...], MONITOR] = ()
    fit: bool | None = None
    reference: Annotated[str | None, Typed(metavar="FILE|physical")] = None
