"""What a rig's screen is to an eye: pixels, angles, and the light that it can make."""

from __future__ import annotations

from dataclasses import dataclass

from devices.display.display_file import EyeModels
from devices.display.viewing import disparity_arcmin, mm_from_px, px_from_mm, size_mm, visual_angle_deg
from stimuli.vision_tests.shown_range import ShownRange


@dataclass(frozen=True, slots=True)
class Screen:
    """An eye's view of ``view_px`` and the geometry in which it is seen.

    ``grain_px`` is how many pixels of the view, across and down, there are to one that the eye is really shown: 2 where
    a mode squeezes the view or gives the eye every second row or column, else 1.
    """

    view_px: tuple[int, int]
    pixel_pitch_mm: float
    distance_mm: float
    interpupillary_distance_mm: float
    grain_px: tuple[int, int]
    models: EyeModels

    @property
    def shown(self) -> ShownRange:
        """The light that both eyes can be shown."""
        return ShownRange(self.models)

    def px(self, angle_deg: float) -> float:
        """Return how many pixels subtend an angle, about the middle of the view."""
        return float(px_from_mm(size_mm(angle_deg, self.distance_mm), self.pixel_pitch_mm))

    def degrees(self, length_px: float) -> float:
        """Return the angle of a length about the middle of the view."""
        return float(visual_angle_deg(mm_from_px(length_px, self.pixel_pitch_mm), self.distance_mm))

    def fitting_px(self, angle_deg: float) -> int:
        """Return the side of a square of ``angle_deg``, or of the largest one that fits with words above and below."""
        width, height = self.view_px
        return int(min(self.px(angle_deg), 0.92 * width, 0.68 * height))

    def parallax_px(self, disparity_arcsec: float) -> float:
        """Return the right eye's place minus the left's for a disparity: negative is in front, nearer than the screen.

        Undoes `disparity_arcmin` of devices.display.viewing: the eyes converge on the point by as much more than on the
        screen.
        """
        eyes_mm = self.interpupillary_distance_mm
        screen_deg = float(visual_angle_deg(eyes_mm, self.distance_mm))
        parallax_mm = eyes_mm - size_mm(screen_deg - disparity_arcsec / 3600.0, self.distance_mm)
        return float(px_from_mm(parallax_mm, self.pixel_pitch_mm))

    def disparity_arcsec(self, parallax_px: float) -> float:
        """Return the disparity of a parallax; positive is behind the screen."""
        geometry = self.pixel_pitch_mm, self.distance_mm, self.interpupillary_distance_mm
        return 60.0 * float(disparity_arcmin(parallax_px, *geometry))
