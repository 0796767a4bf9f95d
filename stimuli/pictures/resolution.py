"""The detail of a picture that a display's pixels keep, and the detail that eyes resolve.

Thesis Section 2.4.1: eyes resolve 60 cycles per degree, and a picture should have MR = FOV · 60 pixels (Expression
2.12). A cycle takes two pixels: FOV · 120 are needed. Both are reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from devices.display import (
    CYCLES_PER_DEGREE,
    minimum_resolution,
    nyquist_resolution,
    pixels_per_degree,
    visual_angle_deg,
)
from documents.text import JsonResult
from stimuli.errors import StimulusError
from stimuli.pictures.resampling import display_pixels


@dataclass(frozen=True, slots=True)
class Resolution(JsonResult):
    """A picture ``size_mm`` wide and high of ``picture_px`` pixels, on ``display_px`` pixels of a display.

    ``needed_px`` are the thesis's MR, ``nyquist_px`` twice that. Frequencies are in cycles per degree straight ahead.
    """

    size_mm: tuple[float, float]
    distance_mm: float
    picture_px: tuple[int, int]
    display_px: tuple[int, int]
    needed_px: tuple[float, float]
    nyquist_px: tuple[float, float]
    picture_cycles_per_degree: float
    display_cycles_per_degree: float
    json_names: ClassVar = (
        "size_mm distance_mm picture_px display_px pixels_per_degree needed_px nyquist_px picture_cycles_per_degree "
        "display_cycles_per_degree lost_cycles_per_degree"
    )

    @property
    def lost_cycles_per_degree(self) -> tuple[float, float] | None:
        """Frequencies that the picture holds and the display's pixels cannot, from and to; None if there are none."""
        low, high = self.display_cycles_per_degree, self.picture_cycles_per_degree
        return (low, high) if low < high * (1 - 1e-9) else None

    @property
    def seen_and_lost(self) -> tuple[float, float] | None:
        """Those of them that eyes would resolve, or None."""
        lost = self.lost_cycles_per_degree
        if lost is None or lost[0] >= CYCLES_PER_DEGREE:
            return None
        return lost[0], min(lost[1], CYCLES_PER_DEGREE)

    def sentences(self) -> tuple[str, ...]:
        """Return sentences on the detail that is lost."""
        wide, display = self.display_px[0], self.display_cycles_per_degree
        needed = f"the {CYCLES_PER_DEGREE:g} that eyes resolve need {self.nyquist_px[0]:.0f}"
        if wide >= self.nyquist_px[0]:
            grid = "eyes cannot see the display's pixels"
        elif wide >= self.needed_px[0]:
            grid = f"{needed}; there is the one pixel per cycle that is also asked for ({self.needed_px[0]:.0f})"
        else:
            grid = f"{needed}, at two pixels per cycle ({self.needed_px[0]:.0f} at the one that is also asked for)"
        lines = [f"{wide} pixels across carry {display:.1f} cycles per degree: {grid}"]
        if self.lost_cycles_per_degree:
            low, high = self.lost_cycles_per_degree
            seen = f"; eyes would resolve up to {self.seen_and_lost[1]:.1f}" if self.seen_and_lost else ""
            lines.append(f"the picture's detail from {low:.1f} to {high:.1f} cycles per degree is lost{seen}")
        return tuple(lines)

    @property
    def pixels_per_degree(self) -> float:
        """How many pixels of the display a degree has."""
        return 2 * self.display_cycles_per_degree


def display_resolution(
    picture_px: tuple[int, int], size_mm: tuple[float, float], pixel_pitch_mm: float, distance_mm: float
) -> Resolution:
    """Return what a display of ``pixel_pitch_mm`` at ``distance_mm`` keeps of a picture; width comes before height.

    Parameters
    ----------
    picture_px
        Width and height of the picture in pixels, at least 1.
    size_mm
        Width and height of the picture on the display, in mm.
    pixel_pitch_mm
        The pixel pitch of the display, in mm.
    distance_mm
        The distance from the eyes to the display, in mm.

    Returns
    -------
    Resolution
        The pixels that the display has for the picture and those that eyes need, and both frequencies in cycles per
        degree.

    Raises
    ------
    InputError
        If a size, the pitch or the distance is not a finite number above 0.

    Examples
    --------
    >>> kept = display_resolution((3000, 2000), (300.0, 200.0), pixel_pitch_mm=0.25, distance_mm=600.0)
    >>> kept.display_px, round(kept.display_cycles_per_degree, 1), round(kept.picture_cycles_per_degree, 1)
    ((1200, 800), 20.9, 52.4)
    """
    if min(picture_px) < 1:
        raise StimulusError(f"a picture has {picture_px[0]} × {picture_px[1]} pixels; expected at least 1")
    fov = [float(visual_angle_deg(size, distance_mm)) for size in size_mm]
    coarser_mm = max(size / count for size, count in zip(size_mm, picture_px, strict=True))
    return Resolution(
        size_mm,
        distance_mm,
        picture_px,
        (display_pixels(size_mm[0], pixel_pitch_mm), display_pixels(size_mm[1], pixel_pitch_mm)),
        (float(minimum_resolution(fov[0])), float(minimum_resolution(fov[1]))),
        (float(nyquist_resolution(fov[0])), float(nyquist_resolution(fov[1]))),
        0.5 * pixels_per_degree(coarser_mm, distance_mm),
        0.5 * pixels_per_degree(pixel_pitch_mm, distance_mm),
    )
