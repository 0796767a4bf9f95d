"""How display models are fitted to readings: the options in Python and typed."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from devices.readings import PatchEye
from documents.options import Typed

if TYPE_CHECKING:
    from devices.display import PanelSpec

Name: TypeAlias = Literal["gog", "gogo", "ggo", "gamma", "table", "plvc", "residual"]


@dataclass(frozen=True, slots=True)
class FitOptions:
    """How display models are fitted to readings.

    Attributes
    ----------
    mode
        Stereo mode of the readings. Default: the file's own.
    eye
        Eye that the readings were taken for.
    model
        Display model; auto takes the simplest that predicts held-out readings well, none fits none; or
        another package's curves, by their name.
    observer
        Colorimetric observer, if not the readings' own: CIE 2015 10, …
    seed
        Random seed for the cross-validation folds.
    keep_all
        Leave no reading out, even one that disagrees with all others.
    correct_drift
        Bring the readings to the end of the run where repeated patches show a drift.
    """

    mode: str | None = None
    eye: PatchEye = "both"
    model: Literal["auto", Name, "none"] | str = "auto"
    observer: Annotated[str | None, Typed(metavar="NAME")] = None
    seed: Annotated[int, Typed(least=0, most=1e40)] = 1
    keep_all: bool = False
    correct_drift: Annotated[bool, Typed("--drift-correction/--no-drift-correction")] = True


@dataclass(frozen=True, slots=True)
class FileOptions:
    """How a file of readings is read, fitted and written into a display file.

    Attributes
    ----------
    fit
        How models are fitted.
    without_glasses
        Readings of the same patches without glasses.
    code_range
        Range of the file's codes, if it does not state it.
    white_cd_m2
        Luminance of the white, of an ICC profile that does not say it.
    output
        Display file to create, or to write the mode into.
    panel
        Panel of a new display file, such as 1920x1080,0.2768,120,8. Default: the measured one.
    replace
        Overwrite an existing characterisation of the mode.
    brief
        Leave out the fits by the thesis's two methods.
    """

    fit: FitOptions = field(default_factory=FitOptions)
    without_glasses: Annotated[Path | None, Typed(metavar="FILE")] = None
    code_range: Annotated[str | None, Typed("--codes", "0..255")] = None
    white_cd_m2: Annotated[float | None, Typed(metavar="CD_M2", least=0, above=True)] = None
    output: Annotated[Path | None, Typed("-o --output", "DISPLAY.yaml")] = None
    panel: Annotated[PanelSpec | None, Typed(metavar="WxH,PITCH_MM[,HZ[,BITS]]", read="devices.display.read_panel")] = (
        None
    )
    replace: bool = False
    brief: bool = False
