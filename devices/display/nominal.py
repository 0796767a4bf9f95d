"""Displays that were not measured: what a standard says that a display like it shows.

Codes give light by the standard's curve and primaries, relative to the display's own black and white: code 0 is the
black of a picture, and code 1 its white (ICC media-relative colorimetry with black point compensation). The black is
stated, as light that adds to every colour, and never corrected for: no guess moves a dark colour. sRGB does the same:
its reference display has an offset of 0, and veiling glare is a fact of the viewing conditions [IEC1999].
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import model_validator

from devices.colour import D65_XY, DISPLAY_P3_PRIMARIES_XY, SRGB_PRIMARIES_XY, rgb_to_xyz_matrix
from devices.colour_matching import DEFAULT_OBSERVER
from devices.display.curves import Curve, SrgbCurve, ToneCurve, bt1886_curve
from devices.display.model import DisplayModel
from devices.display.options import NominalKind, NominalOptions
from devices.display.panel import PANEL_EXAMPLE, AskMonitor, PanelSpec, panel_of_monitor
from devices.errors import DeviceError
from documents import Finding
from documents.arrays import Floats
from documents.files import write_whole, writing
from documents.options import Typed
from documents.text import JsonResult
from documents.yaml import FileModel, NotNegative, Positive

NOT_MEASURED = "nominal, not measured"
NOMINAL_OBSERVER = DEFAULT_OBSERVER  # that of the chromaticities of the standards
_BLACK_SHARE = 0.001
_NAMES: Mapping[str, str] = MappingProxyType(
    {"srgb": "sRGB", "gamma2.2": "gamma 2.2", "bt1886": "BT.1886", "display-p3": "Display P3"}
)


class NominalSpec(FileModel):
    """A display that was not measured: a standard, the luminance of its white and of its black, and its panel.

    ``black_cd_m2`` is 0.1 % of white where it is not given; ``panel`` is asked of the monitor.
    """

    nominal: NominalKind
    """The standard that the display is taken for: srgb, gamma2.2, bt1886 or display-p3."""
    white_cd_m2: Positive
    """The luminance of white, in cd/m²."""
    black_cd_m2: NotNegative | None = None
    """The luminance of black, in cd/m²."""
    panel: PanelSpec | None = None
    """The panel: pixels, pixel pitch, refresh rate and bits."""

    @model_validator(mode="after")
    def _black_is_below_white(self) -> Self:
        refuse_black(self.white_cd_m2, self.black_cd_m2)
        return self

    def with_panel(self, ask_monitor: AskMonitor | None, monitors: tuple[str, ...] = ()) -> tuple[PanelSpec, str]:
        """Return the panel and, where ``ask_monitor`` returned it, whose it is.

        Raises
        ------
        DeviceError
            If neither the file nor a monitor states it, with what to write.
        """
        if self.panel is not None:
            return self.panel, ""
        monitor = ask_monitor(monitors) if ask_monitor else None
        if monitor is None:
            what = "the panel is not stated, and there is no monitor here that could be asked for it"
            remedy = f"write it beside 'nominal': {PANEL_EXAMPLE}, the pitch being the picture's width in mm divided "
            remedy += "by its pixels"
            raise DeviceError(Finding(what, remedy=remedy))
        if isinstance(monitor, PanelSpec):
            return monitor, ""
        return panel_of_monitor(monitor), monitor.words


def refuse_black(white_cd_m2: float | None, black_cd_m2: float | None) -> None:
    """Raise ValueError if a black that is given is not below its white."""
    if white_cd_m2 is not None and black_cd_m2 is not None and black_cd_m2 >= white_cd_m2:
        raise ValueError(f"black_cd_m2 is {black_cd_m2:g}, and must be below white_cd_m2, {white_cd_m2:g}")


@dataclass(frozen=True, slots=True)
class Nominal(JsonResult):
    """A display as a standard describes it, not as it was measured.

    ``black_assumed`` is whether nobody stated the black. ``panel_from`` names the monitor that was asked for size and
    resolution, and is empty where a file states them.
    """

    kind: NominalKind
    white_cd_m2: float
    black_cd_m2: float
    black_assumed: bool = False
    panel_from: str = ""
    json_also: ClassVar = ("words",)
    json_optional: ClassVar = ("panel_from",)
    next_step: ClassVar = "measure it: cyclopean display measure"

    @classmethod
    def of(
        cls, kind: NominalKind, white_cd_m2: float, black_cd_m2: float | None = None, panel_from: str = ""
    ) -> Nominal:
        """Return the display, its black 0.1 % of white where none is given."""
        black = _BLACK_SHARE * white_cd_m2 if black_cd_m2 is None else black_cd_m2
        return cls(kind, white_cd_m2, black, black_cd_m2 is None, panel_from)

    @property
    def name(self) -> str:
        """The standard as people write it, such as ``sRGB``."""
        return _NAMES[self.kind]

    @property
    def words(self) -> str:
        """Return the standard and its luminances, in a phrase."""
        black = f"black {self.black_cd_m2:.4g} cd/m²{' (assumed)' if self.black_assumed else ''}"
        monitor = f"; panel from {self.panel_from}" if self.panel_from else ""
        return f"{self.name}: white {self.white_cd_m2:.4g} cd/m², {black}, without glasses{monitor}"

    @property
    def remark(self) -> str:
        """Return the sentence for people and records, without its full stop: what it is, and the next step."""
        what = f"the display is {NOT_MEASURED} ({self.words})"
        return f"{what}: its colours are those of a standard. To know them, measure it with cyclopean display measure"

    @property
    def black_XYZ_cd_m2(self) -> Floats:
        """XYZ (3,) of its black, of the chromaticity of white."""
        return np.asarray(self._matrix.sum(axis=1) * self.black_cd_m2)

    @property
    def _matrix(self) -> Floats:
        primaries = DISPLAY_P3_PRIMARIES_XY if self.kind == "display-p3" else SRGB_PRIMARIES_XY
        return rgb_to_xyz_matrix(*primaries, D65_XY)

    def model(self) -> DisplayModel:
        """Return the model that codes are computed with: light relative to black and white, so that it has no black.

        Raises
        ------
        DeviceError
            If it cannot be a display, such as a black of BT.1886 that leaves no light to its curve.
        """
        curve: Curve = SrgbCurve()
        if self.kind == "gamma2.2":
            curve = ToneCurve(gamma=2.2)
        elif self.kind == "bt1886":
            curve = bt1886_curve(self.white_cd_m2, self.black_cd_m2)
        return DisplayModel(np.zeros(3), self._matrix * self.white_cd_m2, (curve, curve, curve))

    def light_model(self) -> DisplayModel:
        """Return the model of its light, which an instrument would read: from its black to its white."""
        share = 1.0 - self.black_cd_m2 / self.white_cd_m2
        relative = self.model()
        return DisplayModel(self.black_XYZ_cd_m2, share * relative.primaries_XYZ_cd_m2, relative.curves)


_FILE = """\
# A nominal display: nobody measured it. Colours are those of a standard, and every record says so.
# It serves every stereo mode (docs/modes.md). To measure it, with glasses on, in the mode of the study:
#   cyclopean display measure RIG.yaml --instrument NAME -o readings.jsonl
#   cyclopean display fit readings.csv --mode MODE -o {file}
# That adds the mode below, measured; all other modes stay nominal.
schema_version: 1
nominal: {kind:<12}      # srgb, gamma2.2, bt1886 or display-p3: what the monitor's menu is set to
white_cd_m2: {white:<8}      # luminance of white without glasses: from the monitor's data sheet, or a luminance meter
{black}
{panel_note}{panel}
"""


@dataclass(frozen=True, slots=True)
class NominalFile(JsonResult):
    """The ``file`` of a nominal display that was written, and its panel."""

    file: Path
    nominal: Nominal
    panel: PanelSpec

    def told(self) -> Iterator[str]:
        """Yield what was written, and what comes next."""
        across, down = self.panel.resolution_px
        size = f"{across} x {down} px of {self.panel.pixel_pitch_mm:g} mm, {self.panel.refresh_hz:g} Hz"
        yield f"wrote {self.file}: {NOT_MEASURED}: {self.nominal.words}; {size}"
        yield f"Name it in a rig: display: {self.file.name}. Next step, {self.nominal.next_step}"


def write_nominal_display(
    path: Annotated[Path, Typed("-o --output")],
    options: NominalOptions | None = None,
    ask_monitor: AskMonitor | None = None,
) -> NominalFile:
    """Write the file of a nominal display, to begin with before it is measured.

    A nominal display shows colours by a standard, in every stereo mode. Every record and report of its sessions says
    "nominal, not measured". Nothing is overwritten.

    Parameters
    ----------
    path
        Display file to write: NAME.yaml.
    options
        The standard, white, black and panel.
    ask_monitor
        Called for the monitor where ``options`` has no panel.

    Returns
    -------
    NominalFile
        The display, and its panel.

    Raises
    ------
    DeviceError
        If the black is not below the white, the panel is not known, the file is there already, or it cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> panel = PanelSpec(resolution_px=(1920, 1080), pixel_pitch_mm=0.2768)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_nominal_display(Path(folder, "monitor.yaml"), NominalOptions(panel=panel)).nominal.words
    'sRGB: white 100 cd/m², black 0.1 cd/m² (assumed), without glasses'
    """
    options = options or NominalOptions()
    try:
        refuse_black(options.white_cd_m2, options.black_cd_m2)
    except ValueError as error:
        raise DeviceError(str(error)) from None
    spec = NominalSpec(
        nominal=options.nominal,
        white_cd_m2=options.white_cd_m2,
        black_cd_m2=options.black_cd_m2,
        panel=options.panel,
    )
    try:
        panel, panel_from = spec.with_panel(ask_monitor)
    except DeviceError as error:
        remedy = "give --panel 1920x1080,0.2768: its pixels, and the picture's width in mm divided by them"
        raise DeviceError([Finding(finding.message, remedy=remedy) for finding in error.findings]) from error
    nominal = Nominal.of(spec.nominal, spec.white_cd_m2, spec.black_cd_m2, panel_from)
    black = f"black_cd_m2: {nominal.black_cd_m2:<8.10g}"
    text = _FILE.format(
        file=path.name,
        kind=nominal.kind,
        white=f"{nominal.white_cd_m2:.10g}",
        black=f"# {black}    # luminance of black; nobody stated it, and 0.1 % of white is assumed"
        if nominal.black_assumed
        else f"{black}      # luminance of black",
        panel_note=f"# {panel_from}, as it reports itself\n" if panel_from else "",
        panel=panel.line,
    )
    if os.path.lexists(path):
        raise DeviceError(
            Finding("the file is there already, and is not overwritten", str(path), remedy="give -o another name")
        )
    with writing(path, "display file", DeviceError):
        write_whole(path, text, make_folder=False)
    return NominalFile(path, nominal, panel)
