"""The panel of a display: as a file states it, or as the monitor reports it to the system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from devices.errors import DeviceError
from documents import Finding
from documents.text import visible
from documents.yaml import FileModel, Natural, Positive, yaml_text

PANEL_EXAMPLE = "panel: {resolution_px: [1920, 1080], pixel_pitch_mm: 0.2768, refresh_hz: 60}"
# Monitors that do not know their size report their shape, 16:9 or 160 x 90 mm (VESA E-EDID A2, Section 3.6.2).
_SHAPES = ((16, 9), (16, 10), (4, 3), (5, 4))
# glfw and X servers suppose so many pixels per inch where a monitor reports no size.
_SUPPOSED_DPI = 96.0
_MM_PER_INCH = 25.4
# From the finest panels before an eye to walls of diodes.
_PITCHES_MM = (0.005, 5.0)
_MOST_UNEVEN = 1.05


# The longest picture that graphics cards hold has 32768 pixels.
_Side = Annotated[Natural, Field(le=65_536)]


class PanelSpec(FileModel):
    """The panel: how many pixels, how large, how fast, how deep."""

    resolution_px: tuple[_Side, _Side]
    """Width and height of the panel, in pixels."""
    pixel_pitch_mm: Annotated[Positive, Field(le=1000)]
    """The distance between neighbouring pixels, in mm."""
    refresh_hz: Annotated[Positive, Field(le=100_000)] = 60.0
    """The refresh rate, in Hz."""
    bits: Literal[6, 8, 10, 12] = 8
    """How many bits each channel of the panel has."""

    @property
    def text(self) -> str:
        """Return it in a line, such as ``1920x1080,0.2768,120,8``: pixels, pixel pitch in mm, Hz, bits."""
        across, down = self.resolution_px
        return f"{across}x{down},{self.pixel_pitch_mm:.12g},{self.refresh_hz:.12g},{self.bits}"

    @classmethod
    def parse(cls, text: str) -> PanelSpec:
        """Read what `text` returns; without Hz they are 60, without bits 8. ValueError if it is none."""
        size, *rest = text.split(",")
        across, down = (int(part) for part in size.lower().split("x"))
        if not 1 <= len(rest) <= 3:
            raise ValueError(text)
        refresh = float(rest[1]) if len(rest) > 1 else 60.0
        bits = int(rest[2]) if len(rest) > 2 else 8
        # As a file would say it: pydantic's ValidationError is a ValueError.
        fields = {
            "resolution_px": (across, down),
            "pixel_pitch_mm": float(rest[0]),
            "refresh_hz": refresh,
            "bits": bits,
        }
        return cls.model_validate(fields)

    @property
    def code_bits(self) -> Literal[8, 10]:
        """How many bits a channel to ask the graphics driver for: 10 for a panel that has them."""
        return 10 if self.bits >= 10 else 8

    @property
    def line(self) -> str:
        """Return it as a line of YAML, its key first."""
        return f"panel: {yaml_text(self.model_dump())}"


def read_panel(text: str) -> PanelSpec:
    """Return the panel that a person typed, such as ``1920x1080,0.2768,120,8``: as `PanelSpec.parse`.

    Raises
    ------
    DeviceError
        If it is none.
    """
    try:
        return PanelSpec.parse(text)
    except ValueError as error:
        remedy = "pixels, pixel pitch in mm, and if need be Hz and bits, such as 1920x1080,0.2768,120,8"
        raise DeviceError(Finding(f"'{text}' is no panel", remedy=remedy)) from error


@dataclass(frozen=True, slots=True)
class ReportedMonitor:
    """What a monitor reports of itself: pixels, size in mm (0 where it is not known), and Hz, None if not known."""

    name: str
    size_px: tuple[int, int]
    size_mm: tuple[int, int]
    refresh_hz: float | None = None

    @property
    def words(self) -> str:
        """Return whose size it is, in a phrase."""
        return f"the monitor '{visible(self.name)}', {self.size_mm[0]} x {self.size_mm[1]} mm"


# Given the monitors that the rig names, none if it names none: returns the one that pictures are shown on, or its panel
# where that is known; None if there is no monitor.
AskMonitor = Callable[[tuple[str, ...]], ReportedMonitor | PanelSpec | None]


def panel_of_monitor(monitor: ReportedMonitor) -> PanelSpec:
    """Return the panel of a monitor by what it reports of itself.

    Parameters
    ----------
    monitor
        Its pixels, its size in mm and its refresh rate.

    Returns
    -------
    PanelSpec
        The panel, with the pixel pitch along its diagonal, of 8 bits.

    Raises
    ------
    DeviceError
        If the size is missing, made up, or does not go with the pixels: it says what to write in a rig file.

    Examples
    --------
    >>> panel_of_monitor(ReportedMonitor("DP-1", (1920, 1080), (531, 299), 60.0)).text
    '1920x1080,0.276632,60,8'
    """
    reason = _doubt(monitor)
    if reason:
        across, down = monitor.size_px
        what = f"the monitor '{monitor.name}' reports {across} x {down} px and "
        what += f"{monitor.size_mm[0]} x {monitor.size_mm[1]} mm: {reason}"
        remedy = "write the panel beside 'nominal', with the width of the picture in mm as measured, divided by "
        remedy += f"{across}, as its pitch: panel: {{resolution_px: [{across}, {down}], pixel_pitch_mm: 0.2768}}"
        raise DeviceError(Finding(what, remedy=remedy))
    pitch_mm = _diagonal(monitor.size_mm) / _diagonal(monitor.size_px)
    refresh = {"refresh_hz": monitor.refresh_hz} if monitor.refresh_hz else {}
    return PanelSpec(resolution_px=monitor.size_px, pixel_pitch_mm=round(pitch_mm, 6), **refresh)


def _doubt(monitor: ReportedMonitor) -> str:
    """Return why a monitor's size cannot be true, an empty text if it can."""
    (across, down), (width_mm, height_mm) = monitor.size_px, monitor.size_mm
    if min(monitor.size_px) <= 0:
        return "it shows no pixels"
    if min(monitor.size_mm) <= 0:
        return "its size is not known"
    shapes = [(w * scale, h * scale) for w, h in _SHAPES for scale in (1, 10, 100)]
    if (width_mm, height_mm) in shapes or (height_mm, width_mm) in shapes:
        return "that is a shape, and no size"
    supposed = [pixels * _MM_PER_INCH / _SUPPOSED_DPI for pixels in monitor.size_px]
    if all(abs(mm - value) < 1.0 for mm, value in zip(monitor.size_mm, supposed, strict=True)):
        return f"that is what systems suppose ({_SUPPOSED_DPI:g} pixels per inch) where a monitor does not say its size"
    pitches = width_mm / across, height_mm / down
    # Sizes are in whole millimetres.
    slack = _MOST_UNEVEN * (1.0 + 1.0 / min(monitor.size_mm))
    if max(pitches) > slack * min(pitches):
        return f"its pixels would not be square ({pitches[0]:.4f} x {pitches[1]:.4f} mm)"
    if not _PITCHES_MM[0] <= min(pitches) <= max(pitches) <= _PITCHES_MM[1]:
        return f"its pixels would be {pitches[0]:.4g} mm apart"
    return ""


def _diagonal(sides: tuple[int, int]) -> float:
    return float((sides[0] ** 2 + sides[1] ** 2) ** 0.5)
