"""Tone mapping by one factor, held back where a display would saturate (Section 4.5.2.2, Expressions 4.10 and 4.11).

V_out = k V_in with k = L_ref / L_max. Where that saturates more than 0.3 % of the pixels, the largest factor that does
not is used. The thesis searches for it; `saturation` solves it. Image 3.1 of Table 4.3 asks for 6.69 and gets 1.78.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from devices.display.display_file import EyeModels
from stimuli.luminance.saturation import Saturation, largest_factor, saturation
from stimuli.luminance.scale import factor_to, max_luminance_cd_m2, scaled_picture
from stimuli.pictures.stereo_image import Eye, StereoImage

# "This saturation percentage was chosen experimentally" (note 6 to Section 4.5.2.2).
LIMIT_PERCENT = 0.3
_EYES: tuple[Eye, Eye] = ("left", "right")


@dataclass(frozen=True, slots=True)
class ToneMapping:
    """Which factor was asked for and which one used, one for both eyes, and what saturates in each eye at either.

    ``largest_factor`` is the limit's, infinite where nothing can saturate. ``pixels_transformed`` counts the work of
    finding it.
    """

    reference_cd_m2: float
    max_cd_m2: float
    limit_percent: float
    asked_factor: float
    largest_factor: float
    saturated_at_asked: Mapping[Eye, Saturation]
    saturated: Mapping[Eye, Saturation]
    pixels_transformed: int

    @property
    def factor(self) -> float:
        """The factor to use."""
        return min(self.asked_factor, self.largest_factor)

    @property
    def held_back(self) -> bool:
        """Whether the limit, not the reference, decided."""
        return self.largest_factor < self.asked_factor

    def apply(self, image: StereoImage) -> StereoImage:
        """Return the picture times the factor."""
        return scaled_picture(image, self.factor)

    def to_json(self) -> dict[str, Any]:
        """Return the step for a manifest."""
        return {
            "step": "tone_map",
            "reference_luminance_cd_m2": self.reference_cd_m2,
            "max_luminance_cd_m2": self.max_cd_m2,
            "limit_percent": self.limit_percent,
            "asked_luminance_scale": self.asked_factor,
            "luminance_scale": self.factor,
            "held_back": self.held_back,
            "saturated_percent_at_asked": {eye: one.to_json() for eye, one in self.saturated_at_asked.items()},
            "saturated_percent": {eye: one.to_json() for eye, one in self.saturated.items()},
        }


def tone_mapping(
    image: StereoImage, reference_cd_m2: float, models: EyeModels, limit_percent: float = LIMIT_PERCENT
) -> ToneMapping:
    """Return the factor that brings the picture's maximum luminance to ``reference_cd_m2``, as far as the limit lets.

    The limit holds for each eye by itself on its own display model, free of crosstalk.

    Raises
    ------
    StimulusError
        If the picture holds no light, or reference or limit is not a number that can be.
    """
    most = max_luminance_cd_m2(image)
    asked = factor_to(most, reference_cd_m2)
    same = image.is_flat and models.left is models.right
    eyes: tuple[Eye, ...] = ("left",) if same else _EYES
    found = [largest_factor(image.eye(eye), models.eye(eye), limit_percent) for eye in eyes]
    largest = min(one.factor for one in found)
    at_asked = {eye: saturation(image.eye(eye), models.eye(eye), asked) for eye in eyes}
    used = at_asked
    if largest < asked:
        # A pixel that reaches just 1 at the largest factor is full, not saturated: what rounds above must not count.
        below = math.nextafter(largest * (1 - 4e-16), 0.0)
        used = {eye: saturation(image.eye(eye), models.eye(eye), below) for eye in eyes}
    if same:
        at_asked, used = ({eye: counts["left"] for eye in _EYES} for counts in (at_asked, used))
    return ToneMapping(
        reference_cd_m2,
        most,
        limit_percent,
        asked,
        largest,
        at_asked,
        used,
        sum(one.pixels_transformed for one in found),
    )
